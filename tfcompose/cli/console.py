"""What ``up`` prints: each process's log behind its name, and what the launcher has to say between."""

from __future__ import annotations

from functools import singledispatchmethod
from typing import TYPE_CHECKING, Protocol

from tfcompose.cli.printable import coloured_only, head_of, plain, width_of
from tfcompose.cli.start_table import table_of
from tfcompose.cli.terminal import line_of
from tfcompose.ipc import (
    AllReady,
    AllStarted,
    Ended,
    FindingShown,
    LogLine,
    OwnerLive,
    ProcessReady,
    ProcessState,
    RecoveredShown,
    Replanned,
    Stopping,
    TreeComplete,
    Waiting,
)
from tfcompose.render.text import BOLD, GREEN, PLAIN, RED, YELLOW, render_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.cli.status import Status
    from tfcompose.ipc import Notice
    from tfcompose.plan import Plan

#: Colours that are told apart on dark and light terminals; a process keeps its own by its place in the plan.
COLOURS = tuple(f"\033[{code}m" for code in (36, 35, 34, 32, 33, 96, 95, 94))
OURS = "tfcompose"
NAMED_AT_MOST = 4
#: States that need no line of their own: the edges say more.
QUIET = frozenset({"STARTING", "STOPPED"})


def _counted(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"


class Output(Protocol):
    """Where lines go; ``log`` says that a process wrote it."""

    def write(self, text: str, *, log: bool = False) -> None:
        """Write the text.

        Raises:
            OSError: if nobody reads any more.
        """


class Console:
    """Writes notices as lines: ``name | text``, coloured on a terminal.

    ``keep`` is given each line without colours, and what it returns is said; ``status`` is kept below the lines.
    """

    def __init__(
        self,
        plan: Plan,
        output: Output,
        *,
        colour: bool,
        keep: Callable[[str, str], str | None] | None = None,
        status: Status | None = None,
    ) -> None:
        names = [process.name for process in plan.processes]
        self._output = output
        self._keep = keep
        self._status = status
        self._colour = colour
        self._width = width_of([*names, OURS])
        self._colours = {name: COLOURS[index % len(COLOURS)] for index, name in enumerate(names)}
        self._nodes = {process.name: process.nodes for process in plan.processes}
        self._hosts = {process.name: f"host {process.host}" for process in plan.processes if process.host}

    def __call__(self, notice: Notice) -> None:
        """Write what a notice says, at once.

        Raises:
            OSError: if nobody reads any more.
        """
        if self._status:
            self._status.take(notice)
        self._write(notice)
        self.refresh()

    def refresh(self) -> None:
        """Bring the line below the lines up to date.

        Raises:
            OSError: if nobody reads any more.
        """
        text = self._status.drawn() if self._status else ""
        if text:
            self._output.write(text, log=True)

    @singledispatchmethod
    def _write(self, notice: object) -> None:
        raise TypeError(f"no line for {notice!r}")

    @_write.register
    def _(self, notice: LogLine) -> None:
        self._line(notice.process, notice.text, self._colours.get(notice.process, ""), log=True)

    @_write.register
    def _(self, notice: ProcessState) -> None:
        if notice.state in QUIET:
            return
        text = f"{notice.process}: {notice.state.lower()}"
        if notice.state == "RUNNING":
            text = f"started {notice.process} (pid {notice.pid})"
        elif notice.state == "EXPECTED":
            nodes = ", ".join(self._nodes.get(notice.process, ()))
            who = self._hosts.get(notice.process, "somebody else")
            text = f"expecting {notice.process} ({nodes}): {who} starts it"
        elif notice.detail:
            text += f": {notice.detail}"
        self._say(text)

    @_write.register
    def _(self, notice: OwnerLive) -> None:
        edges = _counted(len(notice.edges), "edge") if len(notice.edges) > NAMED_AT_MOST else ", ".join(notice.edges)
        owner = f"{notice.owner} ({notice.node})"
        self._say(f"{self._paint('live', GREEN)}  {owner}: {edges}  {notice.seconds:.2f} s")

    @_write.register
    def _(self, notice: ProcessReady) -> None:
        self._say(f"{self._paint('ready', GREEN)} {notice.process}: {notice.seen}  {notice.seconds:.2f} s")

    @_write.register
    def _(self, notice: AllStarted) -> None:
        if notice.waiting:
            self._say(f"not started yet: {', '.join(notice.waiting)}")

    @_write.register
    def _(self, notice: AllReady) -> None:
        if len(notice.rows) > 1:
            for line in table_of(notice):
                self._say(line)
        if notice.without:
            self._say(self._paint(f"without {', '.join(notice.without)}: failed, and not required", YELLOW))

    @_write.register
    def _(self, notice: Replanned) -> None:
        parts = (("changed", notice.changed), ("new", notice.added), ("gone", notice.removed))
        said = "; ".join(f"{word}: {', '.join(names)}" for word, names in parts if names)
        self._say(f"another plan: {said or 'nothing to restart'}")
        if notice.held:
            self._say(self._paint(held(notice.held), YELLOW))

    @_write.register
    def _(self, notice: TreeComplete) -> None:
        edges = _counted(notice.edges, "edge")
        self._say(self._paint(f"tree complete: {edges} live after {notice.seconds:.2f} s", GREEN, BOLD))

    @_write.register
    def _(self, notice: Waiting) -> None:
        for one in notice.missing:
            named = ", ".join(one.edges[:NAMED_AT_MOST])
            more = f" and {len(one.edges) - NAMED_AT_MOST} more" if len(one.edges) > NAMED_AT_MOST else ""
            self._say(self._paint(f"waiting for {one.owner} ({one.node}): {named}{more}", YELLOW))

    @_write.register
    def _(self, notice: FindingShown) -> None:
        for line in render_text([notice.found], line_of, colour=self._colour).splitlines():
            self._say(line)

    @_write.register
    def _(self, notice: RecoveredShown) -> None:
        self._say(f"{self._paint('over', GREEN)}  {notice.text}")

    @_write.register
    def _(self, notice: Stopping) -> None:
        self._say(f"stopping: {notice.reason}")

    @_write.register
    def _(self, notice: Ended) -> None:
        if notice.exit_code == 0:
            self._say("ended")
            return
        first, *rest = notice.because or ("",)
        for line in rest:
            self._say(f"   {line}")
        self._say(self._paint(f"ended with exit code {notice.exit_code}{f': {first}' if first else ''}", RED))

    def _say(self, text: str) -> None:
        self._line(OURS, text, BOLD)

    def _line(self, name: str, text: str, colour: str, *, log: bool = False) -> None:
        fault = self._keep(name, plain(text)) if self._keep else None
        clear = self._status.cleared() if self._status else ""
        shown = coloured_only(text) if self._colour else plain(text)
        self._output.write(f"{clear}{self._paint(head_of(name, self._width), colour)} {shown}\n", log=log)
        if fault:
            head = self._paint(head_of(OURS, self._width), BOLD)
            self._output.write(f"{head} {self._paint(fault, YELLOW)}\n")

    def _paint(self, text: str, *codes: str) -> str:
        return f"{''.join(codes)}{text}{PLAIN}" if self._colour else text


def held(edges: tuple[str, ...]) -> str:
    """Return what is to be said of fixed edges that vanished."""
    named = ", ".join(edges[:NAMED_AT_MOST])
    more = f" and {len(edges) - NAMED_AT_MOST} more" if len(edges) > NAMED_AT_MOST else ""
    return f"listeners that run keep {named}{more}: tf2 forgets no fixed frame; restart RViz and whoever looks them up"
