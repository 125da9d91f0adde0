"""The part of a robot that is below one of its frames."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.urdf.blocks import with_joints, within

if TYPE_CHECKING:
    from tfcompose.model import Robot


def subtree(robot: Robot, root: str) -> Robot:
    """Return what is below ``root``, one of the robot's frames, which becomes the base.

    Hardware, raw blocks and drivers of sensors are left out with the joints, links and sensors that they belong to.
    """
    frames = robot.below(root)
    edges = tuple(edge for edge in robot.edges if edge.child in frames and edge.child != root)
    sensors = tuple(sensor for sensor in robot.sensors if sensor.mount in frames)
    joints = {edge.joint_name for edge in edges if edge.joint_name}
    busy = {sensor.driver for sensor in sensors} | {edge.owner for edge in edges}
    unused = {sensor.driver for sensor in robot.sensors} - busy
    return replace(
        robot,
        frames={name: at for name, at in robot.frames.items() if name in frames},
        edges=edges,
        links={name: link for name, link in robot.links.items() if name in frames},
        processes=tuple(process for process in robot.processes if process.name not in unused),
        claims=tuple(one for one in robot.claims if {one.parent, one.child} <= frames or one.child == root),
        sensors=sensors,
        base=root,
        hardware=tuple(filter(None, (with_joints(one, joints) for one in robot.hardware))),
        blocks=tuple(filter(None, (within(one, robot, frames, joints) for one in robot.blocks))),
    )
