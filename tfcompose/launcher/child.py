"""A child process: bound to the launcher, leader of its own group, and read without blocking.

When the launcher dies, the kernel sends SIGKILL to its children (PR_SET_PDEATHSIG), but not to the
children's children. The reaper kills these.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import fcntl
import os
import signal
import struct
import subprocess
import termios
import time
from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from tfcompose.foundation.signals import SIGNALS
from tfcompose.launcher.kernel_settings import apply_settings

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator
    from io import FileIO
    from pathlib import Path
    from typing import IO

    from tfcompose.model.plan import PlanProcess
    from tfcompose.model.plan.components import LoadRequest

#: Maximum length of a line, in bytes. A longer line is split into pieces.
LINE_LIMIT = 64 * 1024
#: Maximum bytes per read, so that a process with much output leaves time for other processes.
READ_SIZE = 64 * 1024
#: Limits of a process's output: burst in bytes, and rate in bytes per second. Output beyond these
#: limits is read and counted, but dropped.
BURST = 8_000_000
PER_SECOND = 1_000_000
#: Number of dropped bytes to keep. They are passed on when the limits permit, because the last
#: output of a process is important.
TAIL = 4096
#: Maximum bytes to read from a process that has ended. A pipe holds less.
DRAIN_LIMIT = 1024 * 1024

#: The size of a pseudo-terminal: lines and columns.
TERMINAL_SIZE = (40, 120)

#: Size of the log excerpt in the finding for a failed process: lines, and characters per line.
LAST_LINES = 8
LAST_LINE_LENGTH = 300

_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36
_LIBC = ctypes.CDLL(None, use_errno=True)


@dataclass(frozen=True, slots=True)
class ChildCommand:
    """The command of a process: arguments, environment and working directory."""

    argv: tuple[str, ...]
    env: dict[str, str]
    folder: Path
    #: Whether it is one of tfcompose's own processes.
    is_built_in: bool = False
    #: The process in the plan, whose settings apply to the child.
    process: PlanProcess | None = None
    #: Path and content of a profile file that must exist before the start.
    fence: tuple[Path, str] | None = None
    #: The reason why the process cannot start, if the run continues without it.
    missing: str = ""
    #: For a component: the request to its container, which is sent instead of starting a process.
    load: LoadRequest | None = None


class Lines:
    """Splits bytes into lines. Between two calls it keeps at most ``limit`` bytes."""

    def __init__(self, limit: int = LINE_LIMIT) -> None:
        self._limit = limit
        self._rest = b""

    def feed(self, data: bytes) -> Iterator[str]:
        """Yield the lines that ``data`` completes, and pieces of a line that exceeds the limit."""
        *complete, self._rest = (self._rest + data).split(b"\n")
        for line in complete:
            yield from self._pieces(line)
        while len(self._rest) > self._limit:
            piece, self._rest = self._rest[: self._limit], self._rest[self._limit :]
            yield _text(piece)

    def end(self) -> Iterator[str]:
        """Yield the text after the last newline, if there is any."""
        if self._rest:
            yield _text(self._rest)
        self._rest = b""

    def _pieces(self, line: bytes) -> Iterator[str]:
        for start in range(0, max(len(line), 1), self._limit):
            yield _text(line[start : start + self._limit])


def _text(line: bytes) -> str:
    """Return the line as a terminal finally shows it, after carriage returns."""
    return line.rstrip(b"\r").rpartition(b"\r")[2].decode(errors="replace")


class Bucket:
    """Limit for the output of a process over all its pipes, with a count of dropped bytes."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._left: float = BURST
        self._at = clock()
        self._dry = False
        self.thrown = 0

    def take(self, size: int) -> bool:
        """Return whether ``size`` bytes are accepted now."""
        now = self._clock()
        self._left = min(BURST, self._left + (now - self._at) * PER_SECOND)
        self._at = now
        # After the bucket is empty, it must fill up to a second's amount. Then the kept output
        # comes in readable pieces.
        self._dry = self._left < (PER_SECOND if self._dry else size)
        self._left -= 0 if self._dry else size
        return not self._dry


class Pipe:
    """The launcher's end of a pipe. ``sink`` receives each line."""

    def __init__(
        self,
        file: IO[bytes] | FileIO,
        sink: Callable[[str], None],
        limit: int = LINE_LIMIT,
        bucket: Bucket | None = None,
    ) -> None:
        self.file = file
        self._bucket = bucket
        self._sink = sink
        self._lines = Lines(limit)
        self._tail = b""
        os.set_blocking(file.fileno(), False)

    def read(self) -> int | None:
        """Pass on some of the available bytes.

        Return the number of bytes: 0 at the end, None if no bytes are available now.
        """
        try:
            data = self.file.read(READ_SIZE)
        except OSError as error:  # a pseudo-terminal whose other end is closed
            if error.errno != errno.EIO:
                raise
            data = b""
        if data is None:
            return None
        bucket = self._bucket
        if bucket and data and not bucket.take(len(data)):
            self._throw_away(bucket, data)
            return len(data)
        if bucket:
            self._catch_up(bucket)
        for line in self._lines.feed(data) if data else self._lines.end():
            self._sink(line)
        return len(data)

    def _throw_away(self, bucket: Bucket, data: bytes) -> None:
        for line in self._lines.end():
            self._sink(line)
        kept = (self._tail + data)[-TAIL:]
        bucket.thrown += len(self._tail) + len(data) - len(kept)
        self._tail = kept

    def _catch_up(self, bucket: Bucket) -> None:
        """Report the number of dropped bytes, and continue at the start of a line."""
        tail, self._tail = self._tail, b""
        if bucket.thrown and b"\n" in tail[:-1]:
            begin = tail.index(b"\n") + 1
            bucket.thrown += begin
            tail = tail[begin:]
        if bucket.thrown:
            self._sink(
                f"… {bucket.thrown:,} bytes of output were dropped here: more than the log can"
                " take"
            )
            bucket.thrown = 0
        for line in self._lines.feed(tail):
            self._sink(line)

    def drain(self) -> None:
        """Pass on the remaining output of a process that has ended, then close the pipe."""
        left = DRAIN_LIMIT
        try:
            while left > 0 and (count := self.read()):
                left -= count
            if self._bucket:
                self._catch_up(self._bucket)
            for line in self._lines.end():
                self._sink(line)
        finally:
            self.file.close()


@dataclass(slots=True)
class Child:
    """A running process, its pipes, and the last lines that it wrote to each pipe."""

    name: str
    popen: Running
    pipes: list[Pipe] = field(default_factory=list)
    last_out: deque[str] = field(default_factory=lambda: deque(maxlen=LAST_LINES))
    last_err: deque[str] = field(default_factory=lambda: deque(maxlen=LAST_LINES))
    bucket: Bucket = field(default_factory=Bucket)
    gate_matched: bool = False

    @property
    def last_lines(self) -> tuple[str, ...]:
        """The last lines of output.

        Lines of stderr come last, because the order of lines across two pipes is unknown.
        """
        return (*self.last_out, *self.last_err)[-LAST_LINES:]


class Running(Protocol):
    """A started process, such as ``subprocess.Popen``."""

    @property
    def pid(self) -> int:
        """The process id, which is also the id of the process's group."""

    @property
    def stdout(self) -> IO[bytes] | FileIO | None:
        """The pipe of its standard output."""

    @property
    def stderr(self) -> IO[bytes] | FileIO | None:
        """The pipe of its standard error."""

    def wait(self) -> int:
        """Wait for the process to end. Return its exit code, or minus the number of the signal."""


def spawn(command: ChildCommand, pass_fds: tuple[int, ...]) -> subprocess.Popen[bytes]:
    """Start the command as the leader of a new session, with pipes for its output.

    A process of tfcompose starts with the ending signals blocked, and unblocks them when it
    handles them (``foundation.signals``). A signal that arrives while Python starts therefore
    stays pending. It neither kills the process nor causes a traceback.

    Raises:
        OSError: if the command cannot be started.
    """
    launcher = os.getpid()

    def before_the_program() -> None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != launcher:  # the launcher died before the previous line
            os._exit(1)
        if command.process:
            apply_settings(command.process)
        if command.is_built_in:
            signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)

    if command.process and command.process.emulate_tty:
        return _on_terminals(command, before_the_program, pass_fds)
    return subprocess.Popen(
        command.argv,
        bufsize=0,
        cwd=(
            "/" if command.is_built_in and not command.folder.is_dir() else command.folder
        ),  # tfcompose's processes need no folder
        env=command.env,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        pass_fds=pass_fds,
        start_new_session=True,
        preexec_fn=before_the_program,  # noqa: PLW1509 (the launcher has one thread)
    )


def _on_terminals(
    command: ChildCommand, before_the_program: Callable[[], None], pass_fds: tuple[int, ...]
) -> subprocess.Popen[bytes]:
    """Start the command with pseudo-terminals for output and errors.

    Raises:
        OSError: if the command cannot be started.
    """
    with output_pairs(os.openpty) as ((out, its_out), (err, its_err)):
        for fd in (out, err):
            fcntl.ioctl(fd, termios.TIOCSWINSZ, struct.pack("HHHH", *TERMINAL_SIZE, 0, 0))
        popen = subprocess.Popen(
            command.argv,
            cwd=command.folder,
            env=command.env,
            stdin=subprocess.DEVNULL,
            stdout=its_out,
            stderr=its_err,
            pass_fds=pass_fds,
            start_new_session=True,
            preexec_fn=before_the_program,  # noqa: PLW1509 (the launcher has one thread)
        )
    popen.stdout, popen.stderr = os.fdopen(out, "rb", 0), os.fdopen(err, "rb", 0)
    return popen


@contextlib.contextmanager
def output_pairs(
    open_pair: Callable[[], tuple[int, int]],
) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Open a pair of descriptors for a child's output and another pair for its errors.

    In each pair the launcher's end is first. After the block, the child's ends are closed. If the
    block failed, the launcher's ends are closed, too.

    Raises:
        OSError: if a pair cannot be opened. An already open pair is closed.
    """
    with contextlib.ExitStack() as child_ends, contextlib.ExitStack() as launcher_ends:

        def opened() -> tuple[int, int]:
            launcher_end, child_end = open_pair()
            launcher_ends.callback(os.close, launcher_end)
            child_ends.callback(os.close, child_end)
            return launcher_end, child_end

        yield opened(), opened()
        launcher_ends.pop_all()


def has_ended(pid: int) -> bool:
    """Return whether the child has ended.

    The child stays a zombie, so that the kernel does not reuse its group id.
    """
    return os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None


def kill_group(pid: int, number: int) -> None:
    """Send the signal to the child and its group."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(pid, number)


@contextlib.contextmanager
def subreaper() -> Iterator[None]:
    """Adopt orphaned descendants, instead of init, during the block."""
    _LIBC.prctl(_PR_SET_CHILD_SUBREAPER, 1)
    try:
        yield
    finally:
        _LIBC.prctl(_PR_SET_CHILD_SUBREAPER, 0)


def end_with(parent: int, number: signal.Signals) -> None:
    """Have the kernel send this process the signal when its parent dies.

    If the parent is already dead, send the signal at once.
    """
    _LIBC.prctl(_PR_SET_PDEATHSIG, number)
    if os.getppid() != parent:
        os.kill(os.getpid(), number)


def reap_adopted(pids: Collection[int]) -> None:
    """Reap ended children that are not in ``pids``: orphans that this process has adopted."""
    with contextlib.suppress(ChildProcessError):
        while ended := os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT):
            if ended.si_pid in pids:
                return
            os.waitpid(ended.si_pid, 0)
