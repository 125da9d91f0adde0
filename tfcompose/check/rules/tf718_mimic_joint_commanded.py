"""TF718: mimic joint commanded."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def mimic_joint_commanded(robot: Robot) -> Iterator[Finding]:
    """A joint that follows another one has a command interface of its own.

    It cannot do both, and ros2_control refuses the whole hardware. Leave its state interfaces, and command the joint
    that it follows.
    """
    mimics = {edge.joint.name: edge.joint for edge in robot.edges if edge.joint and edge.joint.mimic is not None}
    for hardware in robot.hardware:
        for component in hardware.components:
            joint = mimics.get(component.name)
            if joint and component.kind == "joint" and component.command:
                names = ", ".join(interface.name for interface in component.command)
                message = f"{joint.name} follows {joint.mimic}, and {hardware.name} commands its {names}"
                notes = [Note("the joint stands here", joint.at)]
                yield finding("TF718", message, component.at, help="keep its state interfaces only", notes=notes)
