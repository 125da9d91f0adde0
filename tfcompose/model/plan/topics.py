"""On which topics a plan's processes publish TF.

Those of the plan, and behind which fence, if its guard is strict.

A fence is a DDS partition, or topics of each process's own, to which it is remapped. Launcher and
guard both know it.
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

#: The topics of moving and of fixed edges, where nothing moves them.
GLOBAL = ("/tf", "/tf_static")
#: The folder with profile files, beside a run's plan.
_FENCE = "fence"
#: What no part of a topic's name may hold.
_UNDERSCORES = re.compile(r"__+|_(?=/|$)")


def topics_below(namespace: str) -> Topics:
    """Return the topics of moving and of fixed edges below a namespace."""
    prefix = f"/{namespace.strip('/')}" if namespace.strip("/") else ""
    return f"{prefix}/tf", f"{prefix}/tf_static"


def namespace_options(names: Iterable[str]) -> str:
    """Return the options that lead to these topics.

    ``--namespace /robot1 or --namespace /robot2``.
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
    """Return the topic on which the owner of a joint's edge hears its states."""
    name = "joint_states"
    topic = posixpath.join(posixpath.dirname(edge.node), name)
    remap = plan.process(edge.owner).remap
    return posixpath.join(posixpath.dirname(edge.node), remap.get(name, remap.get(topic, topic)))


def joint_states_topics(plan: Plan) -> list[str]:
    """Return the topics on which the plan's owners hear joint states, each once."""
    edges = [edge for edge in plan.edges if edge.kind == "joint"]
    return list(dict.fromkeys(joint_states_topic(plan, edge) for edge in edges))


def partition_of(plan: Plan) -> str:
    """Return the partition that the plan's processes send TF in.

    Those of one host, where it runs on several.
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
    """Return whether a profile file is one that fences the process off.

    That of the run's plan before is one, too.
    """
    return PurePosixPath(file).parts[-2:] == PurePosixPath(fence_file(Path(), process)).parts[-2:]


def judged_topics(plan: Plan) -> set[Topics]:
    """Return the pairs of topics that the guard watches.

    A process that sends on others is nobody's business.
    """
    return {process.topics for process in plan.processes if process.kind == "guard"} | parts_of(
        plan
    ).keys()


def private_topics(plan: Plan) -> dict[str, Topics]:
    """Return the remapped topics (moving, fixed) of each process that can be remapped.

    Their first underscore hides them from lists of topics.
    """
    judged = judged_topics(plan)
    folders = {
        process.name: f"/_tfcompose/{_plain(plan.robot)}/{_plain(process.name)}"
        for process in plan.processes
        if takes_remappings(process) and process.topics in judged
    }
    return {name: (f"{folder}/tf", f"{folder}/tf_static") for name, folder in folders.items()}


def takes_remappings(process: PlanProcess) -> bool:
    """Return whether we start it, it may send TF, and it takes ROS arguments.

    What is started by a plain command may be no ROS node at all, unless it owns an edge or is
    given ROS arguments. What follows a text that a shell reads does not reach the program.
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
    """Return the name as part of a topic: no double or trailing underscores."""
    plain = _UNDERSCORES.sub("_0", name)
    return name if plain == name else f"{plain}_{crc32(name.encode()):08x}"
