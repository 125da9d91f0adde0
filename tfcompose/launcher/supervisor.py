"""Runs a plan: a loop turns pipes, signals and time into events, and carries out actions.

The launcher has a single thread. Its children lead their own sessions, so Ctrl-C in the terminal
reaches only the launcher. If a process writes faster than the launcher passes its output on, the
process blocks on its pipe. The launcher does not buffer the output.
"""

from __future__ import annotations

import contextlib
import math
import os
import selectors
import time
from collections import deque
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.findings import Note
from tfcompose.foundation.signal_queue import SignalQueue
from tfcompose.launcher.answers import CommandInputs
from tfcompose.launcher.answers import answer as answer_to
from tfcompose.launcher.child import subreaper
from tfcompose.launcher.children import Children, GuardPipes
from tfcompose.launcher.components import writer_of
from tfcompose.launcher.events import (
    Begin,
    Finish,
    Follow,
    Kill,
    Notify,
    NotifyLate,
    Order,
    OutputLost,
    Signalled,
    Start,
    StartFailed,
    Tick,
    TimeUp,
)
from tfcompose.launcher.machine import step, wake_time
from tfcompose.launcher.output import Notifier
from tfcompose.launcher.preflight import commands_of
from tfcompose.launcher.state import initial
from tfcompose.model.messages import (
    ComponentOrder,
    ComponentState,
    Ended,
    FilesRestored,
    FindingShown,
    Reread,
    UpdateRequest,
)
from tfcompose.model.plan.components import load_file
from tfcompose.tf.ros.environment import child_environment

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.foundation.findings import Finding
    from tfcompose.launcher.answers import Answer
    from tfcompose.launcher.child import ChildCommand
    from tfcompose.launcher.events import Action, Event
    from tfcompose.launcher.forking import Forker
    from tfcompose.launcher.output import EventStream, NonBlockingOutput
    from tfcompose.launcher.preflight import Environment
    from tfcompose.launcher.run_files import RunFiles
    from tfcompose.launcher.state import State, Times
    from tfcompose.model.messages import Notice, Request
    from tfcompose.model.plan import Plan

#: Maximum interval between checks of the children, in seconds, even without signals.
LONGEST_SLEEP_S = 1.0
#: Interval between checks of the run's files, in seconds.
FILES_CHECK_S = 0.5

#: Kinds of processes that can join ROS early and wait before they publish.
_PREPARED = ("static", "joints", "simulate")


@dataclass(slots=True)
class RunSession:
    """Resources of a run on this machine, other than its processes."""

    plan_file: Path
    #: The run's lock, socket and plan. With these, the run also ends processes that left their
    #: process groups.
    files: RunFiles | None = None
    #: The folder in which the plan was built, if ``plan_file`` is a copy.
    base: Path | None = None
    output: NonBlockingOutput | None = None
    #: Called regularly, to update the screen.
    refresh: Callable[[], None] | None = None
    #: Receives each notice. The run ends when the reader of the stream has gone.
    events: EventStream | None = None
    #: Forks tfcompose's processes; it has imported their modules.
    forker: Forker | None = None

    @property
    def run_id(self) -> str:
        """The id of the run; empty without files."""
        return self.files.run_id if self.files else ""


@dataclass(frozen=True, slots=True)
class _Environments:
    """The launcher's environment, and a function that returns a process's environment."""

    base: Mapping[str, str]
    environment: Environment


def supervise(  # noqa: PLR0913 (all but two are named, and most have what a user wants as default)
    plan: Plan,
    plan_file: Path,
    *,
    report: Callable[[Notice], None],
    duration_s: float | None = None,
    base_env: Mapping[str, str] | None = None,
    environment: Environment = child_environment,
    times: Times | None = None,
    session: RunSession | None = None,
) -> int:
    """Run the plan until it ends, and return the exit code.

    The exit code is 0 after a clean end, 1 after a failure or a finding. SIGINT, SIGTERM and
    SIGHUP end the run. ``report`` receives every notice for the user, in order. If ``report``
    raises OSError, the reader has gone and the run ends. ``duration_s`` is the time to run in
    seconds, counted from the end of the observation before the start. ``session`` has the run's
    resources on this machine other than its processes. Call this function in the main thread.
    """
    state = initial(plan, times)
    processes = [
        tracked.process for tracked in state.tracked.values() if tracked.state != "expected"
    ]
    base = os.environ if base_env is None else base_env
    build_folder = session.base if session else None
    commands, findings = commands_of(plan, processes, plan_file, base, environment, build_folder)
    if findings:
        for finding in findings:
            report(FindingShown(finding))
        report(Ended(1))
        return 1
    with contextlib.ExitStack() as stack:
        environments = _Environments(base, environment)
        supervisor = _Supervisor(
            state, commands, report, session or RunSession(plan_file), environments, stack
        )
        return supervisor.run(duration_s)


class _Supervisor:
    def __init__(  # noqa: PLR0913, PLR0917 (made in one place)
        self,
        state: State,
        commands: dict[str, ChildCommand],
        report: Callable[[Notice], None],
        session: RunSession,
        environments: _Environments,
        stack: contextlib.ExitStack,
    ) -> None:
        self._state = state
        self._commands = commands
        self._events: deque[Event] = deque()
        self._exit_code: int | None = None
        self._due: float | None = None
        self._check_at = 0.0
        self._files_at = 0.0
        self._loads: dict[str, tuple[Path, str]] = {}
        selector = stack.enter_context(selectors.DefaultSelector())
        self._selector = selector
        self._signals = stack.enter_context(SignalQueue())
        selector.register(self._signals.fd, selectors.EVENT_READ, self._signals.woken)
        self._session = session
        self._environments = environments
        self._lost_files = ""
        lost = partial(self._events.append, OutputLost())
        self._notifier = Notifier(
            selector,
            report,
            lost,
            output=session.output,
            refresh=session.refresh,
            events=session.events,
        )
        if session.files:
            self._notifier.listen(session.files.listener, self._answer)
        self._notify = self._notifier.notify
        stack.callback(self._notifier.close)
        if session.run_id:
            stack.enter_context(subreaper())
        self._children = Children(
            selector,
            session.run_id,
            self._handle,
            self._notify,
            self._writer,
            forker=session.forker,
        )
        stack.callback(self._children.close)

    def run(self, duration_s: float | None) -> int:
        self._handle(Begin())
        self._prepare()
        CATALOGUE.load()
        while self._exit_code is None:
            end = self._end(duration_s)
            self._notifier.catch_up()
            for key, _ in self._selector.select(self._sleep_s(end)):
                key.data()
            for number in self._signals.take():
                self._handle(Signalled(number))
            is_due = time.monotonic() >= self._check_at
            if self._signals.take_children_changed() or is_due:
                self._children.reap()
            if is_due:
                self._children.find_strays()
                self._check_at = time.monotonic() + LONGEST_SLEEP_S
            if time.monotonic() >= self._files_at:
                self._restore_files()
                self._files_at = time.monotonic() + FILES_CHECK_S
            if end is not None and time.monotonic() >= end:
                self._handle(TimeUp())
            elif self._events or (self._due or math.inf) <= time.monotonic():
                self._handle(Tick())
        return self._exit_code

    def _prepare(self) -> None:
        """Let publishers join ROS while the guard observes the tree.

        If each publisher has to import ROS first, prepare at most one per CPU core.
        """
        if self._state.clear is not None or self._state.stop:
            return
        built_in = [
            tracked.process
            for tracked in self._state.tracked.values()
            if tracked.process.kind in _PREPARED
        ]
        at_once = None if self._session.forker else os.cpu_count()
        for process in [process for process in built_in if not process.after][:at_once]:
            self._children.prepare(process, self._commands[process.name])

    def _answer(self, request: Request) -> Answer:
        session, environments = self._session, self._environments
        inputs = CommandInputs(
            session.plan_file, session.base, environments.base, environments.environment
        )
        answer, event, planned = answer_to(request, self._state, inputs)
        if planned:
            self._children.dismiss()
            self._session.plan_file, self._commands = planned
            if self._session.files:
                self._session.files.keep(self._session.plan_file)
            if isinstance(request, UpdateRequest):
                self._session.base = Path(request.base)
        if event:
            self._handle(event)
        return answer

    def _end(self, duration_s: float | None) -> float | None:
        """Return when the time is up, counted from the end of the observation before the start."""
        state = self._state
        if duration_s is None or state.clear is None or state.stop:
            return None
        return state.clear + duration_s

    def _sleep_s(self, end: float | None) -> float:
        due = [time_s for time_s in (self._due, end) if time_s is not None]
        due += [self._files_at] if self._session.files else []
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
            case Notify(notice):
                self._notify(notice)
            case Order(ComponentOrder() as order):
                self._order_component(order)
            case Order(order):
                self._children.order(order)
            case Follow(name, file):
                self._children.order_process(name, Reread(file))
            case NotifyLate(name, finding):
                self._notify_late(name, finding)
            case Finish(exit_code):
                self._exit_code = exit_code
            case _:
                pass

    def _restore_files(self) -> None:
        """Restore removed files of the run, because a starting process reads the plan."""
        session = self._session
        if session.files is None:
            return
        try:
            if not session.files.restore():
                return
        except OSError as error:
            why = str(error)
            if why != self._lost_files:
                self._notify(FilesRestored("", why))
            self._lost_files = why
            return
        self._lost_files = ""
        self._notifier.listen(session.files.listener, self._answer)
        if session.plan_file != session.files.plan_file:
            session.plan_file = session.files.plan_file
            self._commands, _ = commands_of(
                self._state.plan,
                self._state.plan.managed,
                session.plan_file,
                self._environments.base,
                self._environments.environment,
                session.base,
            )
        self._notify(FilesRestored(str(session.files.folder)))

    def _start(self, name: str) -> None:
        self._restore_files()
        state = self._state
        guard = None
        try:
            if name == state.guard:
                guard = GuardPipes(joins=state.clear is not None, memory=state.memory)
        except OSError as error:
            self._events.append(StartFailed(name, str(error)))
            return
        self._events.append(
            self._children.start(state.tracked[name].process, self._commands[name], guard)
        )

    def _order_component(self, order: ComponentOrder) -> None:
        """Write the request to the container next to the plan, and order the guard to send it."""
        name = order.process
        if order.do == "load":
            text = msgspec.json.encode(self._commands[name].load).decode()
            try:
                file = self._write_request(name, text)
            except OSError as error:
                failed = ComponentState(name, order.number, "not loaded", str(error))
                self._events.append(failed)
                return
        else:
            file, text = self._loads[name]
            if not file.is_file():
                with contextlib.suppress(OSError):  # the guard reports an unreadable file
                    file = self._write_request(name, text)
        self._children.order(msgspec.structs.replace(order, file=str(file)))

    def _write_request(self, name: str, text: str) -> Path:
        self._restore_files()
        file = load_file(self._session.plan_file.parent, name)
        self._loads[name] = file, text
        file.parent.mkdir(exist_ok=True)
        file.write_text(text, encoding="utf-8")
        return file

    def _writer(self, process: str, line: str) -> str:
        return writer_of(self._state, process, line)

    def _notify_late(self, name: str, finding: Finding) -> None:
        component = self._state.tracked[name].process.component
        writes = component.container if component else name
        notes = [Note(f"{writes}: {line}") for line in self._children.last_lines(writes)]
        self._notify(FindingShown(replace(finding, notes=(*finding.notes, *notes))))
