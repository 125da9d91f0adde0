"""Signals for tfcompose's commands and processes. No signal is lost, and each ends any wait.

While a command loads its modules, Ctrl-C must end it even where Python ignores exceptions. Python
ignores an exception in its own callbacks, for example in the import system, and continues. So
SIGINT also stores the interrupt, and the code that next handles signals raises it. pydantic's Rust
code prints a panic if an exception reaches it while it loads. So SIGINT raises nothing until
pydantic has returned.

Later, a process has a flag that SIGINT, SIGTERM and SIGHUP set and that ends every wait. This
module does not import ROS, because a process handles signals before it spends a second on starting
ROS.
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
#: Interval at which a delayed interrupt is tried again while pydantic loads, in seconds.
HELD_S = 0.02


def take_interrupt() -> bool:
    """Return whether a Ctrl-C is pending, and clear it."""
    came = bool(_remembered)
    _remembered.clear()
    return came


class RememberedInterrupt:
    """Lets SIGINT raise KeyboardInterrupt, as Python does, and stores the interrupt.

    If SIGINT is ignored, as with ``nohup``, it stays ignored. Use it in the main thread. In other
    threads, which receive no signals, it does nothing.
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
            except ValueError:  # not the main thread
                self._is_set = False

    def __exit__(self, *_: object) -> None:
        sys.unraisablehook = self._unraisable
        if self._is_set:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, self._alarm)

    def _print_unraisable(self, what: sys.UnraisableHookArgs) -> None:
        """Let Python print an ignored exception, unless it is an interrupt, which is stored."""
        if what.exc_type is not KeyboardInterrupt:
            self._unraisable(what)


def _interrupt(number: int, frame: FrameType | None) -> None:
    _remembered.append(number)
    _interrupt_again(number, frame)


def _interrupt_again(_number: int, frame: FrameType | None) -> None:
    """Raise a pending interrupt, or retry soon if pydantic is running."""
    if not _remembered:
        return
    while frame is not None:
        if frame.f_globals.get("__name__", "").startswith("pydantic"):
            signal.setitimer(signal.ITIMER_REAL, HELD_S)
            return
        frame = frame.f_back
    raise KeyboardInterrupt


#: Signals that end a process.
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_END = b"\0"


class Waker(Protocol):
    """An object that ends a wait, such as rclpy's guard condition."""

    def trigger_guard_condition(self) -> None:
        """End the current wait; without one, end the next wait at once."""


class Stop:
    """A flag that signals set during the main thread's ``with`` block.

    Python runs a signal handler only when the main thread returns from C code. A wait in ROS may
    never return. So Python's wake-up descriptor passes the number of the signal to a thread, which
    sets the flag and ends the wait. Without ``with``, signals are not handled, and only
    ``request`` sets the flag.

    ``tfcompose up`` starts its own processes with these signals blocked, so that no signal arrives
    before Python handles it. The block unblocks them after it has installed the handlers, and
    blocks them again at its end.
    """

    def __init__(self) -> None:
        self._event = threading.Event()
        self._lock = threading.Lock()
        self._wakers: dict[int, tuple[object, Waker]] = {}

    @property
    def requested(self) -> bool:
        """Whether the process should end."""
        return self._event.is_set()

    def request(self) -> None:
        """Set the flag and end every wait. Can be called from any thread."""
        with self._lock:
            self._event.set()
            for _, waker in self._wakers.values():
                waker.trigger_guard_condition()

    def wait(self, timeout_s: float | None) -> bool:
        """Wait until the flag is set, for at most ``timeout_s`` seconds.

        Return whether it is set.
        """
        return self._event.wait(timeout_s)

    def waker(self, owner: object, make: Callable[[], Waker]) -> Waker:
        """Return the waker of an owner, such as a ROS context, created on first use.

        ``request`` triggers it.
        """
        with self._lock:
            entry = self._wakers.get(id(owner))
            if entry is None:
                entry = self._wakers[id(owner)] = (owner, make())
                if self._event.is_set():
                    entry[1].trigger_guard_condition()
            return entry[1]

    def __enter__(self) -> Self:
        self._reader, self._writer = os.pipe()
        os.set_blocking(self._writer, False)
        self._previous_fd = signal.set_wakeup_fd(self._writer, warn_on_full_buffer=False)
        ignored = (
            signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        )  # nohup ignores SIGHUP on purpose
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
        """Do nothing, because the thread that reads the wake-up descriptor acts at once."""

    def _watch(self) -> None:
        while (numbers := os.read(self._reader, 64)) and _END[0] not in numbers:
            if any(number in numbers for number in SIGNALS):
                self.request()
