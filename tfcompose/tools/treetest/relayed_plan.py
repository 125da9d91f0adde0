"""Plan of a started robot in which relays change the messages of processes with faults."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.model.plan.topics import takes_remappings
from tfcompose.tools.treetest.injections import split_pair
from tfcompose.tools.treetest.processes import own_command
from tfcompose.tools.treetest.relay_request import RelayRequest

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from tfcompose.model.plan import Plan, PlanEdge
    from tfcompose.tools.treetest.injections import InjectionSpec


def changed_edges(injection: InjectionSpec, plan: Plan) -> list[PlanEdge]:
    """Return the edges whose messages a fault changes; empty if it changes no messages."""
    if injection.rename is not None:
        frame = injection.rename.frame
        return [edge for edge in plan.edges if frame in {edge.parent, edge.child}]
    if injection.joint is not None:
        name = injection.joint.name
        return [edge for edge in plan.edges if edge.joint and edge.joint.name == name]
    pair = split_pair(injection.edge) if injection.edge else None
    return [edge for edge in plan.edges if (edge.parent, edge.child) == pair]


def relayed_processes(injection: InjectionSpec, plan: Plan) -> list[str]:
    """Return the processes whose messages a fault changes; empty if it changes no messages."""
    return list(dict.fromkeys(edge.owner for edge in changed_edges(injection, plan)))


def find_obstacles(injection: InjectionSpec, plan: Plan) -> Iterator[tuple[str, str]]:
    """Yield a sentence and a way out for each process whose messages cannot be relayed."""
    for name in relayed_processes(injection, plan):
        process = plan.process(name)
        if process.kind == "external":
            yield f"{name} is started elsewhere", "choose a profile that starts it"
        elif process.component is not None:
            container = process.component.container
            yield f"{name} is a component in {container}", "run it as a node of its own"
        elif not takes_remappings(process):
            advice = "start it as {package, executable}, or as a list, and not in a shell"
            yield f"the command of {name} takes no ROS arguments", advice


def with_relays(plan: Plan, injections: Sequence[InjectionSpec], setup: Path) -> Plan:
    """Return the plan in which processes with faults begin as ``relay``; ``setup`` is its file."""
    names = {name for injection in injections for name in relayed_processes(injection, plan)}
    processes = list(plan.processes)
    for number, process in enumerate(processes):
        if process.name in names:
            # The underscore hides them from lists of topics.
            folder = f"/_tfcompose_test/process{number}"
            topics = (f"{folder}/tf", f"{folder}/tf_static")
            request = RelayRequest(str(setup), process.name, topics, process.topics)
            command = (*own_command("tfcompose.tools.treetest.relay"), request.text)
            processes[number] = replace(process, prefix=(*command, *process.prefix))
    return replace(plan, processes=tuple(processes))
