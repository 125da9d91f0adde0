"""Process machine: the next state and actions, as a function of state, event and time.

The guard starts first, after the processes that it waits for, and observes the tree. Once it
reports that no node publishes an edge of the plan, the other processes start in the plan's order,
each when its conditions are met. A guard in mode ``off`` only reports live edges, and no process
waits for it. After a failure or a request, all processes stop. Each process stops after the
processes that wait for it, and the guard stops last. Reports from the guard during the stop are
ignored, because the edges of a stopped owner fall silent.
"""

from __future__ import annotations

from dataclasses import replace
from signal import SIGKILL
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Note
from tfcompose.launcher.components import order_components, take_component_answer
from tfcompose.launcher.events import (
    Begin,
    Event,
    Exited,
    Kill,
    LogMatched,
    NewPlan,
    Order,
    Started,
    StartFailed,
)
from tfcompose.launcher.failures import guard_hangs, never_clear, not_started_finding
from tfcompose.launcher.readiness import (
    check_gates,
    gate_of,
    give_up_waiting,
    late_at,
    open_gate,
    opens_at,
    order_gate,
    report_progress,
    unmet,
)
from tfcompose.launcher.state import StopReason, Transition, by_owner
from tfcompose.launcher.stopping import (
    backoff_s,
    edge_taken,
    escalate_at,
    follow_plan,
    order_descriptions,
    refusal,
    send_due_signals,
    stop_if_requested,
    take_description_answer,
    take_process_exit,
    take_process_request,
)
from tfcompose.model.messages import (
    Absent,
    Alive,
    Clear,
    ComponentState,
    CurrentFindings,
    DescriptionState,
    EdgeTaken,
    FilterBypassed,
    FindingShown,
    GateState,
    Live,
    Missing,
    OwnerLive,
    OwnerReady,
    Present,
    ProcessRequest,
    RecoveredShown,
    Remember,
    Silent,
    TreeComplete,
    Waiting,
)

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Finding
    from tfcompose.launcher.events import Action
    from tfcompose.launcher.state import State, Tracked
    from tfcompose.model.plan import Plan, PlanEdge


def step(state: State, event: Event, now: float) -> tuple[State, tuple[Action, ...]]:
    """Return the state after the event, and the resulting actions in order.

    ``now`` is monotonic time in seconds.
    """
    if state.finished:
        return state, ()
    transition = Transition(state, now)
    _react(transition, event)
    _settle(transition)
    return transition.state, tuple(transition.actions)


def wake_time(state: State) -> float | None:
    """Return the time of the next ``Tick`` in monotonic seconds, None if only events matter."""
    times, due = state.times, []
    for tracked in state.tracked.values():
        if tracked.state == "backoff":
            due.append(tracked.since + backoff_s(times, tracked.process, tracked.failures))
        escalation = escalate_at(times, tracked)
        gate = [
            time_s
            for time_s in (escalation, opens_at(tracked), late_at(state, tracked))
            if time_s is not None
        ]
        due += gate if state.stop is None else gate[: escalation is not None]
    if state.stop is None and state.begun is not None:
        if state.clear is None:
            due.append(state.begun + times.clear_s)
        due += [
            time_s for time_s in (_guard_due(state), _reminder_due(state)) if time_s is not None
        ]
    return min(due, default=None)


# Events.


def _react(step: Transition, event: Event) -> None:
    match event:
        case Begin():
            _begin(step)
        case Started(name, pid):
            _take_start(step, name, pid)
        case StartFailed(name, why):
            _take_failed_start(step, name, why)
        case Exited():
            take_process_exit(step, event)
        case ComponentState(name, number):
            if name in step.state.tracked and step.state.tracked[name].order == number:
                take_component_answer(step, event)
        case DescriptionState(process) if process in step.state.tracked:
            take_description_answer(step, event)
        case EdgeTaken(finding):
            edge_taken(step, finding)
        case _:
            stop_if_requested(step, event)
            if step.state.stop is None:
                _take_request_or_report(step, event)


def _take_request_or_report(step: Transition, event: Event) -> None:
    match event:
        case ProcessRequest():
            take_process_request(step, event)
        case NewPlan():
            follow_plan(step, event)
        case GateState(process, observed, is_open=False) if process in step.state.tracked:
            step.track(process, replace(step.state.tracked[process], observed=observed))
        case GateState(process, observed) | LogMatched(process, observed) if (
            process in step.state.tracked
        ):
            if gate_of(step.state.tracked[process].process) not in ("edges", "exit", "time"):
                open_gate(step, process, observed)
        case OwnerReady(process) if process in step.state.tracked:
            _owner_ready(step, process)
        case _:  # other events of the guard, and Tick
            _take_guard_report(step, event)


def _take_failed_start(step: Transition, name: str, why: str) -> None:
    tracked = step.state.tracked[name]
    step.enter(name, "fatal", why, order=tracked.order if tracked.began else 0)
    step.fail_process(name, not_started_finding(name, why))


def _begin(step: Transition) -> None:
    guard = step.state.guard
    judges = guard is not None and step.state.plan.guard.mode != "off"
    step.update(begun=step.now, clear=None if judges else step.now)
    if guard and not unmet(step.state, step.state.tracked[guard]):
        step.start(guard)
    for name, tracked in step.state.tracked.items():
        if tracked.state == "expected":
            step.enter(name, "expected", began=step.now)
            order_gate(step, step.state.tracked[name])


def _take_start(step: Transition, name: str, pid: int) -> None:
    step.enter(name, "running", pid=pid, began=step.now)
    if name != step.state.guard:
        order_gate(step, step.state.tracked[name])
        return
    _expect_no_sign_of_life(step)
    step.update(silent=frozenset(), findings=())  # the new guard reports these itself
    if step.state.clear is not None:  # the other processes already run
        for tracked in step.state.tracked.values():
            _introduce(step, tracked)
            if not tracked.ready and tracked.state in ("running", "expected"):
                order_gate(step, tracked)
    order_components(step)
    order_descriptions(step)


def _introduce(step: Transition, owner: Tracked) -> None:
    """Send the orders about an owner that a restarted guard has missed."""
    name = owner.process.name
    runs = owner.state in ("starting", "running", "expected")
    missing = any(child not in step.state.live for _, child in owner.process.owns)
    if owner.process.owns and not runs:
        step.actions.append(Order(Absent(name)))
    elif missing and step.state.memory:
        step.actions += [Order(Absent(name)), Order(Present(name))]


# Reports of the guard.


def _take_guard_report(step: Transition, event: Event) -> None:
    match event:
        case Alive():
            step.update(guard_alive=step.now, guard_overdue=None)
        case Clear():
            _clear(step)
        case Live(children=children):
            step.update(live=step.state.live.union(children))
        case Silent(children, over):
            silent = step.state.silent
            step.update(silent=silent.difference(children) if over else silent.union(children))
        case TreeComplete(edges):
            _complete(step, edges)
        case FindingShown(finding, process):
            _violation(step, finding, process)
        case FilterBypassed(finding, process, pid):
            _report_left_fence(step, finding, process or _process_of(step.state, pid), pid)
        case RecoveredShown(text):
            step.notify(RecoveredShown(text, step.since_begin))
        case _:
            _keep(step, event)


def _keep(step: Transition, event: Event) -> None:
    """Store the guard's report for other commands and for the next guard."""
    match event:
        case Remember(changed):
            step.update(memory=step.state.memory | changed)
        case CurrentFindings(findings):
            step.update(findings=findings)
        case _:
            pass


def _clear(step: Transition) -> None:
    state = step.state
    if state.clear is None:
        step.update(clear=step.now)
    if state.unwatched is not None:
        step.update(unwatched=None)
        message = f"{state.guard} watches again after {step.now - state.unwatched:.1f} s"
        step.notify(RecoveredShown(message, step.since_begin))


def _owner_ready(step: Transition, process: str) -> None:
    """Record that all edges of the owner are live."""
    if gate_of(step.state.tracked[process].process) == "edges":
        open_gate(step, process, "its edges are live")
    edges = step.state.plan.edges_of(process)
    if edges:
        names = tuple(edge.name for edge in edges)
        step.notify(OwnerLive(process, edges[0].node, names, step.since_begin))
        if not step.state.missing:
            _complete(step, len(step.state.plan.edges))


def _complete(step: Transition, edges: int) -> None:
    if not step.state.complete:
        step.update(complete=True)
        step.notify(TreeComplete(edges, step.since_begin))


def _violation(step: Transition, finding: Finding, process: str) -> None:
    """Report the guard's finding, and stop ``process`` or all processes, by the plan's policy.

    ``process`` is the offender if it is certain and belongs to the plan; otherwise empty.
    """
    policy = step.state.plan.guard.on_violation
    if finding.severity == "error" and policy == "stop":
        step.report(finding)
        step.stop(StopReason("failure", 1), finding.label)
    elif finding.severity == "error" and policy == "stop-offender" and process:
        _stop_offender(step, finding, process, "on_violation is stop-offender")
    else:
        step.report(finding)


def _process_of(state: State, pid: int) -> str:
    """Return the process of the plan with this process id, "" without one."""
    started = (name for name, tracked in state.tracked.items() if tracked.pid == pid)
    return next(started, "")


def _report_left_fence(step: Transition, finding: Finding, process: str, pid: int) -> None:
    """Report a process that bypasses a strict plan's filter, and stop it by the plan's policy.

    ``process`` is empty if it is unknown which process of the plan started ``pid``.
    """
    if step.state.plan.guard.on_violation == "stop":
        _violation(step, finding, process)
    elif not process:
        step.report(
            _with_note(
                finding,
                f"nothing is stopped: a process of the plan started it; kill {pid} ends it",
            )
        )
    else:
        _stop_offender(step, finding, process, "guard is strict")


def _stop_offender(step: Transition, finding: Finding, process: str, because: str) -> None:
    if why := refusal(step.state, process, "stop"):
        step.report(_with_note(finding, f"nothing is stopped: {why}"))
        return
    step.report(_with_note(finding, f"{process} is stopped and not restarted: {because}"))
    take_process_request(step, ProcessRequest("stop", process))


def _with_note(finding: Finding, text: str) -> Finding:
    return replace(finding, notes=(*finding.notes, Note(text)))


# A watchdog for the guard. It kills a guard that hangs, and a killed guard restarts. A working
# guard sends a sign of life every second. If signs of life are missing, the launcher itself may
# have been suspended. So it waits again, by its own clock, before it kills the guard.


def _expect_no_sign_of_life(step: Transition) -> None:
    """Expect no sign of life from the guard until its first one."""
    step.update(guard_alive=None, guard_overdue=None)


def _guard_due(state: State) -> float | None:
    """Return when the guard becomes overdue, or counts as hung.

    None if no sign of life is expected.
    """
    if (
        state.guard is None
        or state.guard_alive is None
        or state.tracked[state.guard].state != "running"
    ):
        return None
    if state.guard_overdue is None:
        return state.guard_alive + state.times.guard_silent_s
    return state.guard_overdue + state.times.guard_overdue_s


def _kill_a_guard_that_hangs(step: Transition) -> None:
    due, state = _guard_due(step.state), step.state
    if due is None or step.now < due or state.guard is None or state.guard_alive is None:
        return
    if state.guard_overdue is None:
        step.update(guard_overdue=step.now)
        return
    strict = state.plan.guard.mode == "strict"
    step.report(guard_hangs(state.guard, step.now - state.guard_alive, strict=strict))
    step.actions.append(Kill(state.guard, SIGKILL))
    _expect_no_sign_of_life(step)


# Consequences.


def _settle(step: Transition) -> None:
    """Carry out everything that is due after the event."""
    state = step.state
    if state.begun is None:
        return
    if (
        state.stop is None
        and state.clear is None
        and step.now >= state.begun + state.times.clear_s
    ):
        step.fail(never_clear(state.guard or "guard", state.times.clear_s))
    if step.state.stop is None:
        _go_on(step)
    send_due_signals(step)
    if step.state.stop and not any(tracked.alive for tracked in step.state.tracked.values()):
        step.finish(step.state.stop.exit_code)


def _go_on(step: Transition) -> None:
    check_gates(step)
    _kill_a_guard_that_hangs(step)
    give_up_waiting(step)
    for name, tracked in step.state.tracked.items():
        if tracked.state not in ("stopped", "backoff"):
            continue
        may_start = step.state.clear is not None or name in _before_clear(step.state)
        fresh = (
            tracked.state == "stopped"
            and tracked.should_run
            and may_start
            and not unmet(step.state, tracked)
        )
        again = tracked.state == "backoff" and step.now >= tracked.since + backoff_s(
            step.state.times, tracked.process, tracked.failures
        )
        if fresh or again:
            step.start(name)
    report_progress(step)
    due = _reminder_due(step.state)
    if due is not None and step.now >= due:
        missing = step.state.awaited
        step.update(reminded_of=frozenset(edge.child for edge in missing), reminded=step.now)
        step.notify(
            Waiting(
                tuple(
                    _missing(step.state.plan, owner, edges) for owner, edges in by_owner(missing)
                )
            )
        )
    if step.state.stop is None and all(
        tracked.failed or tracked.state in ("exited", "expected")
        for tracked in step.state.tracked.values()
    ):
        step.finish(1 if step.state.given_up else 0)


def _before_clear(state: State) -> tuple[str, ...]:
    """Return the processes that start before the guard has observed the tree.

    These are the guard and the processes that it waits for.
    """
    return (state.guard, *state.tracked[state.guard].process.after) if state.guard else ()


def _reminder_due(state: State) -> float | None:
    """Return when to report the missing edges, None if no further edges are missing."""
    if state.clear is None or state.complete or not state.awaited:
        return None
    if state.reminded is None:
        return state.clear + state.times.waiting_s
    missing = {edge.child for edge in state.awaited}
    return None if missing == state.reminded_of else state.reminded + state.times.waiting_s


def _missing(plan: Plan, owner: str, edges: tuple[PlanEdge, ...]) -> Missing:
    return Missing(
        owner, edges[0].node, tuple(edge.name for edge in edges), len(plan.edges_of(owner))
    )
