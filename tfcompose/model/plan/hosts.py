"""A plan for several machines: which of them this machine is, and what it starts.

A process runs on the host that it names. If ``static`` names a host, the compiler has set this
host for all processes without a host. Otherwise, processes without a host run on a machine that
the plan does not name. The guard runs on every machine.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, did_you_mean, finding
from tfcompose.model.plan import PlanProcess, Ready

if TYPE_CHECKING:
    from tfcompose.model.plan import Plan, PlanEdge

#: Readiness checks that are impossible for a process on another machine.
_UNSEEN = ("log", "exit")


def hosts_of(plan: Plan) -> tuple[str, ...]:
    """Return the machines that the plan names, in order."""
    named = (process.host for process in plan.managed)
    return tuple(dict.fromkeys(host for host in named if host is not None))


def without_host(plan: Plan) -> tuple[str, ...]:
    """Return the processes that the unnamed machine starts."""
    processes = (
        process for process in plan.processes if process.kind not in ("external", "guard")
    )
    return tuple(process.name for process in processes if process.host is None)


def share_of(plan: Plan, host: str | None, machine: str) -> Plan | Finding:
    """Return the share of the plan that a machine starts. Processes of others become external.

    ``host`` is the user's choice. By default, it is the host with the name ``machine``, either the
    full name or the part before the first dot; otherwise, the machine that the plan does not name.
    A plan without hosts is returned unchanged.
    """
    hosts = hosts_of(plan)
    if host is not None and host not in hosts:
        advice = (
            f"the plan names {', '.join(hosts)}"
            if hosts
            else "the plan names no host: leave out --host"
        )
        message = f"no process of {plan.robot} runs on a host named {host}"
        return finding("TF819", message, None, help=f"{did_you_mean(host, hosts, advice)}")
    if not hosts:
        return plan
    watched = next((process.host for process in plan.processes if process.kind == "guard"), None)
    if plan.guard.mode == "strict" and watched is not None:
        message = (
            f"guard: strict needs a guard on each machine, and that of {plan.robot} is on"
            f" {watched} only"
        )
        return finding(
            "TF819", message, None, help="remove the guard's host, or watch: guard: {mode: watch}"
        )
    host = host or next(
        (name for name in (machine, machine.partition(".")[0]) if name in hosts), None
    )
    if host is None and not without_host(plan):
        message = (
            f"this machine is {machine}, and every process of {plan.robot} runs on another:"
            f" {', '.join(hosts)}"
        )
        return finding(
            "TF819", message, None, help=f"say which one it is: --host {' or --host '.join(hosts)}"
        )
    return _share(plan, host)


def describe_share(plan: Plan) -> tuple[str, ...]:
    """Return lines about a share: what this machine starts, and what other machines start.

    Empty for a complete plan.
    """
    if plan.host is None:
        return ()
    names_by_place: dict[str, list[str]] = {}
    for process in plan.processes:
        if process.kind == "external":
            names_by_place.setdefault(
                f"of {process.host}" if process.host else "from elsewhere", []
            ).append(process.name)
    names = ", ".join(process.name for process in plan.managed)
    here = f"host {plan.host}" if plan.host else "this machine, which the plan does not name,"
    return (
        f"{here} starts {names}",
        *(f"expected {where}: {', '.join(names)}" for where, names in names_by_place.items()),
    )


def _share(plan: Plan, host: str | None) -> Plan:
    processes = tuple(_here(plan, process, host) for process in plan.processes)
    watched = next((process.host for process in plan.processes if process.kind == "guard"), None)
    guard = replace(plan.guard, mode="off") if watched not in (None, host) else plan.guard
    edges = (
        tuple(_edge_on_host(plan, edge, host) for edge in plan.edges)
        if guard.mode == "strict"
        else plan.edges
    )
    return replace(plan, edges=edges, processes=processes, guard=guard, host=host or "")


def with_guard_alone(plan: Plan) -> Plan:
    """Return the plan with every process external except the guard.

    This is for a robot that another program starts. The static publisher is left out if it has no
    edge. A guard cannot block processes that another program starts, so a strict guard only
    watches.
    """
    processes = []
    for process in plan.processes:
        if process.kind in {"external", "guard"}:
            processes.append(process)
        elif process.kind != "static" or plan.edges_of(process.name):
            processes.append(_elsewhere(process))
    mode = "watch" if plan.guard.mode == "strict" else plan.guard.mode
    return replace(plan, processes=tuple(processes), guard=replace(plan.guard, mode=mode))


def _edge_on_host(plan: Plan, edge: PlanEdge, host: str | None) -> PlanEdge:
    """Return the edge as this host observes it.

    The strict guard of another machine forwards the edges of that machine's processes.
    """
    owner = plan.process(edge.owner)
    if owner.kind == "external" or owner.host == host:
        return edge
    return replace(edge, node=next(iter(plan.guards_of(owner.host)), edge.node))


def _here(plan: Plan, process: PlanProcess, host: str | None) -> PlanProcess:
    if process.kind == "guard":
        return replace(process, nodes=plan.guards_of(host))
    return process if process.kind == "external" or process.host == host else _elsewhere(process)


def _elsewhere(process: PlanProcess) -> PlanProcess:
    """Return the process as an external process, without the settings for its start."""
    ready, states = process.ready, set(process.lifecycle.values())
    if ready and ready.kind in _UNSEEN:
        ready = None
    elif ready is None and len(states) == 1 and set(process.nodes) == set(process.lifecycle):
        ready = Ready("lifecycle", states.pop())
    return PlanProcess(
        process.name,
        "external",
        remap=process.remap,
        nodes=process.nodes,
        required=process.required,
        ready=ready,
        host=process.host,
        owns=process.owns,
        drives=process.drives,
        switches=process.switches,
        namespace=process.namespace,
    )


def without_computer(plan: Plan) -> tuple[str, ...]:
    """Return the processes that no computer under ``hosts`` would run."""
    processes = (process for process in plan.managed if process.kind != "guard")
    return tuple(process.name for process in processes if process.host not in plan.hosts)
