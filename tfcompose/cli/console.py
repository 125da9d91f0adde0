"""Output of ``up``: reports, a status line, and log lines after the name of their process."""

from __future__ import annotations

import sys
import time
from collections import deque
from dataclasses import replace
from functools import singledispatchmethod
from typing import TYPE_CHECKING, Protocol

from tfcompose.cli.reading import line_of
from tfcompose.cli.terminal import CLEAR_LINE, keep_colours, plain
from tfcompose.compiler.render.text import (
    BOLD,
    GREEN,
    PLAIN,
    RED,
    YELLOW,
    no_address,
    render_text,
)
from tfcompose.foundation.text import list_names, plural
from tfcompose.model.messages import (
    AllReady,
    AllStarted,
    Ended,
    FilesRestored,
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

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from tfcompose.compiler.render.text import CodeAddress
    from tfcompose.model.messages import Notice, PlanChange
    from tfcompose.model.plan import Plan

#: Colours that are readable on dark and light terminals. A process has the same colour in every
#: run, by its position in the plan.
COLOURS = tuple(f"\033[{code}m" for code in (36, 35, 34, 32, 33, 96, 95, 94))
#: The name before the launcher's own lines.
LAUNCHER = "tfcompose"
NAMED_AT_MOST = 4
#: Number of a process's last printed lines that are remembered. Findings quote fewer lines.
QUOTED_AT_MOST = 40
#: States that are not printed, because the edges are more informative.
UNREPORTED = frozenset({"starting", "stopped"})

#: Minimum time between two drawings of the status line, in seconds.
STATUS_EVERY_S = 0.2
#: Columns that stay free. The terminal prints ``^C`` there, and must not begin a new line for it.
STATUS_FREE_COLUMNS = 3
STATUS_NAMED_AT_MOST = 3


def prefix_of(name: str, width: int) -> str:
    """Return the prefix of each line of the process."""
    return f"{name:<{width}} |"


class Output(Protocol):
    """Destination of lines. ``log`` means that a process wrote the line."""

    def write(self, text: str, *, log: bool = False) -> None:
        """Write the text.

        Raises:
            OSError: if the reader is gone.
        """


class StandardOutput:
    """Standard output, unbuffered."""

    def write(self, text: str, *, log: bool = False) -> None:
        """Write the text."""
        del log
        sys.stdout.write(text)
        sys.stdout.flush()


class Nowhere:
    """Discards lines, because they are stored elsewhere."""

    def write(self, text: str, *, log: bool = False) -> None:
        """Do nothing."""


class Console:
    """Writes notices as lines: ``name | text``, coloured on a terminal.

    ``address_of`` returns the address of the page about a finding's code. ``keep`` receives each
    line without colours, and may return an error to print. ``status`` stays below the lines. The
    ``output`` of a process decides whether its lines are kept, written, or both.
    """

    def __init__(  # noqa: PLR0913 (all but two are named)
        self,
        plan: Plan,
        output: Output,
        *,
        colour: bool,
        address_of: CodeAddress = no_address,
        keep: Callable[[str, str], str | None] | None = None,
        status: StatusLine | None = None,
    ) -> None:
        names = [process.name for process in plan.processes]
        self._output = output
        self._keep = keep
        self._status = status
        self._colour = colour
        self._address_of = address_of
        self._width = max(map(len, [*names, LAUNCHER]))
        self._colours = {name: COLOURS[index % len(COLOURS)] for index, name in enumerate(names)}
        self._nodes = {process.name: process.nodes for process in plan.processes}
        self._outputs = {
            process.name: process.output for process in plan.processes if process.output != "both"
        }
        #: The last printed lines of each process, in the form of quotes in findings. Findings do
        #: not print these lines again.
        self._printed: dict[str, deque[str]] = {}
        self._hosts = {
            process.name: f"host {process.host}" for process in plan.processes if process.host
        }

    def __call__(self, notice: Notice) -> None:
        """Write all lines of a notice.

        Raises:
            OSError: if the reader is gone.
        """
        if self._status:
            self._status.take(notice)
        self._write(notice)
        self.refresh()

    def refresh(self) -> None:
        """Update the status line.

        Raises:
            OSError: if the reader is gone.
        """
        text = self._status.draw() if self._status else ""
        if text:
            self._output.write(text, log=True)

    @singledispatchmethod
    def _write(self, notice: object) -> None:
        raise TypeError(f"no line for {notice!r}")

    @_write.register
    def _(self, notice: LogLine) -> None:
        where = self._outputs.get(notice.process, "both")
        if where == "log":
            if fault := self._kept(notice.process, notice.text):
                self._complain(fault)
            return
        colour = self._colours.get(notice.process, "")
        self._line(notice.process, notice.text, colour, log=True, keep=where == "both")
        last = self._printed.setdefault(notice.process, deque(maxlen=QUOTED_AT_MOST))
        last.append(f"{notice.process}: {notice.text}")

    @_write.register
    def _(self, notice: ProcessState) -> None:
        if notice.state in UNREPORTED:
            return
        text = f"{notice.process}: {notice.state}"
        if notice.state == "running":
            text = f"started {notice.process} (pid {notice.pid})"
        elif notice.state == "expected":
            nodes = ", ".join(self._nodes.get(notice.process, ()))
            host = self._hosts.get(notice.process)
            text = (
                f"expecting {notice.process} ({nodes}):"
                f" {f'{host} starts it' if host else 'it starts elsewhere'}"
            )
        elif notice.detail:
            text += f": {notice.detail}"
        self._say(text)

    @_write.register
    def _(self, notice: OwnerLive) -> None:
        edges = (
            plural(len(notice.edges), "edge")
            if len(notice.edges) > NAMED_AT_MOST
            else ", ".join(notice.edges)
        )
        owner = f"{notice.owner} ({notice.node})"
        self._say(f"{self._paint('live', GREEN)}  {owner}: {edges}  {notice.seconds:.2f} s")

    @_write.register
    def _(self, notice: ProcessReady) -> None:
        self._say(
            f"{self._paint('ready', GREEN)} {notice.process}: {notice.seen} "
            f" {notice.seconds:.2f} s"
        )

    @_write.register
    def _(self, notice: AllStarted) -> None:
        if notice.waiting:
            self._say(f"not started yet: {', '.join(notice.waiting)}")

    @_write.register
    def _(self, notice: AllReady) -> None:
        if len(notice.rows) > 1:
            for line in _start_table(notice):
                self._say(line)
        if notice.without:
            self._say(
                self._paint(
                    f"without {', '.join(notice.without)}: failed, and not required", YELLOW
                )
            )

    @_write.register
    def _(self, notice: Replanned) -> None:
        self._width = max(self._width, *map(len, ("", *notice.added)))
        changes = describe_changes(notice, ("changed", "new", "gone", "new description", "moved"))
        self._say(f"new plan: {changes or 'nothing to restart'}")
        if notice.held:
            self._say(self._paint(describe_vanished_edges(notice.held), YELLOW))

    @_write.register
    def _(self, notice: TreeComplete) -> None:
        self._say(
            self._paint(
                f"tree complete: {plural(notice.edges, 'edge')} live after {notice.seconds:.2f} s",
                GREEN,
                BOLD,
            )
        )

    @_write.register
    def _(self, notice: Waiting) -> None:
        for owner in notice.missing:
            edges = list_names(owner.edges, NAMED_AT_MOST)
            self._say(self._paint(f"waiting for {owner.owner} ({owner.node}): {edges}", YELLOW))

    @_write.register
    def _(self, notice: FindingShown) -> None:
        notes = tuple(note for note in notice.found.notes if not self._is_printed(note.message))
        text = render_text(
            [replace(notice.found, notes=notes)],
            line_of,
            colour=self._colour,
            address_of=self._address_of,
        )
        for line in text.splitlines():
            self._line(LAUNCHER, line, BOLD, is_rendered=True)

    @_write.register
    def _(self, notice: RecoveredShown) -> None:
        self._say(f"{self._paint('over', GREEN)}  {notice.text}")

    @_write.register
    def _(self, notice: FilesRestored) -> None:
        text = f"the files of this run were removed: written to {notice.folder} again"
        if notice.why:
            text = f"the files of this run were removed and cannot be restored: {notice.why}"
        self._say(self._paint(text, YELLOW))

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
            if not self._is_printed(line):
                self._say(f"   {line}")
        self._say(
            self._paint(
                f"ended with exit code {notice.exit_code}{f': {first}' if first else ''}", RED
            )
        )

    def _is_printed(self, quoted: str) -> bool:
        """Return whether the quoted line is among the last printed lines of a process."""
        return any(quoted in lines for lines in self._printed.values())

    def _say(self, text: str) -> None:
        self._line(LAUNCHER, text, BOLD)

    def _kept(self, name: str, text: str) -> str | None:
        return self._keep(name, plain(text)) if self._keep else None

    def _line(  # noqa: PLR0913 (all but three are named)
        self,
        name: str,
        text: str,
        colour: str,
        *,
        log: bool = False,
        keep: bool = True,
        is_rendered: bool = False,
    ) -> None:
        """Write a line. In lines of other programs, keep no control sequences except colours."""
        fault = self._kept(name, text) if keep else None
        clear = self._status.clear() if self._status else ""
        printed = text
        if not is_rendered:
            printed = keep_colours(text) if self._colour else plain(text)
        self._output.write(
            f"{clear}{self._paint(prefix_of(name, self._width), colour)} {printed}\n", log=log
        )
        if fault:
            self._complain(fault)

    def _complain(self, fault: str) -> None:
        head = self._paint(prefix_of(LAUNCHER, self._width), BOLD)
        self._output.write(f"{head} {self._paint(fault, YELLOW)}\n")

    def _paint(self, text: str, *codes: str) -> str:
        return f"{''.join(codes)}{text}{PLAIN}" if self._colour else text


def describe_changes(change: PlanChange | Replanned, labels: Sequence[str]) -> str:
    """Return the processes and edges that another plan affects.

    The groups are the processes that the plan changes, adds, removes, or gives a new description,
    and the edges that it moves without a restart. ``labels`` has a label for each group, in this
    order. The text is empty if all groups are empty.
    """
    moved = (list_names(change.moved, NAMED_AT_MOST),) if change.moved else ()
    groups = (change.changed, change.added, change.removed, change.described, moved)
    return "; ".join(
        f"{label}: {', '.join(names)}"
        for label, names in zip(labels, groups, strict=True)
        if names
    )


def describe_vanished_edges(edges: tuple[str, ...]) -> str:
    """Return a warning about fixed edges that have disappeared."""
    named = list_names(edges, NAMED_AT_MOST)
    return (
        f"running listeners keep {named}: tf2 never forgets a fixed frame; restart RViz and other"
        " listeners"
    )


def _start_table(notice: AllReady) -> list[str]:
    """Return the table of start times: a line for each process, and a line with the total.

    Each line has the times of start and readiness in seconds from the start of the robot.
    """
    width = max(len(row.process) for row in notice.rows)
    lines = [f"{'process':<{max(width, 7)}}  started   ready"]
    for row in sorted(notice.rows, key=lambda row: row.ready):
        started = "      –" if row.started is None else f"{row.started:5.2f} s"
        lines.append(f"{row.process:<{max(width, 7)}}  {started}  {max(row.ready, 0.0):5.2f} s")
    return [*lines, f"all ready after {notice.seconds:.2f} s"]


class StatusLine:
    """The line below the log on a terminal: running processes, live edges and missing edges.

    The line follows from notices. ``columns`` returns the terminal's width.
    """

    def __init__(
        self, plan: Plan, columns: Callable[[], int], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._owned = {process.name: len(process.owns) for process in plan.processes}
        self._edges = len(plan.edges)
        self._columns = columns
        self._clock = clock
        self._begun = clock()
        self._states: dict[str, str] = {}
        self._live: dict[str, int] = {}
        self._findings = {"error": 0, "warning": 0}
        self._stopping = self._ready = self._ended = self._drawn = False
        self._text = ""
        self._at = 0.0

    def take(self, notice: Notice) -> None:
        """Update the counts from the notice."""
        if isinstance(notice, ProcessState):
            self._states[notice.process] = notice.state
            if notice.state not in ("running", "expected", "stopping"):
                self._live.pop(notice.process, None)
        elif isinstance(notice, OwnerLive):
            self._live[notice.owner] = len(notice.edges)
        elif isinstance(notice, FindingShown):
            self._findings[notice.found.severity] += 1
        elif isinstance(notice, (AllReady, TreeComplete)):
            self._ready = True
        elif isinstance(notice, Stopping):
            self._stopping = True
        elif isinstance(notice, Ended):
            self._ended = True

    def clear(self) -> str:
        """Return the control sequence that clears the line."""
        self._text = ""
        return CLEAR_LINE if self._drawn else ""

    def draw(self) -> str:
        """Return the control sequence that redraws the line.

        The sequence is empty if the line is unchanged, or was drawn a moment ago.
        """
        text = "" if self._ended else self._fitting(max(self._columns() - STATUS_FREE_COLUMNS, 1))
        now = self._clock()
        if text == self._text or (self._text and now - self._at < STATUS_EVERY_S):
            return ""
        before, self._text, self._at, self._drawn = self._text, text, now, True
        return f"{CLEAR_LINE}{text}" if before else text

    def _fitting(self, columns: int) -> str:
        """Return the longest version of the line that fits."""
        seconds = int(self._clock() - self._begun)
        clock = f"[{seconds // 60:02d}:{seconds % 60:02d}]"
        long, short = (
            self._parts("processes", "edges live", " of "),
            self._parts("proc", "edges", "/"),
        )
        for parts in (long, long[:-1], short, short[:-1]):
            text = f"{clock} {' · '.join(part for part in parts if part)}"
            if len(text) <= columns:
                return text
        return text if len(text) <= columns else f"{text[: columns - 1]}…"

    def _parts(self, processes: str, edges: str, of: str) -> list[str]:
        """Return findings, running processes, live edges, and missing edges."""
        wrong = [
            f"{count} {what}{'s' * (count > 1)}" for what, count in self._findings.items() if count
        ]
        running = sum(self._runs(name) for name in self._owned)
        parts = [f"{running}{of}{len(self._owned)} {processes}"]
        parts += [f"{sum(self._live.values())}{of}{self._edges} {edges}"] if self._edges else []
        return [*wrong, *parts, self._missing()]

    def _runs(self, name: str) -> bool:
        """Return whether the process runs.

        A process that another program starts counts as running when its edges are live.
        """
        state = self._states.get(name)
        return state in ("running", "stopping") or (
            state == "expected" and (not self._owned[name] or name in self._live)
        )

    def _missing(self) -> str:
        if self._stopping:
            alive = [
                name for name, state in self._states.items() if state in ("running", "stopping")
            ]
            return f"stopping {list_names(alive, STATUS_NAMED_AT_MOST)}" if alive else "stopping"
        waits = [name for name, owned in self._owned.items() if owned and name not in self._live]
        return (
            f"waiting for {list_names(waits, STATUS_NAMED_AT_MOST)}"
            if waits and not self._ready
            else ""
        )
