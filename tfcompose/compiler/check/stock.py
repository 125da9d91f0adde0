"""Rules about stock TF publishers among a robot's processes.

The rules find out from a process's command line which edges it publishes.
"""

from __future__ import annotations

import itertools
import posixpath
import re
from typing import TYPE_CHECKING

from tfcompose.compiler.check.rule import rule
from tfcompose.foundation.findings import Finding, Note, finding
from tfcompose.foundation.text import with_more
from tfcompose.model.robot import JOINTS, STATIC

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model.robot import Edge, Process, Robot

_STATIC_PUBLISHER, _STATE_PUBLISHER = "static_transform_publisher", "robot_state_publisher"
#: A joint's child in a robot description.
_CHILD = re.compile(r"<child\s+link\s*=\s*[\"']([^\"']+)[\"']")
#: Sections whose entries can name an owner.
_WITH_OWNERS = frozenset({"frames", "links", "joints", "sensors", "parts"})
#: Number of positional arguments, with angles and with a quaternion. Both forms have a position
#: and the two frames.
_WITH_ANGLES, _WITH_QUATERNION = 8, 9


@rule("TF317")
def stock_publisher_publishes_too(robot: Robot) -> Iterator[Finding]:
    for process in robot.processes:
        program = _program(process)
        if program == _STATIC_PUBLISHER:
            yield from _of_static_publisher(process, robot)
        elif program == _STATE_PUBLISHER and not process.describes:
            yield from _of_state_publisher(process, robot)


def _program(process: Process) -> str:
    """Return the name of the program that the process runs; empty if unknown."""
    if process.kind != "run" or process.launch is not None:
        return ""
    if process.executable is not None:
        return process.executable
    return posixpath.basename(process.argv[0]) if process.argv else ""


def _of_static_publisher(process: Process, robot: Robot) -> Iterator[Finding]:
    names = _frames_of(_own_arguments(process))
    if names is None:
        return
    frames_by_final = {robot.final(frame): frame for frame in robot.frames}
    parent, child = (frames_by_final.get(name, name) for name in names)
    edge = robot.parent_edge(child)
    if robot.tolerates(child) or (
        edge and edge.owner not in {process.name for process in robot.processes}
    ):
        return  # the edge or its owner was rejected
    if edge is None:
        message = f"{process.name} publishes {parent} → {child}, which is not declared"
        advice = f"replace it by frames: {{{child}: {{parent: {parent}, xyz: […], rpy: […]}}}}"
        yield finding("TF317", message, process.span, help=advice, severity="warning")
    elif edge.owner != process.name:
        yield _publishes_too(process, f"{parent} → {child}", edge)


def _own_arguments(process: Process) -> list[str]:
    """Return the program's arguments without ROS arguments."""
    argv = list(process.argv if process.executable is not None else process.argv[1:])
    return argv[: argv.index("--ros-args")] if "--ros-args" in argv else argv


def _frames_of(argv: list[str]) -> tuple[str, str] | None:
    """Return parent and child from the arguments of static_transform_publisher.

    Both the form with options and the older positional form are accepted.
    """
    if "--frame-id" in argv or any(argument.startswith("--frame-id=") for argument in argv):
        parent, child = _option(argv, "--frame-id"), _option(argv, "--child-frame-id")
        return (_plain(parent), _plain(child)) if parent and child else None
    if len(argv) in {_WITH_ANGLES, _WITH_QUATERNION}:
        return _plain(argv[-2]), _plain(argv[-1])
    return None


def _option(argv: list[str], name: str) -> str:
    following = dict(itertools.pairwise(argv))
    joined = (argument.partition("=")[2] for argument in argv if argument.startswith(f"{name}="))
    return following.get(name) or next(joined, "")


def _plain(frame: str) -> str:
    return frame.removeprefix("/")


def _of_state_publisher(process: Process, robot: Robot) -> Iterator[Finding]:
    params = process.params | _params_on_the_command_line(process)
    described = params.get("robot_description")
    text = described if isinstance(described, str) and "<robot" in described else None
    mine = {edge.child for edge in robot.edges if edge.owner == process.name}
    refused = any(
        section in _WITH_OWNERS for section, _ in robot.broken
    )  # the refused edges may include its own
    if text is None and (mine or refused or robot.tolerates(process.name)):
        return
    children = {*_CHILD.findall(text)} if text is not None else robot.described_frames()
    prefix = params.get("frame_prefix", "")
    frames_by_final = {robot.final(frame): frame for frame in robot.frames}
    if prefix or text is not None:
        sent = {frames_by_final.get(f"{prefix}{name}") for name in children}
    else:
        sent = {frames_by_final.get(robot.final(name)) for name in children}
    contested = [
        edge
        for edge in robot.edges
        if edge.child in sent - mine and edge.owner in {STATIC, JOINTS}
    ]
    edges = [edge for edge in contested if not robot.tolerates(edge.child)]
    if edges:
        yield _publishes_too(
            process, with_more(edges[0].name, len(edges) - 1), edges[0], sure=text is not None
        )


def _params_on_the_command_line(process: Process) -> dict[str, str]:
    """Return the parameters that ``-p NAME:=VALUE`` sets, with their values as text."""
    argv = itertools.dropwhile(lambda argument: argument != "--ros-args", process.argv)
    assignments = [
        value for option, value in itertools.pairwise(argv) if option in {"-p", "--param"}
    ]
    return {
        name: value
        for name, sign, value in (assignment.partition(":=") for assignment in assignments)
        if sign
    }


def _publishes_too(process: Process, what: str, edge: Edge, *, sure: bool = True) -> Finding:
    will = "publishes" if sure else "probably publishes"
    message = f"{process.name} {will} {what}, and so does {edge.owner}, the owner"
    notes = [Note(f"{edge.name} is defined here", edge.owner_at or edge.span)]
    advice = (
        f"remove {process.name}, or write owner: {process.name} on the edges that it is meant to"
        " publish"
    )
    return finding(
        "TF317",
        message,
        process.span,
        help=advice,
        notes=notes,
        severity="error" if sure else "warning",
    )
