"""What was there before the start, and what began after it."""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.support.findings import expect
from tests.support.guard_history import History
from tfcompose.model.messages import Clear, EdgeTaken, FindingShown


def test_an_edge_live_before_the_start_is_taken_and_its_node_is_named(
    history: History,
) -> None:
    history.repeat(history.joins("/rogue"), "map odom", 20)
    (event,) = history.all(EdgeTaken)
    assert history.events[0] == event
    expect(history.only(), "TF807", "map → odom", "node: /rogue")


def test_a_namesake_of_what_the_plan_starts_is_refused_before_the_start(history: History) -> None:
    history.repeat(history.joins("/slam"), "map odom", 10)
    expect(history.only(), "TF807", "map → odom", "another /slam")
    assert "external" not in history.findings()[0].help


def test_a_second_parent_before_the_start_is_taken_and_says_so(history: History) -> None:
    history.repeat(history.joins("/rogue"), "world odom", 10)
    expect(history.only(), "TF807", "world → odom", "/rogue", "map")


def test_an_undeclared_edge_before_the_start_keeps_nothing_from_starting(history: History) -> None:
    history.repeat(history.joins("/tracker"), "map person", 20)
    assert (history.all(EdgeTaken), [finding.code for finding in history.findings()]) == (
        [],
        ["TF803"],
    )
    assert Clear() in history.events


def test_all_is_not_clear_while_a_sender_of_a_planned_edge_has_no_name(history: History) -> None:
    drive = history.joins(None)
    history.repeat(drive, "odom base", 30)
    assert Clear() not in history.events
    drive.node = "/drive"
    assert Clear() in history.repeat(drive, "odom base", 3).events


@pytest.mark.parametrize("hertz", [5, 10, 50, 200])
def test_a_publisher_that_was_there_first_and_is_discovered_late_is_taken(
    running: History, hertz: int
) -> None:
    rogue = running.joins("/rogue")
    rogue.sent = 5 * hertz
    running.wait(2).repeat(rogue, "map odom", hertz, every=1 / hertz)
    assert [
        type(event) for event in running.events if isinstance(event, (FindingShown, EdgeTaken))
    ] == [EdgeTaken]


def test_a_latched_message_from_before_the_start_is_taken_however_late(
    running: History,
) -> None:
    running.wait(4).send(running.joins("/rogue", static=True), "base lidar", ago=10).wait(1)
    assert len(running.all(EdgeTaken)) == 1


@pytest.mark.parametrize("hertz", [5, 10, 50, 200])
def test_a_publisher_that_began_after_the_start_is_found_within_a_second(
    running: History, hertz: int
) -> None:
    rogue = running.joins("/rogue")
    rogue.sent = max(1, hertz // 5)
    running.wait(0.5).repeat(rogue, "map odom", round(0.9 * hertz), every=1 / hertz)
    assert [
        type(event) for event in running.events if isinstance(event, (FindingShown, EdgeTaken))
    ] == [FindingShown]


def test_a_publisher_from_just_before_the_start_is_found_and_not_first(
    running: History,
) -> None:
    running.send(running.joins("/rogue", static=True), "base lidar", ago=0.4).wait(1)
    assert [
        type(event) for event in running.events if isinstance(event, (FindingShown, EdgeTaken))
    ] == [FindingShown]


def test_lost_messages_do_not_make_a_newcomer_one_that_was_first(running: History) -> None:
    rogue = running.joins("/rogue")
    running.wait(0.3)
    rogue.sent = 10
    for _ in range(12):
        rogue.sent += 3
        running.send(rogue, "map odom").wait(0.08)
    assert (running.all(EdgeTaken), len(running.findings())) == ([], 1)


@settings(max_examples=100, deadline=None)
@example(50, [0.0] * 12, 0, 0.6, 0.2)
@given(
    st.sampled_from((5, 10, 50, 200)),
    st.lists(st.floats(-0.9, 0.9), min_size=12, max_size=12),
    st.integers(0, 11),
    st.floats(0, 0.8),
    st.floats(0, 0.2),
)
def test_jitter_and_a_hiccup_do_not_make_a_newcomer_one_that_was_first(
    hertz: int, jitter: list[float], hiccup_index: int, hiccup: float, unheard_s: float
) -> None:
    running = History().clear()
    rogue = running.joins("/rogue")
    running.wait(unheard_s)
    rogue.sent = int(unheard_s * hertz)
    for index, part in enumerate(jitter):
        running.send(rogue, "map odom", ago=part * 0.5 / hertz).wait(
            1 / hertz + (hiccup if index == hiccup_index else 0)
        )
    running.wait(1)
    assert running.all(EdgeTaken) == []
    assert len(running.findings()) == 1


def test_a_publisher_is_not_taken_for_first_long_after_the_start(running: History) -> None:
    running.wait(20).send(running.joins("/rogue", static=True), "base lidar", ago=60).wait(1)
    assert [
        type(event) for event in running.events if isinstance(event, (FindingShown, EdgeTaken))
    ] == [FindingShown]
