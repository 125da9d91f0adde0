"""How a strict plan's processes are fenced off, so that only the guard hears what they send on TF.

Where their rmw is Fast DDS, a profile file moves their writers into a DDS partition. Elsewhere, or
where the plan says so, their TF topics are remapped to topics of their own: then their listeners are moved too, and
the guard feeds the rest of the tree back to them. A remapping reaches every process that takes ROS arguments: one of a
package, of a launch file, of tfcompose's own, and a command that owns an edge.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding
from tfcompose.plan.topics import GLOBAL, fence_file, judged_topics, partition_of, private_topics, takes_remappings
from tfcompose.ros.environment import PROFILE_VARIABLES, RosError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Literal

    from tfcompose.launcher.child import Command
    from tfcompose.plan import Plan, PlanProcess

    Way = Literal["", "partition", "remap"]


_EMPTY = """<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <profiles>
  </profiles>
</dds>
"""
_END = "</profiles>"
_PROFILE = """\
    <{kind} profile_name="{topic}">
      <propertiesPolicy>
        <properties>
          <property>
            <name>partitions</name>
            <value>{partitions}</value>
          </property>
        </properties>
      </propertiesPolicy>
    </{kind}>
"""


def can_fence(env: Mapping[str, str]) -> bool:
    """Return whether the processes' rmw knows partitions: rmw_fastrtps, which is the default."""
    return (env.get("RMW_IMPLEMENTATION") or "rmw_fastrtps_cpp").startswith("rmw_fastrtps")


def profile(env: Mapping[str, str], topics: Sequence[str], partition: str, *, reads: bool) -> str:
    """Return the text of a profile file that puts the writers of these topics into the partition.

    With ``reads`` it opens the readers of these topics to the partition as well as to everybody's. What the file that
    ``env`` names holds stays.

    Raises:
        RosError: if that file cannot be read, or has profiles of these topics itself.
    """
    file = next((env[name] for name in PROFILE_VARIABLES if env.get(name)), None)
    try:
        text = Path(file).read_text(encoding="utf-8") if file else _EMPTY
    except (OSError, UnicodeDecodeError) as error:
        raise RosError(f"the profile file {file} cannot be read: {error}") from None
    at = text.rfind(_END)
    kind = "data_reader" if reads else "data_writer"
    profiles = set(re.findall(rf"<{kind}\s[^>]*profile_name\s*=\s*[\"']([^\"']*)[\"']", text))
    if at < 0 or profiles & set(topics):
        why = "says what its writers of TF do" if profiles else "holds no profiles"
        raise RosError(f"the profile file {file} {why}: guard: strict cannot add to it")
    partitions = f";{partition}" if reads else partition
    added = "".join(_PROFILE.format(kind=kind, topic=topic, partitions=partitions) for topic in dict.fromkeys(topics))
    return text[:at].rstrip() + "\n" + added + "  " + text[at:]


RMW = "RMW_IMPLEMENTATION"


def way_of(plan: Plan, base: Mapping[str, str]) -> Way:
    """Return how the plan's processes are fenced off; empty: they are not. ``base`` is their common environment."""
    if plan.guard.mode != "strict":
        return ""
    if plan.guard.fence != "auto":
        return plan.guard.fence
    return "partition" if all(can_fence({**base, **process.env}) for process in plan.processes) else "remap"


def remapped(plan: Plan, process: PlanProcess) -> PlanProcess:
    """Return the process with its TF on its own topics, also where it uses the names that the plan gives to them.

    ROS takes the first remapping that fits, so these come first.
    """
    private = private_topics(plan).get(process.name)
    if private is None:
        return process
    rules = dict([*zip(GLOBAL, private, strict=True), *zip(process.topics, private, strict=True)])
    if process.argv[0].startswith("${launch:"):
        return replace(process, remap=rules | {old: new for old, new in process.remap.items() if old not in rules})
    words = [word for old, new in rules.items() for word in ("-r", f"{old}:={new}")]
    at = process.argv.index("--ros-args") if "--ros-args" in process.argv else len(process.argv)
    return replace(process, argv=(*process.argv[:at], "--ros-args", *words, *process.argv[at + 1 :]))


def not_remapped(plan: Plan) -> list[Finding]:
    """Return a finding for the owners that no remapping reaches."""
    missed = [
        process.name
        for process in plan.processes
        if process.kind == "run" and process.owns and not takes_remappings(process)
    ]
    if not missed:
        return []
    message = f"guard: strict fences off by remapping, and the command of {_all(missed)} takes no ROS arguments"
    advice = "start it as {package, executable}, or as a list of words, and not in a shell; or let the guard watch"
    return [finding("TF902", message, None, help=advice)]


def by_partition(plan: Plan, commands: Mapping[str, Command], folder: Path) -> tuple[dict[str, Command], list[Finding]]:
    """Return the commands with profiles that move what they send on TF into a partition, and why that cannot be."""
    judged = judged_topics(plan)
    fenced: dict[str, Command] = {}
    wrong: dict[tuple[str, str], list[str]] = {}
    for name, command in commands.items():
        process = plan.process(name)
        reads = process.kind == "guard"
        topics = [topic for pair in (sorted(judged) if reads else judged & {process.topics}) for topic in pair]
        if not topics:
            continue
        try:
            text = _profile(plan, command.env, topics, reads=reads)
        except _CannotFenceError as error:
            wrong.setdefault((error.message, error.advice), []).append(name)
            continue
        file = fence_file(folder, name)
        env = command.env | dict.fromkeys(PROFILE_VARIABLES, str(file))
        fenced[name] = replace(command, env=env, fence=(file, text))
    return {**commands, **fenced}, [
        finding("TF902", f"{message}: {_all(names)}", None, help=advice) for (message, advice), names in wrong.items()
    ]


class _CannotFenceError(Exception):
    """Why a process cannot be fenced off by a partition, and the way out."""

    def __init__(self, message: str, advice: str) -> None:
        super().__init__(message)
        self.message = message
        self.advice = advice


def _profile(plan: Plan, env: Mapping[str, str], topics: list[str], *, reads: bool) -> str:
    moved = [topic for topic in topics if not topic.startswith("/")]
    if moved:
        message = f"guard: strict needs full names of TF's topics, not {_all(moved)}, which has"
        raise _CannotFenceError(message, "write the remapping with a leading slash")
    if not can_fence(env):
        message = f"guard: {{fence: partition}} needs rmw_fastrtps_cpp, and {env[RMW]} is what they are started with"
        raise _CannotFenceError(message, f"let it fence off by remapping: leave fence out; or unset {RMW}")
    try:
        return profile(env, topics, partition_of(plan), reads=reads)
    except RosError as error:
        raise _CannotFenceError(str(error), "let it fence off by remapping: guard: {fence: remap}") from None


def _all(names: list[str]) -> str:
    return ", ".join(dict.fromkeys(names))
