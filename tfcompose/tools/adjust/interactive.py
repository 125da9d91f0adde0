"""Session of ``nudge --interactive``: a terminal's keys move mounts of a running robot.

A thread sends the steps, so that a slow launcher delays neither keys nor the end. Keys that arrive
meanwhile are combined into the next request.
"""

from __future__ import annotations

import contextlib
import os
import selectors
import signal
import sys
import threading
from typing import TYPE_CHECKING

from tfcompose.cli.adjusting import adjust, running_plan
from tfcompose.cli.keys import KeyDecoder
from tfcompose.cli.live_run import ESCAPE_S
from tfcompose.cli.runs import plan_file
from tfcompose.cli.screen import Screen
from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.signal_queue import SignalQueue
from tfcompose.launcher.control import RequestRefusedError, connect
from tfcompose.launcher.output import NonBlockingOutput
from tfcompose.tools.adjust.controls import Controls, apply_steps

if TYPE_CHECKING:
    from collections.abc import Callable
    from socket import socket

    from tfcompose.cli.adjusting import RunningPlan
    from tfcompose.launcher.runtime_dir import RuntimeDir
    from tfcompose.model.plan import Plan

    #: Saves the adjusted poses of a plan, and returns a sentence about it.
    SavePoses = Callable[[Plan], str]

#: How often to look whether another command changed the plan, in seconds.
_REFRESH_S = 0.5


class RobotEndedError(Exception):
    """The robot has ended."""


class SignalledError(Exception):
    """A signal ends the session; ``number`` is the signal's."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def nudge_by_keys(
    runtime_dir: RuntimeDir, running: RunningPlan, child: str, save: SavePoses
) -> Plan:
    """Move mounts by keys until the user quits, and return the plan that runs then.

    ``child`` is the frame of the mount that is chosen first. The terminal is restored whatever
    ends the session.

    Raises:
        RobotEndedError: if the robot ends.
        SignalledError: if a signal ends this process, or the terminal is gone.
        OSError: if the robot cannot be reached.
    """
    more = signal.SIGWINCH, signal.SIGTSTP, signal.SIGQUIT
    with contextlib.ExitStack() as stack:
        signals = stack.enter_context(SignalQueue(*more))
        connection = stack.enter_context(connect(runtime_dir))
        output = stack.enter_context(contextlib.closing(NonBlockingOutput(sys.stdout.fileno())))
        screen = stack.enter_context(Screen(sys.stdin.fileno(), output))
        session = stack.enter_context(
            contextlib.closing(_Session(runtime_dir, running, child, save))
        )
        session.run(screen, signals, connection)
        return session.plan


class _Session:
    def __init__(
        self, runtime_dir: RuntimeDir, running: RunningPlan, child: str, save: SavePoses
    ) -> None:
        self._runtime_dir = runtime_dir
        self._save = save
        self._file = running.file
        self._controls = Controls(runtime_dir.name, running.plan, child)
        self._keys = KeyDecoder()
        self._request: threading.Thread | None = None
        self._reader, self._writer = os.pipe()
        os.set_blocking(self._reader, False)

    @property
    def plan(self) -> Plan:
        """The plan that the robot runs."""
        return self._controls.plan

    def close(self) -> None:
        # A request that is under way may still write to the other end.
        os.close(self._reader)

    def run(self, screen: Screen, signals: SignalQueue, connection: socket) -> None:
        with selectors.DefaultSelector() as selector:
            selector.register(signals.fd, selectors.EVENT_READ, signals.woken)
            selector.register(screen.fd, selectors.EVENT_READ, lambda: self._read_keys(screen))
            selector.register(connection, selectors.EVENT_READ, _end)
            selector.register(self._reader, selectors.EVENT_READ, self._end_request)
            while not (self._controls.quits and self._request is None):
                with contextlib.suppress(OSError):  # the terminal is gone: SIGHUP comes
                    screen.draw(self._controls.rows)
                is_waiting = self._keys.waits or screen.output.owes
                ready = selector.select(ESCAPE_S if is_waiting else _REFRESH_S)
                for key, _ in ready:
                    key.data()
                if self._keys.waits and not ready:
                    self._press(self._keys.end(), screen)
                for number in signals.take():
                    _take_signal(number, screen)
                with contextlib.suppress(OSError):
                    screen.output.push()
                self._refresh()
                self._send()

    def _read_keys(self, screen: Screen) -> None:
        try:
            data = os.read(screen.fd, 1 << 16)
        except OSError:
            data = b""
        if not data:
            raise SignalledError(signal.SIGHUP)
        self._press(self._keys.feed(data), screen)

    def _press(self, keys: list[str], screen: Screen) -> None:
        for key in keys:
            if key == "redraw":
                screen.redraw()
            self._controls.press(key)

    def _refresh(self) -> None:
        """Follow a plan that runs by now, of this session or of another command."""
        with contextlib.suppress(OSError, ValueError, RejectedError):  # it ends, or is replaced
            if plan_file(self._runtime_dir) != self._file:
                running = running_plan(self._runtime_dir)
                self._file = running.file
                self._controls.follow(running.plan)

    def _send(self) -> None:
        """Send what is due, unless a request is under way."""
        if self._request is None and (self._controls.steps or self._controls.saves):
            steps = self._controls.take_steps()
            saves, self._controls.saves = self._controls.saves, False

            def work() -> None:
                if steps:
                    adjust(self._runtime_dir, lambda plan: apply_steps(plan, steps))
                if saves:
                    self._controls.message = self._save(running_plan(self._runtime_dir).plan)

            self._request = threading.Thread(target=self._try, args=(work,), daemon=True)
            self._request.start()

    def _try(self, work: Callable[[], None]) -> None:
        """Do the work, show why it fails, and wake the session."""
        try:
            work()
        except RejectedError as error:
            finding = error.findings[0]
            self._controls.message = f"[{finding.code}] {finding.message}"
        except (OSError, ValueError, RequestRefusedError) as error:
            self._controls.message = str(error)
        finally:
            with contextlib.suppress(OSError):
                os.write(self._writer, b"\0")

    def _end_request(self) -> None:
        os.read(self._reader, 1)
        assert self._request is not None  # noqa: S101 (it has written)
        self._request.join()
        self._request = None


def _end() -> None:
    """Raise RobotEndedError: the launcher sends nothing, but closes the connection at its end."""
    raise RobotEndedError


def _take_signal(number: int, screen: Screen) -> None:
    if number == signal.SIGTSTP:
        screen.suspend()
    elif number != signal.SIGWINCH:
        raise SignalledError(number)
