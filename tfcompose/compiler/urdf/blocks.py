"""Raw blocks: XML elements kept verbatim, and the links and joints that they name.

A block is read as the content of a ``<robot>`` element whose tag is on a line before the block.
Spans refer to that document. A ``<ros2_control>`` element becomes a hardware component if no
content of the element is lost.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.compiler.urdf.read import read_xml
from tfcompose.foundation.findings import Finding, Span, did_you_mean, finding, nearest
from tfcompose.foundation.text import list_names
from tfcompose.model.robot.hardware import Hardware, HardwareComponent, Interface

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from tfcompose.compiler.urdf.read import Element
    from tfcompose.model.robot import Robot
    from tfcompose.model.robot.hardware import Block


#: Elements that name links or joints of the robot.
REFERRING = frozenset({"gazebo", "transmission", "ros2_control"})
#: Elements allowed in a block, in addition to elements with a namespace prefix.
_ALLOWED = ("transmission", "gazebo", "ros2_control", "sensor", "material")
#: Elements that do not belong in a block, with the section of the robot file for each.
_SECTIONS = {"link": "links", "joint": "joints", "robot": "include"}
_INNER = frozenset(
    {"visual", "collision", "inertial", "origin", "geometry", "limit", "mimic", "axis", "plugin"}
)
#: Maximum number of joints that a finding about an unknown joint lists.
_MOST_NAMED = 8
_SUBSTITUTION = re.compile(
    r"\$\((?:find|find-pkg-share|arg|var|env|optenv|eval|dirname|cwd)\b[^()\n<>]*\)"
)
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)


def read_block(text: str, file: str, *, with_text: bool = False) -> Element:
    """Return the ``<robot>`` element with the elements of the block.

    Arguments and exceptions are those of ``read_xml``.
    """
    return read_xml(f"<robot>\n{text}\n</robot>", file, with_text=with_text)


def faults_of(
    root: Element, frames: Collection[str], joints: Collection[str]
) -> Iterator[Finding]:
    """Yield findings about the elements of a block."""
    if not root.children:
        yield finding("TF719", "the block has no element", root.span, help="remove it")
    for element in root.children:
        if element.tag in _SECTIONS or element.tag in _INNER:
            message = f"<{element.tag}> is not allowed in a block"
            section = _SECTIONS.get(element.tag)
            advice = (
                f"write it under {section}:"
                if section
                else "put it into <gazebo>, a link or a joint"
            )
            yield finding("TF719", message, element.span, help=advice)
        elif (
            element.tag not in _ALLOWED
            and ":" not in element.tag
            and nearest(element.tag, _ALLOWED)
        ):
            advice = did_you_mean(element.tag, _ALLOWED)
            yield finding("TF719", f"unknown element <{element.tag}>", element.span, help=advice)
        yield from unknown_references(element, frames, joints)
        yield from _undeclared_prefixes(element)


def _undeclared_prefixes(top: Element) -> Iterator[Finding]:
    """Yield a finding for each namespace prefix that no enclosing element declares.

    Xacro and other XML readers reject such a prefix.
    """
    waiting = [(top, frozenset({"xml", "xmlns"}))]
    while waiting:
        element, properties = waiting.pop()
        properties |= {name[6:] for name in element.attributes if name.startswith("xmlns:")}
        for name in (element.tag, *element.attributes):
            prefix, colon, _ = name.partition(":")
            if colon and prefix not in properties:
                advice = f'<{element.tag} xmlns:{prefix}="http://…">'
                yield finding(
                    "TF719",
                    f"undeclared namespace prefix {prefix} in {name}",
                    element.span,
                    help=advice,
                )
        waiting += [(child, properties) for child in element.children]


def find_unexpanded(text: str, file: str) -> Iterator[Finding]:
    """Yield a finding for each xacro or launch substitution in the text of a block."""
    for match in _SUBSTITUTION.finditer(_COMMENT.sub(_blank, text)):
        before = text[: match.start()]
        line, column = before.count("\n") + 2, match.start() - before.rfind("\n")
        message = f"{match[0]} is not expanded in a URDF"
        advice = (
            "write the path itself, or ${config}/x.yaml with vars: {config: /opt/…}, and --set"
            " vars.config=… elsewhere"
        )
        span = Span(file, line, column, line, column + len(match[0]))
        yield finding("TF729", message, span, help=advice, severity="warning")


def _blank(comment: re.Match[str]) -> str:
    return re.sub(r"[^\n]", " ", comment[0])


def unknown_references(
    element: Element, frames: Collection[str], joints: Collection[str]
) -> Iterator[Finding]:
    """Yield a finding for each link or joint that a block names and the robot does not have."""
    reference = element.attributes.get("reference")
    if (
        element.tag == "gazebo"
        and reference is not None
        and reference not in frames
        and reference not in joints
    ):
        advice = did_you_mean(reference, [*frames, *joints])
        yield finding(
            "TF203",
            f"unknown link or joint {reference}",
            element.value_span("reference"),
            help=advice,
        )
    if element.tag in {"transmission", "ros2_control"}:
        for joint in element.all("joint"):
            name = joint.attributes.get("name", "")
            if name not in joints:
                yield unknown_joint(name, joint.value_span("name"), joints)


def unknown_joint(name: str, span: Span, joints: Collection[str]) -> Finding:
    """Return the finding that the moving ``joints`` do not include this name."""
    listing = f"the robot has {list_names(joints, _MOST_NAMED)}"
    advice = did_you_mean(name, joints, listing if joints else "no joint of the robot moves")
    return finding("TF703", f"no moving joint {name}", span, help=advice)


def unknown_joints(hardware: tuple[Hardware, ...], joints: Collection[str]) -> Iterator[Finding]:
    """Yield a finding for each joint of the hardware that is not a moving joint of the robot."""
    for system in hardware:
        for component in system.components:
            if component.kind == "joint" and component.name not in joints:
                yield unknown_joint(component.name, component.span, joints)


def within(
    block: Block, robot: Robot, frames: Collection[str], joints: Collection[str]
) -> Block | None:
    """Return the block without elements that refer to the robot's other frames and joints.

    Elements that name no frame and no joint are kept. None if no element is left.
    """
    elements = read_block(block.text, robot.file).children
    all_joints = {edge.joint_name for edge in robot.edges}
    left = [
        element
        for element in elements
        if not any(unknown_references(element, frames, joints))
        or any(unknown_references(element, robot.frames, all_joints))
    ]
    if len(left) == len(elements):
        return block
    return replace(block, text="\n".join(element.raw for element in left)) if left else None


def with_joints(hardware: Hardware, joints: Collection[str]) -> Hardware | None:
    """Return the hardware with only the given joints.

    None if the hardware had joints and none is left.
    """
    left = tuple(
        component
        for component in hardware.components
        if component.kind != "joint" or component.name in joints
    )
    had_joints = any(component.kind == "joint" for component in hardware.components)
    return (
        replace(hardware, components=left)
        if not had_joints or any(component.kind == "joint" for component in left)
        else None
    )


# ros2_control.

#: Attributes of an interface that are not parameters.
ATTRIBUTES = ("data_type", "size")
_TYPES = ("system", "actuator", "sensor")
_KINDS = ("joint", "sensor", "gpio")
_INTERFACES = ("command_interface", "state_interface")


class _UnsupportedError(Exception):
    """A hardware component cannot represent some content of the element."""


def with_hardware(robot: Robot) -> Robot:
    """Return the robot of a URDF with ros2_control blocks turned into hardware, if lossless."""
    hardware: dict[str, Hardware] = {}
    blocks = []
    for block in robot.blocks:
        described = None
        if block.text.startswith("<ros2_control"):
            (element,) = read_block(block.text, robot.file, with_text=True).children
            described = _hardware_of(element, block)
        if described and described.name and described.name not in hardware:
            hardware[described.name] = described
        else:
            blocks.append(block)
    return (
        replace(robot, hardware=tuple(hardware.values()), blocks=tuple(blocks))
        if hardware
        else robot
    )


def _hardware_of(element: Element, block: Block) -> Hardware | None:
    """Return the hardware that the element describes, None if it cannot represent the element."""
    try:
        return _hardware(element, block)
    except (_UnsupportedError, ValueError):
        return None


def _hardware(element: Element, block: Block) -> Hardware:
    attributes = _only(element, "name", "type", "rw_rate", "is_async", tags=("hardware", *_KINDS))
    inner = element.first("hardware")
    if inner is None or len(element.all("hardware")) != 1 or attributes.get("type") not in _TYPES:
        raise _UnsupportedError
    _only(inner, tags=("plugin", "param"))
    if len(inner.all("plugin")) != 1 or attributes.get("is_async") not in {None, "true", "false"}:
        raise _UnsupportedError
    plugin = inner.all("plugin")[0]
    places = dict(zip(map(id, element.walk()), block.places, strict=True))
    components = [
        replace(_component(child), span=places[id(child)])
        for child in element.children
        if child.tag in _KINDS
    ]
    if len({(component.kind, component.name) for component in components}) != len(components):
        raise _UnsupportedError
    _only(plugin)
    return Hardware(
        attributes.get("name", ""),
        plugin.text.strip(),
        attributes["type"],
        span=block.span,
        params=_params(inner),
        components=tuple(components),
        rw_rate=int(attributes["rw_rate"]) if "rw_rate" in attributes else None,
        is_async=attributes["is_async"] == "true" if "is_async" in attributes else None,
    )


def _component(element: Element) -> HardwareComponent:
    attributes = _only(element, "name", tags=("param", *_INTERFACES))
    command, state = (
        tuple(_interface(child) for child in element.all(tag)) for tag in _INTERFACES
    )
    for interfaces in (command, state):
        if len({interface.name for interface in interfaces}) != len(interfaces):
            raise _UnsupportedError
    return HardwareComponent(
        element.tag,
        attributes.get("name", ""),
        element.span,
        command=command,
        state=state,
        params=_params(element),
    )


def _interface(element: Element) -> Interface:
    attributes = _only(element, "name", *ATTRIBUTES, tags=("param",))
    if "name" not in attributes:
        raise _UnsupportedError
    more = {key: value for key, value in attributes.items() if key != "name"}
    params = _params(element)
    if params.keys() & set(ATTRIBUTES):
        raise _UnsupportedError
    return Interface(attributes["name"], more | params)


def _params(element: Element) -> dict[str, str]:
    params: dict[str, str] = {}
    for param in element.all("param"):
        name = _only(param, "name").get("name")
        if name is None or name in params:
            raise _UnsupportedError
        params[name] = param.text.strip()
    return params


def _only(element: Element, *attributes: str, tags: tuple[str, ...] = ()) -> dict[str, str]:
    """Return the element's attributes, or raise if it has other attributes or elements."""
    if set(element.attributes) - set(attributes) or {
        child.tag for child in element.children
    } - set(tags):
        raise _UnsupportedError
    return element.attributes
