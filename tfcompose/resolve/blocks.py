"""``ros2_control`` and ``xml``: what stands beside links and joints in a URDF, checked against the robot.

A raw block is text of the user's; its places are lines of the robot file.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, RejectedError, Span, did_you_mean, finding, nearest
from tfcompose.load.urdf import load_xml
from tfcompose.model import Block, Component, Hardware, Interface

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from tfcompose.load import Path, Source
    from tfcompose.load.urdf import Element
    from tfcompose.validate.hardware import ComponentSpec, HardwareSpec

#: What may stand in a raw block, beside extensions with a prefix of their own.
ALLOWED = ("transmission", "gazebo", "ros2_control", "sensor", "material")
#: What belongs into the robot file's own sections, or into an element there.
_OWN = {"link": "links", "joint": "joints", "robot": "include"}
#: What names links or joints of the robot.
REFERRING = frozenset({"gazebo", "transmission", "ros2_control"})
#: As many joints are named where one is wrong.
_LISTED = 8
_SUBSTITUTION = re.compile(r"\$\((?:find|find-pkg-share|arg|var|env|optenv|eval|dirname|cwd)\b[^()\n<>]*\)")
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_INNER = frozenset({"visual", "collision", "inertial", "origin", "geometry", "limit", "mimic", "axis", "plugin"})


def hardware_of(given: dict[str, HardwareSpec], source: Source) -> tuple[Hardware, ...]:
    """Return the hardware components with the places of their joints."""
    return tuple(_hardware(name, said, source) for name, said in given.items())


def _hardware(name: str, said: HardwareSpec, source: Source) -> Hardware:
    at: Path = ("ros2_control", name)
    kinds = (("joint", said.joints), ("sensor", said.sensors), ("gpio", said.gpios))
    components = tuple(
        _component(kind, inner, one, source.at_key((*at, f"{kind}s", inner)))
        for kind, several in kinds
        for inner, one in several.items()
    )
    return Hardware(
        name, said.plugin, said.type, source.at_key(at), said.params, components, said.rw_rate, said.is_async
    )


def _component(kind: str, name: str, said: ComponentSpec, at: Span) -> Component:
    command, state = ([Interface(i, params) for i, params in one.items()] for one in (said.command, said.state))
    return Component(kind, name, at, tuple(command), tuple(state), said.params)


def unknown_joints(hardware: tuple[Hardware, ...], joints: Collection[str]) -> Iterator[Finding]:
    """Yield a finding for each joint that no moving joint of the robot is."""
    for component in hardware:
        for one in component.components:
            if one.kind == "joint" and one.name not in joints:
                yield _no_joint(one.name, one.at, joints)


def _no_joint(name: str, at: Span, joints: Collection[str]) -> Finding:
    more = f" and {len(joints) - _LISTED} more" if len(joints) > _LISTED else ""
    there = f"there is {', '.join(list(joints)[:_LISTED])}{more}"
    advice = did_you_mean(name, joints, there if joints else "no joint moves")
    return finding("TF703", f"no moving joint {name}", at, help=advice)


def blocks_of(
    given: dict[str, str], source: Source, frames: Collection[str], joints: Collection[str]
) -> tuple[tuple[Block, ...], list[Finding]]:
    """Return the raw blocks, and what is wrong with them. ``joints`` are the names of all joints of the robot."""
    found: list[Finding] = []
    blocks = []
    for name, text in given.items():
        at: Path = ("xml", name)
        place = source.at(at)
        try:
            root = load_xml(f"<robot>\n{text}\n</robot>", source.file)
        except RejectedError as error:
            found += [replace(one, span=_in_file(one.span, text, source, at)) for one in error.findings]
            continue
        blocks.append(Block(name, place, text))
        for one in (*_misplaced(root, frames, joints), *_unexpanded(text, source.file)):
            found.append(replace(one, span=_in_file(one.span, text, source, at)))
    return tuple(blocks), found


def _unexpanded(text: str, file: str) -> Iterator[Finding]:
    """Yield a finding for each substitution of xacro's or a launch file's, with its place below the line <robot>."""
    for found in _SUBSTITUTION.finditer(_COMMENT.sub(_blank, text)):
        before = text[: found.start()]
        line, column = before.count("\n") + 2, found.start() - before.rfind("\n")
        message = f"{found[0]} stays as it is: nobody expands it in a URDF"
        advice = "the path itself; with vars: {config: /opt/…}, ${config}/x.yaml and --set vars.config=… elsewhere"
        place = Span(file, line, column, line, column + len(found[0]))
        yield finding("TF729", message, place, help=advice, severity="warning")


def _blank(comment: re.Match[str]) -> str:
    return re.sub(r"[^\n]", " ", comment[0])


def _in_file(span: Span | None, text: str, source: Source, at: Path) -> Span:
    """Return the place in the robot file of a place in the block, in which its text begins at line 2.

    Only in a literal block (``|``) are the lines those of the file; elsewhere it is the whole value.
    """
    whole, key = source.at(at), source.at_key(at)
    lines = text.rstrip("\n").count("\n") + 1
    if span is None or whole.end_line - whole.line < lines:
        return whole
    line = whole.line + min(max(span.line - 1, 1), lines)
    indent = key.column + 1  # as most people write it: two more than the key
    return Span(whole.file, line, span.column + indent, line, max(span.end_column, span.column + 1) + indent)


def _misplaced(root: Element, frames: Collection[str], joints: Collection[str]) -> Iterator[Finding]:
    if not root.children:
        yield finding("TF719", "a block without an element", root.at, help="remove it")
    for element in root.children:
        if element.tag in _OWN or element.tag in _INNER:
            message = f"<{element.tag}> cannot stand in a block"
            section = _OWN.get(element.tag)
            advice = f"write it under {section}:" if section else "it belongs into <gazebo>, a link or a joint"
            yield finding("TF719", message, element.at, help=advice)
        elif element.tag not in ALLOWED and ":" not in element.tag and nearest(element.tag, ALLOWED):
            yield finding(
                "TF719", f"unknown element <{element.tag}>", element.at, help=did_you_mean(element.tag, ALLOWED)
            )
        yield from references(element, frames, joints)
        yield from _undeclared(element)


def _undeclared(top: Element) -> Iterator[Finding]:
    """Yield a finding for each prefix that no element around it declares: xacro, and other readers, stop there."""
    waiting = [(top, frozenset({"xml", "xmlns"}))]
    while waiting:
        element, known = waiting.pop()
        known |= {name[6:] for name in element.attributes if name.startswith("xmlns:")}
        for name in (element.tag, *element.attributes):
            prefix, colon, _ = name.partition(":")
            if colon and prefix not in known:
                advice = f'<{element.tag} xmlns:{prefix}="http://…">'
                yield finding("TF719", f"nothing declares the prefix {prefix} of {name}", element.at, help=advice)
        waiting += [(child, known) for child in element.children]


def references(element: Element, frames: Collection[str], joints: Collection[str]) -> Iterator[Finding]:
    """Yield a finding for each link or joint that a block names and the robot has not."""
    reference = element.attributes.get("reference")
    if element.tag == "gazebo" and reference is not None and reference not in frames and reference not in joints:
        advice = did_you_mean(reference, [*frames, *joints])
        yield finding("TF203", f"no link or joint {reference}", element.place("reference"), help=advice)
    if element.tag in {"transmission", "ros2_control"}:
        for joint in element.all("joint"):
            name = joint.attributes.get("name", "")
            if name not in joints:
                yield _no_joint(name, joint.place("name"), joints)
