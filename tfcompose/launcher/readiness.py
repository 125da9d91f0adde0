"""Start conditions and readiness of processes, and reports about late processes.

The launcher starts a process when the processes in the plan's ``after`` have reached the required
states. A process counts as ready when its own readiness check passes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Literal, cast

from tfcompose.foundation.findings import Note, finding
from tfcompose.foundation.text import list_names
from tfcompose.launcher.events import NotifyLate, Order
from tfcompose.launcher.failures import waits_in_vain
from tfcompose.model.messages import AllReady, AllStarted, Gate, ProcessReady, StartRow

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Finding
    from tfcompose.launcher.state import State, Tracked, Transition
    from tfcompose.model.plan import LifecycleState, PlanProcess, ReadyKind, StartCondition

#: Readiness checks that the guard carries out.
_GUARDED = ("edges", "topic", "service", "lifecycle")
#: Maximum number of missing edges that a report lists.
_NAMED_AT_MOST = 4


# Before the start: ``after``.


def unmet(state: State, tracked: Tracked) -> tuple[tuple[str, StartCondition], ...]:
    """Return the processes that a process still waits for, each with its condition."""
    return tuple(
        (name, what)
        for name, what in tracked.process.after.items()
        if not _is_met(state.tracked[name], what)
    )


def unmet_in_words(state: State, tracked: Tracked) -> str:
    """Return the conditions that delay the start of a process, as text.

    For example "slam to be ready and map to be done"; "" without such conditions.
    """
    return " and ".join(f"{name} to be {what}" for name, what in unmet(state, tracked))


def give_up_waiting(step: Transition) -> None:
    """Fail each process whose start condition can no longer be met."""
    for name, tracked in step.state.tracked.items():
        if tracked.state != "stopped" or not tracked.should_run or tracked.failed:
            continue
        for awaited_name, what in unmet(step.state, tracked):
            awaited = step.state.tracked[awaited_name]
            if awaited.failed or awaited.state == "exited":
                why = "has failed" if awaited.failed else "has ended"
                step.fail_process(name, waits_in_vain(name, awaited_name, what, why))
                break


def _is_met(awaited: Tracked, what: StartCondition) -> bool:
    if what == "ready":
        return awaited.ready
    if what == "done":
        return awaited.state == "exited" and not awaited.failed
    return awaited.was_started or awaited.state == "expected"


# Readiness checks, called gates.


def gate_of(process: PlanProcess) -> ReadyKind | Literal["started"]:
    """Return the kind of the process's readiness check."""
    if process.ready:
        return process.ready.kind
    if process.lifecycle:
        return "lifecycle"
    return "edges" if process.owns else "started"


def has_own_gate(process: PlanProcess) -> bool:
    """Return whether the plan declares a readiness check for the process."""
    return process.ready is not None or bool(process.lifecycle)


def order_gate(step: Transition, tracked: Tracked) -> None:
    """Order the guard to check the readiness and to bring lifecycle nodes into their states."""
    process, kind = tracked.process, gate_of(tracked.process)
    ready = process.ready
    by_edges = kind == "edges" and ready is not None
    if step.state.guard is None or not (
        process.lifecycle or by_edges or kind in ("topic", "service", "lifecycle")
    ):
        return
    nodes, text = process.lifecycle, ready.text if ready else ""
    if kind == "lifecycle" and not nodes:
        nodes = dict.fromkeys(process.nodes, cast("LifecycleState", text))
    topic = text if kind == "topic" else ""
    service = text if kind == "service" else ""
    writers = process.topics if by_edges else ()
    gate = Gate(
        process.name, topic, service, dict(nodes), drive=bool(process.lifecycle), writers=writers
    )
    step.actions.append(Order(gate))


def open_gate(step: Transition, name: str, observed: str = "") -> None:
    """Record that the process is ready."""
    tracked = step.state.tracked[name]
    if tracked.ready:
        return
    step.track(
        name, replace(tracked, ready=True, ready_since=step.now, observed=observed, late=False)
    )
    if gate_of(tracked.process) == "edges" and has_own_gate(tracked.process):
        step.actions.append(Order(Gate(name)))  # ends the check by the guard
    if has_own_gate(tracked.process):
        step.notify(ProcessReady(name, observed, step.since_begin))


def check_gates(step: Transition) -> None:
    """Open the gates that the guard does not watch, and report late processes."""
    for name, tracked in step.state.tracked.items():
        if tracked.ready or not _is_awaited(tracked):
            continue
        kind, ready = gate_of(tracked.process), tracked.process.ready
        if tracked.state != "starting" and (
            kind == "started" or (kind in _GUARDED and step.state.guard is None)
        ):
            open_gate(step, name, "started")
        elif (
            kind == "time"
            and ready
            and tracked.state != "starting"
            and step.now >= tracked.began + ready.number
        ):
            open_gate(step, name, f"{ready.number:g} s have passed")
        elif (
            not tracked.late
            and (due := late_at(step.state, tracked)) is not None
            and step.now >= due
        ):
            step.track(name, replace(tracked, late=True))
            finding = _late(step.state, tracked, due - tracked.began)
            step.update(reported=step.state.reported | {finding.code})
            step.actions.append(NotifyLate(name, finding))


def late_at(state: State, tracked: Tracked) -> float | None:
    """Return when the process counts as late, None without a limit."""
    if tracked.ready or tracked.late or not _is_awaited(tracked):
        return None
    ready = tracked.process.ready
    if tracked.state != "starting" and (
        not has_own_gate(tracked.process) or (ready and ready.kind == "time")
    ):
        return None
    timeout_s = ready.timeout_s if ready else None
    return tracked.began + (state.times.ready_s if timeout_s is None else timeout_s)


def _is_awaited(tracked: Tracked) -> bool:
    """Return whether the process is expected to become ready without further actions.

    For a component, return whether its container was asked to load it.
    """
    return tracked.state in ("running", "expected") or (
        tracked.state == "starting" and tracked.process.component is not None
    )


def opens_at(tracked: Tracked) -> float | None:
    """Return when a gate opens by time, None for other gates."""
    ready = tracked.process.ready
    waits = (
        not tracked.ready
        and tracked.state in ("running", "expected")
        and ready
        and ready.kind == "time"
    )
    return tracked.began + ready.number if waits and ready else None


def waits_for(state: State, tracked: Tracked) -> str:
    """Return as text what a process waits for to be ready.

    The text is empty if the process is ready or must not run.
    """
    if (
        tracked.state == "stopped"
        and tracked.should_run
        and not tracked.failed
        and (conditions := unmet_in_words(state, tracked))
    ):
        return f"waits for {conditions}"
    if tracked.ready or not _is_awaited(tracked):
        return ""
    if tracked.state == "starting" and tracked.process.component:
        return f"{tracked.process.component.container} has not answered"
    ready = tracked.process.ready
    text = ready.text if ready else ""
    missing = [
        edge.name
        for edge in state.plan.edges_of(tracked.process.name)
        if edge.child not in state.live
    ]
    return {
        "topic": f"no node publishes {text}",
        "service": f"there is no service {text}",
        "lifecycle": "its nodes are not in their lifecycle states",
        "log": f"no line of its output holds {text}",
        "exit": "it still runs",
        "time": f"{ready.number if ready else 0:g} s have not passed",
        "edges": f"no node published {list_names(missing, _NAMED_AT_MOST)}",
    }.get(gate_of(tracked.process), "")


def _late(state: State, tracked: Tracked, seconds: float) -> Finding:
    notes = [Note(f"seen instead: {tracked.observed}")] if tracked.observed else []
    message = (
        f"{tracked.process.name} is not ready after {seconds:g} s: {waits_for(state, tracked)}"
    )
    return finding("TF817", message, None, notes=notes)


# All processes.


def is_ready(state: State) -> bool:
    """Return whether every process that should run is ready or done, and every edge is live."""
    if state.clear is None or state.stop or state.awaited:
        return False
    needed = [
        tracked for tracked in state.tracked.values() if tracked.should_run and not tracked.failed
    ]
    return all(
        (tracked.ready and not tracked.leaving) or tracked.state == "exited" for tracked in needed
    )


def report_progress(step: Transition) -> None:
    """Report once that all processes that can start have started, and once that all are ready."""
    _report_started(step)
    _report_ready(step)


def _report_started(step: Transition) -> None:
    state = step.state
    if (
        state.all_started
        or state.clear is None
        or any(tracked.state == "starting" for tracked in state.tracked.values())
    ):
        return
    step.update(all_started=True)
    waiting = tuple(
        name
        for name, tracked in state.tracked.items()
        if tracked.state == "stopped" and tracked.should_run and not tracked.failed
    )
    started = sum(tracked.order > 0 for tracked in state.tracked.values())
    step.notify(AllStarted(started, waiting, step.since_begin))


def _report_ready(step: Transition) -> None:
    state = step.state
    begun = max(state.begun or 0.0, state.replanned)
    if state.all_ready or not is_ready(state):
        return
    step.update(all_ready=True)
    rows = []
    for name, tracked in state.tracked.items():
        if (
            tracked.should_run
            and not tracked.failed
            and (tracked.began >= begun or state.replanned == 0.0)
        ):
            started = None if tracked.state == "expected" else tracked.began - begun
            rows.append(StartRow(name, started, (tracked.ready_since or tracked.since) - begun))
    step.notify(AllReady(tuple(rows), step.now - begun, state.given_up))
