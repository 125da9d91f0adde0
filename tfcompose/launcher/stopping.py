"""Stop of the robot or of a process, and actions after a process ends.

A process first receives its own stop signal, then SIGTERM, then SIGKILL. Each signal follows if
the previous one had no effect in time. After its end, a process restarts after a delay, or stays
stopped until a request, or leaves the plan.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import PurePath
from signal import SIGKILL, SIGTERM, Signals
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import did_you_mean
from tfcompose.foundation.text import plural
from tfcompose.launcher.events import Follow, Kill, Order, OutputLost, Signalled, TimeUp
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
    """Return the delay in seconds before a restart after ``failures`` consecutive failures."""
    if process.restart_delay is not None:
        return process.restart_delay
    return min(times.backoff_s * 2.0 ** (failures - 1), times.backoff_limit_s)


# End of a process.


def take_process_exit(step: Transition, event: Exited) -> None:
    """Handle the end of a process: an expected end, a restart, or a failure.

    The components of a container end with it.
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
    # Processes that wait for this process may start, even though it has ended.
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

    This is so if its end makes it ready, or if another process waits until it is done.
    """
    ends = process.ready is not None and process.ready.kind == "exit"
    return ends or any(
        tracked.process.after.get(process.name) == "done" for tracked in state.tracked.values()
    )


def _take_guard_exit(step: Transition, tracked: Tracked, event: Exited) -> None:
    """Restart a guard that died.

    Its reports stay valid, and the next guard receives its state.
    """
    if not step.state.memory:
        lose_edges(step, tracked)
    unwatched = step.now if step.state.unwatched is None else step.state.unwatched
    step.update(unwatched=unwatched)
    _restart_after(step, step.state.tracked[event.name], event)
    if step.state.stop is None:
        step.report(guard_lost(event.name, event, strict=step.state.plan.guard.mode == "strict"))


def lose_edges(step: Transition, tracked: Tracked) -> None:
    """Mark the edges of a process as not live, because it has ended or is about to end."""
    state, name = step.state, tracked.process.name
    step.track(name, replace(tracked, ready=False, ready_since=None, observed="", late=False))
    if name == state.guard:
        # The state of a strict guard holds latched messages, which a guard restarted by request
        # needs, too.
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

    A component that should run is loaded again when the container is ready again.
    """
    for tracked in step.state.components_of(container):
        if tracked.alive or tracked.state == "backoff":
            lose_edges(step, tracked)
            if (
                not tracked.process.owns and step.state.guard is not None
            ):  # cancels orders for that container
                step.actions.append(Order(Absent(tracked.process.name)))
            tracked = step.state.tracked[tracked.process.name]  # noqa: PLW2901 (the same, without its edges)
            process_left(
                step,
                replace(
                    tracked, leaving=tracked.leaving or ("again" if tracked.should_run else "stop")
                ),
                f"with {container}",
            )


def process_left(step: Transition, tracked: Tracked, how: str) -> None:
    """Handle the expected end of a process: it stays stopped, starts again, or is dropped."""
    name = tracked.process.name
    step.track(name, tracked)
    step.enter(name, "stopped", how, level=0, failures=0)
    if tracked.leaving == "drop":
        step.update(
            tracked={
                tracked_name: each
                for tracked_name, each in step.state.tracked.items()
                if tracked_name != name
            }
        )
    else:
        step.track(
            name,
            replace(step.state.tracked[name], leaving="", should_run=tracked.leaving == "again"),
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
    """Schedule a restart after a delay, or let the process fail after too many restarts.

    ``failure`` returns the finding for the latter case.
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


# Requests about a process.


def refusal(state: State, name: str, verb: Verb) -> str | None:
    """Return a sentence why the process cannot do what ``verb`` requests, None if it can."""
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
        and not (tracked.state == "stopped" and tracked.should_run)
    ):
        return f"{name} is not running"
    return None


def take_process_request(step: Transition, request: ProcessRequest) -> None:
    """Stop, start or restart a process on request."""
    if refusal(step.state, request.name, request.do):
        return
    tracked = step.state.tracked[request.name]
    stays = request.do == "stop"
    if tracked.alive:
        step.track(
            request.name,
            replace(tracked, leaving="stop" if stays else "again", should_run=not stays),
        )
        return
    if tracked.state != "stopped":
        step.enter(request.name, "stopped", failures=0)
    step.track(request.name, replace(step.state.tracked[request.name], should_run=not stays))


# Another plan.


def follow_plan(step: Transition, event: NewPlan) -> None:
    """Switch to another plan: stop removed processes, start new ones, restart changed ones."""
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
    )
    if event.changed or step.state.tracked.keys() != before.keys():
        step.update(all_started=False, all_ready=False, reminded=step.now, replanned=step.now)
    if state.guard is not None and not before[state.guard].alive:
        step.update(memory={}, live=frozenset())  # the next guard begins with an empty state
    gone = {name: tracked for name, tracked in before.items() if name not in step.state.tracked}
    for name, tracked in gone.items():
        if tracked.alive:
            step.track(name, replace(tracked, leaving="drop", should_run=False))
    guard, names = step.state.guard, tuple(step.state.tracked)
    if guard is not None and guard not in event.changed and step.state.tracked[guard].alive:
        step.actions.append(Order(Reread(event.file)))
    order_descriptions(step)
    # After the guard, which compares what they send with the new plan.
    followers = [name for name in names if name in event.followers and before[name].alive]
    step.actions += [Follow(name, event.file) for name in followers]
    started = {process.name for process in (*state.plan.managed, *plan.managed)}
    changed = tuple(name for name in names if name in event.changed & started and name in before)
    added = tuple(name for name in names if name not in before)
    described = tuple(name for name in names if name in event.described & started)
    step.notify(
        Replanned(
            changed,
            added,
            tuple(gone),
            held=event.held,
            described=described,
            moved=event.moved,
        )
    )


def order_descriptions(step: Transition) -> None:
    """Order the guard to pass new descriptions to running processes that do not have them."""
    for name, tracked in step.state.tracked.items():
        if tracked.description:
            node = tracked.process.nodes[0]
            step.actions.append(Order(DescriptionOrder(name, node, tracked.description)))


def take_description_answer(step: Transition, event: DescriptionState) -> None:
    """Restart a process that did not accept its new description."""
    tracked = step.state.tracked[event.process]
    if not tracked.description:
        return
    step.track(event.process, replace(tracked, description=""))
    if event.why and tracked.alive:
        step.track(
            event.process, replace(tracked, description="", leaving="again", should_run=True)
        )
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
        return replace(tracked, process=process, leaving="again", should_run=True)
    return Tracked(process, rests, order=tracked.order)


# Requests to stop everything.


def stop_if_requested(step: Transition, event: Event) -> None:
    """Begin to stop all processes if the event requests it."""
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
    """Stop all processes, because another node already publishes an edge of the plan.

    Each such edge is reported.
    """
    stop = step.state.stop
    if stop is None or stop.cause == "taken":
        step.report(finding)
        step.stop(StopReason("taken", 1), finding.label)


# Signals that are due.


def stop_signals(process: PlanProcess) -> tuple[Signals, ...]:
    """Return the process's stop signals in order: its own signal, SIGTERM, SIGKILL.

    For a component, the request to unload counts as a signal.
    """
    if process.component:
        return (Signals[process.stop.signal],)
    return tuple(dict.fromkeys((Signals[process.stop.signal], SIGTERM, SIGKILL)))[
        : 1 + 2 * (process.stop.signal != "SIGKILL")
    ]


def send_due_signals(step: Transition) -> None:
    """Signal stopping processes in reverse order of their start, and escalate if needed."""
    alive = [tracked for tracked in step.state.tracked.values() if tracked.alive]
    for name in [
        tracked.process.name for tracked in sorted(alive, key=lambda tracked: -tracked.order)
    ]:
        tracked = step.state.tracked.get(name)
        if tracked is None or not tracked.alive:  # it ended with its container
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
    """Unload a component when this is due. If all processes stop, it ends with its container."""
    name, state = tracked.process.name, step.state
    if level and state.stop and state.tracked[container].state != "expected":
        step.enter(name, "stopped", f"with {container}")
    if level <= tracked.level or not step.state.tracked[name].alive:
        return
    lose_edges(step, tracked)
    step.actions.append(Order(ComponentOrder(name, tracked.order, "unload")))
    step.enter(name, "stopping", "unloaded", pid=tracked.pid, level=1)


def escalate_at(times: Times, tracked: Tracked) -> float | None:
    """Return when the next signal is due, by the plan's time limit or the launcher's."""
    if tracked.state != "stopping" or not 0 < tracked.level < len(stop_signals(tracked.process)):
        return None
    rule, kills = tracked.process.stop, tracked.level + 1 == len(stop_signals(tracked.process))
    kill_timeout_s = (
        rule.kill_timeout_s if kills and rule.kill_timeout_s is not None else rule.timeout_s
    )
    default = times.interrupt_s if tracked.level == 1 else times.terminate_s
    return tracked.since + (default if kill_timeout_s is None else kill_timeout_s)


def _due_level(state: State, tracked: Tracked, now: float) -> int:
    """Return the number of ``stop_signals`` that the process should have received by now.

    The first signal is due when no running process waits for this process any more, or when only
    this process stops. Each further signal is due some time after the previous one. If the
    launcher receives a second signal, the second stop signal is due at once for all processes; at
    a third, the third.
    """
    due = escalate_at(state.times, tracked)
    level = tracked.level + 1 if due is not None and now >= due else tracked.level
    if level == 0 and (tracked.leaving or (state.stop and not _is_needed(state, tracked))):
        level = 1
    if state.stop and state.stop.signals > 1:
        level = max(level, state.stop.signals)
    return min(level, len(stop_signals(tracked.process)))


def _is_needed(state: State, tracked: Tracked) -> bool:
    peers = [peer for peer in state.tracked.values() if peer.alive and peer is not tracked]
    if tracked.process.name == state.guard:
        return bool(peers)
    return any(
        tracked.process.name in peer.process.after and peer.process.name != state.guard
        for peer in peers
    )
