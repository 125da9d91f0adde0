"""The line below the log, as a terminal shows it: a terminal emulator reads what is written."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import signal
import struct
import sys
import termios
import time
from typing import TYPE_CHECKING

import pyte
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.waiting import TIMEOUT_S, until
from tfcompose.cli.console import Console, StatusLine
from tfcompose.cli.live_run import can_show_live
from tfcompose.cli.terminal import keep_colours, plain
from tfcompose.foundation.findings import finding
from tfcompose.foundation.geometry import Pose
from tfcompose.model.messages import (
    Ended,
    FindingShown,
    LogLine,
    OwnerLive,
    ProcessState,
    Stopping,
)
from tfcompose.model.plan import Plan, PlanEdge, PlanProcess, RosSettings, SourceLine
from tfcompose.model.plan.file import write_plan

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

#: A launcher as ``up`` makes it on a terminal, for a plan without ROS.
LAUNCHER = """
import sys
from pathlib import Path
from tfcompose.cli.console import Console, StatusLine
from tfcompose.cli.live_run import can_show_live
from tfcompose.cli.terminal import size_of
from tfcompose.model.plan.file import read_plan
from tfcompose.launcher.output import NonBlockingOutput
from tfcompose.launcher.supervisor import RunSession, supervise
file = Path(sys.argv[1])
plan = read_plan(file.read_text(), str(file))
output = NonBlockingOutput(1)
console = Console(plan, output, colour=True, status=StatusLine(plan, lambda: size_of(1)[0]))
code = supervise(plan, file, report=console, session=RunSession(file, output=output, refresh=console.refresh))
output.close()
sys.exit(code)
"""  # noqa: E501 (a text as its reader has it)


def plan_of(*names: str, owner: str = "") -> Plan:
    edge = PlanEdge(
        "base_link", "lidar", "static", owner, f"/{owner}", Pose(), None, SourceLine("r.yaml", 1)
    )
    processes = [
        PlanProcess(name, "run", owns=((edge.parent, edge.child),) * (name == owner))
        for name in names
    ]
    return Plan("rover", "", None, RosSettings(), (edge,) if owner else (), tuple(processes))


class View:
    """A console on an emulated terminal, with a clock that is set by hand."""

    def __init__(self, plan: Plan, columns: int = 80, rows: int = 8) -> None:
        self.screen = pyte.Screen(columns, rows)
        self._stream = pyte.Stream(self.screen)
        self.now = 0.0
        status = StatusLine(plan, lambda: self.screen.columns, lambda: self.now)
        self.console = Console(plan, self, colour=True, status=status)

    def write(self, text: str, *, log: bool = False) -> None:
        del log
        self._stream.feed(text.replace("\n", "\r\n"))

    def tell(self, *notices: object) -> View:
        for notice in notices:
            self.console(notice)  # type: ignore[arg-type]
            self.now += 1
        self.console.refresh()
        return self

    @property
    def lines(self) -> list[str]:
        return [line.rstrip() for line in self.screen.display if line.strip()]


def running(*names: str) -> list[ProcessState]:
    return [ProcessState(name, "running", 7) for name in names]


def test_the_line_stays_below_the_log_and_the_log_is_complete() -> None:
    view = View(plan_of("static", "drive", owner="static"))
    view.tell(
        *running("static"), LogLine("drive", "stdout", "one"), LogLine("drive", "stdout", "two")
    )
    assert view.lines == [
        "tfcompose | started static (pid 7)",
        "drive     | one",
        "drive     | two",
        "[00:03] 1 of 2 processes · 0 of 1 edges live · waiting for static",
    ]
    view.tell(OwnerLive("static", "/static", ("base_link → lidar",), 1.0))
    assert view.lines[-1] == "[00:04] 1 of 2 processes · 1 of 1 edges live"


def test_violations_come_first_and_are_counted() -> None:
    view = View(plan_of("static"))
    view.tell(FindingShown(finding("TF801", "rogue publishes it", None)))
    view.tell(FindingShown(finding("TF803", "nobody declared it", None, severity="warning")))
    assert view.lines[-1].startswith("[00:02] 1 error · 1 warning · 0 of 1 processes")


@pytest.mark.parametrize("columns", [8, 20, 30, 44, 60, 80, 200])
@pytest.mark.parametrize("count", [1, 200])
def test_the_status_is_one_line_and_leaves_room_for_ctrl_c(columns: int, count: int) -> None:
    names = [f"a_process_with_a_long_name_{number}" for number in range(count)]
    view = View(plan_of(*names, owner=names[0]), columns)
    view.tell(*running(*names))
    last = view.lines[-1]
    assert last.startswith("[0")
    assert len(last) <= columns - 3
    view.write("^C")
    view.tell(Stopping("SIGINT"), Ended(0))
    assert "^C" not in "".join(view.lines)
    assert "[0" not in "".join(view.lines)


def test_a_terminal_that_becomes_narrower_gets_a_shorter_line() -> None:
    view = View(plan_of("static", "drive", owner="static")).tell(*running("static", "drive"))
    view.screen.resize(columns=40)
    view.tell(LogLine("drive", "stdout", "x"))
    assert view.lines[-1] == "[00:03] 2/2 proc · 0/1 edges"


def test_who_others_start_counts_when_its_edges_are_live() -> None:
    view = View(plan_of("drive", owner="drive")).tell(ProcessState("drive", "expected"))
    assert "0 of 1 processes" in view.lines[-1]
    view.tell(OwnerLive("drive", "/drive", ("base_link → lidar",), 1.0))
    assert "1 of 1 processes" in view.lines[-1]


def test_lines_begin_below_each_other_whatever_the_longest_name_is() -> None:
    view = View(plan_of("a" * 40, "b")).tell(
        LogLine("b", "stdout", "x"), LogLine("a" * 40, "stdout", "y")
    )
    assert view.lines[:2] == [f"{'b':<40} | x", f"{'a' * 40} | y"]


def test_what_a_process_writes_moves_no_cursor_and_colours_nothing_else() -> None:
    view = View(plan_of("evil"), 60)
    view.tell(LogLine("evil", "stdout", "one"))
    view.tell(
        LogLine("evil", "stdout", "\033[2J\033[3A\033]0;title\a\033[31mred\033[?25l\rback\x9b2J")
    )
    assert view.lines[:2] == [
        "evil      | one",
        "evil      | red\N{REPLACEMENT CHARACTER}back\N{REPLACEMENT CHARACTER}2J",
    ]
    row = view.screen.buffer[1]
    assert row[12].fg == "red"
    assert view.screen.buffer[2][0].fg == "default"
    view.tell(LogLine("evil", "stdout", "plain"))
    assert view.screen.buffer[2][12].fg == "default"


@given(st.text(st.sampled_from("\033[]0;31mAJ?\a\r\n\b\tx\x9b "), max_size=30))
def test_no_control_sequence_but_colours_is_left(text: str) -> None:
    assert "\033" not in plain(text)
    kept = keep_colours(text)
    for piece in kept.split("\033")[1:]:
        assert piece.startswith("["), kept
        assert piece[1:].lstrip("0123456789;:").startswith("m"), kept
    assert not set("\r\n\b\a\x9b") & set(plain(text) + kept)


class Terminal:
    """A program on a terminal of its own."""

    def __init__(self, command: list[str], columns: int, rows: int) -> None:
        self.pid, self._fd = pty.fork()
        if self.pid == 0:
            _set_size(0, columns, rows)  # before it is asked for
            os.execvp(command[0], command)  # noqa: S606 (that is how a terminal's program is started)
        self.screen = pyte.HistoryScreen(columns, rows, history=1000)
        self._stream = pyte.ByteStream(self.screen)

    def resize(self, columns: int, rows: int) -> None:
        _set_size(self._fd, columns, rows)
        self.screen.resize(rows, columns)

    def read(self, seconds: float = 0.1) -> bool:
        """Show what was written; return whether the program still has the terminal."""
        if not select.select([self._fd], [], [], seconds)[0]:
            return True
        try:
            data = os.read(self._fd, 65536)
        except OSError:
            return False
        self._stream.feed(data)
        return bool(data)

    def shows(self, text: str) -> bool:
        """Read until a line holds the text; it may have moved up already."""
        return until(lambda: self.read(0.02) and any(text in line for line in self.lines()))

    def type(self, text: str) -> None:
        os.write(self._fd, text.encode())

    def ends(self) -> int:
        end = time.monotonic() + TIMEOUT_S
        while self.read():
            assert time.monotonic() < end
        return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])

    def lines(self) -> list[str]:
        above = [
            "".join(row[x].data for x in range(self.screen.columns))
            for row in self.screen.history.top
        ]
        return [line.rstrip() for line in [*above, *self.screen.display] if line.strip()]


def _set_size(fd: int, columns: int, rows: int) -> None:
    fcntl.ioctl(fd, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    """A launcher of 40 sleeping processes and one that counts, on a terminal of 60 columns."""
    count = (
        "import time\nfor i in range(10**6): print('line', i, 'end', flush=True); time.sleep(0.02)"
    )
    sleeping = [PlanProcess(f"sleeper_{number}", "run", ("sleep", "60")) for number in range(40)]
    counting = PlanProcess("counting", "run", (sys.executable, "-I", "-S", "-c", count))
    file = tmp_path / "plan.json"
    file.write_text(write_plan(Plan("rover", "", None, RosSettings(), (), (*sleeping, counting))))
    started = Terminal([sys.executable, "-c", LAUNCHER, str(file)], 60, 12)
    yield started
    if started.read(0):
        os.kill(started.pid, signal.SIGKILL)


def test_a_real_terminal_has_the_full_log_and_ctrl_c_leaves_nothing(
    terminal: Terminal,
) -> None:
    assert terminal.shows("41 of 41 processes")
    assert terminal.shows("line 40 end")
    terminal.resize(44, 12)
    assert terminal.shows("line 80 end")
    assert until(lambda: terminal.read(0.02) and terminal.screen.display[-1].startswith("[0"))
    terminal.type("\x03")
    assert terminal.ends() == 0
    lines = terminal.lines()
    assert lines[-1].endswith("| ended")
    assert not [line for line in lines if line.startswith("[0")]
    numbers = [
        int(line.split()[3])
        for line in lines
        if line.startswith("counting") and line.endswith("end")
    ]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert len(numbers) > 80


class StreamOfTerminal:
    """A stream of a terminal."""

    @staticmethod
    def isatty() -> bool:
        return True

    @staticmethod
    def fileno() -> int:
        return 0


@pytest.mark.parametrize(
    ("environment", "group", "shows"),
    [
        ({}, os.getpgrp(), True),
        ({"TERM": "dumb"}, os.getpgrp(), False),
        ({"CI": "true"}, os.getpgrp(), False),
        ({}, 1, False),
    ],
    ids=["a terminal", "a dumb one", "CI", "in the background"],
)
def test_a_view_needs_a_terminal_that_redraws(
    monkeypatch: pytest.MonkeyPatch, environment: dict[str, str], group: int, *, shows: bool
) -> None:
    for name, value in ({"TERM": "xterm", "CI": ""} | environment).items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr("sys.stdout", StreamOfTerminal())
    monkeypatch.setattr("sys.stdin", StreamOfTerminal())
    monkeypatch.setattr("os.tcgetpgrp", lambda _: group)
    assert can_show_live() == shows
