"""Files, as text, of a robot without errors."""

from __future__ import annotations

import posixpath
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.draw.picture import draw
from tfcompose.compiler.draw.svg import svg
from tfcompose.compiler.emit.argv import file_params, params_file
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.compiler.render.tree import graph_of, tree
from tfcompose.compiler.urdf.macro import MACRO, caller, macro
from tfcompose.compiler.urdf.write import urdf
from tfcompose.model.files import AS_IN_SOURCE, File, Target
from tfcompose.model.plan import DESCRIPTION, STOCK_DESCRIPTION
from tfcompose.model.plan.file import write_plan

if TYPE_CHECKING:
    from tfcompose.model.robot import Process, Robot


def emit(robot: Robot, target: Target = AS_IN_SOURCE) -> tuple[File, ...]:
    """Return the robot's files; the same robot always gives the same bytes.

    The robot must have no errors. ``target`` holds the folder to write to, and the form of mesh
    addresses.
    """
    live = robot.with_final_names()
    descriptions = {}
    for part, robot_of in descriptions_of(robot):
        folder = f"{part}/" if part else ""
        descriptions[part] = _descriptions(robot_of, target, folder)
    stock = {part: files[1].text for part, files in descriptions.items()}
    return (
        File("plan.json", write_plan(plan_of(live, target))),
        *(file for files in descriptions.values() for file in files),
        File("tree.txt", tree(live)),
        File("tree.svg", svg(draw(graph_of(live)))),
        *(
            _params(process, nodes, stock)
            for process in robot.processes
            if (nodes := file_params(process))
        ),
    )


def descriptions_of(robot: Robot) -> list[tuple[str, Robot]]:
    """Return the robot, and each part that is a separate robot, by the part's name.

    Each of them has its own robot description.
    """
    return [("", robot), *((part.name, part.robot) for part in robot.parts)]


def _params(process: Process, nodes: dict[str, dict[str, Any]], stock: dict[str, str]) -> File:
    """Return the parameter file of the process.

    A stock publisher's file includes the robot description that this publisher needs.
    """
    if process.describes:
        nodes = {
            node: params | {"robot_description": stock[process.part]}
            for node, params in nodes.items()
        }
    return File(f"params/{process.name}.yaml", params_file(nodes))


def _descriptions(robot: Robot, target: Target, folder: str = "") -> tuple[File, ...]:
    """Return the descriptions of the robot, or of a separate part in the part's folder."""
    target = replace(target, folder=posixpath.join(target.folder, folder))
    full, stock = urdf(robot, target)
    return (
        File(f"{folder}{DESCRIPTION}", full),
        File(f"{folder}{STOCK_DESCRIPTION}", stock),
        File(f"{folder}robot.urdf.xacro", caller(robot)),
        File(f"{folder}{MACRO}", macro(robot, target)),
    )
