"""Whom the guard names: late names, two nodes of one name, ids that identify nobody."""

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import pytest

from tests.support.findings import expect, words_of
from tests.support.guard_history import EDGES, FIXED, PROCESSES, SETTLE_S, TICK_S, History, edge
from tests.support.guard_history import Publisher as Publishes
from tfcompose.foundation.findings import Finding
from tfcompose.guard.judge import Judge
from tfcompose.guard.verdict.publishers import unfenced_finding
from tfcompose.model.messages import (
    Clear,
    EdgeTaken,
    FilterBypassed,
    FindingShown,
    Live,
    RecoveredShown,
)
from tfcompose.model.plan import GuardPolicy, Plan, PlanProcess, RosSettings
from tfcompose.tf.live.publishers import OtherRun, Publisher
from tfcompose.tf.live.state import NAMELESS, NO_NODE
from tfcompose.tf.live.topics import Identity, RunMarks

GuardMode = Literal["watch", "strict"]


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


def test_an_unnamed_publisher_of_an_owned_edge_is_reported_within_1_s(
    running: History,
) -> None:
    slam, stranger = running.joins("/slam"), running.joins(None)
    for _ in range(9):
        running.send(slam, "map odom").send(stranger, "map odom").wait(0.1)
    expect(running.only(), "TF801", "map → odom", NAMELESS, "slam (/slam)")


def test_a_publisher_with_a_late_name_is_named_once_and_has_not_ended(
    running: History,
) -> None:
    slam, stranger = running.joins("/slam"), running.joins(None)
    running.send(slam, "map odom").repeat(stranger, "map odom", 15)
    stranger.node = "/rogue"
    running.repeat(stranger, "map odom", 350)
    first, second = running.findings()
    expect(first, "TF801", NAMELESS)
    expect(second, "TF801", "/rogue;")
    assert running.all(RecoveredShown) == []


def test_a_publisher_that_never_gets_a_name_is_reported_at_last(running: History) -> None:
    running.repeat(running.joins(None), "map odom", 60)
    assert [finding.code for finding in running.findings()] == ["TF801"]


def test_a_publisher_that_sends_once_and_leaves_is_named(running: History) -> None:
    rogue = running.joins("/rogue")
    running.check().leaves(rogue)
    assert "/rogue" in running.send(rogue, "map odom").wait(TICK_S).reports()[0]


def test_two_namesakes_that_alternate_are_reported_and_the_edge_is_live() -> None:
    rated = tuple(
        replace(planned, rate=10.0) if planned.owner == "slam" else planned for planned in EDGES
    )
    running = History()
    running.judge = Judge(
        Plan("r", "0", "base", RosSettings(), rated, PROCESSES),
        SETTLE_S,
        running.now,
        running.wall_ns(),
    )
    running.clear()
    a, b = running.joins("/slam"), running.joins("/slam")
    for _ in range(20):
        running.send(a, "map odom").wait(0.1).send(b, "map odom").wait(0.1)
    expect(running.only(), "TF801", "map → odom", "another /slam", "slam (/slam)")


def test_two_that_latch_alternately_may_be_one_owner_that_is_heard_again() -> None:
    """Latched messages arrive again from each publisher after a new subscription."""
    running = History(edges=(edge("base arm", "arm", "static"),)).clear()
    a, b = (running.joins("/arm", static=True) for _ in range(2))
    for publisher in (a, b, a, b, a):
        running.send(publisher, "base arm").wait(1)
    assert running.reports() == []


def test_a_second_static_process_is_reported_until_it_leaves(
    running: History,
) -> None:
    first, second = (running.joins("/static", static=True) for _ in range(2))
    running.send(first, FIXED).wait(2).send(second, FIXED).wait(10)
    expect(
        running.only(), "TF801", "base → lidar and 1 more", "another /static", "static (/static)"
    )
    assert running.all(RecoveredShown) == []
    running.leaves(second)
    assert len(running.wait(4).all(RecoveredShown)) == 2


def test_a_static_process_in_the_place_of_one_that_has_left_is_right(running: History) -> None:
    first = running.joins("/static", static=True)
    running.send(first, FIXED).wait(1).leaves(first)
    running.send(running.joins("/static", static=True), FIXED).wait(1)
    assert running.reports() == []


def test_a_static_owner_that_leaves_is_reported_once(running: History) -> None:
    static = running.joins("/static", static=True)
    running.send(static, FIXED).wait(1).leaves(static)
    running.wait(10)
    assert [finding.code for finding in running.findings()] == ["TF804"]


def test_without_ids_nobody_is_blamed_where_the_owner_may_have_sent_it() -> None:
    running = History(gids=False).clear()
    slam, rogue = running.joins("/slam"), running.joins("/slam_helper")
    for _ in range(10):
        running.send(slam, "map odom").send(rogue, "map odom").wait(0.1)
    assert running.reports() == []


def test_without_ids_one_suspect_is_blamed_once_and_no_node_was_first() -> None:
    running = History(gids=False)
    drive = running.joins("/drive")
    running.repeat(drive, "odom base", 20)
    rogue = running.joins("/rogue")
    running.joins("/static", static=True)
    running.repeat(rogue, "map odom", 10)
    running.joins("/late")
    running.repeat(rogue, "map odom", 20)
    expect(running.only(), "TF801", "map → odom", "one of /drive, /rogue;", "slam (/slam)")
    assert running.all(EdgeTaken) == []


def test_ids_that_do_not_say_whose_they_are_distinguish_two_that_alternate() -> None:
    running = History(gid_identifies_node=False).clear()
    slam, rogue = running.joins("/slam"), running.joins("/rogue")
    running.repeat(slam, "map odom", 5)
    for _ in range(20):
        running.send(slam, "map odom").send(rogue, "map odom").wait(0.1)
    expect(running.only(), "TF801", "map → odom", "one of /rogue, /slam;", "slam (/slam)")
    running.leaves(rogue)
    running.repeat(slam, "map odom", 400)
    assert len(running.all(RecoveredShown)) == 1


def test_without_ids_a_newcomer_is_one_of_those_that_may_have_sent_it() -> None:
    """Messages of a newcomer can be heard before the graph shows it."""
    running = History(gid_identifies_node=False).clear()
    slam, rogue = running.joins("/slam"), running.joins("/rogue", hidden=True)
    running.joins("/drive")
    running.repeat(slam, "map odom", 5)
    for step in range(20):
        if step == 5:
            running.graph.append(rogue)
        running.send(slam, "map odom").send(rogue, "map odom").wait(0.1)
    expect(running.only(), "TF801", "map → odom", "one of /drive, /rogue, /slam;", "slam (/slam)")


def test_unassignable_ids_blame_no_owner_and_no_restarted_node() -> None:
    running = History(gid_identifies_node=False).clear()
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
    assert {
        child for event in running.all(Live) if isinstance(event, Live) for child in event.children
    } >= {"odom", "base"}


def test_without_ids_all_who_may_have_sent_a_foreign_edge_are_named() -> None:
    running = History(gid_identifies_node=False).clear()
    drive, rogue = running.joins("/drive"), running.joins("/rogue")
    for _ in range(30):
        running.send(drive, "odom base").send(rogue, "map odom, base cup").wait(0.1)
    first, second = running.findings()
    expect(first, "TF801", "map → odom", "one of /drive, /rogue;")
    expect(second, "TF803", "base → cup", "one of /drive, /rogue,")


def test_a_name_that_is_part_of_the_owners_does_not_pass_for_it() -> None:
    running = History(gids=False).clear()
    running.joins("/slam_toolbox")
    running.repeat(running.joins("/other"), "map odom", 10)
    assert [finding.code for finding in running.findings()] == ["TF801"]


# Two with the owner's name: which is the owner is proven by processes, not by names.


@pytest.mark.parametrize("foreign_first", [False, True])
@pytest.mark.parametrize("process", ["", None, "joints"])
@pytest.mark.parametrize(
    ("node", "edges", "owner"), [("/slam", "map odom", "slam"), ("/static", FIXED, "static")]
)
def test_of_two_with_the_owners_name_the_runs_own_process_is_the_owner(
    node: str, edges: str, owner: str, process: str | None, *, foreign_first: bool
) -> None:
    """The other one is of another run, invisible, or another process of this run.

    It may also come first.
    """
    running = History(GuardPolicy(mode="strict")).clear()
    static = owner == "static"
    pair = [
        running.joins(node, static=static, process=process),
        running.joins(node, static=static, process=owner),
    ]
    namesake, owner_publisher = pair
    running.repeat(namesake, edges, 3) if foreign_first else running.check()
    for _ in range(10):
        running.send(owner_publisher, edges)
        assert running.admitted is None, "the owner's messages pass"
        running.send(namesake, edges).wait(0.1)
        assert running.admitted == frozenset(), "the other's do not"
    events = [event for event in running.events if isinstance(event, FindingShown)]
    assert {event.found.code for event in events} == {"TF801"}
    assert {event.process for event in events} == ({"joints"} if process == "joints" else {""})
    expect(events[0].found, "TF801", f"another {node}")


def test_a_child_with_a_stopped_owners_name_is_not_the_owner() -> None:
    running = History(GuardPolicy(mode="strict")).clear()
    slam = running.joins("/slam", process="slam")
    running.repeat(slam, "map odom", 3)
    running.leaves(slam)
    running.judge.absent("slam")
    child = running.joins("/slam", process="joints")
    running.repeat(child, "map odom", 5)
    assert running.admitted == frozenset()
    expect(running.only(), "TF801", "another /slam")


def test_a_restarted_owner_is_the_owner_even_out_of_sight() -> None:
    for before, after in (("slam", "slam"), (None, None), ("", "")):
        running = History().clear()
        slam = running.joins("/slam", process=before)
        running.repeat(slam, "map odom", 5)
        running.leaves(slam)
        running.repeat(running.joins("/slam", process=after), "map odom", 5)
        assert running.findings() == []


def test_an_external_owner_may_be_started_by_another_process_of_the_plan() -> None:
    running = History().clear()
    running.repeat(running.joins("/drive", process="slam"), "odom base", 5)
    assert running.findings() == []


def test_a_program_without_ros_is_called_so_despite_its_middleware_name() -> None:
    running = History().clear()
    running.repeat(running.joins(NO_NODE, process=""), "map odom", 3)
    finding = running.only()
    expect(finding, "TF801", NO_NODE)
    assert finding.help.startswith("stop it")


# A process of a strict plan that is not behind its fence.


def identity(process: str, *, fenced: bool, profile: str = "") -> Identity:
    return Identity(ours=True, process=process, fenced=fenced, profile=profile)


@pytest.mark.parametrize(
    ("environments", "expected"),
    [
        (None, Identity()),
        ([], Identity(ours=False)),
        ([{"RUN": "other"}], Identity(ours=False)),
        (
            [{"RUN": "1", "P": "arm/a", "XML": "/run/plan-1/fence/arm.a.xml"}],
            identity("arm/a", fenced=True),
        ),
        (
            [{"RUN": "1", "P": "a", "XML": "/home/me/fast.xml"}],
            identity("a", fenced=False, profile="/home/me/fast.xml"),
        ),
        (
            [{"RUN": "1", "P": "a", "XML": "/run/1/fence/b.xml"}],
            identity("a", fenced=False, profile="/run/1/fence/b.xml"),
        ),
        ([{"RUN": "1", "P": "a"}], identity("a", fenced=False)),
        ([{"RUN": "1", "P": "a"}, {}], identity("a", fenced=False)),
        ([{"RUN": "1", "P": "a"}, {"RUN": "1", "P": "b"}], Identity(ours=True)),
    ],
)
def test_a_process_environment_tells_its_owner_and_whether_it_is_fenced(
    environments: list[dict[str, str]] | None, expected: Identity
) -> None:
    assert RunMarks("RUN", "1", "P", "XML").identify(environments) == expected
    without = RunMarks("RUN", "1", "P").identify(environments)
    assert without == replace(expected, fenced=None, profile="")


def test_a_process_past_the_fence_is_reported_for_stopping_once() -> None:
    running = History(GuardPolicy(mode="strict")).clear()

    def left() -> list[FilterBypassed]:
        return [event for event in running.events if isinstance(event, FilterBypassed)]

    for fenced, process in (
        (True, "slam"),
        (None, "slam"),
        (False, ""),
        (False, "slam"),
        (False, "slam"),
    ):
        gid = b"1" * 16 if fenced is False and process else bytes([7]) * 16
        publisher = Publisher(
            gid, "/slam", static=False, ours=bool(process), process=process, fenced=fenced
        )
        running.events += running.judge.graph([publisher], running.now)
    assert not left(), "what it sends may be judged first"
    for _ in range(2):
        running.now += 1.0
        running.events += running.judge.graph([publisher], running.now)
    (event,) = left()
    assert (event.found.code, event.process) == ("TF852", "slam")


@pytest.mark.parametrize("fenced", [True, None, False])
def test_a_process_whose_environment_was_cleared_is_reported_by_its_number(
    *, fenced: bool | None
) -> None:
    running = History(GuardPolicy(mode="strict")).clear()
    publisher = Publisher(b"1" * 16, "/slam", static=False, ours=False, fenced=fenced, unmarked=77)
    for _ in range(3):
        running.now += 1.0
        running.events += running.judge.graph([publisher], running.now)
    events = [event for event in running.events if isinstance(event, FilterBypassed)]
    assert [(event.found.code, event.process, event.pid) for event in events] == (
        [("TF852", "", 77)] if fenced is False else []
    )


def test_edges_sent_past_the_fence_are_reported_before_the_stop() -> None:
    running = History(GuardPolicy(mode="strict")).clear()
    slam, renamed = running.joins("/slam"), running.joins("/slam")
    slam.ours, slam.process, slam.fenced = True, "slam", True
    renamed.ours, renamed.process, renamed.fenced = True, "drive", False
    running.check().send(slam, "map odom").send(renamed, "map odom").check()
    codes = [
        event.found.code
        for event in running.events
        if isinstance(event, (FindingShown, FilterBypassed))
    ]
    assert codes == ["TF801", "TF852"]


@pytest.mark.parametrize(
    ("profile", "words"),
    [
        ("/opt/own.xml", ["FASTRTPS_DEFAULT_PROFILES_FILE: /opt/own.xml", "slam: {env", "take"]),
        ("", ["keep FASTRTPS_DEFAULT_PROFILES_FILE"]),
    ],
)
def test_the_finding_about_who_leaves_the_fence_names_the_line_to_move(
    profile: str, words: list[str]
) -> None:
    finding = unfenced_finding("/slam", "slam", "/tf", profile, remapped=False)
    assert all(word in finding.help for word in words)


@pytest.mark.parametrize(
    ("static", "fenced", "kept"), [(True, None, True), (True, True, False), (False, None, False)]
)
def test_when_a_stranger_has_left_its_latched_edges_stay_with_listeners(
    *, static: bool, fenced: bool | None, kept: bool
) -> None:
    running = History(GuardPolicy(mode="strict" if fenced else "watch")).clear()
    rogue = running.joins("/rogue", static=static)
    rogue.fenced = fenced
    running.repeat(rogue, "base lidar" if static else "map odom", 5)
    running.leaves(rogue)
    (over,) = running.wait(5.0).over()
    assert ("listeners keep" in over) == kept


OTHER = OtherRun("other@0", 4711, "14:03:27")


def test_edges_of_another_robot_are_one_finding_with_its_name_and_ways_out() -> None:
    running = History().clear()
    slam, wheels = running.joins("/other/slam"), running.joins("/other/wheels")
    slam.run = wheels.run = OTHER
    for _ in range(20):
        running.send(wheels, "cart left_wheel, cart right_wheel").send(
            slam, "map odom, odom cart"
        ).wait(0.1)
    findings = running.findings()
    assert {finding.code for finding in findings} == {"TF854"}
    assert len(findings) <= 2, "a warning of its own frames, and an error of those that both have"
    expect(
        findings[-1],
        "TF854",
        "other@0",
        "pid 4711",
        "domain_id",
        "isolate: topics",
        "both robots have odom",
    )
    running.leaves(slam)
    running.leaves(wheels)
    assert any("other@0" in over for over in running.wait(10.0).over())


def test_another_robot_with_own_frames_is_a_warning_and_blocks_no_start() -> None:
    running = History()
    wheels = running.joins("/other/wheels")
    wheels.run = OTHER
    running.repeat(wheels, "cart left_wheel, cart right_wheel", 20)
    assert Clear() in running.events
    assert [(finding.code, finding.severity) for finding in running.findings()] == [
        ("TF854", "warning")
    ]


def test_another_robot_that_has_an_edge_of_the_plan_keeps_it_from_starting() -> None:
    running = History()
    slam = running.joins("/other/slam")
    slam.run = OTHER
    running.repeat(slam, "map odom", 5)
    (event,) = running.all(EdgeTaken)
    assert isinstance(event, EdgeTaken)
    expect(event.found, "TF854", "other@0", "odom")


def test_the_environment_of_another_robots_process_says_whose_run_it_is() -> None:
    marks = RunMarks("RUN", "rover@0:1", "P", launcher="L")
    environment = {"RUN": "other@0:7", "L": "4711:100", "P": "slam"}
    run = marks.identify([environment]).run
    assert run is not None
    assert (run.name, run.pid) == ("other@0", 4711)
    own_environments: list[dict[str, str]] = [environment | {"RUN": "rover@0:1"}]
    unsure: list[list[dict[str, str]] | None] = [
        [environment, {}],
        [environment | {"L": ""}],
        own_environments,
        [{}],
        [],
        None,
    ]
    for environments in unsure:
        assert marks.identify(environments).run is None


# Several of one name: each is named by its process.


def pids_of(finding: Finding) -> list[int]:
    """Return the processes that a finding says to run, in order."""
    runs = (
        re.search(r" runs on this machine as pid (\d+)", note.message) for note in finding.notes
    )
    return sorted(int(match[1]) for match in runs if match)


def send_all(
    running: History, publishers: Sequence[Publishes], edges: str, seconds: float
) -> None:
    """Let all of them send, by turns, each ten times a second."""
    for _ in range(round(seconds / 0.1)):
        for publisher in publishers:
            running.send(publisher, edges)
        running.wait(0.1)


@pytest.mark.parametrize("mode", ["watch", "strict"])
@pytest.mark.parametrize("owner", ["slam", "drive"])
def test_each_of_three_namesakes_is_named_and_who_remains(mode: GuardMode, owner: str) -> None:
    """The plan starts slam, whose processes prove that.

    Of drive, which is external, any may be it.
    """
    running = History(GuardPolicy(mode=mode)).clear()
    edges = {"slam": "map odom", "drive": "odom base"}[owner]
    process = owner if owner == "slam" else None
    owner_publisher = running.joins(f"/{owner}", process=process, pid=10)
    send_all(running, [owner_publisher], edges, 1.0)
    namesakes = [running.joins(f"/{owner}", process="", pid=pid) for pid in (11, 12, 13)]
    present = [owner_publisher, *namesakes]
    anybody = [10] if owner == "drive" else []
    send_all(running, present, edges, 2.0)
    assert pids_of(running.findings()[-1]) == [*anybody, 11, 12, 13]
    for ended, remaining in ((12, [11, 13]), (11, [13])):
        before = len(running.events)
        leaving = next(publisher for publisher in present if publisher.pid == ended)
        running.leaves(leaving)
        present.remove(leaving)
        send_all(running, present, edges, 10.0)
        new = History.findings_in(running.events[before:])
        assert [pids_of(finding) for finding in new] == [[*anybody, *remaining]]
        expect(new[0], "TF801", f"another /{owner}", f"pid {ended}")
    assert running.over() == []
    running.leaves(namesakes[2])
    before = len(running.findings())
    send_all(running, [owner_publisher], edges, 5.0)
    assert (len(running.over()), len(running.findings())) == (1, before)


@pytest.mark.parametrize("mode", ["watch", "strict"])
def test_of_ten_strangers_and_ten_namesakes_each_is_named(mode: GuardMode) -> None:
    running = History(GuardPolicy(mode=mode)).clear()
    slam = running.joins("/slam", process="slam", pid=10)
    rogues = [running.joins(f"/rogue_{pid}", process="", pid=pid) for pid in range(20, 30)]
    rogues += [running.joins("/slam", process="", pid=pid) for pid in range(30, 40)]
    send_all(running, [slam, *rogues], "map odom", 2.0)
    for findings in (running.findings(), running.judge.wrong()):
        assert sorted(pid for finding in findings for pid in pids_of(finding)) == [*range(20, 40)]
        assert len(findings) == 11


@pytest.mark.parametrize(("owner", "process"), [("slam", "slam"), ("drive", None)])
def test_namesakes_that_come_one_after_the_other_are_all_named_in_the_end(
    running: History, owner: str, process: str | None
) -> None:
    edges = {"slam": "map odom", "drive": "odom base"}[owner]
    publishers = [running.joins(f"/{owner}", process=process, pid=10)]
    for pid in range(30, 40):
        publishers.append(running.joins(f"/{owner}", process="", pid=pid))
        send_all(running, publishers, edges, 0.5)
    send_all(running, publishers, edges, 20.0)
    anybody = [10] if process is None else []
    assert pids_of(running.findings()[-1]) == [*anybody, *range(30, 40)]
    assert len(running.findings()) < 10, "they are collected"
    assert running.over() == []


def test_an_edge_is_over_when_no_publisher_of_that_name_sends_it(
    running: History,
) -> None:
    first, second = (running.joins("/rogue", process="", pid=pid) for pid in (11, 12))
    for _ in range(10):
        running.send(first, "map odom").send(second, "map odom, odom base").wait(0.1)
    assert [pids_of(finding) for finding in running.findings()] == [[11, 12]]
    running.leaves(second)
    send_all(running, [first], "map odom", 5.0)
    (over,) = running.over()
    assert words_of(over) >= {"odom", "base", "/rogue"}
    assert "map" not in words_of(over)
    expect(running.findings()[-1], "TF801", "map → odom", "pid 12")
    assert pids_of(running.findings()[-1]) == [11]


def test_the_publishers_of_one_process_are_one(running: History) -> None:
    moving, fixed = (
        running.joins("/rogue", static=static, process="", pid=11) for static in (False, True)
    )
    running.send(fixed, "base lidar").repeat(moving, "base lidar", 5)
    (finding,) = running.findings()
    assert pids_of(finding) == [11]
    running.leaves(fixed)
    running.repeat(moving, "base lidar", 50)
    assert (running.over(), len(running.findings())) == ([], 1)


def test_publishers_of_unknown_processes_on_two_topics_may_be_of_one(running: History) -> None:
    moving, fixed = (running.joins("/rogue", static=static) for static in (False, True))
    running.send(fixed, "base lidar").send(moving, "map odom").wait(1.0)
    expect(running.only(), "TF801", "base → lidar and 1 more", "by /rogue;")


@pytest.mark.parametrize(("owner", "process"), [("slam", "slam"), ("drive", None)])
def test_who_remains_is_known_to_the_guard_that_follows(
    running: History, owner: str, process: str | None
) -> None:
    """It finds them one after the other."""
    edges = {"slam": "map odom", "drive": "odom base"}[owner]
    owner_publisher = running.joins(f"/{owner}", process=process, pid=10)
    rogues = [running.joins(f"/{owner}", process="", pid=pid) for pid in (11, 12)]
    present, anybody = [owner_publisher, *rogues], [10] if process is None else []
    send_all(running, present, edges, 2.0)
    assert pids_of(running.findings()[-1]) == [*anybody, 11, 12]
    running.graph.clear()
    running.dies()
    for publisher in present:
        running.graph.append(publisher)
        send_all(running, present, edges, 1.0)
    send_all(running, present, edges, 10.0)
    assert running.findings() == []
    running.leaves(rogues[0])
    send_all(running, [owner_publisher, rogues[1]], edges, 10.0)
    assert pids_of(running.only()) == [*anybody, 12]
    assert running.over() == []


def test_a_stranger_that_restarts_again_and_again_is_reported_rarely(
    running: History,
) -> None:
    for pid in range(100, 200):
        rogue = running.joins("/rogue", process="", pid=pid)
        running.repeat(rogue, "map odom", 5).leaves(rogue)
    assert 3 < len(running.findings()) < 10


def test_the_name_of_an_owner_is_not_given_to_who_is_not_its_process() -> None:
    running = History(processes=(PlanProcess("slam", "run", nodes=("/slam",)),), edges=EDGES[:1])
    for process, name in (("slam", "/slam"), ("", "another /slam"), (None, "/slam")):
        slam = running.joins("/slam", process=process)
        running.check()
        assert running.judge.name_of(slam.gid) == name
    child = running.joins("/slam", process="joints")
    assert running.check().judge.name_of(child.gid) == "another /slam of joints"
