"""Histories of arrivals, judged with a clock that is set by hand."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.findings import expect
from tfcompose.foundation.geometry import Pose
from tfcompose.guard.liveness import Liveness
from tfcompose.model.messages import (
    GUARD_EVENTS,
    FindingShown,
    GuardEvent,
    Live,
    OwnerReady,
    RecoveredShown,
    TreeComplete,
    line_of,
)
from tfcompose.model.plan import Plan, PlanEdge, PlanProcess, RosSettings, SourceLine

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from tfcompose.foundation.findings import Finding
    from tfcompose.model.plan import EdgeKind

TICK_S = 0.1


def edge(
    names: str, owner: str, rate: float | None = None, kind: EdgeKind = "dynamic"
) -> PlanEdge:
    parent, child = names.split()
    return PlanEdge(
        parent, child, kind, owner, f"/{owner}", Pose(), rate, SourceLine("rover.yaml", 3)
    )


@dataclass
class History:
    """Arrivals at given times, and a look every tenth of a second."""

    live: Liveness
    now: float = 500.0
    events: list[GuardEvent] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.live.tick(self.now)

    def run(self, seconds: float, arrivals: Iterable[tuple[float, str]] = ()) -> History:
        """Let time pass with these arrivals, at seconds from now."""
        begun = self.now
        ticks = [(TICK_S * n, "") for n in range(1, round(seconds / TICK_S) + 1)]
        for offset_s, child in sorted([*arrivals, *ticks]):
            self.now = begun + offset_s
            self.events += (
                self.live.note_arrivals((child,), self.now) if child else self.live.judge(self.now)
            )
        self.now = begun + seconds
        return self

    def steadily(self, seconds: float, hertz: float, *children: str) -> History:
        return self.run(
            seconds,
            [(n / hertz, child) for n in range(round(seconds * hertz)) for child in children],
        )

    def findings(self) -> list[Finding]:
        return [event.found for event in self.events if isinstance(event, FindingShown)]

    def only(self) -> Finding:
        (finding,) = self.findings()
        return finding

    def over(self) -> list[str]:
        return [event.text for event in self.events if isinstance(event, RecoveredShown)]


@pytest.fixture
def watch() -> Callable[..., History]:
    def make(*edges: PlanEdge) -> History:
        owners = dict.fromkeys(planned.owner for planned in edges)
        processes = tuple(PlanProcess(owner, "external") for owner in owners)
        return History(Liveness(Plan("rover", "0", None, RosSettings(), edges, processes)))

    return make


def test_what_comes_in_one_message_is_announced_in_few_events(
    watch: Callable[..., History],
) -> None:
    names = [f"frame_{n}" for n in range(2500)]
    history = watch(*(edge(f"base {name}", "static", kind="static") for name in names))
    live = [
        event
        for event in history.live.note_arrivals(tuple(names), history.now)
        if isinstance(event, Live)
    ]
    assert [len(event.children) for event in live] == [1000, 1000, 500]
    assert [child for event in live for child in event.children] == names
    assert [GUARD_EVENTS.decode(line_of(event)) for event in live] == live


def test_edges_owners_and_the_tree_are_each_announced_once(watch: Callable[..., History]) -> None:
    history = watch(
        edge("map odom", "slam", 10), edge("odom a", "drive", 10), edge("odom b", "drive", 10)
    )
    history.steadily(1, 10, "a", "odom").steadily(1, 10, "a", "b", "odom")
    assert [event.children for event in history.events if isinstance(event, Live)] == [
        ("a",),
        ("odom",),
        ("b",),
    ]
    assert [event.process for event in history.events if isinstance(event, OwnerReady)] == [
        "slam",
        "drive",
    ]
    assert [event for event in history.events if isinstance(event, TreeComplete)] == [
        TreeComplete(3)
    ]


@pytest.mark.parametrize("hertz", [10, 50])
def test_an_owner_that_falls_silent_is_named_within_a_second_and_once(
    watch: Callable[..., History], hertz: int
) -> None:
    history = watch(edge("map odom", "slam", hertz)).steadily(3, hertz, "odom").run(1 - 1 / hertz)
    expect(history.only(), "TF804", "slam (/slam)", "map → odom", " ms")
    assert len(history.run(60).findings()) == 1


def test_messages_of_a_deliberately_stopped_owner_do_not_count(
    watch: Callable[..., History],
) -> None:
    history = watch(edge("map odom", "slam", 10)).steadily(2, 10, "odom")
    history.live.absent("slam")
    before = list(history.events)
    assert history.run(5, [(0.1, "odom"), (0.2, "odom")]).events == before


def test_an_owner_that_was_never_heard_is_not_silent(watch: Callable[..., History]) -> None:
    assert watch(edge("map odom", "slam", 10)).run(60).events == []


def test_edges_without_a_rate_and_static_ones_are_never_silent(
    watch: Callable[..., History],
) -> None:
    history = watch(edge("base left", "joints"), edge("base lidar", "lidar", 10, "static"))
    assert history.steadily(0.1, 10, "left", "lidar").run(60).findings() == []


def test_a_slow_rate_may_be_silent_for_four_periods(watch: Callable[..., History]) -> None:
    history = watch(edge("map odom", "slam", 0.5)).steadily(20, 0.5, "odom").run(5)
    assert history.findings() == []
    assert len(history.run(2).findings()) == 1


def test_silent_edges_of_one_owner_are_one_finding_and_one_recovery(
    watch: Callable[..., History],
) -> None:
    children = [f"wheel_{n}" for n in range(8)]
    history = watch(
        *(edge(f"base {child}", "drive", 20) for child in children), edge("map odom", "slam", 10)
    )
    history.steadily(2, 10, *children, *children, "odom").steadily(2, 10, "odom")
    expect(history.only(), "TF804", "base → wheel_5 and 2 more")
    history.steadily(2, 10, *children, *children, "odom")
    (over,) = history.over()
    assert over.startswith("base → wheel_0, ")
    assert re.search(r"and 2 more .* 2\.\d s", over)


def test_an_owner_that_is_back_and_falls_silent_again_is_named_again(
    watch: Callable[..., History],
) -> None:
    history = (
        watch(edge("map odom", "slam", 10)).steadily(2, 10, "odom").run(2).steadily(2, 10, "odom")
    )
    (over,) = history.over()
    assert (over.startswith("map → odom "), over.endswith(" 2.3 s")) == (True, True)
    assert len(history.run(2).findings()) == 2


@pytest.mark.parametrize(
    ("declared", "hertz"), [(10, 7), (50, 30), (100, 79), (300, 200), (1000, 500), (1, 0.7)]
)
def test_an_owner_that_is_too_slow_is_named_once_with_its_rate(
    watch: Callable[..., History], declared: float, hertz: float
) -> None:
    history = watch(edge("map odom", "slam", declared)).steadily(30, hertz, "odom")
    expect(
        history.only(), "TF805", "map → odom", f" {hertz} Hz", "slam (/slam)", f" {declared} Hz"
    )
    assert history.only().severity == "warning"


@pytest.mark.parametrize("hertz", [8.5, 10, 40])
def test_an_owner_that_is_nearly_as_fast_as_declared_or_faster_is_right(
    watch: Callable[..., History], hertz: float
) -> None:
    assert watch(edge("map odom", "slam", 10)).steadily(20, hertz, "odom").findings() == []


def test_an_owner_that_is_fast_enough_again_is_reported_to_be(
    watch: Callable[..., History],
) -> None:
    history = watch(edge("map odom", "slam", 10)).steadily(6, 5, "odom").steadily(6, 10, "odom")
    assert len(history.findings()) == 1
    (over,) = history.over()
    assert over.startswith("map → odom ")


def test_a_rate_just_below_the_declared_one_gives_no_new_report(
    watch: Callable[..., History],
) -> None:
    history = watch(edge("map odom", "slam", 10)).steadily(6, 5, "odom").steadily(12, 8.5, "odom")
    assert (len(history.findings()), history.over()) == (1, [])


def test_several_slow_edges_of_one_owner_are_one_finding(watch: Callable[..., History]) -> None:
    history = watch(edge("odom a", "drive", 10), edge("odom b", "drive", 10)).steadily(
        6, 5, "a", "b"
    )
    expect(history.only(), "TF805", "odom → a, odom → b", " 5 Hz", "drive (/drive)", " 10 Hz")


def test_an_owner_at_a_tenth_of_its_rate_is_silent_then_slow_only(
    watch: Callable[..., History],
) -> None:
    history = watch(edge("map odom", "slam", 10)).steadily(3, 10, "odom").steadily(60, 1, "odom")
    assert [finding.code for finding in history.findings()] == ["TF804", "TF805"]
    assert history.over() == []
    assert len(history.steadily(5, 10, "odom").over()) == 1


def test_a_hiccup_of_half_a_second_is_neither_silence_nor_slowness(
    watch: Callable[..., History],
) -> None:
    history = (
        watch(edge("odom base", "drive", 50))
        .steadily(3, 50, "base")
        .run(0.5)
        .steadily(5, 50, "base")
    )
    assert history.findings() == []


@pytest.mark.parametrize(("stall_s", "late_s"), [(0.5, 0.2), (2, 3), (30, 3)])
def test_a_guard_that_was_kept_from_running_reports_nothing_false(
    watch: Callable[..., History], stall_s: float, late_s: float
) -> None:
    history = watch(edge("map odom", "slam", 10), edge("odom base", "drive", 50))
    history.steadily(3, 50, "base").steadily(3, 10, "odom", "base", "base", "base", "base", "base")
    history.now += stall_s
    history.events += history.live.judge(
        history.now
    )  # before what has come meanwhile is delivered
    history.run(late_s)
    for child in ["odom"] * 20 + ["base"] * 100:
        history.live.note_arrivals((child,), history.now)
    history.steadily(6, 10, "odom", "base", "base", "base", "base", "base")
    assert history.findings() == []
    assert len(history.run(2).findings()) == 2


@settings(max_examples=80, deadline=None)
@given(
    st.sampled_from((10.0, 50.0)),
    st.lists(st.floats(-0.45, 0.45), min_size=400, max_size=400),
    st.lists(st.sampled_from((0.05, 0.1, 0.2, 0.4, 1.5)), max_size=12),
)
def test_jitter_and_checks_at_uneven_times_find_nothing(
    hertz: float, jitter: list[float], ticks: list[float]
) -> None:
    plan = Plan("rover", "0", None, RosSettings(), (edge("map odom", "slam", hertz),), ())
    live, arrival_s, now, sent = Liveness(plan), 500.0, 500.0, 0
    times = [500.0 + (n + part) / hertz for n, part in enumerate(jitter)]
    for pause in [*ticks, *[TICK_S] * 20]:
        now += pause
        while sent < len(times) and times[sent] <= now:
            arrival_s = max(arrival_s, times[sent])
            live.note_arrivals(("odom",), now if pause > TICK_S else arrival_s)
            sent += 1
        if sent < len(times):
            assert [event for event in live.judge(now) if isinstance(event, FindingShown)] == []


def test_a_latching_owner_that_leaves_is_reported_once_and_when_it_is_back(
    watch: Callable[..., History],
) -> None:
    live = watch(
        edge("base lidar", "static", None, "static"), edge("base imu", "static", None, "static")
    ).live
    assert live.static_writers([]) == []
    live.note_arrivals(("lidar",), 1)
    live.note_arrivals(("imu",), 1)
    assert live.static_writers(["/static", "/other"]) == []
    (event,) = live.static_writers(["/other"])
    assert isinstance(event, FindingShown)
    expect(event.found, "TF804", "static (/static)", "base → lidar, base → imu")
    assert live.static_writers([]) == []
    (back,) = live.static_writers(["/static"])
    assert isinstance(back, RecoveredShown)
    assert back.text.startswith("static (/static) ")


def test_edges_may_come_together_apart_and_in_other_company(watch: Callable[..., History]) -> None:
    history = watch(*(edge(f"base {child}", "drive", 4) for child in "abc"))
    for _ in range(10):
        for children in (("a", "b", "c"), ("a", "b"), ("b", "c"), ("c",), ("a", "c")):
            history.live.note_arrivals(children, history.now)
            history.run(0.1)
    assert history.findings() == []
    for _ in range(20):
        history.live.note_arrivals(("a", "b"), history.now)
        history.run(0.1)
    expect(history.only(), "TF804", " base → c ")
