"""From a right robot to its files, as text."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.emit.final import with_final_names
from tfcompose.emit.params import params_file
from tfcompose.emit.plan import plan_of
from tfcompose.emit.target import AS_WRITTEN, Target
from tfcompose.emit.tree import tree
from tfcompose.emit.urdf import urdfs
from tfcompose.planfile import write_plan

if TYPE_CHECKING:
    from tfcompose.model import Robot


@dataclass(frozen=True, slots=True)
class File:
    """A file to be written: its path below the output folder, and its text."""

    path: str
    text: str


def emit(robot: Robot, target: Target = AS_WRITTEN) -> tuple[File, ...]:
    """Return the robot's files; the same robot gives the same bytes. There must be no errors in it.

    ``target`` says where they are written and how they address meshes.
    """
    live = with_final_names(robot)
    params = tuple(
        File(f"params/{process.name}.yaml", params_file({n.name: n.params for n in process.nodes if n.params}))
        for process in robot.processes
        if process.kind == "run" and any(node.params for node in process.nodes)
    )
    whole, stock = urdfs(robot, target)
    return (
        File("plan.json", write_plan(plan_of(live))),
        File("robot.full.urdf", whole),
        File("robot.urdf", stock),
        File("tree.txt", tree(live)),
        *params,
    )
