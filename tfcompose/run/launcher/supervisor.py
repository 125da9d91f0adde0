"""Runs a plan: one loop that turns pipes, signals and time into the machine's events, and does what it decides.

The launcher has one thread. Its children lead sessions of their own, so that a Ctrl-C in the terminal reaches the
launcher alone. A process whose output comes faster than it can be told waits in its own pipe; nothing piles up here.
"""

from __future__ import annotations

import contextlib
import math
import os
import re
import selectors
import signal
import subprocess
import time
from collections import deque
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from tfcompose.diagnostic import Note
from tfcompose.ros.environment import child_environment
from tfcompose.run.events import from_line
from tfcompose.run.launcher.answers import answer
from tfcompose.run.launcher.child import (
    LAST_LINE_LENGTH,
    Child,
    Pipe,
    bury_adopted,
    has_ended,
    kill_group,
    spawn,
    subreaper,
)
from tfcompose.run.launcher.guard_pipes import GuardPipes
from tfcompose.run.launcher.keeper import Keeper
from tfcompose.run.launcher.leftovers import end as end_leftovers
from tfcompose.run.launcher.leftovers import leftovers
from tfcompose.run.launcher.machine import step
from tfcompose.run.launcher.notice import Ended, FindingShown, LogLine
from tfcompose.run.launcher.preflight import commands_of
from tfcompose.run.launcher.session import Session
from tfcompose.run.launcher.signals import Signals
from tfcompose.run.launcher.state import (
    Begin,
    Exited,
    Finish,
    Kill,
    LogSeen,
    Order,
    OutputLost,
    Signalled,
    Start,
    Started,
    StartFailed,
    Tell,
    TellLate,
    Tick,
    TimeUp,
    initial,
)
from tfcompose.run.launcher.teller import Teller
from tfcompose.run.launcher.timing import wake_time
from tfcompose.run.place import RUN_ID

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from tfcompose.plan import Plan
    from tfcompose.run.launcher.notice import Notice, Stream
    from tfcompose.run.launcher.preflight import Command, Environment
    from tfcompose.run.launcher.state import Action, Event, State, Times

#: The loop looks at its children at least this often, whatever signals say; seconds.
LONGEST_SLEEP_S = 1.0
#: So much of a line is compared with what a gate waits for, in characters.
LONGEST_MATCHED = 4000
#: The guard's lines hold findings with notes, so they may be longer than a log's; bytes.
EVENT_LIMIT = 1024 * 1024

#: The answer, what it means for the machine, and another plan's file and commands.
Answer = tuple[dict[str, Any], "Event | None", "tuple[Path, dict[str, Command]] | None"]


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
        ask: Callable[..., Answer],
        stack: contextlib.ExitStack,
    ) -> None:
        self._state = state
        self._commands = commands
        self._children: dict[str, Child] = {}
        self._events: deque[Event] = deque()
        self._exit_code: int | None = None
        self._due: float | None = None
        self._look_at = 0.0
        self._selector = stack.enter_context(selectors.DefaultSelector())
        self._signals = stack.enter_context(Signals())
        self._selector.register(self._signals.fd, selectors.EVENT_READ, self._signals.woken)
        self._session = session
        self._ask = ask
        self._guard_pipes: GuardPipes | None = None
        self._teller = Teller(self._selector, session, report, lambda: self._events.append(OutputLost()))
        self._teller.listen(session, self._answer)
        self._tell = self._teller.tell
        stack.callback(self._teller.close)
        if session.run_id:
            stack.enter_context(subreaper())
        self._keeper = Keeper(session.run_id)
        stack.callback(self._keeper.close)
        stack.callback(self._abandon)

    def run(self, duration_s: float | None) -> int:
        self._handle(Begin())
        while self._exit_code is None:
            end = self._end(duration_s)
            self._teller.keep_up()
            for key, _ in self._selector.select(self._sleep_s(end)):
                key.data()
            for number in self._signals.taken():
                self._handle(Signalled(number))
            if self._signals.children_changed() or time.monotonic() >= self._look_at:
                self._look_at = time.monotonic() + LONGEST_SLEEP_S
                for child in [child for child in self._children.values() if has_ended(child.popen.pid)]:
                    self._ended(child)
                if self._session.run_id:
                    bury_adopted({child.popen.pid for child in self._children.values()} | {self._keeper.pid})
            if end is not None and time.monotonic() >= end:
                self._handle(TimeUp())
            elif self._events or (self._due or math.inf) <= time.monotonic():
                self._handle(Tick())
        return self._exit_code

    def _answer(self, request: dict[str, Any]) -> dict[str, Any]:
        said, event, planned = self._ask(request, self._state, self._session.plan_file)
        if planned:
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
        self._due = wake_time(self._state)

    def _do(self, action: Action) -> None:
        match action:
            case Start(name):
                self._start(name)
            case Kill(name, number) if name in self._children:
                kill_group(self._children[name].popen.pid, number)
            case Tell(notice):
                self._tell(notice)
            case Order(order) if self._guard_pipes:
                self._guard_pipes.order(order)
            case TellLate(name, found) if name in self._children:
                notes = [Note(f"{name}: {line}") for line in self._children[name].last_lines]
                self._tell(FindingShown(replace(found, notes=(*found.notes, *notes))))
            case TellLate(_, found):
                self._tell(FindingShown(found))
            case Finish(exit_code):
                self._exit_code = exit_code
            case _:
                pass

    # A process's life.

    def _start(self, name: str) -> None:
        try:
            if name == self._state.guard:
                self._spawn_guard(name)
            else:
                self._spawn(name, self._commands[name])
        except (OSError, subprocess.SubprocessError, ValueError) as error:
            self._events.append(StartFailed(name, _reason(error)))

    def _spawn_guard(self, name: str) -> None:
        pipes = GuardPipes(joins=self._state.clear is not None, memory=self._state.memory)
        command = self._commands[name]
        try:
            child = self._spawn(name, replace(command, env=command.env | pipes.env), pipes.theirs)
        except BaseException:
            pipes.events.close()
            pipes.close()
            raise
        finally:
            pipes.handed_over()
        self._guard_pipes = pipes
        self._watch(child, Pipe(pipes.events, self._guard_said, EVENT_LIMIT))

    def _close_guard_pipes(self) -> None:
        if self._guard_pipes:
            self._guard_pipes.close()
            self._guard_pipes = None

    def _spawn(self, name: str, command: Command, pass_fds: tuple[int, ...] = ()) -> Child:
        run_id = self._session.run_id
        if run_id:
            command = replace(command, env=command.env | {RUN_ID: run_id})
        if command.fence:
            command.fence[0].parent.mkdir(exist_ok=True)
            command.fence[0].write_text(command.fence[1], encoding="utf-8")
        child = Child(name, spawn(command, pass_fds))
        self._children[name] = child
        self._keep()
        out, err = child.popen.stdout, child.popen.stderr
        if out and err:
            self._watch(child, Pipe(out, self._logger(child, "stdout"), bucket=child.bucket))
            self._watch(child, Pipe(err, self._logger(child, "stderr"), bucket=child.bucket))
        self._events.append(Started(name, child.popen.pid))
        return child

    def _watch(self, child: Child, pipe: Pipe) -> None:
        child.pipes.append(pipe)
        self._selector.register(pipe.file, selectors.EVENT_READ, lambda: self._read(child, pipe))

    def _read(self, child: Child, pipe: Pipe) -> None:
        if pipe.read() == 0:
            self._drain(child, pipe)

    def _drain(self, child: Child, pipe: Pipe) -> None:
        child.pipes.remove(pipe)
        self._selector.unregister(pipe.file)
        pipe.drain()

    def _logger(self, child: Child, stream: Stream) -> Callable[[str], None]:
        last = child.last_err if stream == "stderr" else child.last_out
        ready = self._state.tracked[child.name].process.ready
        gate = re.compile(ready.text) if ready and ready.kind == "log" else None

        def log(text: str) -> None:
            last.append(text[:LAST_LINE_LENGTH])
            self._tell(LogLine(child.name, stream, text))
            if gate and not self._state.tracked[child.name].ready and gate.search(text[:LONGEST_MATCHED]):
                self._handle(LogSeen(child.name, text[:LAST_LINE_LENGTH]))

        return log

    def _guard_said(self, line: str) -> None:
        try:
            event = from_line(line)
        except (ValueError, TypeError, KeyError, AttributeError):
            self._tell(LogLine(self._state.guard or "guard", "stderr", f"not an event: {line}"))
        else:
            self._handle(event)

    def _ended(self, child: Child) -> None:
        """Take what the process leaves behind: the rest of its group, its last words, and its exit code."""
        kill_group(child.popen.pid, signal.SIGKILL)
        for pipe in list(child.pipes):
            self._drain(child, pipe)
        returncode = child.popen.wait()
        del self._children[child.name]
        if child.name == self._state.guard:
            self._close_guard_pipes()
        self._keep()
        self._handle(Exited(child.name, returncode, child.last_lines))

    def _keep(self) -> None:
        self._keeper.keep(child.popen.pid for child in self._children.values())

    def _abandon(self) -> None:
        """Kill what is left: something, only if an error in the launcher itself ends it."""
        for child in self._children.values():
            kill_group(child.popen.pid, signal.SIGKILL)
            child.popen.wait()
            for pipe in child.pipes:
                pipe.file.close()
        self._children.clear()
        self._close_guard_pipes()
        self._keep()
        if self._session.run_id:
            end_leftovers(leftovers(self._session.run_id), 1.0)


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: {error.filename}" if error.filename else error.strerror
    return str(error)
