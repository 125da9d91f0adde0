"""Whom the guard names: names that come late, two of one name, ids that do not say whose they are."""

from dataclasses import replace

from tests.support.findings import expect
from tests.support.guard_history import EDGES, FIXED, PROCESSES, SETTLE_S, TICK_S, History
from tfcompose.guard.judge import Judge
from tfcompose.ipc import Live, Recovered, Taken
from tfcompose.live.state import NAMELESS
from tfcompose.plan import Plan, RosSettings


def test_a_publisher_whose_name_comes_later_is_judged_when_it_is_known(running: History) -> None:
    rogue = running.joins(None)
    running.send(rogue, "map odom").wait(0.4)
    assert running.reports() == []
    rogue.node = "/rogue"
    expect(running.wait(TICK_S).only(), "TF801", "/rogue;")


def test_an_owner_whose_name_comes_after_seconds_is_not_blamed(running: History) -> None:
    slam = running.joins(None)
    running.repeat(slam, "map odom", 40)
    slam.node = "/slam"
    running.repeat(slam, "map odom", 10)
    assert running.reports() == []
    assert Live("slam", ("odom",)) in running.events


def test_a_publisher_without_a_name_is_reported_within_a_second_where_the_owner_is_known(running: History) -> None:
    slam, stranger = running.joins("/slam"), running.joins(None)
    for _ in range(9):
        running.send(slam, "map odom").send(stranger, "map odom").wait(0.1)
    expect(running.only(), "TF801", "map → odom", NAMELESS, "slam (/slam)")


def test_a_publisher_that_gets_its_name_after_it_was_reported_is_named_once_and_not_reported_to_have_ended(
    running: History,
) -> None:
    slam, stranger = running.joins("/slam"), running.joins(None)
    running.send(slam, "map odom").repeat(stranger, "map odom", 15)
    stranger.node = "/rogue"
    running.repeat(stranger, "map odom", 350)
    first, second = running.found()
    expect(first, "TF801", NAMELESS)
    expect(second, "TF801", "/rogue;")
    assert running.all(Recovered) == []


def test_a_publisher_that_never_gets_a_name_is_reported_at_last(running: History) -> None:
    running.repeat(running.joins(None), "map odom", 60)
    assert [found.code for found in running.found()] == ["TF801"]


def test_a_publisher_that_sends_once_and_leaves_is_named(running: History) -> None:
    rogue = running.joins("/rogue")
    running.check().leaves(rogue)
    assert "/rogue" in running.send(rogue, "map odom").wait(TICK_S).reports()[0]


def test_two_publishers_of_one_name_that_alternate_are_reported_and_the_edge_is_not_silent() -> None:
    rated = tuple(replace(one, rate=10.0) if one.owner == "slam" else one for one in EDGES)
    running = History()
    running.judge = Judge(
        Plan("r", "0", "base", RosSettings(), rated, PROCESSES), SETTLE_S, running.now, running.wall_ns()
    )
    running.clear()
    a, b = running.joins("/slam"), running.joins("/slam")
    for _ in range(20):
        running.send(a, "map odom").wait(0.1).send(b, "map odom").wait(0.1)
    expect(running.only(), "TF801", "map → odom", "another /slam", "slam (/slam)")


def test_a_second_static_process_is_reported_while_both_are_there_and_over_when_it_has_left(running: History) -> None:
    first, second = (running.joins("/static", static=True) for _ in range(2))
    running.send(first, FIXED).wait(2).send(second, FIXED).wait(10)
    expect(running.only(), "TF801", "base → lidar and 1 more", "another /static", "static (/static)")
    assert running.all(Recovered) == []
    running.leaves(second)
    assert len(running.wait(4).all(Recovered)) == 2


def test_a_static_process_in_the_place_of_one_that_has_left_is_right(running: History) -> None:
    first = running.joins("/static", static=True)
    running.send(first, FIXED).wait(1).leaves(first)
    running.send(running.joins("/static", static=True), FIXED).wait(1)
    assert running.reports() == []


def test_a_static_owner_that_leaves_is_reported_once(running: History) -> None:
    static = running.joins("/static", static=True)
    running.send(static, FIXED).wait(1).leaves(static)
    running.wait(10)
    assert [found.code for found in running.found()] == ["TF804"]


def test_without_ids_nobody_is_blamed_where_the_owner_may_have_sent_it() -> None:
    running = History(gids=False).clear()
    slam, rogue = running.joins("/slam"), running.joins("/slam_helper")
    for _ in range(10):
        running.send(slam, "map odom").send(rogue, "map odom").wait(0.1)
    assert running.reports() == []


def test_without_ids_one_of_those_that_may_have_sent_it_is_blamed_once_and_nobody_was_first() -> None:
    running = History(gids=False)
    drive = running.joins("/drive")
    running.repeat(drive, "odom base", 20)
    rogue = running.joins("/rogue")
    running.joins("/static", static=True)
    running.repeat(rogue, "map odom", 10)
    running.joins("/late")
    running.repeat(rogue, "map odom", 20)
    expect(running.only(), "TF801", "map → odom", "one of /drive, /rogue;", "slam (/slam)")
    assert running.all(Taken) == []


def test_ids_that_do_not_say_whose_they_are_distinguish_two_that_alternate() -> None:
    running = History(says_who=False).clear()
    slam, rogue = running.joins("/slam"), running.joins("/rogue")
    running.repeat(slam, "map odom", 5)
    for _ in range(20):
        running.send(slam, "map odom").send(rogue, "map odom").wait(0.1)
    expect(running.only(), "TF801", "map → odom", "one of /rogue, /slam;", "slam (/slam)")
    running.leaves(rogue)
    running.repeat(slam, "map odom", 400)
    assert len(running.all(Recovered)) == 1


def test_where_ids_do_not_say_whose_they_are_who_came_just_now_is_one_of_those_that_may_have_sent_it() -> None:
    """Messages of a newcomer can be heard before the graph shows it."""
    running = History(says_who=False).clear()
    slam, rogue = running.joins("/slam"), running.joins("/rogue", hidden=True)
    running.joins("/drive")
    running.repeat(slam, "map odom", 5)
    for step in range(20):
        if step == 5:
            running.graph.append(rogue)
        running.send(slam, "map odom").send(rogue, "map odom").wait(0.1)
    expect(running.only(), "TF801", "map → odom", "one of /drive, /rogue, /slam;", "slam (/slam)")


def test_ids_that_do_not_say_whose_they_are_blame_no_owner_and_nobody_who_was_started_anew() -> None:
    running = History(says_who=False).clear()
    slam, drive = running.joins("/slam"), running.joins("/drive")
    static = running.joins("/static", static=True)
    running.send(static, "base lidar", static=True)
    for _ in range(30):
        running.send(slam, "map odom").send(drive, "odom base").wait(0.1)
    running.leaves(slam)
    again = running.joins("/slam")
    for _ in range(30):
        running.send(again, "map odom").send(drive, "odom base").wait(0.1)
    assert running.reports() == []
    assert {child for one in running.all(Live) if isinstance(one, Live) for child in one.children} >= {"odom", "base"}


def test_ids_that_do_not_say_whose_they_are_name_all_who_may_have_sent_what_nobody_there_owns() -> None:
    running = History(says_who=False).clear()
    drive, rogue = running.joins("/drive"), running.joins("/rogue")
    for _ in range(30):
        running.send(drive, "odom base").send(rogue, "map odom, base cup").wait(0.1)
    first, second = running.found()
    expect(first, "TF801", "map → odom", "one of /drive, /rogue;")
    expect(second, "TF803", "base → cup", "one of /drive, /rogue,")


def test_a_name_that_is_part_of_the_owners_does_not_pass_for_it() -> None:
    running = History(gids=False).clear()
    running.joins("/slam_toolbox")
    running.repeat(running.joins("/other"), "map odom", 10)
    assert [found.code for found in running.found()] == ["TF801"]
