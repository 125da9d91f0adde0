"""The launcher's signals as values: a handler only appends, and a pipe wakes the loop."""

from __future__ import annotations

import contextlib
import os
import signal
from collections import deque
from typing import TYPE_CHECKING, final

from tfcompose import interrupt

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType, TracebackType

#: What ends a plan.
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@final
class Signals:
    """Catches what ends a plan, and SIGCHLD so that it wakes the loop; puts everything back afterwards.

    A SIGHUP that is ignored, as below ``nohup``, stays ignored.
    """

    def __init__(self) -> None:
        self._taken: deque[int] = deque()
        self._children_changed = False
        self._stack = contextlib.ExitStack()
        self.fd = -1

    def __enter__(self) -> Signals:
        self.fd, write_fd = os.pipe()
        self._stack.callback(os.close, self.fd)
        self._stack.callback(os.close, write_fd)
        os.set_blocking(self.fd, False)
        os.set_blocking(write_fd, False)
        before = signal.set_wakeup_fd(write_fd, warn_on_full_buffer=False)
        self._stack.callback(signal.set_wakeup_fd, before)
        for number in (*ENDING, signal.SIGCHLD):
            if number == signal.SIGHUP and signal.getsignal(number) == signal.SIG_IGN:
                continue
            handler = signal.signal(number, self._append)
            self._stack.callback(signal.signal, number, signal.SIG_DFL if handler is None else handler)
        if interrupt.taken():
            self._taken.append(signal.SIGINT)
            os.write(write_fd, b"\0")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def _append(self, number: int, _frame: FrameType | None) -> None:
        self._taken.append(number)

    def woken(self) -> None:
        """Empty the pipe that woke the loop."""
        with contextlib.suppress(BlockingIOError):
            os.read(self.fd, 4096)

    def taken(self) -> Iterator[int]:
        """Yield the signals that came since the last call, without SIGCHLD."""
        while self._taken:
            number = self._taken.popleft()
            if number != signal.SIGCHLD:
                yield number
            else:
                self._children_changed = True

    def children_changed(self) -> bool:
        """Return whether SIGCHLD was among those that ``taken`` has passed since the last call."""
        changed, self._children_changed = self._children_changed, False
        return changed
