"""Runs a plan: one loop that turns pipes, signals and time into the machine's events, and does what it decides.

The launcher has one thread. Its children lead sessions of their own, so that a Ctrl-C in the terminal reaches the
launcher alone. A process whose output comes faster than it can be told waits in its own pipe; nothing piles up here.
"""

from __future__ import annotations

import contextlib
import io
import os
import selectors
import signal
import subprocess
import time
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.ros.environment import child_environment
from tfcompose.run.child import LAST_LINE_LENGTH, Child, Keeper, Pipe, has_ended, kill_group, spawn
from tfcompose.run.events import EVENTS_FD, from_line
from tfcompose.run.machine import step
from tfcompose.run.notice import Ended, FindingShown, LogLine
from tfcompose.run.preflight import commands_of
from tfcompose.run.signals import Signals
from tfcompose.run.state import (
    Begin,
    Exited,
    Finish,
    Kill,
    OutputLost,
    Signalled,
    Start,
    Started,
    StartFailed,
    Tell,
    Tick,
    TimeUp,
    initial,
)
from tfcompose.run.timing import wake_time

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from tfcompose.plan import Plan
    from tfcompose.run.notice import Notice, Stream
    from tfcompose.run.preflight import Command, Environment
    from tfcompose.run.state import Action, Event, State, Times

#: The loop looks at its children at least this often, whatever signals say; seconds.
LONGEST_SLEEP_S = 1.0
#: The guard's lines hold findings with notes, so they may be longer than a log's; bytes.
EVENT_LIMIT = 1024 * 1024


def supervise(  # noqa: PLR0913 (all but two are named, and most have what a user wants as default)
    plan: Plan,
    plan_file: Path,
    *,
    report: Callable[[Notice], None],
    duration_s: float | None = None,
    base_env: Mapping[str, str] | None = None,
    environment: Environment = child_environment,
    times: Times | None = None,
) -> int:
    """Run the plan until it ends, and return the exit code: 0 after a clean end, 1 after a failure or a finding.

    SIGINT, SIGTERM and SIGHUP end it. ``report`` is given everything that a person should know, in order; an OSError
    from it means that nobody reads it any more, and ends the plan. ``duration_s`` is how long to run after
    the look before the start, in seconds. Must be called in the main thread.
    """
    state = initial(plan, times)
    processes = [one.process for one in state.tracked.values() if one.state != "EXPECTED"]
    base = os.environ if base_env is None else base_env
    commands, found = commands_of(plan, processes, plan_file, base, environment)
    if found:
        for one in found:
            report(FindingShown(one))
        report(Ended(1))
        return 1
    with contextlib.ExitStack() as stack:
        supervisor = _Supervisor(state, commands, report, stack)
        return supervisor.run(duration_s)


class _Supervisor:
    def __init__(
        self, state: State, commands: dict[str, Command], report: Callable[[Notice], None], stack: contextlib.ExitStack
    ) -> None:
        self._state = state
        self._commands = commands
        self._report: Callable[[Notice], None] | None = report
        self._children: dict[str, Child] = {}
        self._events: deque[Event] = deque()
        self._exit_code: int | None = None
        self._selector = stack.enter_context(selectors.DefaultSelector())
        self._signals = stack.enter_context(Signals())
        self._selector.register(self._signals.fd, selectors.EVENT_READ, self._signals.woken)
        self._keeper = Keeper()
        stack.callback(self._keeper.close)
        stack.callback(self._abandon)

    def run(self, duration_s: float | None) -> int:
        self._handle(Begin())
        while self._exit_code is None:
            end = self._end(duration_s)
            for key, _ in self._selector.select(self._sleep_s(end)):
                key.data()
            for number in self._signals.taken():
                self._handle(Signalled(number))
            for child in [child for child in self._children.values() if has_ended(child.popen.pid)]:
                self._ended(child)
            if end is not None and time.monotonic() >= end:
                self._handle(TimeUp())
            self._handle(Tick())
        return self._exit_code

    def _end(self, duration_s: float | None) -> float | None:
        """Return when the time is up: it counts from the end of the look before the start."""
        state = self._state
        if duration_s is None or state.clear is None or state.stop:
            return None
        return state.clear + duration_s

    def _sleep_s(self, end: float | None) -> float:
        due = [at for at in (wake_time(self._state), end) if at is not None]
        return min(LONGEST_SLEEP_S, max(0.0, min(due, default=float("inf")) - time.monotonic()))

    def _handle(self, event: Event) -> None:
        self._events.append(event)
        while self._events:
            self._state, actions = step(self._state, self._events.popleft(), time.monotonic())
            for action in actions:
                self._do(action)

    def _do(self, action: Action) -> None:
        match action:
            case Start(name):
                self._start(name)
            case Kill(name, number) if name in self._children:
                kill_group(self._children[name].popen.pid, number)
            case Tell(notice):
                self._tell(notice)
            case Finish(exit_code):
                self._exit_code = exit_code
            case _:
                pass

    def _tell(self, notice: Notice) -> None:
        if self._report is None:
            return
        try:
            self._report(notice)
        except OSError:
            self._report = None
            self._events.append(OutputLost())

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
        read_fd, write_fd = os.pipe()
        events = io.FileIO(read_fd)
        command = self._commands[name]
        try:
            child = self._spawn(name, replace(command, env=command.env | {EVENTS_FD: str(write_fd)}), (write_fd,))
        except BaseException:
            events.close()
            raise
        finally:
            os.close(write_fd)
        self._watch(child, Pipe(events, self._guard_said, EVENT_LIMIT))

    def _spawn(self, name: str, command: Command, pass_fds: tuple[int, ...] = ()) -> Child:
        child = Child(name, spawn(command, pass_fds))
        self._children[name] = child
        self._keep()
        out, err = child.popen.stdout, child.popen.stderr
        if out and err:
            self._watch(child, Pipe(out, self._logger(child, "stdout")))
            self._watch(child, Pipe(err, self._logger(child, "stderr")))
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

        def log(text: str) -> None:
            last.append(text[:LAST_LINE_LENGTH])
            self._tell(LogLine(child.name, stream, text))

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
        self._keep()


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: {error.filename}" if error.filename else error.strerror
    return str(error)
