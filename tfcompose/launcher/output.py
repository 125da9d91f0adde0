"""Output of the launcher and its processes: to the terminal, the control socket and log files.

The robot never waits for its reader, such as a suspended terminal or a pipe to a pager. Output
that cannot be written at once is kept, up to a limit. Beyond it, lines of processes are dropped
from the output and counted; the logs have them.

Each process has one log file with lines ``TIME TEXT``, rotated when it is full. The times are
local, with milliseconds and zone, so that lines of several files can be merged. The file ``runs``
beside them has one line per run, with its start time. A full disk costs log lines, and stops no
process.
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


#: Buffer for a slow reader; the launcher's own messages may use as much again; bytes.
KEPT = 256 * 1024
#: Size that a ready pipe or terminal accepts at once; bytes.
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
        """Whether there is output left to write."""
        return bool(self._owed)

    def write(self, text: str, *, log: bool = False) -> None:
        """Write as much as possible now; drop a log line if too much is pending.

        Raises:
            OSError: if the reader is gone.
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
        """Write as much as possible now.

        Raises:
            OSError: if the reader is gone.
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

    def finish(self, patience_s: float = 0.5) -> None:
        """Write the rest, drop what the reader does not take within ``patience_s`` seconds."""
        with contextlib.suppress(OSError):
            while self._owed and select.select([], [self.fd], [], patience_s)[1]:
                self.push()
        self._owed.clear()

    def close(self) -> None:
        """Write the rest as far as the reader takes it, and release the terminal or pipe."""
        try:
            self.finish()
        finally:
            if self._own and self.fd > 2:  # noqa: PLR2004 (the standard streams stay open)
                os.close(self.fd)


def _not_waiting(fd: int) -> tuple[int, bool]:
    """Return a non-blocking descriptor for the same file, and whether it is a new one.

    The flag belongs to the open file description, and other processes share it, so pipes and
    terminals are opened again. Regular files never block.
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
        #: Whether a reader can go away.
        self.is_pipe = stat.S_ISFIFO(os.fstat(self.fd).st_mode)
        self._output = NonBlockingOutput(self.fd)

    def write(self, line: str) -> None:
        """Write a notice; keep what the reader does not take now.

        Raises:
            OSError: if the reader is gone.
        """
        self._output.write(f"{line}\n")

    def push(self) -> None:
        """Write what was kept, as far as the reader takes it now.

        Raises:
            OSError: if the reader is gone.
        """
        if self._output.owes:
            self._output.push()

    def close(self) -> None:
        """Write the rest, as far as the reader takes it, and close the file."""
        self._output.close()
        if self._output.fd != self.fd:
            os.close(self.fd)


class Notifier:
    """Passes notices to the user's output and to clients of the control socket.

    Calls ``lost`` once, when the reader of ``output`` or ``events`` is gone, and ``refresh``
    regularly.
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
        """Take requests of other commands at this control socket instead of the last one."""
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
        """Pass the notice on."""
        if (self._control or self._events) and not isinstance(notice, LogLine):
            line = notice_line(notice, time.time())
            if self._control:
                self._control.publish(line)
            self._try_events(lambda events: events.write(line))
        if self._report:
            self._try(partial(self._report, notice))

    def catch_up(self) -> None:
        """Refresh the view, and have pending output written when its reader is ready again."""
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
        """End the robot with the program that reads its events."""
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


#: Size at which a log file is rotated, and the number of old files kept; bytes.
FILE_BYTES = 8_000_000
KEPT_FILES = 2
#: Number of runs whose start times are kept.
KEPT_RUNS = 100
#: Pause before the disk is tried again after a failure, in seconds.
LEFT_ALONE_S = 5.0


@dataclass(slots=True)
class _Log:
    path: Path
    fd: int
    size: int


@dataclass(slots=True)
class Logs:
    """The log files of one run."""

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
        """Append a line; return the reason for the first failure, else None."""
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
                os.write(log.fd, b"\n")  # no room for all of it: the next attempt says why
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
        path = self.folder / f"{process}.log"  # of a part in a folder: arm/driver
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
    """Refuse another user's folder, as in a shared ROS_LOG_DIR, and links.

    Raises:
        OSError: if it is a link, or another user's.
    """
    found = folder.lstat()
    if stat.S_ISLNK(found.st_mode):
        raise OSError(errno.EPERM, "the folder is a link", str(folder))
    if found.st_uid != os.geteuid():
        raise OSError(errno.EPERM, "the folder is another user's", str(folder))


def _ensure_kept(folder: Path) -> None:
    """Refuse a folder whose owner, unless root, could replace its content with a link.

    Raises:
        OSError: if it is another user's.
    """
    if folder.lstat().st_uid not in {0, os.geteuid()}:
        raise OSError(errno.EPERM, f"{folder} is another user's", str(folder))


def logged_processes(folder: Path) -> list[str]:
    """Return the names of the processes that have a log, including the launcher."""
    return sorted(
        file.relative_to(folder).as_posix().removesuffix(".log") for file in folder.rglob("*.log")
    )


def last_modified(folder: Path) -> float:
    """Return when a line was last written below the folder, in seconds since 1970; 0: never.

    A folder's own time only tells when its last file was created.
    """
    return max((file.stat().st_mtime for file in folder.rglob("*.log")), default=0.0)


def read_logs(
    folder: Path, names: list[str], begin_s: float = 0.0, end_s: float = math.inf
) -> Iterator[tuple[str, str, str]]:
    """Yield (time, process, text) of these processes' lines, oldest first.

    Only lines from ``begin_s`` on and before ``end_s``, in seconds since 1970.
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
    """Return the time of a line in seconds since 1970; 0 if the line is torn."""
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
                at, _, text = line.rstrip("\n").partition(" ")
                yield at, name, text


class Follower:
    """Reads new lines of the logs, across rotation."""

    def __init__(
        self, folder: Path, names: list[str], *, back: int = 0, since_s: float = 0.0
    ) -> None:
        """Begin at the current end, or at the first line within ``back`` bytes before it.

        Skips lines from before ``since_s``, in seconds since 1970.
        """
        self._since_s = since_s
        self._folder, self._names = folder, names
        self._at = {name: self._before(back, *self._end(name), name) for name in names}
        self._rest = dict.fromkeys(names, b"")

    def more(self) -> list[tuple[str, str, str]]:
        """Return (time, process, text) of the lines since the last call, oldest first."""
        found = [
            line
            for name in self._names
            for line in self._more(name)
            if not self._since_s or _instant(line[0]) >= self._since_s
        ]
        return sorted(found, key=lambda line: line[0])

    def _before(self, back: int, inode: int, end: int, name: str) -> tuple[int, int]:
        begin = max(end - back, 0)
        if 0 < begin < end:
            with contextlib.suppress(OSError):
                begin += len(_from(self._folder / f"{name}.log", begin - 1).partition(b"\n")[0])
        return inode, begin

    def _end(self, name: str) -> tuple[int, int]:
        try:
            found = (self._folder / f"{name}.log").stat()
        except OSError:
            return (0, 0)
        return (found.st_ino, found.st_size)

    def _more(self, name: str) -> Iterator[tuple[str, str, str]]:
        inode, offset = self._at[name]
        end = self._end(name)
        if end == (inode, offset):
            return
        data = b""
        if end[0] != inode:  # it was turned over: first the rest of the old one
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
            at, _, text = line.decode(errors="replace").partition(" ")
            yield at, name, text


def _from(file: Path, offset: int) -> bytes:
    with file.open("rb") as opened:
        opened.seek(offset)
        return opened.read()
