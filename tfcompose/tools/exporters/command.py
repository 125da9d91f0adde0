"""Export the plan for systemd, docker compose, Kubernetes or ros2 launch.

Export a built plan or a robot file. For systemd, write a unit for each process and a target. For
docker compose, write a service for each process. For Kubernetes, write a ConfigMap, a workload for
each process and a kustomization. For ros2 launch, write a launch file with stock nodes for fixed
edges and joints. List each feature of up that the other launcher lacks.
"""

from __future__ import annotations

import os
import sys
from argparse import ArgumentTypeError
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.options import DEFAULT_FILE, add_variant
from tfcompose.cli.terminal import UNREADABLE, fail, reject

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.foundation.findings import Span
    from tfcompose.model.files import File
    from tfcompose.model.plan import Plan

KINDS = ("systemd", "compose", "k8s", "launch")
#: Variables that ROS's setup files or users set for ROS. systemd starts units without a shell, so
#: the units must contain these variables.
ROS_VARIABLES = (
    "AMENT_PREFIX_PATH",
    "CYCLONEDDS_URI",
    "FASTDDS_DEFAULT_PROFILES_FILE",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "LD_LIBRARY_PATH",
    "PATH",
    "PYTHONPATH",
    "RMW_IMPLEMENTATION",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_DISTRO",
    "ROS_DOMAIN_ID",
    "ROS_HOME",
    "ROS_LOG_DIR",
    "ROS_PYTHON_VERSION",
    "ROS_STATIC_PEERS",
    "ROS_VERSION",
)


def arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``export``."""
    parser.add_argument("kind", type=_kind, choices=KINDS, help="the launcher to export to")
    parser.add_argument(
        "file", nargs="?", default=DEFAULT_FILE, metavar="FILE|PLAN", help="default: robot.yaml"
    )
    add_variant(parser)
    parser.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        help=(
            "where to build FILE; the export goes to a subfolder; default: build/ROBOT, or "
            "PLAN's folder"
        ),
    )
    parser.add_argument(
        "--format",
        dest="form",
        choices=("python", "xml", "yaml"),
        help="launch: the launch file's format; default: python",
    )
    parser.add_argument(
        "--host",
        metavar="NAME",
        help="export only the processes of this host; '': those without a host; default: all",
    )
    parser.add_argument(
        "--at",
        metavar="DIR",
        help=(
            "the plan's folder on the robot; default: systemd: the same as here; compose, launch: "
            "relative to the written file; k8s: none, the plan is in a ConfigMap"
        ),
    )
    parser.add_argument(
        "--python",
        metavar="FILE",
        help="systemd: the Python on the robot; default: python of the host under hosts, or "
        "this one",
    )
    parser.add_argument(
        "--setup",
        action="append",
        default=[],
        metavar="FILE",
        help="systemd: a file to source first, such as /opt/ros/jazzy/setup.bash; repeatable; "
        "default: setup of the host under hosts, or this shell's variables",
    )
    parser.add_argument(
        "--image",
        default="",
        metavar="NAME",
        help="compose: the image; default: $TFCOMPOSE_IMAGE at start; k8s: required",
    )


def _kind(text: str) -> str:
    """Return the name of the launcher.

    Raises:
        ArgumentTypeError: for ``kubernetes``, because its name is ``k8s``.
    """
    if text == "kubernetes":
        raise ArgumentTypeError("write k8s for kubernetes")
    return text


def run(arguments: Namespace) -> int:
    """Write the exported files, and return the same exit codes as ``build``."""
    from tfcompose.cli.plans import (
        PLAN,
        host_share,
        in_folder,
        is_plan,
        read_built_plan,
        refuse_variant,
    )
    from tfcompose.launcher.fence import find_not_remapped

    arguments.file = in_folder(arguments.file)
    if arguments.kind == "k8s" and not arguments.image:
        fail(
            "name the image of the pods, with ROS 2 Jazzy and tfcompose: --image NAME", UNREADABLE
        )
    if arguments.form and arguments.kind != "launch":
        fail(f"--format is for export launch, not for export {arguments.kind}", UNREADABLE)
    if is_plan(arguments.file):
        refuse_variant(arguments)
        file = Path(arguments.file)
    else:
        from tfcompose.cli.writing import build

        file = build(arguments)[0] / PLAN
    plan = read_built_plan(file)
    if arguments.host is not None:
        plan = host_share(plan, arguments.host or None, "")
    if plan.guard.mode == "strict" and arguments.kind == "launch":
        fail(
            "a strict plan needs a guard, and a launch file has none: export with --set"
            " guard.mode=watch"
        )
    if plan.guard.mode == "strict" and (missed := find_not_remapped(plan)):
        reject(missed)
    _write(plan, file, arguments)
    return 0


def _write(plan: Plan, file: Path, arguments: Namespace) -> None:
    from tfcompose.cli.writing import write_all
    from tfcompose.foundation.findings import RejectedError

    folder = Path(arguments.output or file.parent) / arguments.kind
    try:
        files, differences = _export(plan, file, folder, arguments)
        write_all(folder, files)
    except RejectedError as error:
        reject(error.findings)
    except OSError as error:
        fail(f"nothing was written to {folder}: {error.strerror}", UNREADABLE)
    print(f"wrote {folder}: {', '.join(file.path for file in files)}")
    if plan.host is None:
        differences += [
            f"{process.name} of host {process.host} is included: --host leaves it out"
            for process in plan.started
            if process.host
        ]
    for line in differences:
        print(f"differs from tfcompose up: {line}")


def _export(
    plan: Plan, file: Path, folder: Path, arguments: Namespace
) -> tuple[tuple[File, ...], list[str]]:
    """Return the files to write, and sentences about the differences from ``up``."""
    from tfcompose.tools.exporters.supervisors import Machine

    plan_folder = Path(os.path.relpath(file.parent, folder)).as_posix()
    if arguments.at:
        plan_folder = Path(arguments.at).absolute().as_posix()
    if arguments.kind == "launch":
        from tfcompose.cli.plans import is_plan
        from tfcompose.cli.reading import read_text
        from tfcompose.model.plan import STOCK_DESCRIPTION
        from tfcompose.tools.exporters.launch import launch
        from tfcompose.tools.exporters.launch_frontends import LaunchFile

        urdf = read_text(str(file.parent / STOCK_DESCRIPTION))
        launch_file = LaunchFile(plan_folder, arguments.form or "python")
        if is_plan(arguments.file):
            return launch(plan, launch_file, urdf)
        from tfcompose.tools.exporters.launch_arguments import collect_launch_values

        values, further, fixed = collect_launch_values(arguments, plan)
        launch_file = replace(launch_file, place_of=partial(_place_in_robot_file, arguments))
        files, gaps = launch(plan, launch_file, urdf, values)
        return (*files, *further), [*gaps, *fixed]
    if arguments.kind == "compose":
        from tfcompose.tools.exporters.supervisors import compose

        return compose(plan, Machine(plan_folder, image=arguments.image))
    if arguments.kind == "k8s":
        return _for_kubernetes(plan, file.parent, arguments)
    from tfcompose.tools.exporters.supervisors import systemd

    host = plan.hosts.get(plan.host or "")
    setup = tuple(arguments.setup) or (host.setup if host else ())
    python = arguments.python or (host.python if host else None) or sys.executable
    variables = (
        {} if setup else {name: os.environ[name] for name in ROS_VARIABLES if os.environ.get(name)}
    )
    folder_on_robot = Path(arguments.at or file.parent).absolute().as_posix()
    return systemd(plan, Machine(folder_on_robot, python, setup, variables))


def _place_in_robot_file(arguments: Namespace, process: str, key: str) -> Span | None:
    """Return the location of a process's key or, if the key is missing, of the process."""
    from tfcompose.cli.compiling import compile_file

    compiled = compile_file(arguments.file, arguments)
    span = compiled.sources[0].exact_span(("processes", process, key))
    processes = compiled.robot.processes if compiled.robot else ()
    return span or next((each.span for each in processes if each.name == process), None)


def _for_kubernetes(
    plan: Plan, folder: Path, arguments: Namespace
) -> tuple[tuple[File, ...], list[str]]:
    """Return the manifests, and the differences from ``up``.

    The manifests contain the files of the built folder that the pods read.
    """
    from tfcompose.cli.reading import read_text
    from tfcompose.tools.exporters.kubernetes import MOST_BYTES, Cluster, files_of, kubernetes

    paths = dict.fromkeys(path for process in plan.started for path in files_of(plan, process))
    texts = {path: read_text(str(folder / path)) for path in paths}
    size = sum(len(text.encode()) for text in texts.values())
    if size > MOST_BYTES and not arguments.at:
        fail(
            f"a ConfigMap takes 1 MB, and the plan has {size / 1e6:.1f}: copy it to each node, add"
            " --at DIR",
            UNREADABLE,
        )
    return kubernetes(plan, Cluster(arguments.image, arguments.at or ""), texts)
