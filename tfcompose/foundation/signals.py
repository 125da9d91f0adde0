"""Signals for tfcompose's commands and processes: none is lost, and each ends any wait.

While a command loads, Ctrl-C ends it also where Python can raise nothing: Python throws an
exception away that comes up in a callback of its own, such as those that its import system has,
and goes on. So what SIGINT raises there is remembered, for whoever handles signals next.
pydantic's Rust prints a panic where an exception comes to it while it loads; SIGINT raises nothing
before pydantic has returned. A process then has a flag that SIGINT, SIGTERM and SIGHUP set, and
that wakes whoever waits. ROS is not imported: a process handles signals before it spends a second
on starting it.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

    from typing_extensions import Self


_remembered: list[int] = []
#: So long an interrupt is held before pydantic is looked for again.
HELD_S = 0.02


def take_interrupt() -> bool:
    """Return whether there was a Ctrl-C that nobody took yet, and take it."""
    came = bool(_remembered)
    _remembered.clear()
    return came


class RememberedInterrupt:
    """Lets SIGINT raise KeyboardInterrupt, as Python does, and remembers it.

    Ignored, as below ``nohup``, it stays so.

    It is for the main thread; in others, which get no signals, it does nothing.
    """

    def __enter__(self) -> None:
        _remembered.clear()
        self._unraisable = sys.unraisablehook
        sys.unraisablehook = self._print_unraisable
        self._is_set = signal.getsignal(signal.SIGINT) is signal.default_int_handler
        if self._is_set:
            try:
                self._alarm = signal.signal(signal.SIGALRM, _interrupt_again)
                signal.signal(signal.SIGINT, _interrupt)
            except ValueError:  # in another thread
                self._is_set = False

    def __exit__(self, *_: object) -> None:
        sys.unraisablehook = self._unraisable
        if self._is_set:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, self._alarm)

    def _print_unraisable(self, what: sys.UnraisableHookArgs) -> None:
        """Let Python print what it throws away, but not an interrupt, which is remembered."""
        if what.exc_type is not KeyboardInterrupt:
            self._unraisable(what)


def _interrupt(number: int, frame: FrameType | None) -> None:
    _remembered.append(number)
    _interrupt_again(number, frame)


def _interrupt_again(_number: int, frame: FrameType | None) -> None:
    """Raise a pending interrupt, or retry it soon if pydantic called what runs now."""
    if not _remembered:
        return
    while frame is not None:
        if frame.f_globals.get("__name__", "").startswith("pydantic"):
            signal.setitimer(signal.ITIMER_REAL, HELD_S)
            return
        frame = frame.f_back
    raise KeyboardInterrupt


#: The signals that end a process.
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_END = b"\0"


class Waker(Protocol):
    """Something that ends a wait: rclpy's guard condition is one."""

    def trigger_guard_condition(self) -> None:
        """End the wait that is under way, or else the next one."""


class Stop:
    """A flag that signals set, from the main thread's ``with`` block on until it ends.

    Python runs a signal's handler only when the main thread is back from C, which a wait in ROS
    may never be. So the number of the signal goes through Python's wake-up descriptor to a thread,
    which sets the flag and ends the wait. Without ``with`` no signal is handled and ``request``
    sets the flag.

    ``tfcompose up`` starts its own processes with these signals blocked, so that none meets a
    Python that does not handle it yet. They are let through once they are handled, and blocked
    again at the block's end.
    """

    def __init__(self) -> None:
        self._event = threading.Event()
        self._lock = threading.Lock()
        self._wakers: dict[int, tuple[object, Waker]] = {}

    @property
    def requested(self) -> bool:
        """Whether the process is to end."""
        return self._event.is_set()

    def request(self) -> None:
        """Set the flag and end every wait, from any thread."""
        with self._lock:
            self._event.set()
            for _, waker in self._wakers.values():
                waker.trigger_guard_condition()

    def wait(self, timeout_s: float | None) -> bool:
        """Wait until the flag is set, at most so many seconds, and return whether it is."""
        return self._event.wait(timeout_s)

    def waker(self, owner: object, make: Callable[[], Waker]) -> Waker:
        """Return the waker of that owner (a ROS context), made on first use.

        ``request`` triggers it.
        """
        with self._lock:
            known = self._wakers.get(id(owner))
            if known is None:
                known = self._wakers[id(owner)] = (owner, make())
                if self._event.is_set():
                    known[1].trigger_guard_condition()
            return known[1]

    def __enter__(self) -> Self:
        self._reader, self._writer = os.pipe()
        os.set_blocking(self._writer, False)
        self._previous_fd = signal.set_wakeup_fd(self._writer, warn_on_full_buffer=False)
        ignored = (
            signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        )  # under nohup a hang-up is meant to be ignored
        handled = SIGNALS[:2] if ignored else SIGNALS
        self._previous = {number: signal.signal(number, self._on_signal) for number in handled}
        self._thread = threading.Thread(target=self._watch, name="signals", daemon=True)
        self._thread.start()
        self._previous_mask = signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
        if take_interrupt():
            self.request()
        return self

    def __exit__(self, *_: object) -> None:
        signal.pthread_sigmask(signal.SIG_SETMASK, self._previous_mask)
        for number, handler in self._previous.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(self._previous_fd)
        os.write(self._writer, _END)
        self._thread.join()
        os.close(self._reader)
        os.close(self._writer)
        with self._lock:
            self._wakers.clear()

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        """Do nothing: the thread that watches the wake-up descriptor does it, at once."""

    def _watch(self) -> None:
        while (numbers := os.read(self._reader, 64)) and _END[0] not in numbers:
            if any(number in numbers for number in SIGNALS):
                self.request()
