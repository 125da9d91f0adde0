"""When a process may start and when it is ready.

What it waits for, and what is reported of one that is late.

A process waits for others, as the plan's ``after`` says, before it is started; and for its own
gate to open before it counts as ready.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Literal, cast

from tfcompose.foundation.findings import Note, finding
from tfcompose.foundation.text import listed
from tfcompose.launcher.events import NotifyLate, Order
from tfcompose.launcher.failures import waits_in_vain
from tfcompose.model.messages import AllReady, AllStarted, Gate, ProcessReady, StartRow

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Finding
    from tfcompose.launcher.state import State, Tracked, Transition
    from tfcompose.model.plan import LifecycleState, PlanProcess, ReadyKind, StartCondition

#: Gates that the guard watches.
_GUARDED = ("edges", "topic", "service", "lifecycle")
#: So many edges are named of those that are missing.
_NAMED_AT_MOST = 4


# Before the start: ``after``.


def unmet(state: State, one: Tracked) -> tuple[tuple[str, StartCondition], ...]:
    """Return the processes that this one still waits for, each with what it is to be."""
    return tuple(
        (name, what)
        for name, what in one.process.after.items()
        if not _is_met(state.tracked[name], what)
    )


def unmet_in_words(state: State, one: Tracked) -> str:
    """Return what a process that was not started waits for.

    "slam to be ready and map to be done", or "".
    """
    return " and ".join(f"{name} to be {what}" for name, what in unmet(state, one))


def give_up_waiting(step: Transition) -> None:
    """Have those fail that wait for what cannot come any more."""
    for name, one in step.state.tracked.items():
        if one.state != "stopped" or not one.wanted or one.failed:
            continue
        for other, what in unmet(step.state, one):
            found = step.state.tracked[other]
            if found.failed or found.state == "exited":
                why = "has failed" if found.failed else "has ended"
                step.fail_process(name, waits_in_vain(name, other, what, why))
                break


def _is_met(other: Tracked, what: StartCondition) -> bool:
    if what == "ready":
        return other.ready
    if what == "done":
        return other.state == "exited" and not other.failed
    return other.was_started or other.state == "expected"


# Gates.


def gate_of(process: PlanProcess) -> ReadyKind | Literal["started"]:
    """Return what the process's readiness depends on."""
    if process.ready:
        return process.ready.kind
    if process.lifecycle:
        return "lifecycle"
    return "edges" if process.owns else "started"


def has_own_gate(process: PlanProcess) -> bool:
    """Return whether the plan declares a readiness check for this process."""
    return process.ready is not None or bool(process.lifecycle)


def order_gate(step: Transition, one: Tracked) -> None:
    """Tell the guard what to watch for, and which nodes to bring into their states."""
    process, kind = one.process, gate_of(one.process)
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
    """Note that the process is ready."""
    one = step.state.tracked[name]
    if one.ready:
        return
    step.track(name, replace(one, ready=True, ready_since=step.now, observed=observed, late=False))
    if gate_of(one.process) == "edges" and has_own_gate(one.process):
        step.actions.append(Order(Gate(name)))  # the guard need not watch it any more
    if has_own_gate(one.process):
        step.notify(ProcessReady(name, observed, step.since_begin))


def check_gates(step: Transition) -> None:
    """Open the gates that no guard watches, and report those that are late."""
    for name, one in step.state.tracked.items():
        if one.ready or not _is_awaited(one):
            continue
        kind, ready = gate_of(one.process), one.process.ready
        if one.state != "starting" and (
            kind == "started" or (kind in _GUARDED and step.state.guard is None)
        ):
            open_gate(step, name, "started")
        elif (
            kind == "time"
            and ready
            and one.state != "starting"
            and step.now >= one.began + ready.number
        ):
            open_gate(step, name, f"{ready.number:g} s have passed")
        elif not one.late and (due := late_at(step.state, one)) is not None and step.now >= due:
            step.track(name, replace(one, late=True))
            found = _late(step.state, one, due - one.began)
            step.update(reported=step.state.reported | {found.code})
            step.actions.append(NotifyLate(name, found))


def late_at(state: State, one: Tracked) -> float | None:
    """Return when the process is late; None if it may take its time."""
    if one.ready or one.late or not _is_awaited(one):
        return None
    ready = one.process.ready
    if one.state != "starting" and (
        not has_own_gate(one.process) or (ready and ready.kind == "time")
    ):
        return None
    timeout_s = ready.timeout_s if ready else None
    return one.began + (state.times.ready_s if timeout_s is None else timeout_s)


def _is_awaited(one: Tracked) -> bool:
    """Return whether it is expected to become ready by itself.

    Of a component, whether its container was asked.
    """
    return one.state in ("running", "expected") or (
        one.state == "starting" and one.process.component is not None
    )


def opens_at(one: Tracked) -> float | None:
    """Return when a gate opens by itself."""
    ready = one.process.ready
    waits = (
        not one.ready and one.state in ("running", "expected") and ready and ready.kind == "time"
    )
    return one.began + ready.number if waits and ready else None


def waits_for(state: State, one: Tracked) -> str:
    """Return what a process is still without, in words; "" if it is ready, or is not to run."""
    if (
        one.state == "stopped"
        and one.wanted
        and not one.failed
        and (others := unmet_in_words(state, one))
    ):
        return f"waits for {others}"
    if one.ready or not _is_awaited(one):
        return ""
    if one.state == "starting" and one.process.component:
        return f"{one.process.component.container} has not answered"
    ready = one.process.ready
    text = ready.text if ready else ""
    missing = [
        edge.name for edge in state.plan.edges_of(one.process.name) if edge.child not in state.live
    ]
    return {
        "topic": f"nobody publishes {text}",
        "service": f"there is no service {text}",
        "lifecycle": "its nodes are not in their lifecycle states",
        "log": f"no line of its output holds {text}",
        "exit": "it still runs",
        "time": f"{ready.number if ready else 0:g} s have not passed",
        "edges": f"nobody published {listed(missing, _NAMED_AT_MOST)}",
    }.get(gate_of(one.process), "")


def _late(state: State, one: Tracked, seconds: float) -> Finding:
    notes = [Note(f"seen instead: {one.observed}")] if one.observed else []
    message = f"{one.process.name} is not ready after {seconds:g} s: {waits_for(state, one)}"
    return finding("TF817", message, None, notes=notes)


# All of them.


def is_ready(state: State) -> bool:
    """Return whether every process that is wanted is ready, or done, and every edge live."""
    if state.clear is None or state.stop or state.awaited:
        return False
    wanted = [one for one in state.tracked.values() if one.wanted and not one.failed]
    return all((one.ready and not one.leaving) or one.state == "exited" for one in wanted)


def report_progress(step: Transition) -> None:
    """Tell, once, that all that can be was started, and that all are ready."""
    _report_started(step)
    _report_ready(step)


def _report_started(step: Transition) -> None:
    state = step.state
    if (
        state.all_started
        or state.clear is None
        or any(one.state == "starting" for one in state.tracked.values())
    ):
        return
    step.update(all_started=True)
    waiting = tuple(
        name
        for name, one in state.tracked.items()
        if one.state == "stopped" and one.wanted and not one.failed
    )
    started = sum(one.order > 0 for one in state.tracked.values())
    step.notify(AllStarted(started, waiting, step.since_begin))


def _report_ready(step: Transition) -> None:
    state = step.state
    begun = max(state.begun or 0.0, state.replanned)
    if state.all_ready or not is_ready(state):
        return
    step.update(all_ready=True)
    rows = []
    for name, one in state.tracked.items():
        if one.wanted and not one.failed and (one.began >= begun or state.replanned == 0.0):
            started = None if one.state == "expected" else one.began - begun
            rows.append(StartRow(name, started, (one.ready_since or one.since) - begun))
    step.notify(AllReady(tuple(rows), step.now - begun, state.given_up))
