"""Stop of the robot or of one process, and the end of a process: restart, failure or removal.

A process first receives its own stop signal, then SIGTERM, then SIGKILL, each if the previous one
did not help. After its end it restarts after a delay, stays stopped until requested by name, or
leaves the plan.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import PurePath
from signal import SIGKILL, SIGTERM, Signals
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import did_you_mean
from tfcompose.foundation.text import plural
from tfcompose.launcher.events import Kill, Order, OutputLost, Signalled, TimeUp
from tfcompose.launcher.failures import (
    describe_exit,
    ended_by_itself_finding,
    guard_lost,
    never_published_finding,
    signal_name,
)
from tfcompose.launcher.state import UNREAD, StopReason, Tracked, by_owner
from tfcompose.model.messages import (
    Absent,
    ComponentOrder,
    DescriptionOrder,
    DescriptionState,
    DownRequest,
    Replanned,
    Reread,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.foundation.findings import Finding
    from tfcompose.launcher.events import Event, Exited, NewPlan
    from tfcompose.launcher.state import State, Times, Transition
    from tfcompose.model.messages import ProcessRequest, StateName, Verb
    from tfcompose.model.plan import PlanProcess


def backoff_s(times: Times, process: PlanProcess, failures: int) -> float:
    """Return the delay in seconds before a restart after ``failures`` failures in a row."""
    if process.restart_delay is not None:
        return process.restart_delay
    return min(times.backoff_s * 2.0 ** (failures - 1), times.backoff_limit_s)


# The end of a process.


def take_process_exit(step: Transition, event: Exited) -> None:
    """Handle the end of a process: expected, followed by a restart, or a failure.

    Components end with their container.
    """
    _take_end(step, event)
    lose_components(step, event.name)


def _take_end(step: Transition, event: Exited) -> None:
    name, how = event.name, describe_exit(event.returncode)
    tracked = step.state.tracked[name]
    if step.state.stop:
        step.enter(name, "stopped", how)
        return
    if name == step.state.guard and step.state.clear is not None and not tracked.leaving:
        _take_guard_exit(step, tracked, event)
        return
    before = tracked
    lose_edges(step, tracked)
    tracked = step.state.tracked[name]
    if tracked.leaving:
        process_left(step, tracked, how)
        return
    process, ready = tracked.process, tracked.process.ready
    expected = int(ready.number) if ready and ready.kind == "exit" else 0
    done = event.returncode == expected and process.kind == "run"
    if name != step.state.guard and (
        process.restart == "always" or (process.restart == "on-failure" and not done)
    ):
        _restart_after(step, tracked, event)
        return
    step.enter(name, "exited", how)
    # The condition that other processes wait for is met, and outlives the process.
    if done and ((before.ready and not process.owns) or (ready and ready.kind == "exit")):
        step.track(
            name,
            replace(
                step.state.tracked[name], ready=True, ready_since=before.ready_since or step.now
            ),
        )
    early = name == step.state.guard and step.state.clear is None
    when = " before it reported whether the plan's edges are published already" if early else ""
    if not done or (process.required and not _is_to_end(step.state, process)):
        when = ", and the plan requires it" if done else when
        step.fail_process(
            name, ended_by_itself_finding(name, event.returncode, when, event.last_lines)
        )


def _is_to_end(state: State, process: PlanProcess) -> bool:
    """Return whether the process is expected to end.

    Its end makes it ready, or another process waits until it is done.
    """
    ends = process.ready is not None and process.ready.kind == "exit"
    return ends or any(
        tracked.process.after.get(process.name) == "done" for tracked in state.tracked.values()
    )


def _take_guard_exit(step: Transition, tracked: Tracked, event: Exited) -> None:
    """Restart a guard that died.

    Its reports stay valid, and the next guard receives its memory.
    """
    if not step.state.memory:
        lose_edges(step, tracked)
    unwatched = step.now if step.state.unwatched is None else step.state.unwatched
    step.update(unwatched=unwatched)
    _restart_after(step, step.state.tracked[event.name], event)
    if step.state.stop is None:
        step.report(guard_lost(event.name, event, strict=step.state.plan.guard.mode == "strict"))


def lose_edges(step: Transition, tracked: Tracked) -> None:
    """Mark the edges of a process as not live: it has ended, or is about to."""
    state, name = step.state, tracked.process.name
    step.track(name, replace(tracked, ready=False, ready_since=None, observed="", late=False))
    if name == state.guard:
        # A strict guard's memory holds what it latched, also for one that is restarted by request.
        memory = state.memory if state.plan.guard.mode == "strict" else {}
        step.update(live=frozenset(), complete=not state.plan.edges, memory=memory)
    elif tracked.process.owns:
        live = state.live - {child for _, child in tracked.process.owns}
        step.update(
            live=live, complete=False, reminded=None if state.reminded is None else step.now
        )
        if state.guard is not None:
            step.actions.append(Order(Absent(name)))


def lose_components(step: Transition, container: str) -> None:
    """Handle components that ended with their container.

    Those still wanted are loaded again once it is ready again.
    """
    for tracked in step.state.components_of(container):
        if tracked.alive or tracked.state == "backoff":
            lose_edges(step, tracked)
            if (
                not tracked.process.owns and step.state.guard is not None
            ):  # what was ordered holds for that container
                step.actions.append(Order(Absent(tracked.process.name)))
            tracked = step.state.tracked[tracked.process.name]  # noqa: PLW2901 (the same, without its edges)
            process_left(
                step,
                replace(
                    tracked, leaving=tracked.leaving or ("again" if tracked.wanted else "stop")
                ),
                f"with {container}",
            )


def process_left(step: Transition, tracked: Tracked, how: str) -> None:
    """Handle the end of a process that was meant to end: stopped, started again, or dropped."""
    name = tracked.process.name
    step.track(name, tracked)
    step.enter(name, "stopped", how, level=0, failures=0)
    if tracked.leaving == "drop":
        step.update(
            tracked={other: each for other, each in step.state.tracked.items() if other != name}
        )
    else:
        step.track(
            name, replace(step.state.tracked[name], leaving="", wanted=tracked.leaving == "again")
        )


def _restart_after(step: Transition, tracked: Tracked, event: Exited) -> None:
    schedule_restart(
        step,
        tracked,
        describe_exit(event.returncode),
        lambda when: ended_by_itself_finding(event.name, event.returncode, when, event.last_lines),
    )


def schedule_restart(
    step: Transition, tracked: Tracked, how: str, failure: Callable[[str], Finding]
) -> None:
    """Schedule a restart after a delay, unless the process restarted too often.

    In that case, ``failure`` makes the finding.
    """
    name, times = tracked.process.name, step.state.times
    most = tracked.process.restart_limit
    failures = 1 if step.now - tracked.since >= times.steady_s else tracked.failures + 1
    if failures > most:
        step.enter(name, "fatal", how)
        step.fail_process(name, failure(f", after {plural(most, 'restart')}"))
        return
    delay = backoff_s(times, tracked.process, failures)
    step.enter(
        name, "backoff", f"{how}; restart {failures} of {most} in {delay:g} s", failures=failures
    )


# Requests for one process.


def refusal(state: State, name: str, verb: Verb) -> str | None:
    """Return in one sentence why the process cannot do that; None if it can."""
    tracked = state.tracked.get(name)
    if tracked is None:
        advice = did_you_mean(name, state.tracked, f"it has {', '.join(state.tracked)}")
        return f"the plan has no process {name}; {advice}"
    if state.stop:
        return "the robot is stopping"
    if tracked.state == "expected":
        return f"{name} is external: start and stop it where it runs"
    if name == state.guard and verb != "restart":
        return (
            f"{name} watches the others and cannot be stopped alone; tfcompose up --guard off"
            " runs without checks"
        )
    if verb == "start" and tracked.alive and tracked.leaving != "stop":
        return f"{name} is already running, with pid {tracked.pid}"
    if (
        verb == "stop"
        and not tracked.alive
        and tracked.state != "backoff"
        and not (tracked.state == "stopped" and tracked.wanted)
    ):
        return f"{name} is not running"
    return None


def take_process_request(step: Transition, request: ProcessRequest) -> None:
    """Stop, start or restart one process."""
    if refusal(step.state, request.name, request.do):
        return
    tracked = step.state.tracked[request.name]
    stays = request.do == "stop"
    if tracked.alive:
        step.track(
            request.name, replace(tracked, leaving="stop" if stays else "again", wanted=not stays)
        )
        return
    if tracked.state != "stopped":
        step.enter(request.name, "stopped", failures=0)
    step.track(request.name, replace(step.state.tracked[request.name], wanted=not stays))


# Another plan.


def follow_plan(step: Transition, event: NewPlan) -> None:
    """Follow another plan: stop removed processes, start new ones, restart changed ones."""
    state, plan = step.state, event.plan
    before = state.tracked
    guards = [process.name for process in plan.processes if process.kind == "guard"]
    if not guards or guards[0] != state.guard or not before[guards[0]].alive:
        event = replace(event, changed=event.changed | event.described, described=frozenset())
    live = frozenset(edge.child for edge in plan.edges if edge.child in state.live)
    step.update(
        plan=plan,
        guard=guards[0] if guards else None,
        tracked={
            process.name: _take_over(before, process.name, event) for process in plan.processes
        },
        live=live,
        complete=len(live) == len(plan.edges),
        all_started=False,
        all_ready=False,
        reminded=step.now,
        replanned=step.now,
    )
    if state.guard is not None and not before[state.guard].alive:
        step.update(memory={}, live=frozenset())  # the next one begins anew, with the new plan
    gone = {name: tracked for name, tracked in before.items() if name not in step.state.tracked}
    for name, tracked in gone.items():
        if tracked.alive:
            step.track(name, replace(tracked, leaving="drop", wanted=False))
    guard = step.state.guard
    if guard is not None and guard not in event.changed and step.state.tracked[guard].alive:
        step.actions.append(Order(Reread(event.file)))
    order_descriptions(step)
    names = tuple(step.state.tracked)
    started = {process.name for process in (*state.plan.managed, *plan.managed)}
    changed = tuple(name for name in names if name in event.changed & started and name in before)
    added = tuple(name for name in names if name not in before)
    described = tuple(name for name in names if name in event.described & started)
    step.notify(Replanned(changed, added, tuple(gone), event.held, described))


def order_descriptions(step: Transition) -> None:
    """Have the guard pass new descriptions to the running processes that do not have them yet."""
    for name, tracked in step.state.tracked.items():
        if tracked.description:
            node = tracked.process.nodes[0]
            step.actions.append(Order(DescriptionOrder(name, node, tracked.description)))


def take_description_answer(step: Transition, event: DescriptionState) -> None:
    """Restart a process that did not take its description."""
    tracked = step.state.tracked[event.process]
    if not tracked.description:
        return
    step.track(event.process, replace(tracked, description=""))
    if event.why and tracked.alive:
        step.track(event.process, replace(tracked, description="", leaving="again", wanted=True))
        step.notify(Replanned(changed=(event.process,)))


def _take_over(before: dict[str, Tracked], name: str, event: NewPlan) -> Tracked:
    process = event.plan.process(name)
    tracked = before.get(name)
    rests: StateName = "expected" if process.kind == "external" else "stopped"
    if tracked is None:
        return Tracked(process, rests)
    if name in event.described and tracked.alive and process.params_file:
        file = str(PurePath(event.file).parent / process.params_file)
        return replace(tracked, process=process, description=file)
    if name not in event.changed:
        return replace(tracked, process=process)
    if tracked.alive and rests == "stopped":
        return replace(tracked, process=process, leaving="again", wanted=True)
    return Tracked(process, rests, order=tracked.order)


# Requests to stop everything.


def stop_if_requested(step: Transition, event: Event) -> None:
    """Begin to stop everything if the event requests it."""
    match event:
        case DownRequest():
            step.stop(StopReason("signal", 0, 1, step.now), "tfcompose down")
        case Signalled(number):
            _note_signal(step, signal_name(number))
        case OutputLost():
            step.stop(StopReason("failure", UNREAD), "the reader of the output closed it")
        case TimeUp():
            _time_up(step)
        case _:
            pass


def _note_signal(step: Transition, name: str) -> None:
    stop = step.state.stop
    if stop is None:
        step.stop(StopReason("signal", 0, 1, step.now), name)
    elif stop.signals == 0 or step.now - stop.signalled >= step.state.times.same_signal_s:
        step.update(stop=replace(stop, signals=stop.signals + 1, signalled=step.now))


def _time_up(step: Transition) -> None:
    state = step.state
    if state.stop:
        return
    complete = state.complete or state.guard is None
    if not complete and "TF811" not in state.reported:
        for owner, edges in by_owner(state.awaited):
            step.report(never_published_finding(state.tracked[owner], edges))
    failed = not complete or bool(step.state.reported or state.given_up)
    step.stop(StopReason("time", 1 if failed else 0), "the time is up")


def edge_taken(step: Transition, finding: Finding) -> None:
    """Stop everything, because another node already publishes an edge of the plan.

    Each such edge is reported.
    """
    stop = step.state.stop
    if stop is None or stop.cause == "taken":
        step.report(finding)
        step.stop(StopReason("taken", 1), finding.label)


# Which signal is due.


def stop_signals(process: PlanProcess) -> tuple[Signals, ...]:
    """Return the process's stop signals in order: its own, SIGTERM, SIGKILL.

    The request to unload a component is one step, too.
    """
    if process.component:
        return (Signals[process.stop.signal],)
    return tuple(dict.fromkeys((Signals[process.stop.signal], SIGTERM, SIGKILL)))[
        : 1 + 2 * (process.stop.signal != "SIGKILL")
    ]


def send_due_signals(step: Transition) -> None:
    """Signal ending processes in reverse order of start, escalating if needed."""
    alive = [tracked for tracked in step.state.tracked.values() if tracked.alive]
    for name in [
        tracked.process.name for tracked in sorted(alive, key=lambda tracked: -tracked.order)
    ]:
        tracked = step.state.tracked.get(name)
        if tracked is None or not tracked.alive:  # it went with its container
            continue
        level = _due_level(step.state, tracked, step.now)
        if tracked.process.component:
            _end_component(step, tracked, level, tracked.process.component.container)
            continue
        if tracked.state == "starting" or level <= tracked.level:
            continue
        signals = stop_signals(tracked.process)
        if tracked.level == 0 and tracked.leaving:
            lose_edges(step, tracked)
            lose_components(step, name)
        step.actions.append(Kill(name, signals[level - 1]))
        before = (
            f"still running after {signals[tracked.level - 1].name}: " if tracked.level else ""
        )
        step.enter(
            name, "stopping", before + signals[level - 1].name, pid=tracked.pid, level=level
        )


def _end_component(step: Transition, tracked: Tracked, level: int, container: str) -> None:
    """Unload a component when it is due; if everything stops, it ends with its container."""
    name, state = tracked.process.name, step.state
    if level and state.stop and state.tracked[container].state != "expected":
        step.enter(name, "stopped", f"with {container}")
    if level <= tracked.level or not step.state.tracked[name].alive:
        return
    lose_edges(step, tracked)
    step.actions.append(Order(ComponentOrder(name, tracked.order, "unload")))
    step.enter(name, "stopping", "unloaded", pid=tracked.pid, level=1)


def firmer_at(times: Times, tracked: Tracked) -> float | None:
    """Return when the next signal is due, by the plan's time limit, or else the launcher's."""
    if tracked.state != "stopping" or not 0 < tracked.level < len(stop_signals(tracked.process)):
        return None
    rule, kills = tracked.process.stop, tracked.level + 1 == len(stop_signals(tracked.process))
    own = rule.kill_timeout_s if kills and rule.kill_timeout_s is not None else rule.timeout_s
    default = times.interrupt_s if tracked.level == 1 else times.terminate_s
    return tracked.since + (default if own is None else own)


def _due_level(state: State, tracked: Tracked, now: float) -> int:
    """Return how many of its ``stop_signals`` the process should have received by now.

    The first is due when nothing that waits for the process still runs, or when only this process
    is to end. Each further one is due some time after the previous one. A second signal to the
    launcher makes the second due at once for all processes, a third the third.
    """
    due = firmer_at(state.times, tracked)
    level = tracked.level + 1 if due is not None and now >= due else tracked.level
    if level == 0 and (tracked.leaving or (state.stop and not _is_needed(state, tracked))):
        level = 1
    if state.stop and state.stop.signals > 1:
        level = max(level, state.stop.signals)
    return min(level, len(stop_signals(tracked.process)))


def _is_needed(state: State, tracked: Tracked) -> bool:
    others = [other for other in state.tracked.values() if other.alive and other is not tracked]
    if tracked.process.name == state.guard:
        return bool(others)
    return any(
        tracked.process.name in other.process.after and other.process.name != state.guard
        for other in others
    )
