"""The launcher's children: started, heard, and taken leave of, with all that belongs to them."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
from dataclasses import replace
from io import FileIO
from selectors import EVENT_READ
from typing import TYPE_CHECKING

from tfcompose.ipc import GO, GUARD_EVENTS, HOLD_FD, LAUNCHER, PROCESS, RUN_ID, LogLine
from tfcompose.run.launcher.child import LAST_LINE_LENGTH, Child, Pipe, bury_adopted, has_ended, kill_group, spawn
from tfcompose.run.launcher.happening import Exited, LogSeen, Started, StartFailed
from tfcompose.run.launcher.keeper import Keeper
from tfcompose.run.launcher.leftovers import end as end_leftovers
from tfcompose.run.launcher.leftovers import launcher_mark, leftovers, tell, these
from tfcompose.run.launcher.processes import descendants

if TYPE_CHECKING:
    from collections.abc import Callable
    from selectors import BaseSelector

    from tfcompose.ipc import GuardOrder, Notice, Stream
    from tfcompose.plan import PlanProcess
    from tfcompose.run.launcher.command import Command
    from tfcompose.run.launcher.guard_pipes import GuardPipes
    from tfcompose.run.launcher.happening import Event

#: So much of a line is compared with what a gate waits for, in characters.
LONGEST_MATCHED = 4000
#: The guard's lines hold findings with notes, so they may be longer than a log's; bytes.
EVENT_LIMIT = 1024 * 1024


class Children:
    """The processes that run. ``happened`` is given what becomes of them, ``tell`` what they say.

    With a run's id, what they leave behind is this process's to bury and to end.
    """

    def __init__(
        self, selector: BaseSelector, run_id: str, happened: Callable[[Event], None], tell: Callable[[Notice], None]
    ) -> None:
        self._selector = selector
        self._run_id = run_id
        self._happened = happened
        self._tell = tell
        self._children: dict[str, Child] = {}
        self._held: dict[str, int] = {}
        self._guard = ""
        self._guard_pipes: GuardPipes | None = None
        self._marks = {RUN_ID: run_id, LAUNCHER: launcher_mark()} if run_id else {}
        self._keeper = Keeper(run_id)
        self._strays: set[int] = set()
        self._ran: set[str] = set()
        self._left: set[str] = set()

    def start(self, process: PlanProcess, command: Command, guard: GuardPipes | None = None) -> Event:
        """Start the process, with the pipes of a guard if it is one, and return what came of it."""
        if process.name in self._held:
            return self._let_go(process.name)
        try:
            if command.missing:
                return StartFailed(process.name, command.missing)
            if process.name in self._ran and self._run_id:  # nobody wants two of what it left behind
                tell(self._run_id, {process.name}, signal.SIGKILL)
            self._left.discard(process.name)
            child = self._spawn(process, command, guard)
        except (OSError, subprocess.SubprocessError, ValueError) as error:
            if guard:
                guard.events.close()
                guard.close()
            return StartFailed(process.name, _reason(error))
        finally:
            if guard:
                guard.handed_over()
        if guard:
            self._guard, self._guard_pipes = process.name, guard
            self._watch(child, Pipe(guard.events, lambda line: self._guard_said(process.name, line), EVENT_LIMIT))
        return Started(process.name, child.popen.pid)

    def prepare(self, process: PlanProcess, command: Command) -> None:
        """Have one of tfcompose's own load what it needs; it joins ROS when it is started, without that delay."""
        theirs, ours = os.pipe()
        try:
            self._spawn(process, replace(command, env=command.env | {HOLD_FD: str(theirs)}), None, (theirs,))
            self._held[process.name] = ours
        except (OSError, subprocess.SubprocessError, ValueError):
            os.close(ours)  # its start will say why
        finally:
            os.close(theirs)

    def dismiss(self) -> None:
        """End those that are held: they will not be started, or in another way."""
        for name in list(self._held):
            os.close(self._held.pop(name))
            child = self._children.pop(name)
            self._bury(child)
        self._keep()

    def kill(self, name: str, number: int) -> None:
        """Send the signal to the child's group, if it runs."""
        if name in self._children:
            self._left.add(name)
            kill_group(self._children[name].popen.pid, number)

    def order(self, order: GuardOrder) -> None:
        """Tell the guard, if it runs."""
        if self._guard_pipes:
            self._guard_pipes.order(order)

    def last_lines(self, name: str) -> tuple[str, ...]:
        """Return what the process said last; nothing if it does not run."""
        return self._children[name].last_lines if name in self._children else ()

    def bury(self) -> None:
        """Take leave of those that have ended."""
        for child in [child for child in self._children.values() if has_ended(child.popen.pid)]:
            if child.name not in self._held:
                self._ended(child)
        if self._run_id:
            bury_adopted(self._groups() | {self._keeper.pid})

    def look_around(self) -> None:
        """Note which groups there are of what descends from this process, and have a keeper who knows them."""
        if not self._run_id:
            return
        if self._keeper.ended:
            self._keeper = Keeper(self._run_id)
        self._strays = set(self._descendants().values())
        if told := self._left.difference(self._children):
            self._left -= told
            if self._strays - self._groups():
                tell(self._run_id, told, signal.SIGTERM)
        self._keep()

    def close(self) -> None:
        """Kill what is left: something, only if an error in the launcher itself ends it."""
        self.dismiss()
        for child in self._children.values():
            self._bury(child)
        self._children.clear()
        self._close_guard_pipes()
        if self._run_id:
            marked = leftovers(self._run_id)
            others = self._descendants().keys() - {one.pid for one in marked}
            end_leftovers(marked + these(others, self._run_id), 1.0)
        self._strays.clear()
        self._keep()
        self._keeper.close()

    # A process's life.

    def _let_go(self, name: str) -> Event:
        with FileIO(self._held.pop(name), "wb") as hold, contextlib.suppress(BrokenPipeError):
            hold.write(GO)  # one that has ended meanwhile is seen to have ended
        return Started(name, self._children[name].popen.pid)

    def _bury(self, child: Child) -> None:
        kill_group(child.popen.pid, signal.SIGKILL)
        child.popen.wait()
        for pipe in child.pipes:
            self._selector.unregister(pipe.file)
            pipe.file.close()

    def _spawn(
        self, process: PlanProcess, command: Command, guard: GuardPipes | None, pass_fds: tuple[int, ...] = ()
    ) -> Child:
        more = (guard.env if guard else {}) | self._marks | ({PROCESS: process.name} if self._run_id else {})
        self._ran.add(process.name)
        if command.fence:
            command.fence[0].parent.mkdir(exist_ok=True)
            command.fence[0].write_text(command.fence[1], encoding="utf-8")
        popen = spawn(replace(command, env=command.env | more), guard.theirs if guard else pass_fds)
        child = Child(process.name, popen)
        self._children[process.name] = child
        self._keep()
        gate = process.ready.text if process.ready and process.ready.kind == "log" else None
        if popen.stdout and popen.stderr:
            self._watch(child, Pipe(popen.stdout, self._logger(child, "stdout", gate), bucket=child.bucket))
            self._watch(child, Pipe(popen.stderr, self._logger(child, "stderr", gate), bucket=child.bucket))
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
        waited_for = re.compile(gate) if gate is not None else None

        def log(text: str) -> None:
            last.append(text[:LAST_LINE_LENGTH])
            self._tell(LogLine(child.name, stream, text))
            if waited_for and not child.gate_seen and waited_for.search(text[:LONGEST_MATCHED]):
                child.gate_seen = True
                self._happened(LogSeen(child.name, text[:LAST_LINE_LENGTH]))

        return log

    def _guard_said(self, name: str, line: str) -> None:
        try:
            event = GUARD_EVENTS.read(line)
        except (ValueError, TypeError, KeyError, AttributeError):
            self._tell(LogLine(name, "stderr", f"not an event: {line}"))
        else:
            self._happened(event)

    def _ended(self, child: Child) -> None:
        """Take what the process leaves behind: the rest of its group, its last words, and its exit code."""
        kill_group(child.popen.pid, signal.SIGKILL)
        for pipe in list(child.pipes):
            self._drain(child, pipe)
        returncode = child.popen.wait()
        del self._children[child.name]
        if child.name == self._guard:
            self._close_guard_pipes()
        self._keep()
        self._happened(Exited(child.name, returncode, child.last_lines))

    def _close_guard_pipes(self) -> None:
        if self._guard_pipes:
            self._guard_pipes.close()
            self._guard_pipes = None

    def _keep(self) -> None:
        self._keeper.keep(self._groups() | self._strays)

    def _groups(self) -> set[int]:
        """Return the groups of the children, each of which leads its own."""
        return {child.popen.pid for child in self._children.values()}

    def _descendants(self) -> dict[int, int]:
        return descendants(os.getpid(), but=self._keeper.pid)


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: {error.filename}" if error.filename else error.strerror
    return str(error)
