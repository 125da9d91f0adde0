"""Runs a plan: one loop that turns pipes, signals and time into the machine's events, and does what it decides.

The launcher has one thread. Its children lead sessions of their own, so that a Ctrl-C in the terminal reaches the
launcher alone. A process whose output comes faster than it can be told waits in its own pipe; nothing piles up here.
"""

from __future__ import annotations

import contextlib
import math
import os
import selectors
import time
from collections import deque
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from tfcompose.findings import Note
from tfcompose.ipc import Ended, FindingShown
from tfcompose.ros.environment import child_environment
from tfcompose.run.launcher.action import Finish, Kill, Order, Start, Tell, TellLate
from tfcompose.run.launcher.answers import answer
from tfcompose.run.launcher.child import subreaper
from tfcompose.run.launcher.children import Children
from tfcompose.run.launcher.guard_pipes import GuardPipes
from tfcompose.run.launcher.happening import Begin, OutputLost, Signalled, StartFailed, Tick, TimeUp
from tfcompose.run.launcher.machine import step
from tfcompose.run.launcher.preflight import commands_of
from tfcompose.run.launcher.session import Session
from tfcompose.run.launcher.signals import Signals
from tfcompose.run.launcher.state import initial
from tfcompose.run.launcher.teller import Teller
from tfcompose.run.launcher.timing import wake_time

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from tfcompose.findings import Finding
    from tfcompose.ipc import Notice, Request
    from tfcompose.plan import Plan
    from tfcompose.run.launcher.action import Action
    from tfcompose.run.launcher.answers import Answer, Outcome
    from tfcompose.run.launcher.command import Command
    from tfcompose.run.launcher.happening import Event
    from tfcompose.run.launcher.preflight import Environment
    from tfcompose.run.launcher.state import State, Times

#: The loop looks at its children at least this often, whatever signals say; seconds.
LONGEST_SLEEP_S = 1.0

#: Processes that can be held before they join ROS.
_PREPARED = ("static", "joints", "simulate")


def supervise(  # noqa: PLR0913 (all but two are named, and most have what a user wants as default)
    plan: Plan,
    plan_file: Path,
    *,
    report: Callable[[Notice], None],
    duration_s: float | None = None,
    base_env: Mapping[str, str] | None = None,
    environment: Environment = child_environment,
    times: Times | None = None,
    session: Session | None = None,
) -> int:
    """Run the plan until it ends, and return the exit code: 0 after a clean end, 1 after a failure or a finding.

    SIGINT, SIGTERM and SIGHUP end it. ``report`` is given everything that a person should know, in order; an OSError
    from it means that nobody reads it any more, and ends the plan. ``duration_s`` is how long to run after
    the look before the start, in seconds. ``session`` is what the run has on this machine besides its processes. Must
    be called in the main thread.
    """
    state = initial(plan, times)
    processes = [one.process for one in state.tracked.values() if one.state != "EXPECTED"]
    base = os.environ if base_env is None else base_env
    built_in = session.base if session else None
    commands, found = commands_of(plan, processes, plan_file, base, environment, built_in)
    if found:
        for one in found:
            report(FindingShown(one))
        report(Ended(1))
        return 1
    with contextlib.ExitStack() as stack:
        ask = partial(answer, base=base, environment=environment)
        supervisor = _Supervisor(state, commands, report, session or Session(plan_file), ask, stack)
        return supervisor.run(duration_s)


class _Supervisor:
    def __init__(  # noqa: PLR0913, PLR0917 (made in one place)
        self,
        state: State,
        commands: dict[str, Command],
        report: Callable[[Notice], None],
        session: Session,
        ask: Callable[..., Outcome],
        stack: contextlib.ExitStack,
    ) -> None:
        self._state = state
        self._commands = commands
        self._events: deque[Event] = deque()
        self._exit_code: int | None = None
        self._due: float | None = None
        self._look_at = 0.0
        selector = stack.enter_context(selectors.DefaultSelector())
        self._selector = selector
        self._signals = stack.enter_context(Signals())
        selector.register(self._signals.fd, selectors.EVENT_READ, self._signals.woken)
        self._session = session
        self._ask = ask
        self._teller = Teller(selector, session, report, lambda: self._events.append(OutputLost()))
        self._teller.listen(session, self._answer)
        self._tell = self._teller.tell
        stack.callback(self._teller.close)
        if session.run_id:
            stack.enter_context(subreaper())
        self._children = Children(selector, session.run_id, self._handle, self._tell)
        stack.callback(self._children.close)

    def run(self, duration_s: float | None) -> int:
        self._handle(Begin())
        self._prepare()
        while self._exit_code is None:
            end = self._end(duration_s)
            self._teller.keep_up()
            for key, _ in self._selector.select(self._sleep_s(end)):
                key.data()
            for number in self._signals.taken():
                self._handle(Signalled(number))
            look = time.monotonic() >= self._look_at
            if self._signals.children_changed() or look:
                self._children.bury()
            if look:
                self._children.look_around()
                self._look_at = time.monotonic() + LONGEST_SLEEP_S
            if end is not None and time.monotonic() >= end:
                self._handle(TimeUp())
            elif self._events or (self._due or math.inf) <= time.monotonic():
                self._handle(Tick())
        return self._exit_code

    def _prepare(self) -> None:
        """While the guard looks whether an edge is taken, have as many publishers load Python as there are cores."""
        if self._state.clear is not None or self._state.stop:
            return
        own = [one.process for one in self._state.tracked.values() if one.process.kind in _PREPARED]
        for process in [process for process in own if not process.after][: os.cpu_count() or 1]:
            self._children.prepare(process, self._commands[process.name])

    def _answer(self, request: Request) -> Answer:
        said, event, planned = self._ask(request, self._state, self._session.plan_file)
        if planned:
            self._children.dismiss()
            self._session.plan_file, self._commands = planned
        if event:
            self._handle(event)
        return said

    def _end(self, duration_s: float | None) -> float | None:
        """Return when the time is up: it counts from the end of the look before the start."""
        state = self._state
        if duration_s is None or state.clear is None or state.stop:
            return None
        return state.clear + duration_s

    def _sleep_s(self, end: float | None) -> float:
        due = [at for at in (self._due, end) if at is not None]
        return min(LONGEST_SLEEP_S, max(0.0, min(due, default=float("inf")) - time.monotonic()))

    def _handle(self, event: Event) -> None:
        self._events.append(event)
        while self._events:
            self._state, actions = step(self._state, self._events.popleft(), time.monotonic())
            for action in actions:
                self._do(action)
        if self._state.stop:
            self._children.dismiss()
        self._due = wake_time(self._state)

    def _do(self, action: Action) -> None:
        match action:
            case Start(name):
                self._start(name)
            case Kill(name, number):
                self._children.kill(name, number)
            case Tell(notice):
                self._tell(notice)
            case Order(order):
                self._children.order(order)
            case TellLate(name, found):
                self._tell_late(name, found)
            case Finish(exit_code):
                self._exit_code = exit_code
            case _:
                pass

    def _start(self, name: str) -> None:
        state = self._state
        guard = None
        try:
            if name == state.guard:
                guard = GuardPipes(joins=state.clear is not None, memory=state.memory)
        except OSError as error:
            self._events.append(StartFailed(name, str(error)))
            return
        self._events.append(self._children.start(state.tracked[name].process, self._commands[name], guard))

    def _tell_late(self, name: str, found: Finding) -> None:
        notes = [Note(f"{name}: {line}") for line in self._children.last_lines(name)]
        self._tell(FindingShown(replace(found, notes=(*found.notes, *notes))))
