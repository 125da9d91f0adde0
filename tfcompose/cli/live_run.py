"""``up`` on a terminal: the launcher runs in a child process, and this process shows the state.

Therefore a slow terminal never delays the robot, Ctrl-Z stops only the view, and an error in the
view ends only the view. When this process ends for any reason, the launcher ends, too.
"""

from __future__ import annotations

import contextlib
import os
import selectors
import signal
import sys
import time
from typing import TYPE_CHECKING

import msgspec

from tfcompose.cli.console import Console
from tfcompose.cli.runs import plan_of_run
from tfcompose.cli.terminal import FAILED, can_redraw, code_addresses, is_coloured, warn
from tfcompose.foundation.signal_queue import SignalQueue
from tfcompose.foundation.signals import SIGNALS
from tfcompose.foundation.text import plural
from tfcompose.launcher.control import connect
from tfcompose.launcher.output import Follower, NonBlockingOutput, runs_of
from tfcompose.launcher.usage import UsageMeter
from tfcompose.model.messages import (
    Ended,
    EventsRequest,
    FindingShown,
    RecoveredShown,
    Replanned,
    RobotStatus,
    StatusRequest,
    Stopping,
    line_of,
    read_notice,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from tfcompose.cli.dashboard import Dashboard
    from tfcompose.cli.screen import Screen
    from tfcompose.foundation.findings import Finding
    from tfcompose.launcher.runtime_dir import RuntimeDir
    from tfcompose.model.messages import Notice, Request
    from tfcompose.model.plan import Plan

#: Intervals in seconds: the longest and the shortest between two requests for the launcher's
#: state, and between measurements of the processes' usage.
STATUS_EVERY_S, STATUS_AT_MOST_EVERY_S, USAGE_EVERY_S = 1.0, 0.2, 5.0
#: Minimum time between drawings in seconds. After a key, the view draws at once.
DRAW_EVERY_S = 0.2
#: Interval between reads of the visible log, in seconds.
LOG_EVERY_S = 0.25
#: Number of bytes at the end of a log that are read first.
LOG_BYTES = 512 * 1024
#: Time in seconds after which an Esc is the Esc key, not the beginning of another key.
ESCAPE_S = 0.05
#: Maximum number of findings that are printed again when the view ends.
PRINTED_AT_MOST = 20


def can_show_live() -> bool:
    """Return whether this is an interactive terminal with this process in the foreground."""
    if not can_redraw(sys.stdout) or not sys.stdin.isatty() or os.environ.get("CI"):
        return False
    try:
        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    except OSError:
        return False


def follow(  # noqa: PLR0913, PLR0917 (the run, and what was printed before it)
    runtime_dir: RuntimeDir,
    plan: Plan,
    launcher: int,
    mask: Iterable[int],
    built_with: Sequence[Finding],
    warnings: Sequence[str],
) -> int:
    """Show the run until its launcher, a child of this process, has ended; return its exit code.

    This process forwards signals that end a program to the launcher. These signals are still
    blocked, and ``mask`` is the signal mask from before. ``built_with`` (findings of the build)
    and ``warnings`` were already printed. The view shows them again, because it covers the earlier
    output.
    """
    with SignalQueue(signal.SIGWINCH, signal.SIGTSTP, signal.SIGQUIT) as signals:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        from tfcompose.cli.dashboard import (
            Dashboard,  # importing rich is slow; meanwhile, the queue records signals
        )
        from tfcompose.cli.screen import Screen

        view = _LiveView(
            runtime_dir, Dashboard(runtime_dir.name, plan, built_with, warnings), launcher, signals
        )
        output = NonBlockingOutput(sys.stdout.fileno())
        with Screen(sys.stdin.fileno(), output) as screen:
            code = view.run(screen)
        view.print_rest(plan, output)
        output.close()
    return code


class _LauncherConnection:
    """A connection to the launcher that reads lines without blocking."""

    def __init__(self, runtime_dir: RuntimeDir) -> None:
        """Connect. Raises OSError."""
        self._socket = connect(runtime_dir)
        self._socket.setblocking(False)  # noqa: FBT003 (its only argument)
        self._rest = b""

    def fileno(self) -> int:
        return self._socket.fileno()

    def send(self, request: Request) -> None:
        """Send a request. Raises OSError."""
        self._socket.sendall(line_of(request))

    def lines(self) -> list[bytes]:
        """Return the received lines.

        Raises:
            OSError: if the launcher has closed the connection.
        """
        collected: list[bytes] = []
        while True:
            try:
                data = self._socket.recv(64 * 1024)
            except BlockingIOError:
                return collected
            if not data:
                if collected:
                    return collected
                raise ConnectionResetError
            *lines, self._rest = (self._rest + data).split(b"\n")
            collected += lines

    def close(self) -> None:
        self._socket.close()


class _LiveView:
    def __init__(
        self, runtime_dir: RuntimeDir, dashboard: Dashboard, launcher: int, signals: SignalQueue
    ) -> None:
        from tfcompose.cli.keys import KeyDecoder

        self._runtime_dir = runtime_dir
        self._dashboard = dashboard
        self._launcher = launcher
        self._signals = signals
        self._keys = KeyDecoder()
        self._meter = UsageMeter()
        self._events: _LauncherConnection | None = None
        self._states: _LauncherConnection | None = None
        self._requested = self._stale = self._owing = False
        self._follower: Follower | None = None
        self._last: list[Notice] = []
        self._left_out = 0
        self._fault = ""
        self._draw_at = 0.0
        now = time.monotonic()
        self._status_at = self._usage_at = self._log_at = self._connect_at = self._requested_at = (
            now
        )
        self._code: int | None = None

    def run(self, screen: Screen) -> int:
        with selectors.DefaultSelector() as selector:
            self._selector = selector
            self._screen = screen
            selector.register(self._signals.fd, selectors.EVENT_READ, self._signals.woken)
            selector.register(screen.fd, selectors.EVENT_READ, self._press)
            try:
                while self._code is None:
                    self._connect()
                    self._wait_for_terminal()
                    for key, _ in selector.select(self._sleep_s()):
                        key.data()
                    for number in self._signals.take():
                        self._take_signal(number)
                    self._work()
                    self._draw()
                    self._reap()
                self._take_events()
            finally:
                for connection in (self._events, self._states):
                    if connection:
                        connection.close()
        return self._code

    def print_rest(self, plan: Plan, output: NonBlockingOutput) -> None:
        """Print the findings and the end of the run on the terminal's main screen."""
        if self._fault:
            warn(f"the live view failed: {self._fault}")
        console = Console(
            plan,
            output,
            colour=is_coloured(sys.stdout),
            address_of=code_addresses(sys.stdout),
        )
        with contextlib.suppress(OSError):
            if self._left_out:
                output.write(
                    f"{plural(self._left_out, 'earlier finding')}: tfcompose logs tfcompose\n"
                )
            for notice in self._last:
                console(notice)
        if not any(isinstance(notice, Ended) for notice in self._last):
            warn(f"the launcher has ended; see {self._runtime_dir.logs / 'launcher.err'}")

    # Input.

    def _connect(self) -> None:
        if (
            self._dashboard.ended
            or time.monotonic() < self._connect_at
            or (self._events and self._states)
        ):
            return
        self._connect_at = time.monotonic() + STATUS_EVERY_S
        with contextlib.suppress(OSError):
            if self._events is None:
                self._events = _LauncherConnection(self._runtime_dir)
                self._selector.register(self._events, selectors.EVENT_READ, self._take_events)
                self._dashboard.forget()
                self._last.clear()
                self._left_out = 0
                self._events.send(EventsRequest())
            if self._states is None:
                self._states = _LauncherConnection(self._runtime_dir)
                self._requested = False
                self._selector.register(self._states, selectors.EVENT_READ, self._take_status)

    def _take_events(self) -> None:
        try:
            lines = self._events.lines() if self._events else []
        except OSError:
            self._drop(self._events)
            self._events = None
            return
        for line in lines:
            notice, time_s = read_notice(line)
            self._dashboard.take(notice, time_s)
            self._stale = True
            self._status_at = min(self._status_at, self._requested_at + STATUS_AT_MOST_EVERY_S)
            if isinstance(notice, (FindingShown, RecoveredShown, Stopping, Ended)):
                self._last.append(notice)
            if len(self._last) > PRINTED_AT_MOST:
                del self._last[0]
                self._left_out += 1
            if isinstance(notice, Replanned):
                self._dashboard.plan = plan_of_run(self._runtime_dir) or self._dashboard.plan

    def _take_status(self) -> None:
        try:
            lines = self._states.lines() if self._states else []
        except OSError:
            self._drop(self._states)
            self._states = None
            return
        for line in lines:
            self._dashboard.status = msgspec.json.decode(line, type=RobotStatus)
            self._requested, self._stale = False, True

    def _drop(self, connection: _LauncherConnection | None) -> None:
        if connection:
            self._selector.unregister(connection)
            connection.close()

    def _press(self) -> None:
        try:
            data = os.read(self._screen.fd, 1024)
        except OSError:
            data = b""
        if not data:  # the terminal is gone
            self._selector.unregister(self._screen.fd)
            self._pass_on(signal.SIGHUP)
            return
        self._take_keys(self._keys.feed(data))

    def _take_keys(self, keys: list[str]) -> None:
        for key in keys:
            if key == "redraw":
                self._screen.redraw()
            process = self._dashboard.log_of
            if self._dashboard.press(key):
                self._pass_on(signal.SIGINT)
            if self._dashboard.log_of != process:
                self._follow_log(self._dashboard.log_of)
        self._stale, self._draw_at = True, 0.0

    def _follow_log(self, name: str | None) -> None:
        """Read the process's log from the start of this run. None stops the reading."""
        folder = self._runtime_dir.logs
        since_s = max(runs_of(folder), default=0.0)
        self._follower = (
            Follower(folder, [name], back=LOG_BYTES, since_s=since_s) if name else None
        )
        self._log_at = 0.0

    def _take_signal(self, number: int) -> None:
        if number == signal.SIGTSTP:
            self._screen.suspend()
        elif number in SIGNALS or number == signal.SIGQUIT:
            self._pass_on(signal.SIGTERM if number == signal.SIGQUIT else signal.Signals(number))
        self._stale = True

    def _pass_on(self, number: signal.Signals) -> None:
        if self._code is None:
            os.kill(self._launcher, number)

    # Periodic work.

    def _sleep_s(self) -> float:
        due = [self._status_at, self._usage_at]
        due += [self._log_at] if self._follower else []
        due += [self._draw_at] if self._stale and not self._fault and not self._owing else []
        due += (
            [] if self._dashboard.ended or (self._events and self._states) else [self._connect_at]
        )
        longest = ESCAPE_S if self._keys.waits else STATUS_EVERY_S
        return min(max(min(due) - time.monotonic(), 0.0), longest)

    def _work(self) -> None:
        now = time.monotonic()
        if self._keys.waits and not self._selector.select(ESCAPE_S):
            self._take_keys(self._keys.end())
        if self._follower and now >= self._log_at:
            self._log_at = now + LOG_EVERY_S
            lines = [text for _, _, text in self._follower.more()]
            self._dashboard.add_log_lines(lines)
            self._stale |= bool(lines)
        if now >= self._usage_at:
            self._usage_at = now + USAGE_EVERY_S
            status = self._dashboard.status
            if status and self._dashboard.page == "processes":
                self._dashboard.used = self._meter.usage(
                    [process.pid for process in status.processes if process.pid]
                )
        if now >= self._status_at:
            self._status_at = now + STATUS_EVERY_S
            self._ask(now)

    def _ask(self, now: float) -> None:
        if self._states is None or self._requested:
            return
        with contextlib.suppress(OSError):
            self._states.send(StatusRequest())
            self._requested, self._requested_at = True, now

    def _draw(self) -> None:
        now = time.monotonic()
        if not self._stale or self._fault or now < self._draw_at:
            return
        self._draw_at = now + DRAW_EVERY_S
        try:
            self._stale = not self._screen.draw(self._dashboard.rows)
        except OSError:
            self._lose_terminal()
        except Exception as error:  # noqa: BLE001 (a fault of the view ends no robot)
            self._fault = f"{type(error).__name__}: {error}"
            self._screen.leave()
            warn(f"the live view failed: {self._fault}; the robot runs on, and Ctrl-C stops it")

    def _wait_for_terminal(self) -> None:
        """While output is pending, wake up when the terminal accepts more."""
        output = self._screen.output
        if output.owes == self._owing:
            return
        self._owing = output.owes
        if self._owing:
            self._selector.register(output.fd, selectors.EVENT_WRITE, self._push)
        else:
            self._selector.unregister(output.fd)

    def _push(self) -> None:
        try:
            self._screen.output.push()
        except OSError:
            self._lose_terminal()

    def _lose_terminal(self) -> None:
        self._fault = "the terminal was closed"
        self._screen.output.finish(0)
        self._pass_on(signal.SIGHUP)

    def _reap(self) -> None:
        pid, status = os.waitpid(self._launcher, os.WNOHANG)
        if pid:
            code = os.waitstatus_to_exitcode(status)
            self._code = code if code >= 0 else FAILED
