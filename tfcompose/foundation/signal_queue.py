"""Queue of signals for a loop that waits for several descriptors."""

from __future__ import annotations

import contextlib
import os
import signal
from collections import deque
from typing import TYPE_CHECKING, final

from tfcompose.foundation.signals import SIGNALS, take_interrupt

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType

    from typing_extensions import Self


@final
class SignalQueue:
    """Signals that arrived during the ``with`` block: those that end a process, and SIGCHLD.

    Each wakes a loop that waits for ``fd``. Afterwards the handlers are as before. If SIGHUP is
    ignored, as with ``nohup``, it stays ignored. ``more`` are further signals to catch.
    """

    def __init__(self, *more: signal.Signals) -> None:
        self._more = more
        self._taken: deque[int] = deque()
        self._children_changed = False
        self._stack = contextlib.ExitStack()
        self.fd = -1

    def __enter__(self) -> Self:
        self.fd, write_fd = os.pipe()
        self._stack.callback(os.close, self.fd)
        self._stack.callback(os.close, write_fd)
        os.set_blocking(self.fd, False)
        os.set_blocking(write_fd, False)
        before = signal.set_wakeup_fd(write_fd, warn_on_full_buffer=False)
        self._stack.callback(signal.set_wakeup_fd, before)
        for number in (*SIGNALS, signal.SIGCHLD, *self._more):
            if number == signal.SIGHUP and signal.getsignal(number) == signal.SIG_IGN:
                continue
            handler = signal.signal(number, self._append)
            self._stack.callback(
                signal.signal, number, signal.SIG_DFL if handler is None else handler
            )
        if take_interrupt():
            self._taken.append(signal.SIGINT)
            os.write(write_fd, b"\0")
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def _append(self, number: int, _frame: FrameType | None) -> None:
        self._taken.append(number)

    def woken(self) -> None:
        """Empty the pipe that has woken the loop."""
        with contextlib.suppress(BlockingIOError):
            os.read(self.fd, 4096)

    def take(self) -> Iterator[int]:
        """Yield the signals received since the previous call, without SIGCHLD."""
        while self._taken:
            number = self._taken.popleft()
            if number != signal.SIGCHLD:
                yield number
            else:
                self._children_changed = True

    def take_children_changed(self) -> bool:
        """Return whether SIGCHLD was among the signals that the previous ``take`` consumed."""
        changed, self._children_changed = self._children_changed, False
        return changed
