"""The topics on which a plan's processes publish TF, and the isolation of these processes.

A strict guard isolates processes by a DDS partition, or by remapping each process to separate
topics. Both the launcher and the guard use this module.
"""

from __future__ import annotations

import posixpath
import re
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING
from zlib import crc32

from tfcompose.model.plan.middleware import ROUTER_PROGRAM

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tfcompose.model.plan import Plan, PlanEdge, PlanProcess

#: Topics of moving and of fixed edges.
Topics = tuple[str, str]

#: The default topics of moving and of fixed edges.
GLOBAL = ("/tf", "/tf_static")
#: The folder with profile files, next to a run's plan.
_FENCE = "fence"
#: Underscores that are invalid in a part of a topic's name.
_UNDERSCORES = re.compile(r"__+|_(?=/|$)")


def topics_below(namespace: str) -> Topics:
    """Return the topics of moving and of fixed edges below a namespace."""
    prefix = f"/{namespace.strip('/')}" if namespace.strip("/") else ""
    return f"{prefix}/tf", f"{prefix}/tf_static"


def namespace_options(names: Iterable[str]) -> str:
    """Return the options that select these topics.

    For example, ``--namespace /robot1 or --namespace /robot2``.
    """
    spaces = dict.fromkeys(name.rpartition("/")[0] for name in names)
    return " or ".join(map(_namespace_option, spaces))


def _namespace_option(name: str) -> str:
    return f"--namespace {name}" if name else "without --namespace"


def parts_of(plan: Plan) -> dict[Topics, Plan]:
    """Return the plan for each pair of topics, with the edges published on them."""
    topics = {process.name: process.topics for process in plan.processes}
    edges: dict[Topics, list[PlanEdge]] = {}
    for edge in plan.edges:
        edges.setdefault(topics.get(edge.owner, GLOBAL), []).append(edge)
    return {pair: replace(plan, edges=tuple(some)) for pair, some in edges.items()}


def joint_states_topic(plan: Plan, edge: PlanEdge) -> str:
    """Return the topic on which the owner of a joint's edge receives joint states."""
    name = "joint_states"
    topic = posixpath.join(posixpath.dirname(edge.node), name)
    remap = plan.process(edge.owner).remap
    return posixpath.join(posixpath.dirname(edge.node), remap.get(name, remap.get(topic, topic)))


def joint_states_topics(plan: Plan) -> list[str]:
    """Return the topics on which the plan's owners receive joint states, without duplicates."""
    edges = [edge for edge in plan.edges if edge.kind == "joint"]
    return list(dict.fromkeys(joint_states_topic(plan, edge) for edge in edges))


def partition_of(plan: Plan) -> str:
    """Return the partition in which the plan's processes publish TF.

    If the plan runs on several hosts, each host has its own partition.
    """
    return (
        f"tfc_{plan.robot}.{re.sub(r'[^A-Za-z0-9.-]', '_', plan.host)}"
        if plan.host
        else f"tfc_{plan.robot}"
    )


def fence_file(folder: Path, process: str) -> Path:
    """Return the profile file that moves a process's writers into the partition."""
    return folder / _FENCE / f"{process.replace('/', '.')}.xml"


def is_fence(file: str, process: str) -> bool:
    """Return whether a profile file isolates the process.

    The file may also belong to a previous plan of the run.
    """
    return PurePosixPath(file).parts[-2:] == PurePosixPath(fence_file(Path(), process)).parts[-2:]


def judged_topics(plan: Plan) -> set[Topics]:
    """Return the pairs of topics that the guard watches.

    The guard ignores processes that publish on other topics.
    """
    return {process.topics for process in plan.processes if process.kind == "guard"} | parts_of(
        plan
    ).keys()


def private_topics(plan: Plan) -> dict[str, Topics]:
    """Return the separate topics (moving, fixed) of each process that can be remapped.

    The names begin with an underscore, which hides them from lists of topics.
    """
    judged = judged_topics(plan)
    folders = {
        process.name: f"/_tfcompose/{_plain(plan.robot)}/{_plain(process.name)}"
        for process in plan.processes
        if takes_remappings(process) and process.topics in judged
    }
    return {name: (f"{folder}/tf", f"{folder}/tf_static") for name, folder in folders.items()}


def takes_remappings(process: PlanProcess) -> bool:
    """Return whether tfcompose starts the process, it may publish TF, and it takes ROS arguments.

    A plain command counts only if it owns an edge or has ROS arguments, because it may not be a
    ROS node. Arguments after a shell command do not reach the program.
    """
    if process.kind != "run":
        return process.kind in ("static", "joints", "simulate", "component")
    if (
        not process.argv
        or process.argv[:2] == ("/bin/sh", "-c")
        or process.argv[0] == ROUTER_PROGRAM
    ):
        return False
    return process.argv[0].startswith("${") or bool(process.owns) or "--ros-args" in process.argv


def _plain(name: str) -> str:
    """Return the name as a part of a topic, without double or trailing underscores."""
    plain = _UNDERSCORES.sub("_0", name)
    return name if plain == name else f"{plain}_{crc32(name.encode()):08x}"
