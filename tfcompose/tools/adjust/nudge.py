"""Move a mount of the running robot, without a restart.

Send another pose of MOUNT (a sensor, or a frame): --x +2mm and --yaw -0.5deg add to the current
value, --x =0.3m replaces it. Additions go along the axes of the parent frame and rotate about
them; with --local, the mount's own axes. /tf_static and robot_description change, no process
restarts, and the robot file stays as it is: up --update and a restart of the robot bring its
poses back. --save keeps them in the overlay of this robot. Only edges that tfcompose publishes can
be nudged. Without changes, print the current pose of MOUNT, or all adjusted mounts. With
--interactive, keys of the terminal move mounts.
"""

from __future__ import annotations

import shlex
import sys
from typing import TYPE_CHECKING

from tfcompose.cli.options import DEFAULT_FILE, add_robot
from tfcompose.cli.terminal import UNREADABLE, can_redraw, fail, reject
from tfcompose.tools.adjust.change import AXES, ChangeError, PoseChange, change_of, change_pose

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Callable, Iterator, Sequence

    from tfcompose.launcher.runtime_dir import RuntimeDir
    from tfcompose.model.plan import Plan, PlanEdge


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("mount", nargs="?", metavar="MOUNT", help="a sensor, or a frame")
    for axis in AXES:
        unit = "2mm" if len(axis) == 1 else "0.5deg"
        text = f"+{unit} or -{unit} to add, ={unit} to replace"
        parser.add_argument(f"--{axis}", metavar="CHANGE", help=text)
    parser.add_argument(
        "--local", action="store_true", help="add along and about the mount's own axes"
    )
    parser.add_argument(
        "-i", "--interactive", action="store_true", help="move mounts with the arrow keys"
    )
    parser.add_argument(
        "--undo", action="store_true", help="restore the pose before the last adjustment"
    )
    parser.add_argument(
        "--reset", action="store_true", help="restore the built pose, of MOUNT or of all mounts"
    )
    parser.add_argument(
        "--save",
        action="store_true",
        help="write the pose of MOUNT, or of all adjusted mounts, into the robot's overlay",
    )
    parser.add_argument(
        "--file", metavar="FILE", help=f"for --save: the robot file; default: {DEFAULT_FILE}"
    )
    parser.add_argument(
        "--as",
        dest="overlay",
        metavar="NAME",
        help="for --save: write NAME.yaml; default: the overlay that it runs with, or the"
        " hostname's",
    )
    add_robot(parser)


def run(arguments: Namespace) -> int:
    """Move the mount; exit code 0, 1 if the robot refuses, 2 for wrong use."""
    from tfcompose.cli.runs import chosen_run

    changes = _changes(arguments)
    names = [arguments.mount] if arguments.mount else []
    runtime_dir = chosen_run(arguments.robot, shlex.join(["nudge", *names]))
    if arguments.interactive:
        return _nudge_by_keys(runtime_dir, arguments)
    edges = _adjust(runtime_dir, arguments, changes)
    if not edges:
        print(f"{runtime_dir.name}: no mount is adjusted")
    for edge in edges:
        print(_describe(edge))
    if arguments.save and edges:
        _save(runtime_dir, arguments, edges)
    return 0


def _changes(arguments: Namespace) -> list[PoseChange]:
    """Return the changes of the command line.

    Raises:
        SystemExit: after reporting all that is wrong with them.
    """
    texts = {axis: text for axis in AXES if (text := getattr(arguments, axis)) is not None}
    changes, errors = [], []
    for axis, text in texts.items():
        try:
            changes.append(change_of(axis, text))
        except ChangeError as error:
            errors.append(str(error))
    errors += _misuse(arguments, has_changes=bool(texts))
    if arguments.local and not any(change.relative for change in changes) and not errors:
        errors.append("--local applies to changes that add, such as --x +2mm")
    if errors:
        fail("\n".join(errors), UNREADABLE)
    return changes


def _misuse(arguments: Namespace, *, has_changes: bool) -> Iterator[str]:
    """Yield which options do not go together, or lack something."""
    restores = arguments.undo or arguments.reset
    if has_changes and not arguments.mount:
        yield "name the mount to move: tfcompose nudge MOUNT --x +2mm"
    if sum((has_changes, arguments.undo, arguments.reset)) > 1:
        yield "choose one of a change, --undo and --reset"
    if arguments.save and restores:
        yield (
            "--save writes poses of the running robot; calibrate --undo restores those"
            " of the overlay"
        )
    if arguments.interactive:
        if has_changes or restores or arguments.save or arguments.local:
            yield "--interactive has keys for changes, --undo, --reset, --save and --local"
        elif not sys.stdin.isatty() or not can_redraw(sys.stdout):
            yield "--interactive needs a terminal; in a script: tfcompose nudge MOUNT --x +2mm"
    elif not arguments.save and (arguments.file or arguments.overlay):
        yield "--file and --as go with --save and --interactive"


def _adjust(
    runtime_dir: RuntimeDir, arguments: Namespace, changes: Sequence[PoseChange]
) -> list[PlanEdge]:
    """Adjust the robot, and return the edges to print.

    Raises:
        SystemExit: after reporting why it cannot be adjusted.
    """
    from tfcompose.cli.adjusting import adjust
    from tfcompose.foundation.findings import RejectedError
    from tfcompose.launcher.control import RequestRefusedError
    from tfcompose.tools.adjust.selection import select_edges, short_name

    step = _step(arguments, changes)
    restores = arguments.undo or arguments.reset

    def choose(plan: Plan) -> dict[str, PlanEdge]:
        edges = select_edges(plan, arguments.mount, restores=restores)
        if arguments.undo and len(edges) > 1:
            names = ", ".join(map(short_name, edges))
            fail(f"several mounts are adjusted; name one to undo: {names}", UNREADABLE)
        return {edge.child: step(edge) for edge in edges}

    try:
        return list(adjust(runtime_dir, choose).values())
    except RejectedError as error:
        reject(error.findings)
    except RequestRefusedError as error:
        fail(f"{runtime_dir.name}: {error}")
    except (OSError, ValueError) as error:  # it has just ended
        fail(f"{runtime_dir.name} cannot be adjusted: {error}")


def _save(runtime_dir: RuntimeDir, arguments: Namespace, edges: Sequence[PlanEdge]) -> None:
    """Write the edges' poses into the robot's overlay.

    Raises:
        SystemExit: after reporting why that is impossible.
    """
    from tfcompose.cli.adjusting import running_plan
    from tfcompose.foundation.findings import RejectedError

    try:
        print(_write_overlay(running_plan(runtime_dir).plan, arguments, edges))
    except RejectedError as error:
        reject(error.findings)
    except (OSError, ValueError) as error:
        fail(f"the poses cannot be saved: {error}", UNREADABLE)


def _write_overlay(plan: Plan, arguments: Namespace, edges: Sequence[PlanEdge]) -> str:
    """Write the edges' poses into the robot's overlay, and return a sentence about it.

    Raises:
        RejectedError, OSError, ValueError: if that is impossible.
    """
    from tfcompose.tools.adjust.saving import save_poses

    path, saved = save_poses(plan, edges, arguments.file or DEFAULT_FILE, arguments.overlay)
    return f"wrote {path}" if saved else f"{path} is up to date"


def _nudge_by_keys(runtime_dir: RuntimeDir, arguments: Namespace) -> int:
    """Let keys move mounts, print the adjusted ones, and return the exit code.

    Raises:
        SystemExit: after reporting that the robot has ended, or that there is nothing to move.
    """
    from tfcompose.cli.adjusting import running_plan
    from tfcompose.foundation.findings import RejectedError
    from tfcompose.tools.adjust.interactive import RobotEndedError, SignalledError, nudge_by_keys
    from tfcompose.tools.adjust.selection import select_edges

    try:
        running = running_plan(runtime_dir)
        if arguments.mount:
            edges = select_edges(running.plan, arguments.mount, restores=False)
        else:
            edges = [edge for edge in running.plan.edges if running.plan.is_adjustable(edge)]
        if not edges:
            fail(f"{runtime_dir.name} has no mount that can be nudged")
        plan = nudge_by_keys(
            runtime_dir,
            running,
            edges[0].child,
            lambda plan: _write_overlay(plan, arguments, plan.adjusted),
        )
    except RejectedError as error:
        reject(error.findings)
    except SignalledError as error:
        return 128 + error.number
    except RobotEndedError:
        fail(f"{runtime_dir.name} has ended")
    except (OSError, ValueError) as error:
        fail(f"{runtime_dir.name} cannot be adjusted: {error}")
    for edge in plan.adjusted:
        print(_describe(edge))
    return 0


def _step(arguments: Namespace, changes: Sequence[PoseChange]) -> Callable[[PlanEdge], PlanEdge]:
    """Return the function from an edge to the adjusted one."""
    from tfcompose.cli.adjusting import moved, reset, undone

    def change(edge: PlanEdge) -> PlanEdge:
        return moved(edge, change_pose(edge.pose, changes, local=arguments.local))

    if arguments.undo or arguments.reset:
        return undone if arguments.undo else reset
    return change


def _describe(edge: PlanEdge) -> str:
    """Return an edge's pose, and how far it is from the built one."""
    from tfcompose.cli.adjusting import describe_adjustment
    from tfcompose.guard.verdict.publishers import show_pose

    return f"{edge.name}: {show_pose(edge.pose)}; {describe_adjustment(edge)}"
