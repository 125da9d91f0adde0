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
    from tfcompose.model.messages import GuardOrder, Notice, Stream
    from tfcompose.model.plan import PlanProcess

#: Maximum length of a line's beginning that is compared with a gate's pattern, in characters.
LONGEST_MATCHED = 4000
#: Time limit of one comparison in the launcher, in seconds.
MATCHED_WITHIN_S = 0.1
#: The guard's lines hold findings with notes, so they may be longer than a log's; bytes.
EVENT_LIMIT = 1024 * 1024
#: Processes that are held have this long to leave ROS before they are killed, in seconds.
LEAVE_S = 0.5
_LEAVE_CHECK_S = 0.005


class Children:
    """The running processes.

    ``happened`` receives their events and ``notify`` their output. ``writer`` maps a process and
    one of its lines to the process that wrote it: a container also writes the lines of its
    components. With a run id, this process also reaps and ends the orphans that they leave behind.
    ``forker`` forks the commands that it can; all others are executed.
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
        """Start the process, with pipes if it is a guard; return the resulting event."""
        if process.name in self._held:
            return self._let_go(process.name)
        try:
            if command.missing:
                return StartFailed(process.name, command.missing)
            if (
                process.name in self._ran and self._run_id
            ):  # nobody wants two of what it left behind
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
        """Let one of tfcompose's own processes join ROS; it publishes once it is started.

        If that fails, its start says why.
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
        """End the held processes, which will not be started, or not in this way.

        Each leaves ROS when its pipe closes. A killed process stays in the node lists of others
        until its DDS lease expires.
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
        """Send the signal to the child's group, if it runs."""
        if name in self._children:
            self._left.add(name)
            kill_group(self._children[name].popen.pid, number)

    def order(self, order: GuardOrder) -> None:
        """Send the guard an order, if it runs."""
        if self._guard_pipes:
            self._guard_pipes.order(order)

    def last_lines(self, name: str) -> tuple[str, ...]:
        """Return the last lines of the process's output; none if it does not run."""
        return self._children[name].last_lines if name in self._children else ()

    def reap(self) -> None:
        """Reap the children that have ended."""
        for child in [child for child in self._children.values() if has_ended(child.popen.pid)]:
            # The guard's end dismisses those that are held, so that one of these may be gone by
            # now.
            if child.name not in self._held and self._children.get(child.name) is child:
                self._take_leavings(child)
        if self._run_id:
            reap_adopted(self._groups() | {self._reaper.pid})

    def find_strays(self) -> None:
        """Record the groups of this process's descendants, and pass them to the reaper."""
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
        """Kill the remaining children: some remain only if an error in the launcher ends it."""
        self.dismiss()
        for child in self._children.values():
            self._end(child)
        self._children.clear()
        self._close_guard_pipes()
        if self._run_id:
            marked = leftovers(self._run_id)
            others = self._descendants().keys() - {child.pid for child in marked}
            end(marked + leftovers_of(others, self._run_id), 1.0)
        self._strays.clear()
        self._update_reaper()
        self._reaper.close()

    # A process's life.

    def _let_go(self, name: str) -> Event:
        with io.FileIO(self._held.pop(name), "wb") as hold, contextlib.suppress(BrokenPipeError):
            hold.write(GO)  # one that has ended meanwhile is seen to have ended
        return Started(name, self._children[name].popen.pid)

    def _end(self, child: Child) -> None:
        kill_group(child.popen.pid, signal.SIGKILL)
        child.popen.wait()
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
        marked = replace(command, env=command.env | more)
        passed = guard.theirs if guard else pass_fds
        popen: Running
        if self._forker and self._forker.can_start(marked):
            popen = self._forker.start(marked, passed)
        else:
            popen = spawn(marked, passed)
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
        """Collect what an ended process leaves: the rest of its group, last output, exit code."""
        kill_group(child.popen.pid, signal.SIGKILL)
        for pipe in list(child.pipes):
            self._drain(child, pipe)
        returncode = child.popen.wait()
        del self._children[child.name]
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
        """Return the groups of the children; each child leads its own."""
        return {child.popen.pid for child in self._children.values()}

    def _descendants(self) -> dict[int, int]:
        return descendants(os.getpid(), but=self._reaper.pid)


def _matcher(pattern: str) -> Callable[[str], bool]:
    """Return a function that tells whether a line contains the pattern.

    It raises TimeoutError if the match takes too long: ``(a|aa)+$`` takes time exponential in the
    length of the line, and ``re`` cannot be interrupted.
    """
    compiled = regex.compile(pattern)
    return lambda line: compiled.search(line, timeout=MATCHED_WITHIN_S) is not None


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: {error.filename}" if error.filename else error.strerror
    return str(error)


class GuardPipes:
    """The launcher's ends of the guard's pipes, for its events and for orders to it.

    ``theirs`` are the guard's ends. The launcher closes its copies once the guard has started.
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
        """Send the guard an order; drop it if the guard does not read."""
        with contextlib.suppress(OSError):
            os.write(self._orders, line_of(order))

    def close(self) -> None:
        """Close the end for orders; the reader of events closes the other."""
        os.close(self._orders)


#: Script of the reaper: it reads process groups until the launcher is gone.
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
    """Ignore the ending signals from the start; the shell's children inherit that."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


class Reaper:
    """Ends a run whose launcher was killed: a shell that outlives the launcher briefly.

    It kills the groups last passed to ``watch``, those of all the launcher's descendants. Then it
    kills every process with the run id in its environment, to catch those that left their groups
    since.
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
        """Its process id."""
        return self._shell.pid

    @property
    def returncode(self) -> int | None:
        """Its exit code; None while it runs."""
        return self._shell.poll()

    @property
    def ended(self) -> bool:
        """Whether something else killed it."""
        return self.returncode is not None

    def watch(self, groups: Iterable[int]) -> None:
        """Set the groups to kill."""
        watched = " ".join(map(str, sorted(groups)))
        if self._shell.stdin and watched != self._watched:
            self._watched = watched
            with contextlib.suppress(BrokenPipeError):
                self._shell.stdin.write(f"{watched}\n".encode())

    def close(self) -> None:
        """Let it end; it kills the groups it was last given."""
        if self._shell.stdin:
            if not self._watched:
                with contextlib.suppress(BrokenPipeError):
                    self._shell.stdin.write(b"end\n")
            self._shell.stdin.close()
        self._shell.wait()
