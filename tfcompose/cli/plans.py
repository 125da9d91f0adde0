"""Plans from a built file or a compiled robot file, and copies of plans for a run."""

from __future__ import annotations

import hashlib
import os
import shutil
import threading
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.reading import read_text
from tfcompose.cli.terminal import UNREADABLE, fail, reject
from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.reading import is_file, read_bytes
from tfcompose.model.files import with_absolute_addresses
from tfcompose.model.plan import Plan
from tfcompose.model.plan.file import read_plan, write_plan
from tfcompose.model.plan.hosts import share_of, with_guard_alone
from tfcompose.model.variables import SETTLE

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Mapping
    from datetime import date

    from tfcompose.foundation.findings import Span
    from tfcompose.launcher.runtime_dir import RuntimeDir

PLAN = "plan.json"


def is_plan(file: str) -> bool:
    """Return whether the file is a built plan, according to its name, and not a robot file."""
    return file.endswith(".json")


def in_folder(file: str) -> str:
    """Return the path of the plan in a folder that ``build`` wrote, or else ``file`` unchanged."""
    plan = Path(file) / PLAN
    return str(plan) if is_file(plan) else file


def read_built_plan(file: Path) -> Plan:
    """Return the plan in the file.

    Raises:
        SystemExit: after the plan's errors are printed.
    """
    try:
        return read_plan(read_text(str(file)), str(file))
    except RejectedError as error:
        reject(error.findings)


def refuse_variant(arguments: Namespace, *more: str) -> None:
    """Reject --profile, --robot, --overlay, --set and arguments for a built plan.

    A built plan has no variants.

    Raises:
        SystemExit: after an error message, if one of them is used.
    """
    if (
        arguments.profiles
        or arguments.overlays
        or arguments.settings
        or getattr(arguments, "overlay_robot", None) is not None
        or any(getattr(arguments, option) for option in more)
    ):
        *options, last = [
            "--profile",
            "--robot",
            "--overlay",
            "--set",
            *(f"--{option}" for option in more),
        ]
        fail(
            f"a built plan takes no {', '.join(options)} or {last}: these options apply at"
            " build time",
            UNREADABLE,
        )
    if getattr(arguments, "ros_args", ()):
        fail("a built plan takes no --ros-args: pass them to build", UNREADABLE)
    if arguments.arg_values:
        built_with = "; tfcompose up --dry-run PLAN prints the arguments of its build"
        fail(
            f"{next(iter(arguments.arg_values))}:=…: a built plan takes no arguments{built_with}",
            UNREADABLE,
        )


def expected_plan(
    file: str, arguments: Namespace, day: date | None = None
) -> tuple[Plan, dict[str, Span]]:
    """Return the plan of a robot file, plan.json or folder, and the places of its edges.

    The places are by child; a built plan has no places. ``day`` selects the calibrations that were
    valid on that day. None selects those that are still valid.

    Raises:
        SystemExit: after an error message about unreadable files, or after the robot's errors.
    """
    file = in_folder(file)
    if is_plan(file):
        refuse_variant(arguments)
        return read_built_plan(Path(file)), {}
    from tfcompose.cli.compiling import compile_or_exit
    from tfcompose.compiler.emit.plan import plan_of

    robot = compile_or_exit(file, arguments, day).with_final_names()
    return plan_of(robot), {edge.child: edge.span for edge in robot.edges}


def plan_to_start(plan: Plan, arguments: Namespace) -> Plan:
    """Return the plan's part for this host, with the command line's options about the guard.

    Raises:
        SystemExit: after an error message, if the plan has no part for this host.
    """
    if arguments.guard:
        plan = replace(plan, guard=replace(plan.guard, mode=arguments.guard))
    plan = host_share(plan, arguments.host, os.uname().nodename)
    if arguments.guard_alone:
        plan = with_guard_alone(plan)
    if arguments.settle is None:
        return plan
    env = {SETTLE: str(arguments.settle)}
    processes = list(plan.processes)
    for index, process in enumerate(processes):
        if process.kind == "guard":
            processes[index] = replace(process, env=process.env | env)
    return replace(plan, processes=tuple(processes))


def host_share(plan: Plan, host: str | None, here: str) -> Plan:
    """Return the plan's part for the named host, or for the host ``here``.

    Raises:
        SystemExit: after an error message, if the plan has no such part.
    """
    share = share_of(plan, host, here)
    if not isinstance(share, Plan):
        reject([share])
    return share


def copy_plan(
    plan: Plan, file: Path, runtime_dir: RuntimeDir, *, alone: bool, build_dir: Path | None = None
) -> Path:
    """Copy the plan and its files to the run's folder; return the path of the copy.

    A later build then does not affect the run. Meshes are not copied. The copied descriptions
    contain the absolute addresses of the meshes. ``alone`` removes the copies of earlier runs.
    Relative paths in descriptions start at ``build_dir``; the default is the plan's folder.

    Raises:
        SystemExit: after an error message, if the plan cannot be copied.
    """
    try:
        parts = files_of(plan, file.parent)
        for name in descriptions_of(plan) & parts.keys():
            parts[name] = _with_absolute_addresses(
                parts[name], ((build_dir or file.parent) / name).parent
            )
        folder = runtime_dir.plan_folder(digest_of(parts))
        if alone:
            for old in set(runtime_dir.plan_folders()) - {folder}:
                shutil.rmtree(old, ignore_errors=True)
        try:
            write_copy(parts, folder)
        except (
            FileNotFoundError
        ):  # who has won the race for the run removed it as an earlier one's
            write_copy(parts, folder)
    except RejectedError as error:
        reject(error.findings)
    except OSError as error:
        fail(f"the plan cannot be copied to {runtime_dir.folder}: {error.strerror}", UNREADABLE)
    return folder / PLAN


def descriptions_of(plan: Plan) -> set[str]:
    """Return the names of the descriptions that belong to a plan."""
    process_descriptions = {
        process.description for process in plan.processes if process.description is not None
    }
    return {plan.description, *process_descriptions}


def files_of(plan: Plan, folder: Path) -> dict[str, bytes]:
    """Return the files that a run of the plan needs, by name; ``folder`` has all but the plan.

    Raises:
        RejectedError, OSError: if one cannot be read.
    """
    names = {*descriptions_of(plan), *(process.params_file for process in plan.processes)}
    files = {name: read_bytes(folder / name) for name in names if name and is_file(folder / name)}
    return {PLAN: write_plan(plan).encode(), **files}


def digest_of(files: Mapping[str, bytes]) -> str:
    """Return the name of a copy of these files."""
    return hashlib.sha256(repr(sorted(files.items())).encode()).hexdigest()[:16]


def write_copy(parts: Mapping[str, bytes], folder: Path) -> None:
    """Write the files, each atomically.

    Another ``up`` may write the same files while the run's processes read them.
    """
    for name, data in parts.items():
        file = folder / name
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        new = file.with_name(f".{file.name}.{os.getpid()}.{threading.get_ident()}")
        new.write_bytes(data)
        new.replace(file)


def _with_absolute_addresses(urdf: bytes, folder: Path) -> bytes:
    """Return a description with absolute addresses.

    Bytes that are not text stay unchanged, because their reader rejects them.
    """
    try:
        return with_absolute_addresses(urdf.decode("utf-8"), folder).encode()
    except UnicodeDecodeError:
        return urdf
