"""TF708: mimic chain."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Joint, Robot


#: No more joints are followed than this.
LONGEST = 100


def mimic_chain(robot: Robot) -> Iterator[Finding]:
    """A joint follows a joint that follows another one.

    tfcompose follows such a chain to its end. The stock robot_state_publisher goes through the joints once, in
    alphabetical order, so a joint that comes before the one it follows stays behind or never appears; Gazebo and
    ros2_control do not follow chains at all. Let it follow the leader itself, with the multipliers multiplied.
    """
    joints = {edge.joint.name: edge.joint for edge in robot.edges if edge.joint}
    for joint in joints.values():
        middle = joints.get(joint.mimic or "")
        if middle is None or middle.mimic not in joints or middle.mimic in {joint.name, middle.name}:
            continue
        if joints[middle.mimic].mimic is not None and _loops(joints, joint.name):
            continue
        multiplier = joint.multiplier * middle.multiplier
        offset = joint.multiplier * middle.offset + joint.offset
        end = f", offset: {offset:g}" if offset else ""
        message = f"{joint.name} follows {middle.name}, which follows {middle.mimic}"
        notes = [Note(f"{middle.name} stands here", middle.at)]
        advice = f"mimic: {{joint: {middle.mimic}, multiplier: {multiplier:g}{end}}}"
        yield finding("TF708", message, joint.at, help=advice, notes=notes)


def _loops(joints: dict[str, Joint], name: str) -> bool:
    """Whether the joint follows itself in the end; that is TF702."""
    seen: set[str] = set()
    while name in joints and name not in seen and len(seen) < LONGEST:
        seen.add(name)
        name = joints[name].mimic or ""
    return name in seen
