"""The launcher's children: start, output, guard pipes and reaping."""

from __future__ import annotations

import contextlib
import io
import os
import signal
import subprocess
import time
from dataclasses import replace
from selectors import EVENT_READ
from typing import TYPE_CHECKING, Any

import msgspec
import regex

from tfcompose.foundation.signals import SIGNALS
from tfcompose.launcher.child import (
    LAST_LINE_LENGTH,
    Child,
    Pipe,
    has_ended,
    kill_group,
    reap_adopted,
    spawn,
)
from tfcompose.launcher.events import Exited, LogMatched, Started, StartFailed
from tfcompose.launcher.leftovers import (
    descendants,
    end,
    launcher_mark,
    leftovers,
    leftovers_of,
    signal_leftovers,
)
from tfcompose.model.messages import GUARD_EVENTS, UNREADABLE, LogLine, line_of
from tfcompose.model.variables import (
    EVENTS_FD,
    GO,
    HOLD_FD,
    JOINS,
    LAUNCHER,
    MEMORY_FD,
    ORDERS_FD,
    PROCESS,
    RUN_ID,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from selectors import BaseSelector

    from tfcompose.launcher.child import ChildCommand, Running
    from tfcompose.launcher.events import Event
    from tfcompose.launcher.forking import Forker
    from tfcompose.model.messages import GuardOrder, Notice, Reread, Stream
    from tfcompose.model.plan import PlanProcess

#: Number of characters of a line that are matched against a log pattern.
LONGEST_MATCHED = 4000
#: Time limit of a match, in seconds.
MATCHED_WITHIN_S = 0.1
#: Maximum length of a guard's line, in bytes. It may contain findings with notes, so it may be
#: longer than a log line.
EVENT_LIMIT = 1024 * 1024
#: Time for held processes to leave ROS before they are killed, in seconds.
LEAVE_S = 0.5
_LEAVE_CHECK_S = 0.005


class Children:
    """The running processes.

    ``happened`` receives their events, and ``notify`` their output. ``writer`` maps a process and
    a line of its output to the process that wrote the line, because a container also writes the
    lines of its components. If there is a run id, this class also ends and reaps orphans of the
    processes. ``forker`` forks the commands that it can. All other commands are executed.
    """

    def __init__(  # noqa: PLR0913, PLR0917 (made in one place)
        self,
        selector: BaseSelector,
        run_id: str,
        happened: Callable[[Event], None],
        notify: Callable[[Notice], None],
        writer: Callable[[str, str], str],
        forker: Forker | None = None,
    ) -> None:
        self._forker = forker
        self._writer = writer
        self._selector = selector
        self._run_id = run_id
        self._happened = happened
        self._notify = notify
        self._children: dict[str, Child] = {}
        self._held: dict[str, int] = {}
        #: The launcher's ends of the pipes for orders to ``static``.
        self._orders: dict[str, int] = {}
        self._guard = ""
        self._guard_pipes: GuardPipes | None = None
        self._marks = {RUN_ID: run_id, LAUNCHER: launcher_mark()} if run_id else {}
        self._reaper = Reaper(run_id)
        self._strays: set[int] = set()
        self._ran: set[str] = set()
        self._left: set[str] = set()

    def start(
        self, process: PlanProcess, command: ChildCommand, guard: GuardPipes | None = None
    ) -> Event:
        """Start the process and return the resulting event; ``guard`` has the pipes of a guard."""
        if process.name in self._held:
            return self._let_go(process.name)
        try:
            if command.missing:
                return StartFailed(process.name, command.missing)
            if (
                process.name in self._ran and self._run_id
            ):  # leftovers of its previous run would run twice
                signal_leftovers(self._run_id, {process.name}, signal.SIGKILL)
            self._left.discard(process.name)
            child = self._spawn(process, command, guard)
        except (OSError, subprocess.SubprocessError, ValueError) as error:
            if guard:
                guard.events.close()
                guard.close()
            return StartFailed(process.name, _reason(error))
        finally:
            if guard:
                guard.close_guard_ends()
        if guard:
            self._guard, self._guard_pipes = process.name, guard
            self._watch(
                child,
                Pipe(guard.events, lambda line: self._guard_line(process.name, line), EVENT_LIMIT),
            )
        return Started(process.name, child.popen.pid)

    def prepare(self, process: PlanProcess, command: ChildCommand) -> None:
        """Let a process of tfcompose join ROS early. It publishes only after ``start``.

        If this fails, ``start`` reports the reason.
        """
        try:
            theirs, ours = os.pipe()
        except OSError:
            return
        try:
            self._spawn(
                process,
                replace(command, env=command.env | {HOLD_FD: str(theirs)}),
                None,
                (theirs,),
            )
            self._held[process.name] = ours
        except (OSError, subprocess.SubprocessError, ValueError):
            os.close(ours)
        finally:
            os.close(theirs)

    def dismiss(self) -> None:
        """End the held processes, which will not start or will start differently.

        Each process leaves ROS when its pipe closes. If it were killed instead, other nodes would
        list its node until its DDS lease expires.
        """
        dismissed = [self._children.pop(name) for name in self._held]
        while self._held:
            os.close(self._held.popitem()[1])
        deadline = time.monotonic() + LEAVE_S
        while time.monotonic() < deadline and not all(
            has_ended(child.popen.pid) for child in dismissed
        ):
            time.sleep(_LEAVE_CHECK_S)
        for child in dismissed:
            self._end(child)
        if dismissed:
            self._update_reaper()

    def kill(self, name: str, number: int) -> None:
        """Send the signal to the child's group, if the child runs."""
        if name in self._children:
            self._left.add(name)
            kill_group(self._children[name].popen.pid, number)

    def order(self, order: GuardOrder) -> None:
        """Send an order to the guard, if the guard runs."""
        if self._guard_pipes:
            self._guard_pipes.order(order)

    def order_process(self, name: str, order: Reread) -> None:
        """Send an order to a process of kind ``static``, if it runs."""
        if name in self._orders:
            with contextlib.suppress(OSError):
                os.write(self._orders[name], line_of(order))

    def last_lines(self, name: str) -> tuple[str, ...]:
        """Return the last lines of the process's output; empty if the process does not run."""
        return self._children[name].last_lines if name in self._children else ()

    def reap(self) -> None:
        """Reap children that have ended."""
        for child in [child for child in self._children.values() if has_ended(child.popen.pid)]:
            # The guard's end dismisses held processes, so this process may already be gone.
            if child.name not in self._held and self._children.get(child.name) is child:
                self._take_leavings(child)
        if self._run_id:
            reap_adopted(self._groups() | {self._reaper.pid})

    def find_strays(self) -> None:
        """Record the groups of this process's descendants, and pass the groups to the reaper."""
        if not self._run_id:
            return
        if self._reaper.ended:
            self._reaper = Reaper(self._run_id)
        self._strays = set(self._descendants().values())
        if ended := self._left.difference(self._children):
            self._left -= ended
            if self._strays - self._groups():
                signal_leftovers(self._run_id, ended, signal.SIGTERM)
        self._update_reaper()

    def close(self) -> None:
        """Kill the remaining children. Children remain only after an error in the launcher."""
        self.dismiss()
        for child in self._children.values():
            self._end(child)
        self._children.clear()
        self._close_guard_pipes()
        if self._run_id:
            marked = leftovers(self._run_id)
            unmarked = self._descendants().keys() - {child.pid for child in marked}
            end(marked + leftovers_of(unmarked, self._run_id), 1.0)
        self._strays.clear()
        self._update_reaper()
        self._reaper.close()

    # Lifecycle of a process.

    def _let_go(self, name: str) -> Event:
        with io.FileIO(self._held.pop(name), "wb") as hold, contextlib.suppress(BrokenPipeError):
            hold.write(GO)  # if it has ended, ``reap`` detects that
        return Started(name, self._children[name].popen.pid)

    def _end(self, child: Child) -> None:
        kill_group(child.popen.pid, signal.SIGKILL)
        child.popen.wait()
        self._close_orders(child.name)
        for pipe in child.pipes:
            self._selector.unregister(pipe.file)
            pipe.file.close()

    def _spawn(
        self,
        process: PlanProcess,
        command: ChildCommand,
        guard: GuardPipes | None,
        pass_fds: tuple[int, ...] = (),
    ) -> Child:
        more = (
            (guard.env if guard else {})
            | self._marks
            | ({PROCESS: process.name} if self._run_id else {})
        )
        self._ran.add(process.name)
        if command.fence:
            command.fence[0].parent.mkdir(exist_ok=True)
            command.fence[0].write_text(command.fence[1], encoding="utf-8")
        passed = guard.theirs if guard else pass_fds
        with contextlib.ExitStack() as started, contextlib.ExitStack() as failed:
            if process.kind == "static":
                theirs = self._open_orders(process.name)
                started.callback(os.close, theirs)
                failed.callback(self._close_orders, process.name)
                passed, more = (*passed, theirs), more | {ORDERS_FD: str(theirs)}
            popen = self._start_program(replace(command, env=command.env | more), passed)
            failed.pop_all()
        child = Child(process.name, popen)
        self._children[process.name] = child
        self._update_reaper()
        gate = process.ready.text if process.ready and process.ready.kind == "log" else None
        if popen.stdout and popen.stderr:
            self._watch(
                child, Pipe(popen.stdout, self._logger(child, "stdout", gate), bucket=child.bucket)
            )
            self._watch(
                child, Pipe(popen.stderr, self._logger(child, "stderr", gate), bucket=child.bucket)
            )
        return child

    def _start_program(self, command: ChildCommand, passed: tuple[int, ...]) -> Running:
        if self._forker and self._forker.can_start(command):
            return self._forker.start(command, passed)
        return spawn(command, passed)

    def _open_orders(self, name: str) -> int:
        """Open the pipe for orders to a process, and return its end.

        Raises:
            OSError: if it cannot be opened.
        """
        theirs, ours = os.pipe()
        os.set_blocking(ours, False)
        self._close_orders(name)
        self._orders[name] = ours
        return theirs

    def _close_orders(self, name: str) -> None:
        if name in self._orders:
            os.close(self._orders.pop(name))

    def _watch(self, child: Child, pipe: Pipe) -> None:
        child.pipes.append(pipe)
        self._selector.register(pipe.file, EVENT_READ, lambda: self._read(child, pipe))

    def _read(self, child: Child, pipe: Pipe) -> None:
        if pipe.read() == 0:
            self._drain(child, pipe)

    def _drain(self, child: Child, pipe: Pipe) -> None:
        child.pipes.remove(pipe)
        self._selector.unregister(pipe.file)
        pipe.drain()

    def _logger(self, child: Child, stream: Stream, gate: str | None) -> Callable[[str], None]:
        last = child.last_err if stream == "stderr" else child.last_out
        matches = _matcher(gate) if gate is not None else None

        def log(text: str) -> None:
            nonlocal matches
            last.append(text[:LAST_LINE_LENGTH])
            self._notify(LogLine(self._writer(child.name, text), stream, text))
            if matches is None or child.gate_matched:
                return
            try:
                child.gate_matched = matches(text[:LONGEST_MATCHED])
            except TimeoutError:
                matches = None
                self._notify(
                    LogLine(
                        child.name,
                        "stderr",
                        f"ready: log: matching {gate!r} takes too long on this line; gave up",
                    )
                )
            if child.gate_matched:
                self._happened(LogMatched(child.name, text[:LAST_LINE_LENGTH]))

        return log

    def _guard_line(self, name: str, line: str) -> None:
        try:
            event = GUARD_EVENTS.decode(line)
        except UNREADABLE:
            self._notify(LogLine(name, "stderr", f"not an event: {line}"))
        else:
            self._happened(event)

    def _take_leavings(self, child: Child) -> None:
        """Handle an ended process.

        Kill the rest of its group, read its last output and exit code.
        """
        kill_group(child.popen.pid, signal.SIGKILL)
        for pipe in list(child.pipes):
            self._drain(child, pipe)
        returncode = child.popen.wait()
        del self._children[child.name]
        self._close_orders(child.name)
        if child.name == self._guard:
            self._close_guard_pipes()
        self._update_reaper()
        self._happened(Exited(child.name, returncode, child.last_lines))

    def _close_guard_pipes(self) -> None:
        if self._guard_pipes:
            self._guard_pipes.close()
            self._guard_pipes = None

    def _update_reaper(self) -> None:
        self._reaper.watch(self._groups() | self._strays)

    def _groups(self) -> set[int]:
        """Return the process groups of the children. Each child leads its own group."""
        return {child.popen.pid for child in self._children.values()}

    def _descendants(self) -> dict[int, int]:
        return descendants(os.getpid(), but=self._reaper.pid)


def _matcher(pattern: str) -> Callable[[str], bool]:
    """Return a function that returns whether a line contains the pattern.

    The function raises TimeoutError if the match takes too long. For example, ``(a|aa)+$`` takes
    time exponential in the length of the line. Unlike ``re``, the library ``regex`` has a time
    limit.
    """
    compiled = regex.compile(pattern)
    return lambda line: compiled.search(line, timeout=MATCHED_WITHIN_S) is not None


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: {error.filename}" if error.filename else error.strerror
    return str(error)


class GuardPipes:
    """The launcher's ends of the guard's pipes: for events from the guard and orders to it.

    ``theirs`` are the guard's ends. The launcher closes its copies after the guard has started.
    """

    def __init__(self, *, joins: bool, memory: dict[str, Any]) -> None:
        """Open the pipes.

        Raises:
            OSError: if they cannot be opened.
        """
        with contextlib.ExitStack() as opened:

            def kept(fd: int) -> int:
                opened.callback(os.close, fd)
                return fd

            read_fd, write_fd = map(kept, os.pipe())
            orders_fd, self._orders = map(kept, os.pipe())
            os.set_blocking(self._orders, False)
            self.theirs: tuple[int, ...] = (write_fd, orders_fd)
            self.env = {EVENTS_FD: str(write_fd), ORDERS_FD: str(orders_fd)} | (
                {JOINS: "1"} if joins else {}
            )
            if memory:
                memory_fd = kept(os.memfd_create("tfcompose-guard-memory"))
                with open(memory_fd, "wb", closefd=False) as file:
                    file.write(msgspec.json.encode(memory))
                os.lseek(memory_fd, 0, os.SEEK_SET)
                self.theirs += (memory_fd,)
                self.env[MEMORY_FD] = str(memory_fd)
            self.events = io.FileIO(read_fd)
            opened.pop_all()

    def close_guard_ends(self) -> None:
        """Close the guard's ends."""
        for fd in self.theirs:
            os.close(fd)

    def order(self, order: GuardOrder) -> None:
        """Send an order to the guard. Drop the order if the guard does not read."""
        with contextlib.suppress(OSError):
            os.write(self._orders, line_of(order))

    def close(self) -> None:
        """Close the pipe for orders. The reader of events closes the other pipe."""
        os.close(self._orders)


#: Shell script of the reaper. It reads process groups until the launcher is gone.
_SCRIPT = """
groups='' last=''
while read -r line; do groups=$line; last=$line; done
for g in $groups; do [ "$g" = end ] || kill -9 -$g; done
[ -n "$1" ] && [ "$last" != end ] || exit 0
for e in /proc/[0-9]*/environ; do
    pid=${e#/proc/}; pid=${pid%/environ}
    [ "$pid" = $$ ] || ! grep -qaF "$1" "$e" || kill -9 "$pid"
done
"""


def _ignore_signals() -> None:
    """Ignore the ending signals. Children of the shell inherit this."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


class Reaper:
    """Ends a run whose launcher was killed: a shell process that briefly outlives the launcher.

    It kills the groups that ``watch`` last set, which are the groups of all the launcher's
    descendants. Then it kills every process with the run id in its environment, because a process
    may have left its group since then.
    """

    def __init__(self, run_id: str = "") -> None:
        self._shell = subprocess.Popen(
            ["/bin/sh", "-c", _SCRIPT, "sh", f"{RUN_ID}={run_id}" if run_id else ""],
            bufsize=0,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            preexec_fn=_ignore_signals,  # noqa: PLW1509 (the launcher has one thread)
        )
        self._watched = ""

    @property
    def pid(self) -> int:
        """The process id of the shell."""
        return self._shell.pid

    @property
    def returncode(self) -> int | None:
        """The shell's exit code, None while it runs."""
        return self._shell.poll()

    @property
    def ended(self) -> bool:
        """Whether another process killed the shell."""
        return self.returncode is not None

    def watch(self, groups: Iterable[int]) -> None:
        """Set the process groups to kill."""
        watched = " ".join(map(str, sorted(groups)))
        if self._shell.stdin and watched != self._watched:
            self._watched = watched
            with contextlib.suppress(BrokenPipeError):
                self._shell.stdin.write(f"{watched}\n".encode())

    def close(self) -> None:
        """End the shell. It kills the groups that were last set."""
        if self._shell.stdin:
            if not self._watched:
                with contextlib.suppress(BrokenPipeError):
                    self._shell.stdin.write(b"end\n")
            self._shell.stdin.close()
        self._shell.wait()
