"""Raw blocks: elements next to links and joints that are kept verbatim, and what of the robot they name.

A block is read as the content of a ``<robot>`` that has the first line to itself: places are those in that document.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Span, did_you_mean, finding, nearest
from tfcompose.urdf.read import read_xml

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from tfcompose.model import Block, Robot
    from tfcompose.urdf.read import Element

#: Elements that name links or joints of the robot.
REFERRING = frozenset({"gazebo", "transmission", "ros2_control"})
#: What a block may hold, besides extensions with a prefix of their own.
_ALLOWED = ("transmission", "gazebo", "ros2_control", "sensor", "material")
#: What belongs into a section of the robot file, and what into another element.
_SECTIONS = {"link": "links", "joint": "joints", "robot": "include"}
_INNER = frozenset({"visual", "collision", "inertial", "origin", "geometry", "limit", "mimic", "axis", "plugin"})
#: At most so many joints are named where one is wrong.
_MOST_NAMED = 8
_SUBSTITUTION = re.compile(r"\$\((?:find|find-pkg-share|arg|var|env|optenv|eval|dirname|cwd)\b[^()\n<>]*\)")
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)


def read_block(text: str, file: str, *, with_text: bool = False) -> Element:
    """Return the ``<robot>`` with the elements of the block; arguments and exceptions are those of ``read_xml``."""
    return read_xml(f"<robot>\n{text}\n</robot>", file, with_text=with_text)


def faults_of(root: Element, frames: Collection[str], joints: Collection[str]) -> Iterator[Finding]:
    """Yield what is wrong with the elements of a block."""
    if not root.children:
        yield finding("TF719", "the block has no element", root.at, help="remove it")
    for element in root.children:
        if element.tag in _SECTIONS or element.tag in _INNER:
            message = f"<{element.tag}> is not allowed in a block"
            section = _SECTIONS.get(element.tag)
            advice = f"write it under {section}:" if section else "put it into <gazebo>, a link or a joint"
            yield finding("TF719", message, element.at, help=advice)
        elif element.tag not in _ALLOWED and ":" not in element.tag and nearest(element.tag, _ALLOWED):
            advice = did_you_mean(element.tag, _ALLOWED)
            yield finding("TF719", f"unknown element <{element.tag}>", element.at, help=advice)
        yield from unknown_references(element, frames, joints)
        yield from _undeclared_prefixes(element)


def _undeclared_prefixes(top: Element) -> Iterator[Finding]:
    """Yield a finding for each prefix that no element around it declares: xacro, and other readers, stop there."""
    waiting = [(top, frozenset({"xml", "xmlns"}))]
    while waiting:
        element, known = waiting.pop()
        known |= {name[6:] for name in element.attributes if name.startswith("xmlns:")}
        for name in (element.tag, *element.attributes):
            prefix, colon, _ = name.partition(":")
            if colon and prefix not in known:
                advice = f'<{element.tag} xmlns:{prefix}="http://…">'
                yield finding("TF719", f"undeclared namespace prefix {prefix} in {name}", element.at, help=advice)
        waiting += [(child, known) for child in element.children]


def unexpanded(text: str, file: str) -> Iterator[Finding]:
    """Yield a finding for each substitution of xacro's or a launch file's in the text of a block."""
    for found in _SUBSTITUTION.finditer(_COMMENT.sub(_blank, text)):
        before = text[: found.start()]
        line, column = before.count("\n") + 2, found.start() - before.rfind("\n")
        message = f"{found[0]} is not expanded in a URDF"
        advice = (
            "write the path itself, or ${config}/x.yaml with vars: {config: /opt/…}, and --set vars.config=… elsewhere"
        )
        at = Span(file, line, column, line, column + len(found[0]))
        yield finding("TF729", message, at, help=advice, severity="warning")


def _blank(comment: re.Match[str]) -> str:
    return re.sub(r"[^\n]", " ", comment[0])


def unknown_references(element: Element, frames: Collection[str], joints: Collection[str]) -> Iterator[Finding]:
    """Yield a finding for each link or joint that an element of a block names and the robot does not have."""
    reference = element.attributes.get("reference")
    if element.tag == "gazebo" and reference is not None and reference not in frames and reference not in joints:
        advice = did_you_mean(reference, [*frames, *joints])
        yield finding("TF203", f"unknown link or joint {reference}", element.at_value("reference"), help=advice)
    if element.tag in {"transmission", "ros2_control"}:
        for joint in element.all("joint"):
            name = joint.attributes.get("name", "")
            if name not in joints:
                yield unknown_joint(name, joint.at_value("name"), joints)


def unknown_joint(name: str, at: Span, joints: Collection[str]) -> Finding:
    """Return the finding that none of the ``joints``, the moving ones, has this name."""
    more = f" and {len(joints) - _MOST_NAMED} more" if len(joints) > _MOST_NAMED else ""
    there = f"the robot has {', '.join(list(joints)[:_MOST_NAMED])}{more}"
    advice = did_you_mean(name, joints, there if joints else "no joint of the robot moves")
    return finding("TF703", f"no moving joint {name}", at, help=advice)


def within(block: Block, robot: Robot, frames: Collection[str], joints: Collection[str]) -> Block | None:
    """Return the block of a robot without those of its elements that are about others than these frames and joints.

    What is about neither the robot's frames nor its joints stays. None is returned where no element is left.
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
