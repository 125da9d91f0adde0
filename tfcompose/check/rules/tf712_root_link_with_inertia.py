"""TF712: root link with inertia."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


#: Programs that read the description with KDL.
READERS = frozenset({"robot_state_publisher", "moveit_ros_move_group"})


def root_link_with_inertia(robot: Robot) -> Iterator[Finding]:
    """The root link has an inertia, and a program of the plan reads the robot with KDL.

    KDL takes no inertia for a tree's root: it warns at each start, and leaves the mass out of dynamics. Put a bodiless
    root above: ``base: base_footprint`` with ``base_link: {parent: base_footprint}``. Where nothing uses KDL (tfcompose
    itself does not) the inertia of the root is right, and is left alone; ``robot.urdf``, which is for a stock
    robot_state_publisher, is written without it.
    """
    root = robot.links.get(robot.base or "")
    if root is None or root.inertial is None:
        return
    for process in robot.processes:
        if process.package in READERS and not process.describes:  # what tfcompose starts gets a root without one
            message = f"the root link {root.name} has an inertia, which {process.package} leaves out"
            notes = [Note(f"{process.name} is started here", process.at)]
            advice = f"a fixed frame above {root.name}, without a body"
            yield finding("TF712", message, root.at, help=advice, notes=notes)
            return
