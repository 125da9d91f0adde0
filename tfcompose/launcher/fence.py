"""Isolation of the processes of a strict plan: only the guard receives their TF.

If their middleware is Fast DDS, a profile file moves their writers into a DDS partition.
Otherwise, or if the plan requires it, their TF topics are remapped to separate topics. This also
moves their listeners, so the guard sends the rest of the tree to these topics. A remapping applies
to every process that takes ROS arguments: executables of packages, launch files, tfcompose's own
processes, and commands that own an edge.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, finding
from tfcompose.launcher.fastdds_profile import with_partitions
from tfcompose.model.plan.middleware import middleware_variables
from tfcompose.model.plan.topics import (
    GLOBAL,
    fence_file,
    judged_topics,
    partition_of,
    private_topics,
    takes_remappings,
)
from tfcompose.tf.ros.environment import PROFILE_VARIABLES, RMW, RosError, is_fastdds

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path
    from typing import Literal

    from tfcompose.launcher.child import ChildCommand
    from tfcompose.model.plan import Plan, PlanProcess

    Way = Literal["", "partition", "remap"]


#: Matches a command that sets or clears the profile file itself.
_LEAVES = re.compile(rf"\b({'|'.join(PROFILE_VARIABLES)})\b(=(?P<file>[^\s;&|]*))?")


def way_of(plan: Plan, base: Mapping[str, str]) -> Way:
    """Return how the plan's processes are isolated; empty if they are not isolated.

    ``base`` is the common environment of the processes.
    """
    if plan.guard.mode != "strict":
        return ""
    if plan.guard.fence != "auto":
        return plan.guard.fence
    common = {**base, **middleware_variables(plan.ros, base)}
    return (
        "partition"
        if all(is_fastdds({**common, **process.env}) for process in plan.processes)
        else "remap"
    )


def remap_tf(plan: Plan, process: PlanProcess) -> PlanProcess:
    """Return the process with its TF topics remapped to separate topics, under any name.

    ROS applies the first matching remapping, so these remappings come first.
    """
    private = private_topics(plan).get(process.name)
    if private is None or process.component:  # the request to its container contains the remapping
        return process
    rules = dict([*zip(GLOBAL, private, strict=True), *zip(process.topics, private, strict=True)])
    if process.argv[0].startswith("${launch:"):
        return replace(
            process,
            remap=rules | {old: new for old, new in process.remap.items() if old not in rules},
        )
    arguments = [argument for old, new in rules.items() for argument in ("-r", f"{old}:={new}")]
    end = process.argv.index("--ros-args") if "--ros-args" in process.argv else len(process.argv)
    return replace(
        process, argv=(*process.argv[:end], "--ros-args", *arguments, *process.argv[end + 1 :])
    )


def find_not_remapped(plan: Plan) -> list[Finding]:
    """Return a finding for owners that ignore remappings."""
    missed = [
        process.name
        for process in plan.processes
        if process.kind == "run" and process.owns and not takes_remappings(process)
    ]
    if not missed:
        return []
    message = (
        f"guard: strict uses remapping here, but the command of {_all(missed)} takes no ROS"
        " arguments"
    )
    advice = (
        "start it as {package, executable}, or as a list, and not in a shell; or use guard: {mode:"
        " watch}"
    )
    return [finding("TF902", message, None, help=advice)]


def by_partition(
    plan: Plan, commands: Mapping[str, ChildCommand], folder: Path
) -> tuple[dict[str, ChildCommand], list[Finding]]:
    """Return the commands with profiles that isolate their TF, and findings about failures."""
    judged = judged_topics(plan)
    fenced: dict[str, ChildCommand] = {}
    wrong: dict[tuple[str, str], list[str]] = {}
    for name, command in commands.items():
        process = plan.process(name)
        if process.component:
            continue  # its container has the profile
        reads = process.kind == "guard"
        topics = [
            topic
            for pair in (sorted(judged) if reads else judged & {process.topics})
            for topic in pair
        ]
        if not topics:
            continue
        try:
            _refuse_own_profile(process, command)
            text = _profile(plan, command, topics, reads=reads)
        except _CannotFenceError as error:
            wrong.setdefault((error.message, error.advice), []).append(name)
            continue
        file = fence_file(folder, name)
        env = command.env | dict.fromkeys(PROFILE_VARIABLES, str(file))
        fenced[name] = replace(command, env=env, fence=(file, text))
    return {**commands, **fenced}, [
        finding("TF902", f"{message}: {_all(names)}", None, help=advice)
        for (message, advice), names in wrong.items()
    ]


class _CannotFenceError(Exception):
    """A partition cannot isolate a process; has the reason and a way out."""

    def __init__(self, message: str, advice: str) -> None:
        super().__init__(message)
        self.message = message
        self.advice = advice


def _profile(plan: Plan, command: ChildCommand, topics: list[str], *, reads: bool) -> str:
    env = command.env
    moved = [topic for topic in topics if not topic.startswith("/")]
    if moved:
        message = f"guard: strict needs absolute names of TF topics, not {_all(moved)}"
        raise _CannotFenceError(message, "write the remapping with a leading slash")
    if not is_fastdds(env):
        message = (
            f"guard: {{fence: partition}} needs rmw_fastrtps_cpp, but these start with {env[RMW]}"
        )
        raise _CannotFenceError(message, f"use remapping: remove fence; or unset {RMW}")
    named = next((env[name] for name in PROFILE_VARIABLES if env.get(name)), None)
    file = command.folder / named if named else None
    partition = partition_of(plan)
    try:
        return with_partitions(file, "data_reader" if reads else "data_writer", topics, partition)
    except RosError as error:
        message = f"guard: strict cannot add its partition to the profile file {file}: {error}"
        raise _CannotFenceError(message, "use remapping: guard: {fence: remap}") from None


def _refuse_own_profile(process: PlanProcess, command: ChildCommand) -> None:
    """Reject an owner whose command sets another profile file and so bypasses the partition."""
    match = next(filter(None, map(_LEAVES.search, command.argv)), None) if process.owns else None
    if match is None:
        return
    variable, file = match[1], (match["file"] or "").strip("\"'")
    message = (
        f"guard: strict cannot separate a command that sets {variable}"
        f" itself{f', to {file}' if file else ''}"
    )
    advice = (
        f"name the file in the robot file, so that the partition is added to it: env:"
        f" {{{variable}: {file or 'FILE'}}}"
    )
    raise _CannotFenceError(message, f"{advice}; or use remapping: guard: {{fence: remap}}")


def _all(names: list[str]) -> str:
    return ", ".join(dict.fromkeys(names))
