"""Processes that tests start.

In a session of their own, with no signal ignored, bounded, and ended with the test.
"""

import contextlib
import os
import signal
import subprocess
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.support.waiting import TIMEOUT_S, until

#: What a script that puts the tests into the background, or nohup, has them ignore; a child would
#: inherit that.
_IGNORABLE = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_started: list[subprocess.Popen[str]] = []
#: Processes of fixtures that outlive a test in which they are started.
_shared: set[int] = set()


def start(command: Sequence[str | Path], **options: Any) -> subprocess.Popen[str]:
    """Start a process like ``subprocess.Popen``, in its own session, with default signals.

    Its pipes are text, and it reads nothing unless it is given something. It is killed at the end
    of the test, with its group, if it still runs then.
    """
    options.setdefault("stdin", subprocess.DEVNULL)
    with default_signal_actions():
        process = subprocess.Popen(command, start_new_session=True, text=True, **options)
    _started.append(process)
    return process


def run(
    command: Sequence[str | Path],
    *,
    check: bool = False,
    stdin: str | None = None,
    timeout_s: float = 2 * TIMEOUT_S,
    **options: Any,
) -> subprocess.CompletedProcess[str]:
    """Run a process to its end and return its exit code and what it printed.

    It is given the text of ``stdin``, if there is one, and killed with its group if the time is
    over before.

    Raises:
        subprocess.TimeoutExpired: if it does not end in time.
        subprocess.CalledProcessError: if it is to be checked, and does not end with 0.
    """
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    if stdin is not None:
        pipes["stdin"] = subprocess.PIPE
    process = start(command, **pipes | options)
    try:
        output, errors = process.communicate(stdin, timeout_s)
    finally:
        end(process)
    done = subprocess.CompletedProcess(process.args, process.returncode, output, errors)
    if check:
        done.check_returncode()
    return done


def end(process: subprocess.Popen[str]) -> None:
    """Kill the process and its group, if they still run, and close its pipes."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait(TIMEOUT_S)
    for stream in (process.stdin, process.stdout, process.stderr):
        if stream:
            with contextlib.suppress(BrokenPipeError):
                stream.close()
    if process in _started:
        _started.remove(process)


@dataclass
class Started:
    """A process under test, its standard output and error read line by line."""

    process: subprocess.Popen[str]
    lines: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        pairs = ((self.process.stdout, self.lines), (self.process.stderr, self.errors))
        self._readers = [
            threading.Thread(target=lines.extend, args=(stream,))
            for stream, lines in pairs
            if stream
        ]
        for reader in self._readers:
            reader.start()

    @property
    def output(self) -> str:
        return "".join(self.lines)

    def until_says(self, text: str) -> None:
        """Wait until a line holds ``text``."""
        until(lambda: text in self.output or self.process.poll() is not None)
        if self.process.poll() is not None:
            self._join()  # its last lines may not have been read yet
        assert text in self.output, self.lines + self.errors

    def end(self, number: int = signal.SIGINT) -> int:
        """Send the signal; return the exit code."""
        self.process.send_signal(number)
        return self.process.wait(TIMEOUT_S)

    def close(self) -> None:
        """End the process, whatever it does, and its readers."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(TIMEOUT_S)
        self._join()
        for stream in (self.process.stdout, self.process.stderr):
            if stream:
                stream.close()

    def _join(self) -> None:
        for reader in self._readers:
            reader.join(TIMEOUT_S)


@contextlib.contextmanager
def ended_at_exit() -> Iterator[None]:
    """End what was started inside and still runs at the end."""
    before = list(_started)
    try:
        yield
    finally:
        for process in [started for started in _started if started not in before]:
            end(process)


@contextlib.contextmanager
def default_signal_actions() -> Iterator[None]:
    """Heed the signals that this process was started to ignore, as Python does.

    An interrupt is an exception.
    """
    before = {number: signal.getsignal(number) for number in _IGNORABLE}
    ignored = [number for number, handler in before.items() if handler == signal.SIG_IGN]
    for number in ignored:
        signal.signal(
            number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
        )
    try:
        yield
    finally:
        for number in ignored:
            signal.signal(number, before[number])


def share(process: subprocess.Popen[str]) -> None:
    """Let a process outlive the test that starts it: a fixture of the module ends it."""
    _shared.add(process.pid)


def children() -> set[int]:
    """Return the process ids of this process's children that have not ended.

    Without those that are shared.
    """
    pids: set[int] = set()
    for task in Path("/proc/self/task").iterdir():  # one may end meanwhile
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            pids |= set(map(int, (task / "children").read_text("ascii").split()))
    return {pid for pid in pids - _shared if command_line(pid)}


def command_line(pid: int) -> str:
    """Return the command of a process, empty where it has ended."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_text("utf-8", "replace").replace("\0", " ")
    except (FileNotFoundError, ProcessLookupError):
        return ""
