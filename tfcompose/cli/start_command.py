"""Arguments and steps of commands that start a robot, or only its guard."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.options import (
    DEFAULT_FILE,
    add_ros_args,
    add_variant,
    not_negative,
    positive,
)

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.launcher.output import EventStream


def add_start_arguments(parser: ArgumentParser, *, guard_alone: bool = False) -> None:
    """Add the arguments of a command that starts a robot, or only its guard."""
    parser.add_argument(
        "file", nargs="?", default=DEFAULT_FILE, metavar="FILE|PLAN", help="default: robot.yaml"
    )
    add_variant(parser, robot="HOSTNAME.yaml, if there is one", by_hostname=True)
    add_ros_args(parser)
    parser.add_argument(
        "-o", "--output", metavar="DIR", help="where to build; default: build/ROBOT"
    )
    parser.add_argument(
        "-d",
        "--detach",
        action="store_true",
        help="run in the background; see tfcompose ps, logs and down",
    )
    parser.add_argument(
        "--wait",
        action="store_true",
        help="run in the background, and return once every process is ready and every edge live",
    )
    parser.add_argument(
        "--update",
        action="store_true",
        help="apply this plan to the running robot; start none if it does not run",
    )
    parser.add_argument(
        "--build-dir",
        metavar="DIR",
        help="with --update: the folder for the plan's relative paths; default: that of the plan",
    )
    parser.add_argument(
        "--timeout",
        type=positive,
        default=60.0,
        metavar="S",
        help="with --wait: exit 1 after S seconds, while the robot keeps running; default: 60",
    )
    parser.add_argument(
        "--host",
        metavar="NAME",
        help=(
            "start the processes of this host and expect the others elsewhere; default: this "
            "machine, if the robot names it"
        ),
    )
    parser.add_argument(
        "--no-live",
        dest="live",
        action="store_false",
        help="print lines instead of the live view",
    )
    parser.add_argument(
        "--events",
        metavar="FILE",
        help=(
            "write each event to this file or named pipe, as one JSON object per line; the robot"
            " stops when the reader closes the pipe"
        ),
    )
    parser.add_argument(
        "--dry-run",
        action="store_true",
        help="print commands, environment, parameters and edges; start nothing",
    )
    parser.add_argument(
        "--guard",
        choices=("off", "watch", "strict"),
        help=(
            "off: report live edges, no checks; strict: block edges that a process does not "
            "own; default: as in the file"
        ),
    )
    parser.add_argument(
        "--settle",
        type=not_negative,
        metavar="S",
        help="seconds to look for conflicting publishers first; default: 0.5",
    )
    parser.add_argument(
        "--for",
        dest="duration",
        type=positive,
        metavar="S",
        help=(
            "stop S seconds after the settle time; exit 1 if the tree was not complete or "
            "there was an error"
        ),
    )
    parser.set_defaults(guard_alone=guard_alone)


def build_and_start(arguments: Namespace) -> int:
    """Start the plan and return the exit code.

    The code is 0 after a clean end, 1 after a failure or a finding, 2 if something cannot be read.

    Raises:
        SystemExit: after an error message, if nothing can be built or started.
    """
    from tfcompose.cli.plans import in_folder, is_plan, refuse_variant

    arguments.file = in_folder(arguments.file)
    if is_plan(arguments.file):
        refuse_variant(arguments, "output")
    if arguments.dry_run:
        from tfcompose.cli.dry_run import dry_run

        return dry_run(arguments)
    from tfcompose.cli.terminal import reject
    from tfcompose.tf.ros.environment import no_ros

    if missing := no_ros():
        reject([missing])
    events = _open_events(arguments.events)
    if is_plan(arguments.file):
        from tfcompose.cli.starting import load_forker, start

        return start(Path(arguments.file), arguments, load_forker(arguments), events=events)
    from tfcompose.cli.build_process import BuildProcess

    with BuildProcess(arguments) as build:
        from tfcompose.cli.starting import load_forker, start  # during the build

        forker = load_forker(arguments)
        plan_file, findings = build.wait_until_built()
    return start(plan_file, arguments, forker, findings, events)


def _open_events(path: str | None) -> EventStream | None:
    """Return the stream to a file or named pipe, None without a path.

    Raises:
        SystemExit: after an error message, if the file cannot be opened.
    """
    if path is None:
        return None
    from tfcompose.cli.terminal import UNREADABLE, fail
    from tfcompose.launcher.output import EventStream

    try:
        return EventStream(path)
    except OSError as error:
        why = "no process reads the pipe" if error.errno == errno.ENXIO else error.strerror
        fail(f"--events {path}: {why}", UNREADABLE)
