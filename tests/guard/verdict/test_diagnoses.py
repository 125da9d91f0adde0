"""The doctor's diagnoses over histories: what is found, and when nothing is.

How it is worded: tests/golden/scenes.
"""

import time
from dataclasses import replace

import pytest

from tests.support.findings import expect
from tests.support.tree_history import (
    BEGUN_NS,
    END_NS,
    SECOND_NS,
    SECONDS,
    TreeHistory,
    late,
    row,
    since_start,
    sound_plan,
    sound_tree,
)
from tfcompose.foundation.findings import Finding
from tfcompose.foundation.text import duration
from tfcompose.guard.verdict.doctor import diagnose, examine
from tfcompose.guard.verdict.setup import MOST_PROCESSES, MOST_SETTINGS, settings_apart
from tfcompose.guard.verdict.stamps import other_clock
from tfcompose.model.plan import EdgePattern, GuardPolicy, PlanProcess
from tfcompose.tf.live.publishers import Publisher
from tfcompose.tf.live.state import NAMELESS, RosProcess, StampedData, TopicState, TreeState
from tfcompose.tf.ros.environment import RANGE
from tfcompose.tf.ros.tf_codec import TF_MESSAGE

JOINT_STATE, CLOCK = "sensor_msgs/msg/JointState", "rosgraph_msgs/msg/Clock"


def codes(state: TreeState) -> set[str]:
    return {finding.code for finding in diagnose(state)}


def only(state: TreeState) -> Finding:
    (finding,) = diagnose(state)
    return finding


def data(frame: str, delay_s: float, topic: str = "/scan") -> tuple[StampedData]:
    return (StampedData(topic, frame, ("/lidar",), (delay_s,) * 5),)


def stamped(seconds: float, edge: str = "odom base_link") -> TreeHistory:
    """Return the tree of one edge that is so late."""
    return TreeHistory().moving(edge, stamp=late(seconds))


def handed_over(alternation_hz: float) -> TreeHistory:
    """Return a tree in which one node hands a cup to and fro so often."""
    history = TreeHistory().moving("world tool0", hz=60).moving("world table", hz=60)
    return history.moving(
        "_ cup",
        b"x",
        hz=20,
        parents=lambda tick: ("table", "tool0")[int(tick / 20 * alternation_hz) % 2],
    )


def now_and_then(*at_s: float) -> TreeHistory:
    """Return the tree of an edge that comes at these times."""
    history = TreeHistory()
    for now in (BEGUN_NS + int(each * SECOND_NS) for each in at_s):
        history.takes(row("odom base_link", now), at_ns=now)
    return history


def in_a_simulation(speed: float) -> TreeState:
    """Return the tree of an edge at 10 Hz, where simulated time goes so fast."""
    history = TreeHistory().moving(
        "odom base_link",
        hz=10.0,
        stamp=lambda now: 100 * SECOND_NS + int((now - BEGUN_NS) * speed),
    )
    return history.observed(clock_ns=int((100 + SECONDS * speed) * SECOND_NS), clock_moves=True)


def played(stamp_ns: int, edge_s: float) -> TreeState:
    """Return a tree whose edge is so late, and data with this stamp."""
    delay_s = (END_NS - stamp_ns) / 1e9
    scan = StampedData("/scan", "laser", ("/player",), (delay_s,) * 5, stamp_ns, END_NS)
    return stamped(edge_s).fixed("base_link laser").observed(stamped=(scan,))


SIMULATED = TreeHistory().moving("odom base_link", stamp=since_start).fixed("base_link laser")
DAY_S = 86_400

CASES: dict[str, tuple[TreeState, set[str]]] = {
    "a sound robot": (sound_tree().observed(), set()),
    "a sound robot with its plan": (sound_tree().observed(plan=sound_plan()), set()),
    "odometry a little ahead": (stamped(-0.1).observed(), set()),
    "a localizer that dates forward": (stamped(-1.0, "robot1/map robot1/odom").observed(), set()),
    "a localizer far ahead": (stamped(-2.0, "map odom").observed(), {"TF835"}),
    "late": (sound_tree().moving("base_link arm", b"x", stamp=late(0.4)).observed(), {"TF833"}),
    "late because clocks differ": (
        sound_tree().moving("base_link arm", b"x", stamp=late(0.4)).observed(skews_s={b"x": -0.4}),
        {"TF834"},
    ),
    "messages a little under way": (sound_tree().observed(skews_s={b"d": -0.2}), set()),
    "handed over now and then": (handed_over(0.7).observed(), set()),
    "handed over seldom": (handed_over(0.3).observed(), set()),
    "jumping to and fro": (handed_over(20.0).observed(), {"TF802"}),
    "a parent now and then, of one node": (
        TreeHistory()
        .moving("_ base_link", b"x", parents=lambda tick: "odom" if tick % 15 else "map")
        .observed(),
        {"TF802"},
    ),
    "slash dropped": (
        TreeHistory()
        .moving("/odom /base_link")
        .moving("odom base_link", b"x")
        .fixed("base_link laser")
        .observed(),
        {"TF501", "TF822"},
    ),
    "slash in itself": (TreeHistory().fixed("/base_link base_link").observed(), {"TF821"}),
    "data and tree of one old recording": (played(END_NS - DAY_S * SECOND_NS, DAY_S), {"TF825"}),
    "a slow simulation": (in_a_simulation(0.4), set()),
    "a simulation as fast as the day": (in_a_simulation(1.0), {"TF838"}),
    "a timer of the least rate": (
        TreeHistory().moving("odom base_link", hz=19.4).observed(),
        set(),
    ),
    "too rarely": (TreeHistory().moving("odom base_link", hz=15.0).observed(), {"TF838"}),
    "a loop is no second parent too": (
        sound_tree().moving("map odom").moving("laser odom", b"x").observed(),
        {"TF820"},
    ),
    "a clock that nobody stamps with": (
        sound_tree().moving("map odom", b"x").observed(clock_ns=100 * SECOND_NS, clock_moves=True),
        set(),
    ),
    "two simulators whose time goes": (
        sound_tree().observed(
            graph=(TopicState("/clock", CLOCK, ("/bag", "/sim")),), clock_ns=1, clock_moves=True
        ),
        {"TF837"},
    ),
    "data a little late": (sound_tree().observed(stamped=data("base_link", 0.1)), set()),
    "data a little ahead of a late edge": (
        stamped(0.2).observed(stamped=data("base_link", 0.0)),
        set(),
    ),
    "data of before": (sound_tree().observed(stamped=data("base_link", 11.0)), {"TF841"}),
    "data ahead of time": (sound_tree().observed(stamped=data("base_link", -1.0)), {"TF841"}),
    "late for data is told once": (
        stamped(1.0).observed(stamped=data("base_link", 0.0)),
        {"TF841"},
    ),
    "nobody is missed by name where nobody publishes": (
        TreeState(SECONDS, plan=sound_plan()),
        {"TF845"},
    ),
    "on both topics": (sound_tree().fixed("odom base_link", b"x").observed(), {"TF809"}),
    "two trees that the plan has": (
        sound_tree()
        .fixed("shelf box")
        .observed(
            plan=sound_plan(
                *sound_plan().edges, replace(sound_plan().edges[1], parent="shelf", child="box")
            )
        ),
        set(),
    ),
    "two trees": (sound_tree().fixed("shelf box").observed(), {"TF830"}),
    "of a short look two messages are no rate": (
        replace(now_and_then(0.0, 0.5).observed(), seconds=1.0),
        set(),
    ),
    "of a long one they are": (now_and_then(0.0, 4.8).observed(), {"TF838"}),
    "rare messages with a hole among them": (
        now_and_then(*(n / 4 for n in range(8)), *(n / 4 for n in range(13, 20))).observed(),
        {"TF838"},
    ),
    "data without a tree": (TreeHistory().observed(stamped=data("laser", 0.0)), set()),
    "an allowed edge": (
        sound_tree()
        .moving("base_link tag_1", b"x")
        .observed(plan=sound_plan(guard=GuardPolicy(allow=(EdgePattern("*", "tag_*"),)))),
        set(),
    ),
    "a namespace without topics of its own": (
        sound_tree().observed(graph=(TopicState("/tf", TF_MESSAGE, ("/robot1/ekf", "/drive")),)),
        set(),
    ),
    "never seen": (TreeHistory().moving("odom base_link").observed(plan=sound_plan()), {"TF811"}),
}


@pytest.mark.parametrize("case", CASES)
def test_a_tree_has_exactly_these_findings(case: str) -> None:
    state, expected = CASES[case]
    assert codes(state) == expected


#: With the names that the finding has in its message and its help.
NAMED: dict[str, tuple[TreeState, str, list[str]]] = {
    "late": (stamped(0.7).observed(), "TF833", ["odom → base_link", "/drive", "700 ms"]),
    "ahead": (stamped(-0.3).observed(), "TF835", ["odom → base_link", "/drive", "300 ms"]),
    "a node that jumps": (
        handed_over(20.0).observed(),
        "TF802",
        ["cup", "table", "tool0", "let /ekf"],
    ),
    "data without its prefix": (
        TreeHistory()
        .moving("robot1/odom robot1/base_link")
        .fixed("robot1/base_link robot1/laser")
        .observed(stamped=data("laser", 0.0)),
        "TF840",
        ["/scan", "/lidar", "robot1/laser"],
    ),
    "a prefix": (
        sound_tree().fixed("robot1/base_link camera").observed(),
        "TF830",
        ["robot1/base_link", "frame_prefix"],
    ),
    "a loop of one node": (
        TreeHistory().moving("a b").moving("b a").observed(),
        "TF820",
        ["let /drive"],
    ),
    "a loop of two": (
        TreeHistory().moving("a b").moving("b a", b"x").observed(),
        "TF820",
        ["one of these nodes"],
    ),
    "a clock ahead": (sound_tree().observed(skews_s={b"d": 3.2}), "TF834", ["/drive", "3.2 s"]),
    "a clock behind": (sound_tree().observed(skews_s={b"d": -0.4}), "TF834", ["/drive", "400 ms"]),
    "the one with the system's time": (
        TreeHistory()
        .moving("map odom", b"x", stamp=since_start)
        .moving("base_link arm", b"x", stamp=since_start)
        .moving("odom base_link")
        .observed(clock_ns=5 * SECOND_NS, clock_moves=True),
        "TF825",
        ["/drive", "odom → base_link", "/clock", "5.0 s"],
    ),
    "data before the tree": (
        stamped(0.4).observed(stamped=data("base_link", 0.0)),
        "TF841",
        ["/scan", "/lidar", "400 ms", "odom → base_link", "/drive", "future"],
    ),
    "a scan whose clock is ahead": (
        sound_tree().observed(stamped=data("base_link", -1.0)),
        "TF841",
        ["/scan", "1 s ahead"],
    ),
    "data without a stamp": (
        played(0, 0.0),
        "TF841",
        ["/scan", "odom → base_link", "header.stamp"],
    ),
    "data of time since a start": (
        played(1234 * SECOND_NS, 0.0),
        "TF841",
        ["/scan", "1234.0 s", "ROS time"],
    ),
    "data of a clock in another zone": (
        played(END_NS + 7200 * SECOND_NS, 0.0),
        "TF841",
        ["/scan", "2 h ahead of the system's time"],
    ),
    "data with the system's time": (
        SIMULATED.observed(
            stamped=(StampedData("/imu", "base_link", ("/imu",), (0.0,) * 5, END_NS, END_NS),),
            clock_ns=5 * SECOND_NS,
            clock_moves=True,
        ),
        "TF841",
        ["/imu", "the system's time", "/clock", "5.0 s", "use_sim_time"],
    ),
    "wrong now and then": (
        sound_tree()
        .takes(row("odom base_link", END_NS, w=0.9))
        .takes(row("odom base_link", END_NS + 1))
        .observed(),
        "TF831",
        ["odom → base_link", "0.900", "1 of 252"],
    ),
    "a leak": (
        sound_tree().observed(
            graph=(
                TopicState("/robot1/tf", TF_MESSAGE, ("/robot1/drive",)),
                TopicState("/tf", TF_MESSAGE, ("/robot1/ekf", "/drive")),
            )
        ),
        "TF827",
        ["/robot1/ekf", "/robot1/tf"],
    ),
}


@pytest.mark.parametrize("case", NAMED)
def test_a_finding_names_nodes_edges_and_values(case: str) -> None:
    state, code, names = NAMED[case]
    expect(only(state), code, *names)


#: By the plan of an edge odom → base_link of drive at 50 Hz, and base_link → laser of static.
BY_PLAN: dict[str, tuple[TreeHistory, str, list[str]]] = {
    "missing": (
        TreeHistory().moving("odom base_link"),
        "TF811",
        ["base_link → laser", "static (/static)"],
    ),
    "foreign": (
        TreeHistory().moving("odom base_link", b"x").fixed("base_link laser"),
        "TF801",
        ["odom → base_link", "/ekf", "drive (/drive)"],
    ),
    "twice": (
        sound_tree().moving("odom base_link", b"e"),
        "TF801",
        ["odom → base_link", "another /drive"],
    ),
    "parent": (
        sound_tree().moving("map base_link", b"x"),
        "TF802",
        ["map (from /ekf)", "odom", "drive (/drive)"],
    ),
    "undeclared": (
        sound_tree().moving("base_link arm", b"x"),
        "TF803",
        ["base_link → arm", "/ekf"],
    ),
    "silent": (
        TreeHistory().moving("odom base_link", until_s=3.0).fixed("base_link laser"),
        "TF804",
        ["drive (/drive)", "odom → base_link", "2.02 s"],
    ),
    "slow": (
        TreeHistory().moving("odom base_link", hz=20.0).fixed("base_link laser"),
        "TF805",
        ["odom → base_link", "20 Hz", "drive (/drive)", "50 Hz"],
    ),
    "topic": (
        TreeHistory().moving("odom base_link").moving("base_link laser", b"s"),
        "TF809",
        ["base_link → laser", "/static", "/tf ", "/tf_static"],
    ),
    "pose": (
        TreeHistory().moving("odom base_link").fixed("base_link laser", x=0.02),
        "TF846",
        ["laser", "base_link", "/static", "20 mm", "xyz 0.02 0 0 m", "xyz 0 0 0 m"],
    ),
}


@pytest.mark.parametrize("case", BY_PLAN)
def test_with_a_plan_what_differs_from_it_is_found(case: str) -> None:
    history, code, names = BY_PLAN[case]
    (finding,) = [
        entry for entry in diagnose(history.observed(plan=sound_plan())) if entry.code == code
    ]
    expect(finding, code, *names)


def test_a_frame_that_goes_from_node_to_node_is_reported_once() -> None:
    history = TreeHistory().moving("table cup", until_s=2.0).fixed("table tool0")
    for tick in range(101, 250):
        now = BEGUN_NS + tick * SECOND_NS // 50
        history.takes(row("tool0 cup", now), b"x", now)
    assert codes(history.observed()) == {"TF802"}
    assert "TF804" in codes(history.knows(b"x", b"s").observed())


def test_of_a_frame_with_very_many_parents_some_are_named() -> None:
    history = TreeHistory()
    for index in range(60):
        history.fixed(f"parent{index:02} cup")
    (finding,) = [entry for entry in diagnose(history.observed()) if entry.code == "TF802"]
    expect(finding, "TF802", "cup", "60", "parent00 (from /static)", "parent01 (from /static)")
    assert len(finding.notes) < 10


def test_stamps_that_stand_with_the_clock_are_reported_of_the_clock_alone() -> None:
    history = (
        TreeHistory()
        .moving("odom base_link", stamp=lambda _: 106 * SECOND_NS)
        .fixed("base_link laser")
    )
    clock = TopicState("/clock", CLOCK, ("/gazebo",), ("/nav",))
    stands = history.observed(clock_ns=106 * SECOND_NS, clock_moves=False, graph=(clock,))
    assert codes(stands) == {"TF836"}
    assert "TF823" in codes(replace(stands, clock_moves=True))


@pytest.mark.parametrize(
    ("ahead_s", "name"),
    [(37.0, "TAI"), (18.1, "GPS"), (3600.0, "local time"), (-7200.0, "local time"), (60.0, "")],
)
def test_a_clock_that_is_off_by_a_known_offset_is_named(ahead_s: float, name: str) -> None:
    finding = only(stamped(-ahead_s).observed())
    assert finding.code == "TF825"
    assert (name in finding.message) if name else ("(" not in finding.message)


def test_stamps_that_are_the_age_of_this_machine_are_named() -> None:
    boot_ns = time.time_ns() - time.clock_gettime_ns(time.CLOCK_BOOTTIME)
    now_ns = time.time_ns()
    named = other_clock(now_ns - boot_ns, now_ns, None, simulated=False)
    unnamed = other_clock(now_ns - boot_ns + 100 * SECOND_NS, now_ns, None, simulated=False)
    assert ("this machine" in named, "this machine" in unnamed) == (True, False)


def test_the_cost_of_tf_names_who_sends_edges_one_by_one() -> None:
    history = sound_tree()
    for name in ("a", "b", "c"):
        history = history.moving(f"base_link {name}", b"wheels")
    heard = TopicState("/tf", TF_MESSAGE, ("/drive",), ("/nav", "/rviz"))
    (cost,) = examine([history.observed(graph=(heard,))]).costs
    assert all(word in cost for word in ("/tf", "2 listeners", "3 edges one by one"))


def test_a_frame_with_dropped_messages_is_not_reported_missing() -> None:
    always = only(sound_tree().takes(row("base_link arm", END_NS, float("nan")), b"x").observed())
    some = only(sound_tree().takes(row("odom base_link", END_NS, float("nan"))).observed())
    assert always.code == some.code == "TF831"
    assert always.help != some.help


@pytest.mark.parametrize(("w", "expected"), [(0.9, {"TF831"}), (0.0, {"TF830", "TF831"})])
def test_a_frame_whose_quaternion_tf2_normalises_belongs_to_the_tree(
    w: float, expected: set[str]
) -> None:
    history = sound_tree().takes(row("base_link arm", END_NS, w=w), b"x").fixed("arm hand")
    assert codes(history.observed()) == expected


def test_edges_of_a_publisher_that_replaced_another_have_one_publisher() -> None:
    """It was started anew, and the graph shows the killed one for some seconds still.

    Fixed edges hold on.
    """
    history = TreeHistory().moving("odom base_link", until_s=2.0).fixed("base_link laser")
    for tick in range(100):
        now = BEGUN_NS + 3 * SECOND_NS + tick * SECOND_NS // 50
        history.takes(row("odom base_link", now), b"e", now)
    assert codes(history.observed()) == set()
    history.fixed("base_link laser", b"t").knows(b"s", b"t")
    assert codes(history.observed()) == {"TF822"}
    assert codes(history.knows(b"e", b"t").observed()) == set()


def test_what_a_strict_guard_passes_on_is_its_owners() -> None:
    strict = sound_plan(guard=GuardPolicy("strict"))
    strict = replace(
        strict, processes=(*strict.processes, PlanProcess("guard", "guard", nodes=("/ekf",)))
    )
    history = TreeHistory().moving("odom base_link", b"x").fixed("base_link laser", b"x")
    assert codes(history.observed(plan=strict)) == set()
    assert codes(history.observed(plan=sound_plan())) == {"TF801"}


def test_without_tf_in_a_namespace_other_process_settings_are_searched() -> None:
    observed = TreeState(SECONDS, processes=(RosProcess(9, "nav", {"ROS_DOMAIN_ID": "8"}),))
    assert codes(observed) == {"TF845", "TF908"}
    below = (TopicState("/robot1/tf", TF_MESSAGE, ("/robot1/drive",)),)
    assert codes(replace(observed, graph=below)) == {"TF845"}


def test_of_many_other_settings_some_are_named_and_some_processes_of_each() -> None:
    domains = [8] * (MOST_PROCESSES + 2) + list(range(9, 9 + MOST_SETTINGS))
    started = tuple(
        RosProcess(pid, "nav", {"ROS_DOMAIN_ID": str(domain)})
        for pid, domain in enumerate(domains, 100)
    )
    findings = [
        finding
        for finding in diagnose(TreeState(SECONDS, processes=started))
        if finding.code == "TF908"
    ]
    assert len(findings) == MOST_SETTINGS == 3
    many = diagnose(TreeState(SECONDS, processes=started[: MOST_PROCESSES + 2]))
    [of_one] = [finding for finding in many if finding.code == "TF908"]
    assert len(of_one.notes) == MOST_PROCESSES + 1
    assert of_one.notes[-1].message == "and 2 more"


def test_processes_with_other_settings_cannot_be_heard_and_why_is_reported() -> None:
    ours = {"ROS_DOMAIN_ID": "7"}
    assert (
        settings_apart({"ROS_DOMAIN_ID": "7", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, ours)
        == {}
    )
    assert settings_apart({}, ours) == {"ROS_DOMAIN_ID": "0"}
    assert settings_apart({**ours, "ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, ours) == {RANGE: "OFF"}
    assert settings_apart({**ours, "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, ours) == {}, (
        "the default may be the same"
    )
    observed = TreeState(1.0, settings={**ours, "RMW_IMPLEMENTATION": "b"})
    process = RosProcess(9, "nav", {**ours, "ROS_DOMAIN_ID": "8", "RMW_IMPLEMENTATION": "a"})
    [finding] = [
        entry
        for entry in diagnose(replace(observed, processes=(process,)))
        if entry.code == "TF908"
    ]
    names = (
        "ROS_DOMAIN_ID=8",
        "RMW_IMPLEMENTATION=a",
        "ROS_DOMAIN_ID is 7",
        "RMW_IMPLEMENTATION is b",
    )
    expect(finding, "TF908", *names, "ROS_DOMAIN_ID=8 RMW_IMPLEMENTATION=a tfcompose doctor")


@pytest.mark.parametrize(
    ("settings", "name"),
    [
        (
            {"ROS_LOCALHOST_ONLY": "1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"},
            "ROS_LOCALHOST_ONLY=1",
        ),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LAN"}, "=LAN"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, "=OFF"),
    ],
)
def test_settings_that_cannot_be_meant_are_found(settings: dict[str, str], name: str) -> None:
    expect(only(sound_tree().observed(settings=settings)), "TF909", name)


def test_times_are_shown_in_the_unit_that_people_use() -> None:
    assert [duration(value) for value in (0.12, 3.21, 7200, 864000)] == [
        "120 ms",
        "3.21 s",
        "2 h",
        "10 days",
    ]


def test_joint_states_of_a_neighbour_robot_are_not_this_ones() -> None:
    heard = TopicState(
        "/robot1/joint_states", JOINT_STATE, ("/robot1/wheels",), ("/robot1/joints",)
    )
    neighbours = (
        TopicState("/tf", TF_MESSAGE, ("/drive",)),
        TopicState("/robot1/tf", TF_MESSAGE, ("/robot1/joints",)),
        heard,
    )
    history = TreeHistory().moving("odom base_link")
    assert "TF842" not in codes(history.observed(graph=neighbours))
    alone = (
        TopicState("/tf", TF_MESSAGE, ("/drive",)),
        heard,
    )  # nobody below /robot1 publishes TF: they are for this tree
    assert "TF842" in codes(history.observed(graph=alone))


def test_two_publishers_of_one_node_are_each_reported_with_their_edges() -> None:
    tree = TreeHistory().knows(b"d", b"e").fixed("base_link laser")
    for edge, gid in (("odom base_link", b"d"), ("base_link arm", b"e")):
        tree.moving(edge, gid, stamp=late(-0.5))
    findings = [finding for finding in diagnose(tree.observed()) if finding.code == "TF835"]
    assert len(findings) == 2


@pytest.mark.parametrize("node", ["", "/flood"])
def test_a_flood_is_reported_also_of_a_publisher_that_has_no_name(node: str) -> None:
    state = sound_tree().observed(beyond={b"f": 7})
    state = replace(state, publishers=(*state.publishers, Publisher(b"f", node, static=False)))
    (finding,) = [entry for entry in diagnose(state) if entry.code == "TF853"]
    assert finding.message.startswith(node or NAMELESS)
