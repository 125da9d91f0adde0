"""Blocks of a URDF that are about a link or joint that it does not have: nobody reads them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.urdf.blocks import read_block, unknown_references

if TYPE_CHECKING:
    from tfcompose.model import Robot
    from tfcompose.urdf.read import Element

#: ros2_control is not among them: with a joint that is not there it does not start.
_IDLE = ("<gazebo", "<transmission")


def without_idle_blocks(robot: Robot) -> tuple[Robot, list[str]]:
    """Return the robot without such blocks, with a note for each."""
    joints = {edge.joint_name: None for edge in robot.edges}
    blocks, notes = [], []
    for block in robot.blocks:
        (element,) = read_block(block.text, robot.file).children
        missing = list(unknown_references(element, robot.frames, joints)) if block.text.startswith(_IDLE) else []
        if missing:
            notes.append(f"left out: {_called(element)}: {missing[0].message}")
        else:
            blocks.append(block)
    return (replace(robot, blocks=tuple(blocks)), notes) if notes else (robot, [])


def _called(element: Element) -> str:
    name = next((key for key in ("name", "reference") if key in element.attributes), None)
    return f'<{element.tag} {name}="{element.attributes[name]}">' if name else f"<{element.tag}>"
