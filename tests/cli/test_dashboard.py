"""The live view of ``up``: what its pages show at any size, and what keys do.

Without a terminal.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from tfcompose.cli.dashboard import KEPT_LINES, Dashboard
from tfcompose.cli.keys import KeyDecoder
from tfcompose.foundation.findings import Note, finding
from tfcompose.foundation.geometry import Pose
from tfcompose.model.messages import (
    Ended,
    FindingShown,
    OwnerLive,
    ProcessStatus,
    RecoveredShown,
    RobotStatus,
    Stopping,
)
from tfcompose.model.plan import Plan, PlanEdge, PlanProcess, RosSettings, SourceLine

if TYPE_CHECKING:
    from rich.text import Text

    from tfcompose.cli.dashboard import Page

NOON = 1_800_000_000.0
#: A process that runs and is ready, in the order of the class.
RUNNING = ProcessStatus(
    "",
    "run",
    None,
    "running",
    "",
    True,  # noqa: FBT003
    False,  # noqa: FBT003
    True,  # noqa: FBT003
    "",
    "",
    4711,
    3725.0,
    0,
    0,
    0,
    (),
)
PAGES: dict[Page, str] = {
    "processes": "esc",
    "log": "1",
    "edges": "e",
    "findings": "f",
    "help": "?",
}
TAKEN = finding(
    "TF801",
    "map → odom is also published by /slam_old",
    None,
    notes=[Note("pid 77")],
    help="end it",
)


def edge_of(number: int) -> PlanEdge:
    source = SourceLine("r.yaml", 1)
    return PlanEdge(
        f"frame_{number}",
        f"frame_{number + 1}",
        "dynamic",
        "drive",
        "/drive",
        Pose(),
        50.0,
        source,
    )


def dashboard(count: int = 3, edges: int = 2, **changes: object) -> Dashboard:
    """Return the view of a robot whose processes all run and whose edges are all live."""
    names = ["drive", *(f"process_{number}" for number in range(1, count))]
    states = [
        structs.replace(RUNNING, name=name, pid=100 + number) for number, name in enumerate(names)
    ]
    states[0] = structs.replace(states[0], edges=edges, live=edges)
    status = RobotStatus(
        robot="rover",
        host=None,
        launcher=99,
        plan="",
        uptime=3725.0,
        complete=True,
        ready=True,
        stopping=False,
        missing=(),
        silent=(),
        processes=tuple(states),
    )
    plan = Plan(
        "rover",
        "",
        None,
        RosSettings(),
        tuple(map(edge_of, range(edges))),
        tuple(PlanProcess(n, "run") for n in names),
    )
    return Dashboard(
        "rover@0", plan, clock=lambda: NOON, status=structs.replace(status, **changes)
    )


def screen_text(view: Dashboard, columns: int = 80, rows: int = 24) -> str:
    return "\n".join(line.plain for line in view.lines(columns, rows))


def open_page(view: Dashboard, page: Page) -> Dashboard:
    view.press(PAGES[page])
    assert view.page == page
    return view


SIZES = ((20, 3), (40, 8), (80, 24), (132, 43), (200, 60))


@pytest.mark.parametrize("page", PAGES)
def test_each_page_fills_a_terminal_of_any_size_and_no_line_is_wider(page: Page) -> None:
    view = dashboard(50, 60)
    for number in range(30):
        view.take(FindingShown(replace(TAKEN, message=f"{number} 漢字 {'long ' * 60}")), NOON)
    open_page(view, page)
    if page == "log":
        view.add_log_lines(["漢字" * 90, "\tx", ""] * 50)
    for columns, rows in SIZES:
        lines: list[Text] = view.lines(columns, rows)
        assert len(lines) == rows
        assert max(line.cell_len for line in lines) <= columns


def test_numbers_are_not_shortened_at_80_columns() -> None:
    text = screen_text(dashboard(50))
    assert "1:02 h" in text
    assert all(f"  {100 + number}  " in text for number in range(10))
    assert "2/2" in text


def test_when_all_is_well_one_line_shows_it_and_events_are_below() -> None:
    view = dashboard()
    view.take(OwnerLive("drive", "/drive", ("frame_0 → frame_1",), 0.5), NOON)
    head, *rest = screen_text(view).splitlines()
    assert "all well" in head
    assert "3/3 processes" in head
    assert "2/2 edges live" in head
    assert "no findings" in head
    assert any("live  drive (/drive)" in line for line in rest)


def test_a_finding_is_on_the_first_page_and_its_help_on_its_own_page() -> None:
    view = dashboard()
    view.take(OwnerLive("drive", "/drive", ("frame_0 → frame_1",), 0.5), NOON)
    view.take(FindingShown(TAKEN), NOON)
    text = screen_text(view)
    assert "TF801" in text
    assert "1 error" in text.splitlines()[0]
    assert "all well" not in text
    assert "end it" not in text
    view.take(RecoveredShown("map → odom: /slam_old has ended", 3.0), NOON)
    assert {"TF801", "pid 77", "end it", "has ended"} <= {
        word
        for word in ("TF801", "pid 77", "end it", "has ended")
        if word in screen_text(open_page(view, "findings"))
    }


def test_edges_that_are_not_live_come_first() -> None:
    view = dashboard(
        3, 40, missing=("frame_30 → frame_31",), silent=("frame_35 → frame_36",), complete=False
    )
    lines = screen_text(open_page(view, "edges")).splitlines()[2:4]
    assert ["not live" in lines[0], "silent" in lines[1]] == [True, True]
    assert "frame_30" in lines[0]
    assert "frame_35" in lines[1]


def test_a_robot_is_ended_by_q_twice_on_the_first_page_alone() -> None:
    view = dashboard()
    assert not view.press("q")
    assert "rover@0" in screen_text(view).splitlines()[-1]
    assert not view.press("down")
    assert not view.press("q")
    assert view.press("q")
    for page in ("log", "edges", "findings", "help"):
        assert not open_page(view, page).press("q")
        assert view.page == "processes"


def test_digits_and_enter_show_a_log_and_arrows_go_to_the_next_one() -> None:
    view = dashboard()
    view.press("2")
    assert view.log_of == "process_1"
    view.press("right")
    assert view.log_of == "process_2"
    view.press("right")
    assert view.log_of == "process_2"  # the last one
    view.press("0")
    assert view.log_of == "tfcompose"
    view.press("esc")
    assert view.log_of is None
    view.press("down")
    view.press("enter")
    assert view.log_of == "process_1"
    view.press("7")
    assert view.log_of == "process_1"  # there is none


def test_the_chosen_process_is_in_view_among_fifty() -> None:
    view = dashboard(50)
    for _ in range(60):
        view.press("down")
    assert "▸" in screen_text(view)
    assert "process_49" in screen_text(view)
    view.press("home")
    assert "drive" in screen_text(view)
    assert "process_49" not in screen_text(view)


def test_a_log_follows_its_end_and_stays_in_place_once_it_is_scrolled() -> None:
    view = open_page(dashboard(), "log")
    view.add_log_lines(f"line {number}" for number in range(100))
    assert "line 99" in screen_text(view)
    view.press("pgup")
    before = screen_text(view).splitlines()[2:-1]
    view.add_log_lines(f"line {number}" for number in range(100, 150))
    assert screen_text(view).splitlines()[2:-1] == before
    view.press("end")
    assert "line 149" in screen_text(view)


def test_what_a_process_prints_cannot_control_the_terminal() -> None:
    view = open_page(dashboard(), "log")
    view.add_log_lines(["\033[2J\033[31mred\033]0;title\a \b\x9b2J end", "a\tb"])
    text = screen_text(view)
    assert "red" in text
    assert "title" not in text
    assert all(char.isprintable() or char == "\n" for char in text)
    view.take(FindingShown(replace(TAKEN, message="\033[2J", help="\x9b2J")), NOON)
    view.take(Stopping("\033[2J"), NOON)
    for page in PAGES:
        assert all(
            char.isprintable() or char == "\n" for char in screen_text(open_page(view, page))
        )


def test_a_flood_is_kept_within_bounds() -> None:
    view = open_page(dashboard(), "log")
    view.add_log_lines("x" * 100_000 for _ in range(2 * KEPT_LINES))
    assert sum(map(len, view._log)) < 5 * KEPT_LINES * 1000
    assert len(view.lines(80, 24)) == 24


def test_the_end_is_remembered() -> None:
    view = dashboard()
    view.take(Stopping("SIGINT"), NOON)
    view.take(Ended(0), NOON)
    assert "stopping: SIGINT" in screen_text(view)
    assert view.ended == Ended(0)


KEYS = [
    *"qefgh?lkj0123456789 x",
    "up",
    "down",
    "left",
    "right",
    "pgup",
    "pgdn",
    "home",
    "end",
    "esc",
    "enter",
    "",
]


@given(st.lists(st.sampled_from(KEYS), max_size=30), st.integers(0, 12), st.sampled_from(SIZES))
def test_no_keys_break_the_view(keys: list[str], count: int, size: tuple[int, int]) -> None:
    view = (
        dashboard(count)
        if count
        else Dashboard("rover@0", Plan("rover", "", None, RosSettings(), (), ()))
    )
    for key in keys:
        view.press(key)
        assert len(view.lines(*size)) == size[1]


def test_keys_are_known_in_pieces_and_in_the_forms_that_terminals_send() -> None:
    keys = KeyDecoder()
    assert keys.feed(b"q\033[A\033OB\033[5~\r") == ["q", "up", "down", "pgup", "enter"]
    assert keys.feed(b"\033[") == []
    assert keys.waits
    assert keys.feed(b"6~e") == ["pgdn", "e"]
    assert keys.feed(b"\033") == []
    assert keys.end() == ["esc"]
    assert not keys.waits
    assert keys.feed("ö".encode()) == ["ö"]


def test_events_printed_before_the_view_appear_after_each_connection() -> None:
    plan = Plan("rover", "", None, RosSettings(), (), ())
    view = Dashboard(
        "rover@0", plan, (), ["an earlier run left 77 behind\033[2J"], clock=lambda: NOON
    )
    assert "WARNING an earlier run left 77 behind" in screen_text(view)
    view.forget()
    assert screen_text(view).count("an earlier run left 77 behind") == 1


def test_findings_of_the_build_remain_after_a_reconnect() -> None:
    view = dashboard()
    view = Dashboard(
        "rover@0",
        view.plan,
        [replace(TAKEN, code="TF508", severity="warning")],
        clock=lambda: NOON,
    )
    for _ in range(2):
        assert "1 warning" in screen_text(view).splitlines()[0]
        assert "TF508" in screen_text(view)
        view.forget()
    assert "pid 77" in screen_text(open_page(view, "findings"))
