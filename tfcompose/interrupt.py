"""Ctrl-C while a command loads: it ends the command, and is not lost where Python can raise nothing.

Python throws an exception away that comes up in a callback of its own, such as those that its import system has, and
goes on. So what SIGINT raises there is remembered, for whoever handles signals next.
"""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import FrameType, TracebackType

_remembered: list[int] = []


def taken() -> bool:
    """Return whether there was a Ctrl-C that nobody took yet, and take it."""
    came = bool(_remembered)
    _remembered.clear()
    return came


class Remembered:
    """Lets SIGINT raise KeyboardInterrupt, as Python does, and remembers it; ignored, as below ``nohup``, it stays so.

    It is for the main thread; in others, which get no signals, it does nothing.
    """

    def __enter__(self) -> None:
        _remembered.clear()
        self._is_set = signal.getsignal(signal.SIGINT) is signal.default_int_handler
        if self._is_set:
            try:
                signal.signal(signal.SIGINT, _interrupt)
            except ValueError:  # in another thread
                self._is_set = False

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._is_set:
            signal.signal(signal.SIGINT, signal.default_int_handler)


def _interrupt(number: int, _frame: FrameType | None) -> None:
    _remembered.append(number)
    raise KeyboardInterrupt
