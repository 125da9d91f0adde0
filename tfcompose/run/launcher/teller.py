"""Who hears what the launcher tells: the person at its output, and whoever listens at the control socket."""

from __future__ import annotations

import selectors
import time
from functools import partial
from typing import TYPE_CHECKING

from tfcompose.ipc import LogLine, notice_line
from tfcompose.run.launcher.control import Control

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.ipc import Notice, Request
    from tfcompose.run.launcher.session import Session


class Teller:
    """Passes notices on. ``lost`` is called once, when nobody reads the output any more."""

    def __init__(
        self,
        selector: selectors.BaseSelector,
        session: Session,
        report: Callable[[Notice], None],
        lost: Callable[[], None],
    ) -> None:
        self._selector = selector
        self._outlet = session.outlet
        self._refresh = session.refresh
        self._report: Callable[[Notice], None] | None = report
        self._lost = lost
        self._owing: int | None = None
        self._control: Control | None = None

    def listen(self, session: Session, answer: Callable[[Request], object]) -> None:
        """Hear other commands at the session's socket, if it has one."""
        if session.listener:
            self._control = Control(session.listener, self._selector, answer)

    def close(self) -> None:
        """Let all go who listen."""
        if self._control:
            self._control.close()

    def tell(self, notice: Notice) -> None:
        """Pass the notice on."""
        if self._control and not isinstance(notice, LogLine):
            self._control.tell(notice_line(notice, time.time()), keep=True)
        if self._report:
            self._try(partial(self._report, notice))

    def keep_up(self) -> None:
        """Bring what is shown up to date; have what is owed written when its reader is ready again."""
        if self._refresh and self._report:
            self._try(self._refresh)
        outlet = self._outlet
        if outlet is None or outlet.owes == (self._owing is not None):
            return
        if outlet.owes:
            self._owing = outlet.fd
            self._selector.register(outlet.fd, selectors.EVENT_WRITE, lambda: self._try(outlet.push))
        elif self._owing is not None:
            self._selector.unregister(self._owing)
            self._owing = None

    def _try(self, write: Callable[[], None]) -> None:
        try:
            write()
        except OSError:
            if self._owing is not None:
                self._selector.unregister(self._owing)
            self._outlet = self._report = self._owing = None
            self._lost()
