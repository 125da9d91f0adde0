"""``<ros2_control>`` elements of a URDF, as hardware components where these can say all that is in them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.findings import Span
from tfcompose.model import Component, Hardware, Interface
from tfcompose.urdf.blocks import read_block, unknown_joint

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from tfcompose.findings import Finding
    from tfcompose.model import Block, Robot
    from tfcompose.urdf.read import Element

#: What ros2_control reads as attributes of an interface, and not as parameters.
ATTRIBUTES = ("data_type", "size")
_TYPES = ("system", "actuator", "sensor")
_KINDS = ("joint", "sensor", "gpio")
_INTERFACES = ("command_interface", "state_interface")


class _UnsupportedError(Exception):
    """A hardware component cannot say something that is in the element."""


def with_hardware(robot: Robot) -> Robot:
    """Return the robot of a URDF with its ros2_control blocks as hardware, where that keeps all of them."""
    hardware: dict[str, Hardware] = {}
    blocks = []
    for block in robot.blocks:
        one = None
        if block.text.startswith("<ros2_control"):
            (element,) = read_block(block.text, robot.file, with_text=True).children
            one = _hardware_of(element, block)
        if one and one.name and one.name not in hardware:
            hardware[one.name] = one
        else:
            blocks.append(block)
    return replace(robot, hardware=tuple(hardware.values()), blocks=tuple(blocks)) if hardware else robot


def _hardware_of(element: Element, block: Block) -> Hardware | None:
    """Return the hardware component that the element describes, or None where it cannot say all of it."""
    try:
        return _hardware(element, block.at)
    except (_UnsupportedError, ValueError):
        return None


def _hardware(element: Element, at: Span) -> Hardware:
    attributes = _only(element, "name", "type", "rw_rate", "is_async", tags=("hardware", *_KINDS))
    inner = element.first("hardware")
    if inner is None or len(element.all("hardware")) != 1 or attributes.get("type") not in _TYPES:
        raise _UnsupportedError
    _only(inner, tags=("plugin", "param"))
    if len(inner.all("plugin")) != 1 or attributes.get("is_async") not in {None, "true", "false"}:
        raise _UnsupportedError
    plugin = inner.all("plugin")[0]
    components = [
        replace(_component(one), at=_in_document(one.at, at)) for one in element.children if one.tag in _KINDS
    ]
    if len({(one.kind, one.name) for one in components}) != len(components):
        raise _UnsupportedError
    _only(plugin)
    return Hardware(
        attributes.get("name", ""),
        plugin.text.strip(),
        attributes["type"],
        at,
        _params(inner),
        tuple(components),
        int(attributes["rw_rate"]) if "rw_rate" in attributes else None,
        attributes["is_async"] == "true" if "is_async" in attributes else None,
    )


def _in_document(inside: Span, block: Span) -> Span:
    """Return the place in the document of one in the block that begins there."""
    lines, columns = block.line - 2, block.column - 1 if inside.line == 2 else 0  # noqa: PLR2004 (the block's first)
    begin, end = (inside.line + lines, inside.column + columns), (inside.end_line + lines, inside.end_column + columns)
    return Span(block.file, *begin, *end)


def _component(element: Element) -> Component:
    attributes = _only(element, "name", tags=("param", *_INTERFACES))
    command, state = (tuple(_interface(one) for one in element.all(tag)) for tag in _INTERFACES)
    for interfaces in (command, state):
        if len({one.name for one in interfaces}) != len(interfaces):
            raise _UnsupportedError
    return Component(element.tag, attributes.get("name", ""), element.at, command, state, _params(element))


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
    for one in element.all("param"):
        name = _only(one, "name").get("name")
        if name is None or name in params:
            raise _UnsupportedError
        params[name] = one.text.strip()
    return params


def _only(element: Element, *attributes: str, tags: tuple[str, ...] = ()) -> dict[str, str]:
    """Return the element's attributes, if it has no others and no other elements in it."""
    if set(element.attributes) - set(attributes) or {child.tag for child in element.children} - set(tags):
        raise _UnsupportedError
    return element.attributes


def unknown_joints(hardware: tuple[Hardware, ...], joints: Collection[str]) -> Iterator[Finding]:
    """Yield a finding for each joint of the hardware that is none of these, the robot's moving joints."""
    for one in hardware:
        for component in one.components:
            if component.kind == "joint" and component.name not in joints:
                yield unknown_joint(component.name, component.at, joints)


def with_joints(hardware: Hardware, joints: Collection[str]) -> Hardware | None:
    """Return the hardware with these of its joints only; None where it had some, and none is left."""
    left = tuple(one for one in hardware.components if one.kind != "joint" or one.name in joints)
    had_joints = any(one.kind == "joint" for one in hardware.components)
    return replace(hardware, components=left) if not had_joints or any(one.kind == "joint" for one in left) else None
