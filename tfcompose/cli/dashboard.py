"""Live view of ``up``: pages of lines for a terminal of any size, and keys that change the pages.

The view shows notices and answers of the launcher, the plan, usage of processes, and log lines.
Lines are rich's ``Text``, because rich counts wide characters as a terminal does. The tables are
tfcompose's own: they drop columns on a narrow terminal, while rich would shorten numbers.
"""

from __future__ import annotations

import re
import sys
import time
from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from rich.cells import chop_cells
from rich.console import Console as Renderer
from rich.text import Text

from tfcompose.cli.console import Console, Nowhere
from tfcompose.cli.process_table import HEAD, TABLE, row, uptime
from tfcompose.cli.reading import line_of
from tfcompose.cli.tables import Table, shorten
from tfcompose.cli.terminal import code_addresses, is_coloured, plain
from tfcompose.compiler.render.text import GREEN, RED, YELLOW, render_text
from tfcompose.foundation.text import plural
from tfcompose.model.messages import Ended, FindingShown, RecoveredShown, Stopping

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from tfcompose.cli.process_table import Usage
    from tfcompose.foundation.findings import Finding
    from tfcompose.model.messages import Notice, ProcessStatus, RobotStatus
    from tfcompose.model.plan import Plan

Page = Literal["processes", "log", "edges", "findings", "help"]

#: The name of the launcher's log.
LAUNCHER = "tfcompose"
#: Maximum number of log lines, of characters in a line, of findings and of events in memory. The
#: log files are complete.
KEPT_LINES = 5000
LONGEST_LINE = 4000
KEPT_FINDINGS = 500
KEPT_EVENTS = 100
#: Minimum rows of the lower part of the first page. With enough rows, that part takes a third of
#: them.
NEWS_AT_LEAST = 4
MARK = "▸"

HELP = """\
Keys

  ↑ ↓ or k j       choose a process; in a log or a list, scroll
  Enter or l       show the log of the chosen process
  1 to 9, 0        show the log of that process; 0: of tfcompose itself
  ← →              in a log: the previous or next process
  PgUp PgDn        scroll by a page; Home and End go to the first and last line
  e                edges: owner, rate, and which are not live
  f or g           findings, with notes and help
  Esc              back to the processes
  q                back; on the first page: stop the robot (press q twice)
  Ctrl-L           redraw the screen
  Ctrl-C           stop the robot
  Ctrl-Z           back to the shell; the robot keeps running, and fg shows it again

A log that you scroll back stays there; End follows it again.
In another terminal, tfcompose ps, logs, restart and doctor work as usual.
tfcompose up --no-live prints lines instead of this view."""

#: The keys of each page in order of importance. A narrow terminal shows only the first keys.
_KEYS: dict[Page, str] = {
    "processes": "q end · ? help · l log · e edges · f findings · ↑↓ choose",
    "log": "Esc back · ? help · ↑↓ PgUp PgDn scroll · End follow · ←→ other process",
    "edges": "Esc back · ? help · ↑↓ PgUp PgDn scroll · f findings",
    "findings": "Esc back · ? help · ↑↓ PgUp PgDn scroll · e edges",
    "help": "Esc back",
}
#: Styles of lines in logs and events.
_STYLES = (
    (re.compile(r"\b(?:ERROR|FATAL|CRITICAL)\b|^error\[|^Traceback "), "red"),
    (re.compile(r"\bWARN(?:ING)?\b|^warning\["), "yellow"),
    (re.compile(r"^(?:live|ready|over|tree complete)\b"), "green"),
)
#: Space before the table of processes for the mark and the key.
_INDENT = "    "
_EDGE_HEAD = ("EDGE", "OWNER", "KIND", "RATE", "STATE")


@dataclass(frozen=True, slots=True)
class _Reported:
    """A report of a finding, or of the end of a finding."""

    #: Time in seconds since 1970.
    time_s: float
    #: The report's lines, with colours.
    lines: tuple[Text, ...]


@dataclass(slots=True)
class _Scroll:
    """The visible part of a list."""

    #: Number of the list's last lines that are below the window.
    back: int = 0
    #: Height of the window in lines.
    room: int = 1

    def move(self, lines: int) -> None:
        """Scroll up by this many lines; down if negative."""
        self.back = max(self.back + lines, 0)

    def window(self, count: int, room: int) -> slice:
        """Return the slice of ``count`` lines that fits into the room."""
        self.room = max(room, 1)
        self.back = min(self.back, max(count - self.room, 0))
        end = count - self.back
        return slice(max(end - self.room, 0), end)


@dataclass(slots=True)
class Dashboard:
    """The live view's state."""

    #: The robot's name with its domain.
    name: str
    plan: Plan
    #: Findings of the build, which were printed before the view. The page of findings begins with
    #: them.
    built_with: Sequence[Finding] = ()
    #: Warnings, which were printed before the view. The events begin with them.
    warnings: Sequence[str] = ()
    #: Returns seconds since 1970.
    clock: Callable[[], float] = time.time
    #: The launcher's last answer.
    status: RobotStatus | None = None
    #: The last measurement of the processes' usage.
    used: Usage = field(default_factory=dict)
    page: Page = "processes"
    #: The process whose lines ``add_log_lines`` expects, None if no log is visible.
    log_of: str | None = None
    stopping: str = ""
    ended: Ended | None = None
    _chosen: int = 0
    _confirming: bool = False
    _log: deque[str] = field(default_factory=lambda: deque(maxlen=KEPT_LINES))
    _scrolls: dict[Page, _Scroll] = field(default_factory=dict)
    _reports: deque[_Reported] = field(default_factory=lambda: deque(maxlen=KEPT_FINDINGS))
    _events: deque[tuple[float, str]] = field(default_factory=lambda: deque(maxlen=KEPT_EVENTS))
    _counts: dict[str, int] = field(default_factory=lambda: {"error": 0, "warning": 0})
    _console: Console = field(init=False)
    _renderer: Renderer = field(init=False)
    _began: float = field(init=False)
    #: The time of the event being shown, in seconds since 1970.
    _event_s: float = 0.0

    def __post_init__(self) -> None:
        self._console = Console(self.plan, Nowhere(), colour=False, keep=self._keep)
        self._renderer = Renderer(
            force_terminal=True, no_color=not is_coloured(sys.stdout), highlight=False
        )
        self._began = self.clock()
        self.forget()

    # Input.

    def take(self, notice: Notice, time_s: float) -> None:
        """Update the state from a notice and its time."""
        self._event_s = time_s
        self._console(notice)
        if isinstance(notice, FindingShown):
            self._counts[notice.found.severity] += 1
            text = render_text(
                [notice.found], line_of, colour=True, address_of=code_addresses(sys.stdout)
            )
            self._reports.append(_Reported(time_s, tuple(map(Text.from_ansi, text.splitlines()))))
        elif isinstance(notice, RecoveredShown):
            self._reports.append(
                _Reported(time_s, (Text.assemble(("over", "green"), f"  {plain(notice.text)}"),))
            )
        elif isinstance(notice, Stopping):
            self.stopping = plain(notice.reason)
        elif isinstance(notice, Ended):
            self.ended = notice

    def forget(self) -> None:
        """Delete all notices, because the launcher will send them again."""
        self._reports.clear()
        self._events.clear()
        self._events.extend(
            (self._began, f"WARNING {plain(warning)}") for warning in self.warnings
        )
        self._counts = dict.fromkeys(self._counts, 0)
        for finding in self.built_with:
            self.take(FindingShown(finding), self._began)

    def add_log_lines(self, lines: Iterable[str]) -> None:
        """Add lines to the log. If the log is scrolled back, keep its position."""
        before = len(self._log)
        added = 0
        for line in lines:
            self._log.append(plain(line[:LONGEST_LINE]).expandtabs(8))
            added += 1
        scroll = self._scroll("log")
        if scroll.back and before:
            scroll.move(added)

    def press(self, key: str) -> bool:
        """Handle a key. Return whether to stop the robot."""
        confirmed, self._confirming = self._confirming and key == "q", False
        if confirmed:
            return True
        if key in ("esc", "backspace") or (key == "q" and self.page != "processes"):
            self._show("processes")
        elif key == "q":
            self._confirming = True
        elif key in ("e", "f", "g", "?", "h"):
            self._show("edges" if key == "e" else "findings" if key in "fg" else "help")
        elif len(key) == 1 and key.isdigit():
            self._show_log(int(key) - 1)
        elif self.page == "processes" and key in ("enter", "l"):
            self._show_log(self._chosen)
        elif self.page == "log" and key in ("left", "right"):
            self._show_log(self._log_number() + (1 if key == "right" else -1))
        else:
            self._move(key)
        return False

    def _move(self, key: str) -> None:
        scroll = self._scroll(self.page)
        by = {"up": 1, "k": 1, "down": -1, "j": -1, "pgup": scroll.room, "pgdn": -scroll.room}
        far = 1 << 30
        step = {"home": far, "end": -far}.get(key, by.get(key, 0))
        if self.page == "processes":
            self._chosen = min(max(self._chosen - step, 0), max(len(self._processes()) - 1, 0))
        else:
            scroll.move(step)

    def _show(self, page: Page) -> None:
        if page != "log":
            self.log_of = None
            self._log.clear()
        self.page = page
        scroll = self._scroll(page)
        scroll.back = 1 << 30 if page in ("edges", "help") else 0

    def _show_log(self, number: int) -> None:
        """Show the log of the process with this index, from 0. The index -1 is the launcher."""
        names = [LAUNCHER, *(process.name for process in self._processes())]
        if number + 1 >= len(names) or number < -1:
            return
        self._show("processes")
        self._chosen = max(number, 0)
        self._show("log")
        self.log_of = names[number + 1]

    def _log_number(self) -> int:
        names = [process.name for process in self._processes()]
        return names.index(self.log_of) if self.log_of in names else -1

    def _scroll(self, page: Page) -> _Scroll:
        return self._scrolls.setdefault(page, _Scroll())

    def _processes(self) -> tuple[ProcessStatus, ...]:
        return self.status.processes if self.status else ()

    def _keep(self, name: str, line: str) -> None:
        if name == LAUNCHER:
            self._events.append((self._event_s, line))

    # Output.

    def rows(self, columns: int, rows: int) -> list[str]:
        """Return the lines with their colours as control sequences."""
        with self._renderer.capture() as captured:
            text = Text("\n").join(self.lines(columns, rows))
            self._renderer.print(text, soft_wrap=True, end="")
        return _LINK_ID.sub("\033]8;;", captured.get()).split("\n")

    def lines(self, columns: int, rows: int) -> list[Text]:
        """Return a line for each row of the terminal. No line is wider than the terminal."""
        columns, rows = max(columns, 20), max(rows, 3)
        body = {
            "processes": self._process_page,
            "log": self._log_page,
            "edges": self._edge_page,
            "findings": self._finding_page,
            "help": self._help_page,
        }[self.page](columns, rows - 2)
        body = [*body[: rows - 2], *[Text()] * (rows - 2 - len(body))]
        drawn = [self._head(columns), *body, self._foot()]
        for line in drawn:
            line.no_wrap = True
            line.truncate(columns, overflow="ellipsis")
        return drawn

    def _head(self, columns: int) -> Text:
        head = Text(f"{MARK if self.page == 'log' else ' '} {self.name} ", style="bold")
        head.append_text(self._state())
        if self.status:
            ours = [process for process in self._processes() if process.kind != "external"]
            running = sum(process.state == "running" for process in ours)
            edges, live = self._live_edges()
            head.append(
                f" · {running}/{len(ours)} processes",
                style="" if running == len(ours) else "yellow",
            )
            if edges:
                head.append(
                    f" · {live}/{edges} edges live", style="" if live == edges else "yellow"
                )
        wrong = [plural(number, severity) for severity, number in self._counts.items() if number]
        head.append(
            f" · {', '.join(wrong) or 'no findings'}", style="red" if self._counts["error"] else ""
        )
        clock = Text(f"up {uptime(self.status.uptime)} " if self.status else "")
        room = columns - head.cell_len - clock.cell_len
        if room > 0:
            head.append(" " * room).append_text(clock)
        head.stylize("reverse", 0)
        return head

    def _state(self) -> Text:
        if self.stopping:
            return Text(f"stopping: {self.stopping}", style="yellow")
        if self.status is None:
            return Text("starting", style="yellow")
        failed = [process.name for process in self._processes() if process.failed]
        if failed:
            return Text(f"without {', '.join(failed)}", style="red")
        if self.status.ready and self.status.complete:
            return Text(
                "all well" if not sum(self._counts.values()) else "complete", style="green"
            )
        return Text("ready, edges silent" if self.status.ready else "not ready", style="yellow")

    def _live_edges(self) -> tuple[int, int]:
        """Return the number of the processes' edges, and the number of live edges among these."""
        return sum(process.edges for process in self._processes()), sum(
            process.live for process in self._processes()
        )

    def _foot(self) -> Text:
        if self._confirming:
            return Text(
                f" q again stops {self.name}; any other key cancels", style="reverse yellow"
            )
        return Text(f" {_KEYS[self.page]}", style="dim")

    def _process_page(self, columns: int, rows: int) -> list[Text]:
        processes = self._processes()
        below = (
            max(min(NEWS_AT_LEAST, rows // 3), rows - len(processes) - 1) if processes else rows
        )
        shown_rows = self._process_lines(columns, rows - below) if processes else []
        if below > 1:
            hidden = len(processes) - max(len(shown_rows) - 1, 0)
            title = (
                "Findings (f shows them with help)" if self._reports else "Events (0 shows all)"
            )
            title = f"{hidden} more ↑↓ · {title}" if hidden else title
            shown_rows.append(
                Text(
                    shorten(f"── {title} ".ljust(columns, "─"), columns, at_end=True),
                    style="dim",
                )
            )
            news = self._news()
            shown_rows += news[max(len(news) - below + 1, 0) :]
        return shown_rows

    def _process_lines(self, columns: int, rows: int) -> list[Text]:
        """Return the table's head and the processes that fit, always with the selected process."""
        rows_of = [row(process, self.used) for process in self._processes()]
        head, *process_rows = (
            Text.from_ansi(line)
            for line in TABLE.lines([HEAD, *rows_of], columns - len(_INDENT), coloured=True)
        )
        room = max(rows - 1, 1)
        first = min(max(self._chosen - room // 2, 0), max(len(process_rows) - room, 0))
        texts = [Text(f"{_INDENT}{head.plain}", style="dim")]
        for number, line in enumerate(process_rows[first : first + room], first):
            key = str(number + 1) if number < 9 else " "  # noqa: PLR2004 (keys of one digit)
            chosen = number == self._chosen
            texts.append(
                Text(
                    f" {MARK if chosen else ' '}{key} ", style="bold" if chosen else "dim"
                ).append_text(line)
            )
        return texts

    def _news(self) -> list[Text]:
        """Return the first line of each report, or without reports the launcher's lines."""
        if self._reports:
            return [self._with_time(report.time_s, report.lines[0]) for report in self._reports]
        return [self._with_time(time_s, _style_line(line)) for time_s, line in self._events]

    def _log_page(self, columns: int, rows: int) -> list[Text]:
        scroll = self._scroll("log")
        where = f"{scroll.back} lines back, End follows" if scroll.back else "following"
        title = Text(
            f" log of {self.log_of} · {where if self._log else 'nothing yet'}", style="bold"
        )
        lines = self._log
        window = scroll.window(len(lines), rows - 1)
        texts: list[Text] = []
        for number in range(window.stop - 1, window.start - 1, -1):  # a line may fill several rows
            style = _style_of(lines[number])
            pieces = chop_cells(lines[number], columns) or [""]
            texts[:0] = [Text(piece, style=style) for piece in pieces]
            if len(texts) >= rows - 1:
                break
        return [title, *(texts[len(texts) - rows + 1 :] if len(texts) >= rows else texts)]

    def _edge_page(self, columns: int, rows: int) -> list[Text]:
        missing = (
            set(self.status.missing) if self.status else {edge.name for edge in self.plan.edges}
        )
        silent = set(self.status.silent) if self.status else set()
        table = []
        for edge in self.plan.edges:
            rate = f"{edge.rate:g} Hz" if edge.rate and edge.kind != "static" else "–"
            state = "silent" if edge.name in silent else "live"
            if edge.name in missing:
                state = "not live"
            table.append((edge.name, edge.owner, edge.kind, rate, state))
        table.sort(key=lambda cells: cells[-1] == "live")  # edges that are not live come first
        if not table:
            return [Text(" this plan has no edges", style="dim")]
        edge_lines = Table(frozenset({3}), (3, 2), {0: 24, 1: 10}, _edge_colour).lines(
            [_EDGE_HEAD, *table], columns - 1, coloured=True
        )
        head, *lines = (Text(" ").append_text(Text.from_ansi(line)) for line in edge_lines)
        return [
            Text(head.plain, style="dim"),
            *lines[self._scroll("edges").window(len(lines), rows - 1)],
        ]

    def _finding_page(self, columns: int, rows: int) -> list[Text]:
        if not self._reports:
            return [Text(), Text(" No findings.", style="green")]
        lines: list[Text] = []
        for report in self._reports:
            first, *rest = report.lines
            for line in (self._with_time(report.time_s, first), *rest):
                pieces = line.divide([len(piece) for piece in _ends(line.plain, columns - 1)])
                lines += [Text(" ").append_text(piece) for piece in pieces if piece.plain]
        return lines[self._scroll("findings").window(len(lines), rows)]

    def _help_page(self, columns: int, rows: int) -> list[Text]:
        del columns
        styles = {"Keys": "bold"}
        lines = [Text(f" {line}", style=styles.get(line, "")) for line in HELP.splitlines()]
        return lines[self._scroll("help").window(len(lines), rows)]

    def _with_time(self, time_s: float, line: Text) -> Text:
        today = time.localtime(self.clock())[:3] == time.localtime(time_s)[:3]
        stamp = time.strftime("%H:%M:%S" if today else "%b %d %H:%M", time.localtime(time_s))
        return Text(f"{stamp} ", style="dim").append_text(line)


#: rich gives a link a new id in each drawing, so that every row with a link would differ.
_LINK_ID = re.compile(r"\033\]8;id=[^;]*;")


def _ends(text: str, width: int) -> Sequence[str]:
    """Return, for each row of that width except the last, the text up to the row's end."""
    pieces = chop_cells(text, max(width, 1))
    return ["".join(pieces[: number + 1]) for number in range(len(pieces) - 1)]


def _style_of(line: str) -> str:
    return next((style for pattern, style in _STYLES if pattern.search(line)), "")


def _style_line(line: str) -> Text:
    return Text(line, style=_style_of(line))


def _edge_colour(column: int, text: str) -> str:
    if column != len(_EDGE_HEAD) - 1 or text == "STATE":
        return ""
    return {"live": GREEN, "silent": RED}.get(text, YELLOW)
