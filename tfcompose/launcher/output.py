"""Output of the launcher and its processes to the terminal, the control socket and log files.

The robot never waits for a reader of its output, such as a suspended terminal or a pager. Output
that cannot be written at once is kept, up to a limit. Beyond the limit, log lines are dropped from
this output and counted. The log files still contain them.

Each process has a log file with lines ``TIME TEXT``. A full file is rotated. Times are local, with
milliseconds and time zone, so that lines of several files can be merged. The file ``runs`` in the
same folder has a line with the start time of each run. If the disk is full, log lines are lost,
but no process stops.
"""

from __future__ import annotations

import contextlib
import errno
import heapq
import math
import os
import select
import selectors
import stat
import time
from dataclasses import dataclass, field
from datetime import datetime
from functools import partial
from itertools import dropwhile, takewhile
from typing import TYPE_CHECKING

from tfcompose.foundation import procfs
from tfcompose.launcher.control import Control
from tfcompose.model.messages import LogLine, notice_line

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path
    from socket import socket

    from tfcompose.model.messages import Notice, ProcessMessage, Request


#: Limit of log output kept for a slow reader, in bytes. With the launcher's own messages, twice as
#: much is kept.
KEPT = 256 * 1024
#: Number of bytes that a ready pipe or terminal accepts at once.
PIECE = 4096


class NonBlockingOutput:
    """Writes to a file descriptor without blocking."""

    def __init__(self, fd: int) -> None:
        self.fd, self._own = _not_waiting(fd)
        self._owed = bytearray()
        self.left_out = 0
        self._announced = 0

    @property
    def owes(self) -> bool:
        """Whether pending output remains."""
        return bool(self._owed)

    def write(self, text: str, *, log: bool = False) -> None:
        """Write as much as possible now. Drop a log line if too much output is pending.

        Raises:
            OSError: if the reader has gone.
        """
        limit = KEPT if log else 2 * KEPT
        if len(self._owed) > limit:
            self.left_out += 1
            return
        if self.left_out and not self._owed:
            self._owed += (
                f"… {self.left_out} lines were too fast to print; they are in the logs\n".encode()
            )
            self._announced, self.left_out = self.left_out, 0
        self._owed += text.encode(errors="backslashreplace")
        self.push()

    def push(self) -> None:
        """Write as much pending output as possible now.

        Raises:
            OSError: if the reader has gone.
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
                # A full disk does not stop the robot.
                self.left_out += self._owed.count(b"\n") + self._announced - (self._announced > 0)
                self._announced = 0
                self._owed.clear()
                return
            del self._owed[:count]
            self._announced = self._announced if self._owed else 0

    def finish(self, patience_s: float = 0.5) -> None:
        """Write pending output.

        Drop output that the reader does not accept in ``patience_s`` s.
        """
        with contextlib.suppress(OSError):
            while self._owed and select.select([], [self.fd], [], patience_s)[1]:
                self.push()
        self._owed.clear()

    def close(self) -> None:
        """Write pending output if the reader accepts it, and close the terminal or pipe."""
        try:
            self.finish()
        finally:
            if self._own and self.fd > 2:  # noqa: PLR2004 (the standard streams stay open)
                os.close(self.fd)


def _not_waiting(fd: int) -> tuple[int, bool]:
    """Return a non-blocking descriptor for the same file, and whether it never blocks.

    The flag O_NONBLOCK belongs to the open file description, which other processes share. So pipes
    and terminals are opened again. Regular files never block.
    """
    kind = os.fstat(fd).st_mode
    if stat.S_ISREG(kind):
        return fd, True
    try:
        return os.open(procfs.descriptor(fd), os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY), True
    except OSError:
        return fd, False


class EventStream:
    """A file or pipe with each notice except log lines, as ``tfcompose events --format json``.

    Raises:
        OSError: if the file cannot be opened; ENXIO for a named pipe without a reader.
    """

    def __init__(self, path: str) -> None:
        flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
        self.fd = os.open(path, flags, 0o640)
        #: Whether its reader can close it.
        self.is_pipe = stat.S_ISFIFO(os.fstat(self.fd).st_mode)
        self._output = NonBlockingOutput(self.fd)

    def write(self, line: str) -> None:
        """Write a notice. Keep output that the reader does not accept now.

        Raises:
            OSError: if the reader has gone.
        """
        self._output.write(f"{line}\n")

    def push(self) -> None:
        """Write pending output that the reader accepts now.

        Raises:
            OSError: if the reader has gone.
        """
        if self._output.owes:
            self._output.push()

    def close(self) -> None:
        """Write pending output that the reader accepts, and close the file."""
        self._output.close()
        if self._output.fd != self.fd:
            os.close(self.fd)


class Notifier:
    """Passes notices to the user's output and to clients of the control socket.

    It calls ``lost`` once when the reader of ``output`` or ``events`` has gone, and calls
    ``refresh`` regularly.
    """

    def __init__(  # noqa: PLR0913 (made in one place)
        self,
        selector: selectors.BaseSelector,
        report: Callable[[Notice], None],
        lost: Callable[[], None],
        *,
        output: NonBlockingOutput | None,
        refresh: Callable[[], None] | None,
        events: EventStream | None,
    ) -> None:
        self._selector = selector
        self._output = output
        self._refresh = refresh
        self._report: Callable[[Notice], None] | None = report
        self._lost = lost
        self._owing: int | None = None
        self._control: Control | None = None
        self._events = events
        if events and events.is_pipe:
            selector.register(events.fd, selectors.EVENT_READ, self._lose_events)

    def listen(self, listener: socket, answer: Callable[[Request], ProcessMessage]) -> None:
        """Accept requests of other commands at this control socket instead of the previous one."""
        if self._control:
            self._control.listen(listener)
        else:
            self._control = Control(listener, self._selector, answer)

    def close(self) -> None:
        """Disconnect all clients."""
        if self._control:
            self._control.close()
        if self._events:
            self._events.close()

    def notify(self, notice: Notice) -> None:
        """Pass on the notice."""
        if (self._control or self._events) and not isinstance(notice, LogLine):
            line = notice_line(notice, time.time())
            if self._control:
                self._control.publish(line)
            self._try_events(lambda events: events.write(line))
        if self._report:
            self._try(partial(self._report, notice))

    def catch_up(self) -> None:
        """Refresh the view. Watch for a ready reader if output is pending."""
        if self._refresh and self._report:
            self._try(self._refresh)
        self._try_events(EventStream.push)
        output = self._output
        if output is None or output.owes == (self._owing is not None):
            return
        if output.owes:
            self._owing = output.fd
            self._selector.register(
                output.fd, selectors.EVENT_WRITE, lambda: self._try(output.push)
            )
        elif self._owing is not None:
            self._selector.unregister(self._owing)
            self._owing = None

    def _try_events(self, write: Callable[[EventStream], None]) -> None:
        if self._events:
            try:
                write(self._events)
            except OSError:
                self._lose_events()

    def _lose_events(self) -> None:
        """Stop the robot because the program that reads its events has ended."""
        if self._events:
            if self._events.is_pipe:
                self._selector.unregister(self._events.fd)
            self._events.close()
            self._events = None
            self._lost()

    def _try(self, write: Callable[[], None]) -> None:
        try:
            write()
        except OSError:
            if self._owing is not None:
                self._selector.unregister(self._owing)
            self._output = self._report = self._owing = None
            self._lost()


#: Size in bytes at which a log file is rotated, and number of old files to keep.
FILE_BYTES = 8_000_000
KEPT_FILES = 2
#: Number of runs whose start times are kept.
KEPT_RUNS = 100
#: Pause before the next attempt to write after a failure, in seconds.
LEFT_ALONE_S = 5.0


@dataclass(slots=True)
class _Log:
    path: Path
    fd: int
    size: int


@dataclass(slots=True)
class Logs:
    """The log files of a run."""

    folder: Path
    file_bytes: int = FILE_BYTES
    #: Lines that could not be written.
    lost: int = 0
    _open: dict[str, _Log] = field(default_factory=dict)
    _has_begun: bool = False
    _failed: float = -LEFT_ALONE_S
    _second: int = -1
    _stamp: tuple[str, str] = ("", "")

    def write(self, process: str, text: str) -> str | None:
        """Append a line. Return the reason for the first failure, otherwise None."""
        stamp = self._time(time.time())
        if time.monotonic() - self._failed < LEFT_ALONE_S:
            self.lost += 1
            return None
        data = f"{stamp} {text}\n".encode(errors="replace")
        try:
            log = self._open.get(process) or self._begin(process, stamp)
            if log.size + len(data) > self.file_bytes:
                log = self._rotate(process, log, stamp)
            if os.write(log.fd, data) != len(data):
                os.write(log.fd, b"\n")  # the line was truncated; the next write reports why
            log.size += len(data)
        except OSError as error:
            first, self._failed, self.lost = self.lost == 0, time.monotonic(), self.lost + 1
            return f"logs cannot be written to {self.folder}: {error.strerror}" if first else None
        return None

    def close(self) -> None:
        """Close the files."""
        for log in self._open.values():
            os.close(log.fd)
        self._open.clear()

    def _begin(self, process: str, stamp: str) -> _Log:
        path = self.folder / f"{process}.log"  # a part's process has a folder: arm/driver
        path.parent.mkdir(parents=True, exist_ok=True)
        for folder in {self.folder, path.parent}:
            _ensure_own(folder)
        _ensure_kept(self.folder.parent)
        if not self._has_begun:
            self._has_begun = True
            runs = [*_run_lines(self.folder)[1 - KEPT_RUNS :], stamp]
            new = self.folder / f".runs.{os.getpid()}"
            new.write_text("".join(f"{run}\n" for run in runs), encoding="utf-8")
            new.replace(self.folder / "runs")
        fd = os.open(path, os.O_CREAT | os.O_WRONLY | os.O_APPEND | os.O_NOFOLLOW, 0o640)
        log = self._open[process] = _Log(path, fd, os.fstat(fd).st_size)
        return log

    def _rotate(self, process: str, log: _Log, stamp: str) -> _Log:
        os.close(log.fd)
        del self._open[process]
        for number in range(KEPT_FILES, 0, -1):
            newer = log.path.with_suffix(f".log.{number - 1}") if number > 1 else log.path
            with contextlib.suppress(FileNotFoundError):
                newer.replace(log.path.with_suffix(f".log.{number}"))
        return self._begin(process, stamp)

    def _time(self, now: float) -> str:
        second = int(now)
        if second != self._second:
            local = time.localtime(second)
            zone = time.strftime("%z", local)
            self._second, self._stamp = (
                second,
                (time.strftime("%Y-%m-%dT%H:%M:%S", local), f"{zone[:3]}:{zone[3:]}"),
            )
        return f"{self._stamp[0]}.{int(now * 1000) % 1000:03d}{self._stamp[1]}"


def _ensure_own(folder: Path) -> None:
    """Reject a link, and a folder of another user, as in a shared ROS_LOG_DIR.

    Raises:
        OSError: if the folder is a link or belongs to another user.
    """
    status = folder.lstat()
    if stat.S_ISLNK(status.st_mode):
        raise OSError(errno.EPERM, "the folder is a link", str(folder))
    if status.st_uid != os.geteuid():
        raise OSError(errno.EPERM, "the folder is another user's", str(folder))


def _ensure_kept(folder: Path) -> None:
    """Reject a folder whose owner could replace its content with a link. Root is trusted.

    Raises:
        OSError: if the folder belongs to another user.
    """
    if folder.lstat().st_uid not in {0, os.geteuid()}:
        raise OSError(errno.EPERM, f"{folder} is another user's", str(folder))


def logged_processes(folder: Path) -> list[str]:
    """Return the names of the processes that have a log, including the launcher."""
    return sorted(
        file.relative_to(folder).as_posix().removesuffix(".log") for file in folder.rglob("*.log")
    )


def last_modified(folder: Path) -> float:
    """Return the time of the last log line below the folder, in seconds since 1970; 0 if none.

    The modification time of the folder only tells when its last file was created.
    """
    return max((file.stat().st_mtime for file in folder.rglob("*.log")), default=0.0)


def read_logs(
    folder: Path, names: list[str], begin_s: float = 0.0, end_s: float = math.inf
) -> Iterator[tuple[str, str, str]]:
    """Yield (time, process, text) of the processes' log lines, oldest first.

    Only lines from ``begin_s`` up to, but not including, ``end_s`` are read. Times are in seconds
    since 1970.
    """
    lines: Iterator[tuple[str, str, str]]
    lines = heapq.merge(*(_lines(folder, name) for name in names), key=lambda line: line[0])
    lines = dropwhile(lambda line: _instant(line[0]) < begin_s, lines) if begin_s else lines
    return takewhile(lambda line: _instant(line[0]) < end_s, lines) if end_s < math.inf else lines


def runs_of(folder: Path) -> list[float]:
    """Return the start times of the runs with these logs, in seconds since 1970, newest last."""
    return [_instant(line) for line in _run_lines(folder)]


def _run_lines(folder: Path) -> list[str]:
    with contextlib.suppress(OSError):
        return (folder / "runs").read_text(encoding="utf-8", errors="replace").splitlines()
    return []


def _instant(stamp: str) -> float:
    """Return the time of a line in seconds since 1970; 0 for an incomplete line."""
    try:
        return datetime.fromisoformat(stamp).timestamp()
    except ValueError:
        return 0.0


def _lines(folder: Path, name: str) -> Iterator[tuple[str, str, str]]:
    for file in [
        *(folder / f"{name}.log.{number}" for number in range(KEPT_FILES, 0, -1)),
        folder / f"{name}.log",
    ]:
        with (
            contextlib.suppress(FileNotFoundError),
            file.open(encoding="utf-8", errors="replace", newline="\n") as lines,
        ):
            for line in lines:
                time_text, _, text = line.rstrip("\n").partition(" ")
                yield time_text, name, text


class Follower:
    """Reads new log lines, also after a rotation."""

    def __init__(
        self, folder: Path, names: list[str], *, back: int = 0, since_s: float = 0.0
    ) -> None:
        """Start at the current end, or at the first line in the last ``back`` bytes.

        Lines from before ``since_s``, in seconds since 1970, are skipped.
        """
        self._since_s = since_s
        self._folder, self._names = folder, names
        self._at = {name: self._before(back, *self._end(name), name) for name in names}
        self._rest = dict.fromkeys(names, b"")

    def more(self) -> list[tuple[str, str, str]]:
        """Return (time, process, text) of all lines since the previous call, oldest first."""
        lines = [
            line
            for name in self._names
            for line in self._more(name)
            if not self._since_s or _instant(line[0]) >= self._since_s
        ]
        return sorted(lines, key=lambda line: line[0])

    def _before(self, back: int, inode: int, end: int, name: str) -> tuple[int, int]:
        begin = max(end - back, 0)
        if 0 < begin < end:
            with contextlib.suppress(OSError):
                begin += len(_from(self._folder / f"{name}.log", begin - 1).partition(b"\n")[0])
        return inode, begin

    def _end(self, name: str) -> tuple[int, int]:
        try:
            status = (self._folder / f"{name}.log").stat()
        except OSError:
            return (0, 0)
        return (status.st_ino, status.st_size)

    def _more(self, name: str) -> Iterator[tuple[str, str, str]]:
        inode, offset = self._at[name]
        end = self._end(name)
        if end == (inode, offset):
            return
        data = b""
        if end[0] != inode:  # the file was rotated: read the rest of the old file first
            old = self._folder / f"{name}.log.1"
            with contextlib.suppress(OSError):
                if old.stat().st_ino == inode:
                    data = _from(old, offset)
            offset = 0
        with contextlib.suppress(OSError):
            added = _from(self._folder / f"{name}.log", offset)
            data += added
            offset += len(added)
        self._at[name] = (end[0], offset)
        *complete, self._rest[name] = (self._rest[name] + data).split(b"\n")
        for line in complete:
            time_text, _, text = line.decode(errors="replace").partition(" ")
            yield time_text, name, text


def _from(file: Path, offset: int) -> bytes:
    with file.open("rb") as opened:
        opened.seek(offset)
        return opened.read()
