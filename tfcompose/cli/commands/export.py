"""``tfcompose export``: the plan for other launchers.

Write a built plan, or a robot that is built first, for systemd (a unit for each process and a target), docker compose
(a service for each process) or ros2 launch (a launch file with stock nodes for what is fixed and jointed). What the
other launcher cannot do is said.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.built_plan import PLAN, plan_in
from tfcompose.cli.options import DEFAULT_FILE, add_variant
from tfcompose.cli.output import write_all
from tfcompose.cli.terminal import UNREADABLE, complain, print_findings, read_text
from tfcompose.emit.supervised import Machine, started
from tfcompose.findings import RejectedError
from tfcompose.plan import Plan
from tfcompose.run.hosts import share_of
from tfcompose.run.launcher.fencing import not_remapped

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.files import File

KINDS = ("systemd", "compose", "launch")
#: What ROS's setup files set, and what people set for ROS: units start without a shell that has it.
ROS_VARIABLES = (
    "AMENT_PREFIX_PATH", "CYCLONEDDS_URI", "FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE",
    "LD_LIBRARY_PATH", "PATH", "PYTHONPATH", "RMW_IMPLEMENTATION", "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_DISTRO",
    "ROS_DOMAIN_ID", "ROS_HOME", "ROS_LOG_DIR", "ROS_PYTHON_VERSION", "ROS_STATIC_PEERS", "ROS_VERSION",
)  # fmt: skip


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("kind", choices=KINDS, help="for which launcher")
    parser.add_argument("file", nargs="?", default=DEFAULT_FILE, metavar="FILE|PLAN", help="default: robot.yaml")
    add_variant(parser)
    parser.add_argument(
        "-o", "--output", metavar="DIR",
        help="where to build FILE; the export is in a folder there; default: build/ROBOT, or PLAN's folder",
    )  # fmt: skip
    parser.add_argument("--host", metavar="NAME", help="only this host's share; '': what has no host; default: all")
    parser.add_argument(
        "--at", metavar="DIR", help="systemd: where the plan's folder is on the robot; default: where it is here"
    )
    parser.add_argument(
        "--python", metavar="FILE", default=sys.executable, help="systemd: the robot's Python; default: this one"
    )
    parser.add_argument(
        "--setup", action="append", default=[], metavar="FILE",
        help="systemd: source this first, as /opt/ros/jazzy/setup.bash; repeatable; default: this shell's variables",
    )  # fmt: skip
    parser.add_argument("--image", default="", metavar="NAME", help="compose: default: $TFCOMPOSE_IMAGE at the start")


def run(arguments: Namespace) -> int:
    """Write the export; exit code as for ``build``."""
    if arguments.file.endswith(".json"):
        if arguments.profiles or arguments.overlays or arguments.settings:
            complain("a built plan takes no --profile, --overlay and --set: those are for building it")
            return UNREADABLE
        file = Path(arguments.file)
    else:
        built = import_module("tfcompose.cli.building").build(arguments)
        if isinstance(built, int):
            return built
        file = built[0] / PLAN
    plan = plan_in(file)
    if isinstance(plan, int):
        return plan
    if arguments.host is not None:
        share = share_of(plan, arguments.host or None, "")
        if not isinstance(share, Plan):
            print_findings([share], sys.stderr)
            return 1
        plan = share
    if plan.guard.mode == "strict" and arguments.kind == "launch":
        complain("guard: strict needs a guard, and a launch file has none: export with --set guard.mode=watch")
        return 1
    if plan.guard.mode == "strict" and (missed := not_remapped(plan)):
        print_findings(missed, sys.stderr)
        return 1
    return _export(plan, file, arguments)


def _export(plan: Plan, file: Path, arguments: Namespace) -> int:
    folder = Path(arguments.output or file.parent) / arguments.kind
    try:
        files, said = _made(plan, file, folder, arguments)
        write_all(folder, files)
    except RejectedError as error:
        print_findings(error.findings, sys.stderr)
        return UNREADABLE
    except OSError as error:
        complain(f"nothing was written to {folder}: {error.strerror}")
        return UNREADABLE
    sys.stdout.write(f"wrote {folder}: {', '.join(one.path for one in files)}\n")
    if plan.host is None:
        said += [f"{one.name} runs on {one.host}, and is here too: --host" for one in started(plan) if one.host]
    sys.stdout.writelines(f"not as tfcompose up: {line}\n" for line in said)
    return 0


def _made(plan: Plan, file: Path, folder: Path, arguments: Namespace) -> tuple[tuple[File, ...], list[str]]:
    emit = getattr(import_module(f"tfcompose.emit.{arguments.kind}"), arguments.kind)
    beside = Path(os.path.relpath(file.parent, folder)).as_posix()
    made: tuple[tuple[File, ...], list[str]]
    if arguments.kind == "launch":
        made = emit(plan, Machine(beside), read_text(str(file.parent / "robot.urdf")))
    elif arguments.kind == "compose":
        made = emit(plan, Machine(beside, image=arguments.image))
    else:
        own = {} if arguments.setup else {name: os.environ[name] for name in ROS_VARIABLES if os.environ.get(name)}
        at = Path(arguments.at or file.parent).absolute().as_posix()
        made = emit(plan, Machine(at, arguments.python, tuple(arguments.setup), own))
    return made
