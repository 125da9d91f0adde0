"""Where the launcher's notices go: to a person who may read slowly, and to whoever listens at the control socket.

The robot does not wait for its reader: a terminal that was stopped, a pipe to a pager. What cannot be written at once
is kept, up to a limit; beyond it, lines of processes are left out and counted, and they are in the logs.
"""

from __future__ import annotations

import errno
import os
import select
import selectors
import stat
import time
from functools import partial
from typing import TYPE_CHECKING

from tfcompose.ipc import LogLine, notice_line
from tfcompose.launcher.control import Control

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.ipc import Notice, Request
    from tfcompose.launcher.supervisor import Session

#: So much is kept for a slow reader; what the launcher itself says may take as much again; bytes.
KEPT = 256 * 1024
#: What a pipe or terminal surely takes when it is ready; bytes.
PIECE = 4096


class NonBlockingOutput:
    """Writes to a file descriptor without waiting."""

    def __init__(self, fd: int) -> None:
        self.fd, self._own = _not_waiting(fd)
        self._owed = bytearray()
        self.left_out = 0
        self._announced = 0

    @property
    def owes(self) -> bool:
        """Whether something is still to be written."""
        return bool(self._owed)

    def write(self, text: str, *, log: bool = False) -> None:
        """Write what can be written now; a log line is left out where too much is kept already.

        Raises:
            OSError: if nobody reads any more.
        """
        limit = KEPT if log else 2 * KEPT
        if len(self._owed) > limit:
            self.left_out += 1
            return
        if self.left_out and not self._owed:
            self._owed += (
                f"… {self.left_out} lines are left out here: they came too fast, and are in the logs\n".encode()
            )
            self._announced, self.left_out = self.left_out, 0
        self._owed += text.encode(errors="backslashreplace")
        self.push()

    def push(self) -> None:
        """Write what can be written now.

        Raises:
            OSError: if nobody reads any more.
        """
        while self._owed:
            if not self._own and not select.select([], [self.fd], [], 0)[1]:
                return
            try:
                count = os.write(self.fd, bytes(self._owed[: (1 << 16) if self._own else PIECE]))
            except BlockingIOError:
                return
            except OSError as error:
                if error.errno not in {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}:
                    raise
                # A full disk stops no robot.
                self.left_out += self._owed.count(b"\n") + self._announced - (self._announced > 0)
                self._announced = 0
                self._owed.clear()
                return
            del self._owed[:count]
            self._announced = self._announced if self._owed else 0

    def close(self, patience_s: float = 0.5) -> None:
        """Write the rest, as far as the reader takes it in that time."""
        try:
            while self._owed and select.select([], [self.fd], [], patience_s)[1]:
                self.push()
        except OSError:
            pass
        finally:
            if self._own and self.fd > 2:  # noqa: PLR2004 (the standard streams stay open)
                os.close(self.fd)


def _not_waiting(fd: int) -> tuple[int, bool]:
    """Return a descriptor for the same thing that never waits, and whether it is one.

    The flag belongs to what was opened, which others share; so pipes and terminals are opened once more. Regular files
    never wait.
    """
    kind = os.fstat(fd).st_mode
    if stat.S_ISREG(kind):
        return fd, True
    try:
        return os.open(f"/proc/self/fd/{fd}", os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY), True
    except OSError:
        return fd, False


class Notifier:
    """Passes notices on to the person at the output, and to whoever listens at the control socket.

    ``lost`` is called once, when nobody reads the output any more.
    """

    def __init__(
        self,
        selector: selectors.BaseSelector,
        session: Session,
        report: Callable[[Notice], None],
        lost: Callable[[], None],
    ) -> None:
        self._selector = selector
        self._output = session.output
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

    def notify(self, notice: Notice) -> None:
        """Pass the notice on."""
        if self._control and not isinstance(notice, LogLine):
            self._control.publish(notice_line(notice, time.time()))
        if self._report:
            self._try(partial(self._report, notice))

    def catch_up(self) -> None:
        """Bring what is shown up to date; have what is owed written when its reader is ready again."""
        if self._refresh and self._report:
            self._try(self._refresh)
        output = self._output
        if output is None or output.owes == (self._owing is not None):
            return
        if output.owes:
            self._owing = output.fd
            self._selector.register(output.fd, selectors.EVENT_WRITE, lambda: self._try(output.push))
        elif self._owing is not None:
            self._selector.unregister(self._owing)
            self._owing = None

    def _try(self, write: Callable[[], None]) -> None:
        try:
            write()
        except OSError:
            if self._owing is not None:
                self._selector.unregister(self._owing)
            self._output = self._report = self._owing = None
            self._lost()
