"""Findings of the guard about publishers and edges, from histories with a set clock."""

import re
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.findings import expect, words_of
from tests.support.guard_history import FIXED, SETTLE_S, TICK_S, History, Publisher
from tfcompose.model.messages import (
    Clear,
    FindingShown,
    Live,
    OwnerReady,
    RecoveredShown,
    TreeComplete,
)
from tfcompose.model.plan import EdgePattern, GuardPolicy, SourceLine


def test_owners_are_live_and_nothing_is_found(running: History) -> None:
    static, joints = running.joins("/static", static=True), running.joins("/joints")
    slam, drive = running.joins("/slam"), running.joins("/drive")
    running.send(static, FIXED)
    for _ in range(40):
        running.send(joints, "base left").send(slam, "map odom").send(drive, "odom base").wait(0.1)
    live = (
        ("static", ("lidar", "camera")),
        ("joints", ("left",)),
        ("slam", ("odom",)),
        ("drive", ("base",)),
    )
    assert running.all(Live) == [Live(owner, children) for owner, children in live]
    assert running.all(OwnerReady) == [
        OwnerReady(name) for name in ("static", "joints", "slam", "drive")
    ]
    assert running.all(TreeComplete) == [TreeComplete(5)]
    assert running.reports() == []


def test_all_is_clear_after_the_settling_time_when_nobody_sends(history: History) -> None:
    history.wait(SETTLE_S - 0.05)
    assert history.events == []
    assert history.wait(TICK_S).events == [Clear()]


def test_findings_name_the_lines_of_the_plan_that_is_followed_now(running: History) -> None:
    slam, static = running.joins("/slam"), running.joins("/static", static=True)
    running.send(static, FIXED).repeat(slam, "map odom", 20)
    running.repeat(running.joins("/rogue"), "odom base", 3)
    running.leaves(static)
    running.wait(5)
    judge = running.judge

    def lines() -> set[int]:
        notes = [
            note.message
            for finding in (*judge.wrong(), *judge.live.wrong())
            for note in finding.notes
        ]
        return {int(line) for note in notes for line in re.findall(r"rover.yaml:(\d+)", note)}

    assert lines() == {7}
    moved = tuple(replace(edge, source=SourceLine("rover.yaml", 9)) for edge in judge.plan.edges)
    judge.follow(replace(judge.plan, edges=moved))
    assert lines() == {9}
    running.dies().wait(0.5)
    assert lines() == {9}


def test_an_external_owner_that_is_there_before_the_start_is_right(history: History) -> None:
    drive = history.joins("/drive")
    history.repeat(drive, "odom base", 30)
    assert history.reports() == []
    assert Live("drive", ("base",)) in history.events


def test_a_restarted_owner_is_right_while_its_old_publisher_lingers(
    running: History,
) -> None:
    for _ in range(4):
        running.repeat(running.joins("/slam"), "map odom", 10)
    assert running.reports() == []


def test_an_owner_may_send_other_edges_that_are_allowed() -> None:
    running = History(
        GuardPolicy(unknown_edges="error", allow=(EdgePattern("map", "goal_*"),))
    ).clear()
    running.repeat(running.joins("/slam"), "map odom, map goal_1", 5)
    assert running.reports() == []


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(("/static", "/joints", "/slam", "/drive")),
            st.floats(0, 0.3),
            st.floats(0, 0.65),
        ),
        max_size=40,
    )
)
def test_rightful_messages_give_no_finding_in_any_order_with_late_names(
    sends: list[tuple[str, float, float]],
) -> None:
    running = History().clear()
    edges = {"/static": FIXED, "/joints": "base left", "/slam": "map odom", "/drive": "odom base"}
    publishers: dict[str, Publisher] = {}
    named: list[tuple[float, Publisher, str]] = []
    for node, pause, delay in sends:
        if node not in publishers:
            publishers[node] = running.joins(None, static=node == "/static")
            named.append((running.now + delay, publishers[node], node))
        for time_s, publisher, name in named:
            publisher.node = name if running.now >= time_s else publisher.node
        running.send(
            publishers[node], edges[node], ago=min(delay, running.now - 1000 - SETTLE_S - TICK_S)
        ).wait(pause)
    for _, publisher, name in named:
        publisher.node = name
    running.wait(2)
    assert running.reports() == []
    assert {e.owner for e in running.all(Live) if isinstance(e, Live)} == {
        name[1:] for name in publishers
    }


def test_a_foreign_publisher_is_named_once_and_at_the_next_check(running: History) -> None:
    rogue = running.joins("/rogue")
    running.send(rogue, "map odom").wait(TICK_S).repeat(rogue, "map odom", 100)
    (finding,) = running.findings()
    expect(finding, "TF801", "map → odom", "/rogue", "slam (/slam)", "rover.yaml:7")
    assert finding.severity == "error"


def test_a_foreign_publisher_that_ends_and_returns_is_reported_each_time(
    running: History,
) -> None:
    rogue = running.joins("/rogue")
    running.repeat(rogue, "map odom", 5)
    running.leaves(rogue)
    (over,) = running.wait(4).over()
    assert words_of(over) >= {"map", "odom", "/rogue"}
    running.repeat(running.joins("/rogue"), "map odom", 5)
    assert len(running.findings()) == 2


def test_a_foreign_publisher_that_sends_every_5_s_is_reported_once(
    running: History,
) -> None:
    rogue = running.joins("/rogue")
    running.repeat(rogue, "map odom", 10, every=5)
    assert len(running.findings()) == 1
    assert running.all(RecoveredShown) == []
    assert len(running.wait(31).all(RecoveredShown)) == 1


def test_a_foreign_publisher_is_reported_again_after_a_long_pause(
    running: History,
) -> None:
    rogue = running.joins("/rogue")
    running.repeat(rogue, "map odom", 5).wait(40).repeat(rogue, "map odom", 5)
    assert (len(running.findings()), len(running.all(RecoveredShown))) == (2, 1)


def test_a_latched_offence_lasts_while_its_publisher_does(running: History) -> None:
    rogue = running.joins("/rogue", static=True)
    running.send(rogue, "base lidar").wait(120)
    assert (len(running.findings()), running.all(RecoveredShown)) == (1, [])
    running.leaves(rogue)
    assert len(running.wait(4).all(RecoveredShown)) == 1


def test_many_edges_of_one_node_are_one_finding_even_in_separate_messages(
    running: History,
) -> None:
    rogue = running.joins("/rogue", static=True)
    running.send(rogue, "base lidar").send(rogue, "base camera").wait(TICK_S)
    (finding,) = running.findings()
    expect(finding, "TF801", "base → lidar and 1 more", "/rogue", "static (/static)")
    assert [note.message for note in finding.notes][:2] == ["base → lidar", "base → camera"]


def test_later_edges_of_an_offender_are_reported_and_a_floods_at_once(
    running: History,
) -> None:
    rogue = running.joins("/rogue")
    for n in range(100):
        running.send(rogue, f"base thing_{n}").wait(0.02)
    running.wait(1)
    assert 2 <= len(running.findings()) <= 6
    assert len(running.findings()[1].notes) <= 13
    running.send(rogue, "map odom").wait(TICK_S)
    assert running.findings()[-1].code == "TF801"


@pytest.mark.parametrize(
    ("sent", "code", "names"),
    [
        (
            ("/rogue", "map odom, odom base, odom base", False),
            "TF801",
            ["map → odom and 1 more", "slam (/slam), drive"],
        ),
        (
            ("/rogue", "base_footprint base", False),
            "TF802",
            ["base_footprint (from /rogue)", "odom", "drive (/drive)"],
        ),
        (("/drive", "odom base, map base", False), "TF802", ["map → base", "drive (/drive)"]),
        (("/slam", "map odom", True), "TF809", ["map → odom", "/tf_static", "/slam"]),
        (
            ("/rogue", "base odom", False),
            "TF820",
            ["odom → base → odom", "base → odom from /rogue"],
        ),
        (("/slam", "odom odom", False), "TF821", ["/slam", "odom → odom"]),
    ],
)
def test_what_one_node_does_wrong_is_one_finding_with_its_names(
    running: History, sent: tuple[str, str, bool], code: str, names: list[str]
) -> None:
    node, edges, static = sent
    running.repeat(running.joins(node, static=static), edges, 10)
    expect(running.only(), code, *names)
    assert [event.owner for event in running.all(Live) if isinstance(event, Live)] in (
        [],
        ["drive"],
    )


@pytest.mark.parametrize(
    ("policy", "severities"), [("ignore", []), ("warn", ["warning"]), ("error", ["error"])]
)
def test_an_undeclared_edge_is_reported_as_the_policy_says(
    policy: str, severities: list[str]
) -> None:
    running = History(GuardPolicy(unknown_edges=policy)).clear()  # type: ignore[arg-type]
    running.repeat(running.joins("/tracker"), "map person", 10)
    assert [(finding.code, finding.severity) for finding in running.findings()] == [
        ("TF803", severity) for severity in severities
    ]


def test_only_undeclared_edges_that_no_pattern_allows_are_reported() -> None:
    running = History(GuardPolicy(allow=(EdgePattern("map", "person_*"),))).clear()
    tracker = running.joins("/tracker")
    running.repeat(tracker, "map person_1, odom person_2, map person", 3)
    (finding,) = running.findings()
    expect(finding, "TF803", "odom → person_2 and 1 more", "/tracker")
    assert [note.message for note in finding.notes] == ["odom → person_2", "map → person"]


def test_a_volatile_writer_of_static_edges_is_reported_once_with_its_edges(
    running: History,
) -> None:
    running.joins("/static", static=True, volatile=True)
    running.joins("/slam", volatile=True)
    running.wait(5)
    (finding,) = running.findings()
    expect(finding, "TF806", "/static", "/tf_static", "base → lidar")


@pytest.mark.parametrize("late", [0.0, 5.0])
def test_an_owner_that_replaced_an_unheard_latched_edge_is_reported_once(
    late: float,
) -> None:
    running = History().clear().wait(late)
    static = running.joins("/static", static=True)
    static.sent = 1  # with base → lidar, before the guard had found it
    running.send(static, "base camera").wait(1)
    assert running.reports() == []
    running.wait(5)
    (finding,) = running.findings()
    expect(finding, "TF850", "/static", "1 message", "/tf_static", "base → lidar")
    assert finding.severity == "warning"
    running.dies()
    running.wait(10)
    assert running.findings() == []


@pytest.mark.parametrize("edges", ["base lidar, base camera", "base camera"])
def test_an_owner_replaced_nothing_if_all_its_latched_messages_were_heard(
    edges: str,
) -> None:
    running = History().clear()
    static = running.joins("/static", static=True)
    static.sent = 0 if edges == "base camera" else 3
    running.send(static, edges).wait(5)
    running.send(static, FIXED).wait(5)
    assert running.reports() == []


def test_a_source_of_ever_new_frames_is_reported_ever_more_rarely(
    running: History,
) -> None:
    """A tracker that names its frames after what it sees: tag_1, tag_2, ….

    For a minute, ten a second.
    """
    tracker = running.joins("/tracker")
    for number in range(600):
        running.send(tracker, f"base tag_{number}").wait(0.1)
    assert 5 < len(running.reports()) < 10
    running.wait(130)
    for texts in (running.reports(), running.over()):
        assert len(texts) < 20
        counted = [re.search(r"and (\d+) more", text) for text in texts]
        assert sum(1 + int(more[1]) if more else 1 for more in counted) == 600
    findings = [event.found for event in running.events if isinstance(event, FindingShown)]
    assert "child: 'tag_*'}" in (findings[-1].help or "")
    running.send(tracker, "base tag_600").wait(0.5)
    assert "base → tag_600" in running.reports()[-1], "after some quiet it is told at once again"
