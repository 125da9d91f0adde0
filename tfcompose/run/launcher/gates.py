"""When a process is ready: what its gate waits for, and what is said of one that stays shut."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, cast

from tfcompose.findings import Note, finding
from tfcompose.ipc import AllReady, AllStarted, Gate, ProcessReady, StartRow
from tfcompose.run.launcher.action import Order, TellLate
from tfcompose.run.launcher.prerequisites import unmet_in_words

if TYPE_CHECKING:
    from tfcompose.findings import Finding
    from tfcompose.plan import LifecycleState, PlanProcess
    from tfcompose.run.launcher.state import State, Tracked
    from tfcompose.run.launcher.turn import Turn

#: Gates at which the guard looks.
_GUARDED = ("edges", "topic", "service", "lifecycle")


def kind_of(process: PlanProcess) -> str:
    """Return what the process's readiness hangs on: its gate's kind, or "started"."""
    if process.ready:
        return process.ready.kind
    if process.lifecycle:
        return "lifecycle"
    return "edges" if process.owns else "started"


def has_own_gate(process: PlanProcess) -> bool:
    """Return whether the plan says by what this process is ready."""
    return process.ready is not None or bool(process.lifecycle)


def order_gate(turn: Turn, one: Tracked) -> None:
    """Tell the guard what to look for, and which nodes to bring into their states."""
    process, kind = one.process, kind_of(one.process)
    ready = process.ready
    by_edges = kind == "edges" and ready is not None
    if turn.state.guard is None or not (process.lifecycle or by_edges or kind in ("topic", "service", "lifecycle")):
        return
    nodes, text = process.lifecycle, ready.text if ready else ""
    if kind == "lifecycle" and not nodes:
        nodes = dict.fromkeys(process.nodes, cast("LifecycleState", text))
    topic, service = (text if kind == name else "" for name in ("topic", "service"))
    writers = process.topics if by_edges else ()
    gate = Gate(process.name, topic, service, dict(nodes), drive=bool(process.lifecycle), writers=writers)
    turn.actions.append(Order(gate))


def opened(turn: Turn, name: str, seen: str = "") -> None:
    """Note that the process is ready."""
    one = turn.state.tracked[name]
    if one.ready:
        return
    turn.track(name, replace(one, ready=True, ready_since=turn.now, seen=seen, late=False))
    if kind_of(one.process) == "edges" and has_own_gate(one.process):
        turn.actions.append(Order(Gate(name)))  # nobody need look any more
    if has_own_gate(one.process):
        turn.tell(ProcessReady(name, seen, turn.now - (turn.state.begun or 0.0)))


def look(turn: Turn) -> None:
    """Open the gates that need nobody to look, and say which are late."""
    for name, one in turn.state.tracked.items():
        if one.ready or one.state not in ("RUNNING", "EXPECTED"):
            continue
        kind, ready = kind_of(one.process), one.process.ready
        if kind == "started" or (kind in _GUARDED and turn.state.guard is None):
            opened(turn, name, "started")
        elif kind == "time" and ready and turn.now >= one.began + ready.number:
            opened(turn, name, f"{ready.number:g} s have passed")
        elif not one.late and (due := late_at(turn.state, one)) is not None and turn.now >= due:
            turn.track(name, replace(one, late=True))
            found = _late(turn.state, one, due - one.began)
            turn.know(shown=turn.state.shown | {found.code})
            turn.actions.append(TellLate(name, found))


def say_progress(turn: Turn) -> None:
    """Say, once, that all that can be was started, and that all are ready."""
    _say_started(turn)
    _say_ready(turn)


def late_at(state: State, one: Tracked) -> float | None:
    """Return when the process is late; None if it may take its time."""
    if one.ready or one.late or not has_own_gate(one.process) or one.state not in ("RUNNING", "EXPECTED"):
        return None
    ready = one.process.ready
    if ready and ready.kind == "time":
        return None
    timeout_s = ready.timeout_s if ready else None
    return one.began + (state.times.ready_s if timeout_s is None else timeout_s)


def opens_at(one: Tracked) -> float | None:
    """Return when a gate opens by itself."""
    ready = one.process.ready
    waits = not one.ready and one.state in ("RUNNING", "EXPECTED") and ready and ready.kind == "time"
    return one.began + ready.number if waits and ready else None


def waits_for(state: State, one: Tracked) -> str:
    """Return what a process is still without, in words; "" if it is ready, or is not to run."""
    if one.state == "STOPPED" and one.wanted and not one.failed and (others := unmet_in_words(state, one)):
        return f"waits for {others}"
    if one.ready or one.state not in ("RUNNING", "EXPECTED"):
        return ""
    ready = one.process.ready
    text = ready.text if ready else ""
    missing = [edge.name for edge in state.plan.edges_of(one.process.name) if edge.child not in state.live]
    named = ", ".join(missing[:4]) + (f" and {len(missing) - 4} more" if len(missing) > 4 else "")  # noqa: PLR2004
    return {
        "topic": f"nobody publishes {text}",
        "service": f"there is no service {text}",
        "lifecycle": "its nodes are not in their lifecycle states",
        "log": f"no line of its output holds {text}",
        "exit": "it still runs",
        "time": f"{ready.number if ready else 0:g} s have not passed",
        "edges": f"nobody published {named}",
    }.get(kind_of(one.process), "")


def _late(state: State, one: Tracked, seconds: float) -> Finding:
    notes = [Note(f"seen instead: {one.seen}")] if one.seen else []
    message = f"{one.process.name} is not ready after {seconds:g} s: {waits_for(state, one)}"
    return finding("TF817", message, None, notes=notes)


def _say_started(turn: Turn) -> None:
    state = turn.state
    if state.all_started or state.clear is None or any(one.state == "STARTING" for one in state.tracked.values()):
        return
    turn.know(all_started=True)
    waiting = tuple(
        name for name, one in state.tracked.items() if one.state == "STOPPED" and one.wanted and not one.failed
    )
    started = sum(one.order > 0 for one in state.tracked.values())
    turn.tell(AllStarted(started, waiting, turn.now - (state.begun or 0.0)))


def is_ready(state: State) -> bool:
    """Return whether every process that is wanted is ready, or done, and every edge live."""
    if state.clear is None or state.stop or state.awaited:
        return False
    wanted = [one for one in state.tracked.values() if one.wanted and not one.failed]
    return all((one.ready and not one.leaving) or one.state == "EXITED" for one in wanted)


def _say_ready(turn: Turn) -> None:
    state = turn.state
    begun = max(state.begun or 0.0, state.begun_anew)
    if state.all_ready or not is_ready(state):
        return
    turn.know(all_ready=True)
    rows = []
    for name, one in state.tracked.items():
        if one.wanted and not one.failed and (one.began >= begun or state.begun_anew == 0.0):
            started = None if one.state == "EXPECTED" else one.began - begun
            rows.append(StartRow(name, started, (one.ready_since or one.since) - begun))
    turn.tell(AllReady(tuple(rows), turn.now - begun, state.given_up))
