"""What is below one frame of a robot: the rest of it is cut off, with all that is about the rest."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.model import Block, Hardware, Robot


def below(robot: Robot, root: str) -> Robot:
    """Return what is below ``root``, one of the robot's frames, which becomes the base.

    Joints that are gone are no longer in hardware, and what stands beside links and joints is gone with what it is
    about; so are the drivers of the sensors that are gone.
    """
    frames = robot.below(root)
    edges = tuple(edge for edge in robot.edges if edge.child in frames and edge.child != root)
    sensors = tuple(sensor for sensor in robot.sensors if sensor.mount in frames)
    if robot.hardware or robot.blocks:
        joints = {edge.joint_name for edge in edges if edge.joint_name}
        hardware = (_hardware(one, joints) for one in robot.hardware)
        blocks = (_block(one, robot, frames, joints) for one in robot.blocks)
        robot = replace(robot, hardware=tuple(filter(None, hardware)), blocks=tuple(filter(None, blocks)))
    busy = {sensor.driver for sensor in sensors} | {edge.owner for edge in edges}
    idle = {sensor.driver for sensor in robot.sensors} - busy
    return replace(
        robot,
        frames={name: at for name, at in robot.frames.items() if name in frames},
        edges=edges,
        links={name: link for name, link in robot.links.items() if name in frames},
        processes=tuple(process for process in robot.processes if process.name not in idle),
        claims=tuple(one for one in robot.claims if {one.parent, one.child} <= frames or one.child == root),
        sensors=sensors,
        base=root,
    )


def _hardware(hardware: Hardware, joints: set[str]) -> Hardware | None:
    """Return the hardware with the joints that are left; None where it had some, and none is left."""
    left = tuple(one for one in hardware.components if one.kind != "joint" or one.name in joints)
    had = [one for one in hardware.components if one.kind == "joint"]
    return replace(hardware, components=left) if not had or any(one.kind == "joint" for one in left) else None


def _block(block: Block, robot: Robot, frames: set[str], joints: set[str]) -> Block | None:
    """Return the block with those of its elements that are about nothing that is gone; None where none is left."""
    work = import_module("tfcompose.resolve.blocks")
    elements = import_module("tfcompose.load.urdf").load_xml(f"<robot>{block.text}</robot>", robot.file).children
    all_joints = {edge.joint_name for edge in robot.edges}
    left = [
        element
        for element in elements
        if not any(work.references(element, frames, joints)) or any(work.references(element, robot.frames, all_joints))
    ]
    if len(left) == len(elements):
        return block
    return replace(block, text="\n".join(element.raw for element in left)) if left else None
