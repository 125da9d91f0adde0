"""What the guard remembers, shows, hands on to the next guard, and lets pass."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.findings import expect
from tests.support.guard_history import EDGES, FIXED, History, edge, wall
from tfcompose.foundation.geometry import Pose
from tfcompose.guard.diagnostics import statuses
from tfcompose.model.messages import Clear, FindingShown, Live, RecoveredShown
from tfcompose.model.plan import (
    EdgePattern,
    GuardPolicy,
    PlanClaim,
    PlanEdge,
    PlanProcess,
    SourceLine,
)
from tfcompose.tf.live.publishers import Publisher


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(st.sampled_from("sdrjx"), st.sampled_from((0.0, 0.05, 0.1, 0.7))), max_size=60
    )
)
def test_remembered_verdicts_are_those_that_would_be_given_anew(
    sends: list[tuple[str, float]],
) -> None:
    """The same history, judged with and without memory of what was judged before."""
    reports = []
    for forgets in (False, True):
        running = History(GuardPolicy(allow=(EdgePattern("map", "person"),))).clear()
        senders = {
            "s": (running.joins("/slam"), "map odom"),
            "d": (running.joins("/drive"), "odom base, map person"),
            "r": (running.joins("/rogue"), "map odom, base cup"),
            "j": (running.joins("/slam"), "map odom"),
            "x": (running.joins("/x"), "map person, cup map"),
        }
        for who, pause in sends:
            if forgets:
                running.judge.ledger._judged.clear()
            running.send(*senders[who]).wait(pause)
        running.wait(1)
        reports.append(running.events)
    assert reports[0] == reports[1]


def test_edges_that_waited_for_a_name_share_a_history_all_the_same(running: History) -> None:
    rates = tuple(
        PlanEdge(
            "base",
            f"part_{n}",
            "dynamic",
            "drive",
            "/drive",
            Pose(),
            10.0,
            SourceLine("r.yaml", 1),
        )
        for n in range(99)
    )
    running = History(edges=rates).clear()
    drive, names = running.joins(None), ", ".join(f"base part_{n}" for n in range(99))
    running.repeat(drive, names, 3)
    drive.node = "/drive"
    running.repeat(drive, names, 10)
    assert len(running.judge.live.tracks) == 1
    assert [len(event.children) for event in running.all(Live) if isinstance(event, Live)] == [99]


def test_each_edge_has_publisher_rate_age_and_delay_once_it_arrives() -> None:
    rated = tuple(
        replace(planned, rate=10.0) if planned.owner == "slam" else planned for planned in EDGES
    )
    running = History(edges=rated).clear()
    slam, static = running.joins("/slam"), running.joins("/static", static=True)
    running.send(static, FIXED)
    for _ in range(30):
        running.send(slam, "map odom", stamp_s=wall(running) - 0.25).wait(0.1)
    running.wait(0.2)
    health = {
        edge_health.edge.child: edge_health for edge_health in running.judge.health(running.now)
    }
    odom = health["odom"]
    assert odom.publisher == "/slam"
    assert odom.rate is not None
    assert odom.age_s is not None
    assert odom.delay_s is not None
    assert [round(value, 2) for value in (odom.rate, odom.age_s, odom.delay_s)] == [
        10.0,
        0.3,
        0.25,
    ]
    assert (health["lidar"].text, health["base"].text) == ("latched, from /static", "not seen yet")
    levels = {
        line.name: line.level
        for line in statuses("rover", list(health.values()), running.judge.wrong())
    }
    assert levels == {
        "tfcompose rover: tree": 0,
        "tfcompose rover: slam": 0,
        "tfcompose rover: drive": 3,
        "tfcompose rover: joints": 3,
        "tfcompose rover: static": 0,
    }


def test_what_is_wrong_now_is_on_the_page_and_gone_when_it_is_over(running: History) -> None:
    rogue = running.joins("/rogue")
    running.repeat(rogue, "map odom, base cup", 3)
    lines = statuses("rover", running.judge.health(running.now), running.judge.wrong())
    assert (lines[0].level, [key for key, _ in lines[0].values]) == (2, ["TF801", "TF803"])
    running.leaves(rogue)
    running.wait(5)
    assert running.judge.wrong() == []


@pytest.mark.parametrize("switch", ["enable_odom_tf: false", ""])
def test_the_guard_names_the_switch_of_a_node_that_publishes_by_default(switch: str) -> None:
    history = History(claims=(PlanClaim("/diff", "odom", "base", switch),)).clear()
    history.repeat(history.joins("/drive"), "odom base", 5)
    history.repeat(history.joins("/diff"), "odom base", 10)
    expect(history.only(), "TF801", "/diff", "by default", switch)


@pytest.mark.parametrize(
    ("node", "simulator", "switch"),
    [
        ("/sim/ros_gz_bridge", "Gazebo", "config_file"),
        ("/_World_Graph_ros2_publish_transform_tree_01", "Isaac Sim", "targetPrims"),
    ],
)
def test_the_tree_of_a_simulator_is_named_as_such_with_its_switch(
    node: str, simulator: str, switch: str
) -> None:
    history = History().clear()
    history.repeat(history.joins("/drive"), "odom base", 5)
    history.repeat(history.joins(node), "odom base", 10)
    expect(history.only(), "TF801", node, simulator, switch)


def test_undeclared_edges_of_a_simulator_are_named_as_its_tree() -> None:
    history = History().clear()
    history.repeat(history.joins("/ros_gz_bridge"), "rover rover/cup", 10)
    expect(history.only(), "TF803", "/ros_gz_bridge", "Gazebo", "config_file")


def test_the_guard_names_no_switch_for_another_node_or_edge() -> None:
    history = History(claims=(PlanClaim("/diff", "odom", "base", "x: false"),)).clear()
    history.repeat(history.joins("/other"), "odom base", 10)
    history.repeat(history.joins("/diff"), "map odom", 10)
    assert [("set" in finding.help) for finding in history.findings()] == [False, False]


def test_a_judge_that_follows_another_tells_nothing_twice_and_goes_on(running: History) -> None:
    static, slam, rogue = (
        running.joins("/static", static=True),
        running.joins("/slam"),
        running.joins("/rogue"),
    )
    volatile = running.joins("/volatile", static=True, volatile=True)
    running.send(static, FIXED).repeat(slam, "map odom", 5).repeat(rogue, "map odom, map cup", 5)
    assert [line[:5] for line in running.reports()] == ["TF806", "TF801", "TF803"]
    assert running.all(Live) != []
    running.dies()
    assert running.events == [Clear()]
    running.send(static, FIXED, ago=10)
    for _ in range(100):
        running.send(slam, "map odom").send(rogue, "map odom, map cup").wait(0.1)
    assert running.events == [Clear()]
    running.leaves(rogue)
    running.leaves(volatile)
    running.repeat(slam, "map odom", 50)
    assert [type(event) for event in running.events[1:]] == [RecoveredShown, RecoveredShown]
    running.repeat(running.joins("/other"), "map odom", 5)
    expect(running.only(), "TF801", "map → odom", "/other", "slam (/slam)")


def test_a_successor_judge_does_not_miss_publishers_not_yet_discovered(
    running: History,
) -> None:
    running = History(
        edges=(edge("map odom", "slam", rate=10.0), edge("base lidar", "static", "static"))
    ).clear()
    static, slam, rogue = (
        running.joins("/static", static=True),
        running.joins("/slam"),
        running.joins("/rogue"),
    )
    running.send(static, FIXED[:10]).repeat(slam, "map odom", 30).repeat(rogue, "map odom", 3)
    running.graph.clear()
    running.dies().wait(4)
    assert running.events == [Clear()]
    running.graph += [static, slam, rogue]
    for _ in range(40):
        running.send(slam, "map odom").send(rogue, "map odom").wait(0.1)
    assert running.events == [Clear()]
    running.leaves(static)
    running.repeat(rogue, "map odom", 20)
    assert sorted(line[:10] for line in running.reports()) == ["TF804 slam", "TF804 stat"]


def test_a_silent_owner_is_not_reported_again_but_its_return_is() -> None:
    running = History(edges=(edge("map odom", "slam", rate=10.0),)).clear()
    slam = running.joins("/slam")
    running.repeat(slam, "map odom", 30).wait(2)
    assert [line[:5] for line in running.reports()] == ["TF804"]
    running.dies().wait(8)
    assert running.events == [Clear()]
    running.repeat(slam, "map odom", 5)
    assert (
        [event for event in running.events if not isinstance(event, Clear)]
        == running.all(RecoveredShown)
        != []
    )


def test_a_namesake_remains_distinct_from_the_owner_after_the_guard_died(
    running: History,
) -> None:
    slam, namesake = running.joins("/slam"), running.joins("/slam")
    running.repeat(slam, "map odom", 5).dies()
    running.send(namesake, "map odom").repeat(slam, "map odom", 5)
    expect(running.findings()[0], "TF801", "map → odom", "another /slam")


def test_a_message_passes_only_if_its_sender_has_a_name_and_owns_all_of_it(
    running: History,
) -> None:
    slam = running.joins(None)
    for name, edges, admitted in (
        (None, "map odom", set()),
        ("/slam", "map odom", None),
        ("/slam", "map odom, odom base", {("map", "odom")}),
        ("/slam", "odom base", set()),
        ("/slam", "map odom, map cup", {("map", "odom")}),
        ("/slam", "odom map", set()),
    ):
        slam.node = name
        running.check().send(slam, edges)
        assert running.admitted == admitted, edges
        running.send(slam, edges)
        assert running.admitted == admitted, edges


@pytest.mark.parametrize(
    ("process", "stopped"), [("slam", "slam"), ("", ""), (None, ""), ("drive", "")]
)
def test_only_a_proven_offender_can_be_stopped(process: str | None, stopped: str) -> None:
    """A node's name proves nothing: whoever has it may be of another run, or of no ROS at all."""
    processes = (
        PlanProcess("slam", "run", nodes=("/slam",)),
        PlanProcess("drive", "external", nodes=("/drive",)),
    )
    running = History(GuardPolicy(on_violation="stop-offender"), processes).clear()
    running.repeat(running.joins("/slam", process=process), "odom base", 5)
    (event,) = [event for event in running.events if isinstance(event, FindingShown)]
    assert (event.found.code, event.process) == ("TF801", stopped)
    assert bool(event.found.notes) is True


@pytest.mark.parametrize(
    ("process", "edges", "ours"),
    [("slam", "map odom", True), ("slam", "odom base", False), ("", "map odom", False)],
)
def test_an_owner_under_another_name_is_advised_to_declare_it(
    process: str, edges: str, *, ours: bool
) -> None:
    processes = [PlanProcess(name, "run", nodes=(f"/{name}",)) for name in ("slam", "drive")]
    running = History(processes=tuple(processes)).clear()
    renamed = running.joins("/other")
    running.send(renamed, edges)
    writer = Publisher(renamed.gid, "/other", static=False, ours=True, process=process)
    running.judge.graph([writer], running.now)
    (event,) = running.judge.tick(running.now + 0.2)
    assert isinstance(event, FindingShown)
    assert (event.found.code, "node: /other" in event.found.help) == ("TF801", ours)
    assert event.found.help.startswith("stop /other") is not ours
