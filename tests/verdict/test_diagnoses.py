"""The doctor's diagnoses over histories: what they say, and when they say nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from tfcompose.geometry import Pose
from tfcompose.live.edges import TreeObserver
from tfcompose.live.joints import joints_of
from tfcompose.live.publishers import Publisher
from tfcompose.live.state import RosProcess, StampedData, Topic, TreeState
from tfcompose.plan import EdgePattern, GuardPolicy, Plan, PlanEdge, PlanProcess, RosSettings, SourceLine
from tfcompose.ros.environment import RANGE
from tfcompose.text import duration
from tfcompose.verdict.doctor import diagnose
from tfcompose.verdict.setup import settings_apart

if TYPE_CHECKING:
    from collections.abc import Callable

SECOND_NS = 1_000_000_000
BEGUN_NS = 1_800_000_000 * SECOND_NS
SECONDS = 5.0
END_NS = BEGUN_NS + int(SECONDS * SECOND_NS)
SENDERS = {b"d": "/drive", b"e": "/drive", b"s": "/static", b"x": "/ekf"}


class History:
    """What came in five seconds, from publishers that are named after their ids."""

    def __init__(self) -> None:
        self.observer = TreeObserver()
        self.observer.take_graph([Publisher(gid, node, static=gid == b"s") for gid, node in SENDERS.items()])

    def fixed(self, edge: str, gid: bytes = b"s", x: float = 0.0) -> History:
        self.observer.take([row(edge, 0, x)], static=True, gid=gid, received_ns=BEGUN_NS)
        return self

    def moving(
        self,
        edge: str,
        gid: bytes = b"d",
        hz: float = 50.0,
        until_s: float = SECONDS,
        stamp: Callable[[int], int] = lambda now: now,
    ) -> History:
        for tick in range(int(until_s * hz)):
            now = BEGUN_NS + int(tick * SECOND_NS / hz)
            self.observer.take([row(edge, stamp(now))], static=False, gid=gid, received_ns=now)
        return self

    def seen(self, **more: Any) -> TreeState:
        publishers = tuple(self.observer.publishers.known.values())
        return TreeState(SECONDS, edges=tuple(self.observer.edges(END_NS)), publishers=publishers, **more)


def row(edge: str, stamp_ns: int, x: float = 0.0) -> Any:
    parent, child = edge.split()
    return (parent, child, *divmod(stamp_ns, SECOND_NS), x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def robot() -> History:
    return History().moving("odom base_link").fixed("base_link laser")


def plan(*edges: PlanEdge, **more: Any) -> Plan:
    processes = (
        PlanProcess("drive", "external", nodes=("/drive",)),
        PlanProcess("static", "static", nodes=("/static",)),
    )
    return Plan("rover", "0", "base_link", RosSettings(), edges or planned(), processes, **more)


def planned() -> tuple[PlanEdge, ...]:
    moving = PlanEdge("odom", "base_link", "dynamic", "drive", "/drive", Pose(), 50.0, SourceLine("rover.yaml", 7))
    return moving, PlanEdge(
        "base_link", "laser", "static", "static", "/static", Pose(), None, SourceLine("rover.yaml", 9)
    )


def messages(seen: TreeState) -> dict[str, str]:
    return {one.code: one.message for one in diagnose(seen)}


def test_a_sound_robot_gives_no_finding_with_a_plan_or_without() -> None:
    assert messages(robot().seen()) == {}
    assert messages(robot().seen(plan=plan())) == {}


def test_an_edge_that_comes_late_is_said_with_the_time_that_lookups_lack() -> None:
    history = History().moving("odom base_link", stamp=lambda now: now - 7 * SECOND_NS // 10)
    assert messages(history.seen()) == {
        "TF833": "odom → base_link from /drive is stamped 700 ms ago when it comes",
    }


def test_odometry_that_is_ahead_is_told_and_a_localizer_that_dates_forward_is_not() -> None:
    def ahead(edge: str, seconds: float) -> dict[str, str]:
        history = History().moving(edge, stamp=lambda now: now + int(seconds * SECOND_NS))
        return messages(history.seen())

    assert ahead("odom base_link", 0.3) == {"TF835": "/drive stamps odom → base_link 300 ms ahead of time"}
    assert ahead("odom base_link", 0.1) == ahead("robot1/map robot1/odom", 1.0) == {}
    assert set(ahead("map odom", 2.0)) == {"TF835"}


def test_what_is_late_because_the_clocks_differ_is_told_of_the_clocks_alone() -> None:
    history = robot().moving("base_link arm", b"x", stamp=lambda now: now - 4 * SECOND_NS // 10)
    assert set(messages(history.seen())) == {"TF833"}
    assert set(messages(history.seen(skews_s={b"x": -0.4}))) == {"TF834"}


def test_a_frame_that_one_node_hands_over_is_no_finding_and_one_that_jumps_to_and_fro_is() -> None:
    def handed_over(turns_hz: float) -> TreeState:
        history = History().moving("world tool0", hz=60).moving("world table", hz=60)
        for tick in range(int(SECONDS * 20)):
            now = BEGUN_NS + tick * SECOND_NS // 20
            parent = "tool0" if int(tick / 20 * turns_hz) % 2 else "table"
            history.observer.take([row(f"{parent} cup", now)], static=False, gid=b"x", received_ns=now)
        return history.seen()

    assert messages(handed_over(0.7)) == messages(handed_over(0.3)) == {}
    found = diagnose(handed_over(20.0))
    assert [one.code for one in found] == ["TF802"]
    assert found[0].help == "let /ekf send one of them, or end it if it runs twice; tf2 takes whatever came last"


def test_a_parent_that_comes_between_now_and_then_is_a_second_one_also_from_the_same_node() -> None:
    history = History()
    for tick in range(int(SECONDS * 50)):
        now = BEGUN_NS + tick * SECOND_NS // 50
        history.observer.take([row("odom base_link", now)], static=False, gid=b"x", received_ns=now)
        if tick % 15 == 0:
            history.observer.take([row("map base_link", now)], static=False, gid=b"x", received_ns=now)
    assert "TF802" in messages(history.seen())


def test_a_frame_that_goes_from_node_to_node_is_told_once_and_one_whose_node_has_left_is_told_of_too() -> None:
    history = History().moving("table cup", b"d", until_s=2.0)
    for tick in range(int(SECONDS * 50)):
        now = BEGUN_NS + tick * SECOND_NS // 50
        if tick > 100:
            history.observer.take([row("tool0 cup", now)], static=False, gid=b"x", received_ns=now)
    history.fixed("table tool0")
    assert set(messages(history.seen())) == {"TF802"}
    history.observer.take_graph([Publisher(b"x", "/ekf", static=False), Publisher(b"s", "/static", static=True)])
    assert "TF804" in messages(history.seen())


def test_a_name_with_a_slash_in_front_is_the_frame_without_as_in_tf2_and_is_told() -> None:
    history = History().moving("/odom /base_link").moving("odom base_link", b"x").fixed("base_link laser")
    found = messages(history.seen())
    assert set(found) == {"TF501", "TF822"}
    assert found["TF501"].startswith("/drive publishes odom → base_link with a slash in front")
    assert found["TF822"].startswith("odom → base_link is published by /drive and by /ekf")
    assert set(messages(History().fixed("/base_link base_link").seen())) == {"TF821"}


def test_data_in_a_frame_without_its_robots_prefix_are_told_the_name_with_it() -> None:
    history = History().moving("robot1/odom robot1/base_link").fixed("robot1/base_link robot1/laser")
    data = StampedData("/robot1/scan", "laser", ("/robot1/lidar",), (0.0,) * 5)
    found = diagnose(history.seen(stamped=(data,)))
    assert [(one.code, one.help) for one in found] == [
        ("TF840", "is it meant to be robot1/laser? A frame_prefix is on one side only")
    ]


def test_data_of_another_clock_are_told_which_it_is() -> None:
    def of(stamp_ns: int, history: History, **more: Any) -> tuple[str, str]:
        times = [END_NS, more["clock_ns"]] if "clock_ns" in more else [END_NS]
        delay_s = min((time_ns - stamp_ns for time_ns in times), key=abs) / 1e9
        data = StampedData("/imu", "base_link", ("/imu",), (delay_s,) * 5, stamp_ns, END_NS)
        (found,) = diagnose(history.seen(stamped=(data,), **more))
        assert found.code == "TF841"
        return found.message, found.help

    message, advice = of(0, robot())
    assert message.startswith("/imu from /imu has no stamp: no lookup brings it together with odom → base_link")
    assert advice.startswith("set header.stamp")
    message, advice = of(1234 * SECOND_NS, robot())
    assert "is stamped 1234.0 s, which is simulated time, or time since a start: no lookup" in message
    assert advice.endswith("let the driver stamp with ROS time, not with its device's")
    message, advice = of(END_NS + 7200 * SECOND_NS, robot())
    assert "is stamped 2 h ahead of the system's time" in message
    assert advice.startswith("the clock behind /imu is 2 h ahead: sync it")
    simulated = History().moving("odom base_link", stamp=lambda now: now - BEGUN_NS).fixed("base_link laser")
    message, advice = of(END_NS, simulated, clock_ns=5 * SECOND_NS, clock_moves=True)
    assert "is stamped with the system's time, while /clock says 5.0 s" in message
    assert advice.startswith("set use_sim_time alike")


def test_data_and_a_tree_of_one_old_recording_are_together() -> None:
    day_ns = 86_400 * SECOND_NS
    played = History().moving("odom base_link", stamp=lambda now: now - day_ns).fixed("base_link laser")
    data = StampedData("/scan", "laser", ("/player",), (86_400.0,) * 5, END_NS - day_ns, END_NS)
    assert set(messages(played.seen(stamped=(data,)))) == {"TF825"}


def test_a_node_that_sends_a_loop_alone_is_not_told_to_end_one_of_several() -> None:
    alone = History().moving("a b").moving("b a")
    assert [one.help for one in diagnose(alone.seen())] == ["let /drive leave one of these edges out"]
    two = History().moving("a b").moving("b a", b"x")
    assert [one.help for one in diagnose(two.seen())] == [
        "end one of these nodes, or swap parent and child of that edge: tf2 finds no way through a loop"
    ]


def test_in_a_slow_simulation_edges_come_as_much_more_rarely() -> None:
    def found(speed: float) -> set[str]:
        history = History().moving(
            "odom base_link", hz=10.0, stamp=lambda now: 100 * SECOND_NS + int((now - BEGUN_NS) * speed)
        )
        return set(messages(history.seen(clock_ns=int((100 + SECONDS * speed) * SECOND_NS), clock_moves=True)))

    assert found(0.4) == set()
    assert found(1.0) == {"TF838"}


def test_of_a_quaternion_that_is_wrong_now_and_then_the_wrong_ones_length_is_told() -> None:
    history = robot()
    short = ("odom", "base_link", *divmod(END_NS, SECOND_NS), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.9)
    for each in (short, row("odom base_link", END_NS + 1)):
        history.observer.take([each], static=False, gid=b"d", received_ns=END_NS)
    assert messages(history.seen())["TF831"].endswith("its quaternion has length 0.900 (1 of 252)")


def test_of_a_frame_with_very_many_parents_some_are_named() -> None:
    history = History()
    for index in range(60):
        history.fixed(f"parent{index:02} cup")
    (found,) = [one for one in diagnose(history.seen()) if one.code == "TF802"]
    assert found.message.startswith("cup has 60 parents: parent00 (from /static), parent01 (from /static), ")
    assert len(found.notes) < 10


def test_what_is_sent_with_a_timer_of_the_least_rate_is_often_enough() -> None:
    assert messages(History().moving("odom base_link", hz=19.4).seen()) == {}
    assert set(messages(History().moving("odom base_link", hz=15.0).seen())) == {"TF838"}


def test_stamps_that_stand_with_the_clock_are_told_of_the_clock_alone() -> None:
    history = History().moving("odom base_link", stamp=lambda _: 106 * SECOND_NS).fixed("base_link laser")
    clock = Topic("/clock", "rosgraph_msgs/msg/Clock", ("/gazebo",), ("/nav",))
    stands = history.seen(clock_ns=106 * SECOND_NS, clock_moves=False, graph=(clock,))
    assert set(messages(stands)) == {"TF836"}
    assert "TF823" in messages(replace(stands, clock_moves=True))


def test_where_some_are_dropped_it_is_not_said_that_the_frame_is_missing() -> None:
    history = robot()
    history.observer.take([row("odom base_link", END_NS, float("nan"))], static=False, gid=b"d", received_ns=END_NS)
    assert [one.help for one in diagnose(history.seen())] == [
        "fix what the node computes it from; tf2 goes on with those before and after"
    ]


def test_a_machine_whose_clock_is_ahead_is_known_by_messages_that_come_before_they_were_sent() -> None:
    seen = robot().seen(skews_s={b"d": 3.2})
    assert messages(seen) == {"TF834": "the clock of /drive is 3.2 s ahead of this machine's"}
    assert messages(replace(seen, skews_s={b"d": -0.4})) == {
        "TF834": "what /drive sends arrives 400 ms after it was sent"
    }
    assert messages(replace(seen, skews_s={b"d": -0.2})) == {}


def test_a_loop_is_told_once_and_not_as_two_parents_too() -> None:
    history = robot().moving("map odom").moving("laser odom", b"x")
    assert messages(history.seen()) == {"TF820": "the frames base_link → laser → odom → base_link form a loop"}


def test_edges_of_a_publisher_that_replaced_another_have_one_publisher() -> None:
    """It was started anew, and the graph shows the killed one for some seconds still; fixed edges hold on."""
    history = History().moving("odom base_link", until_s=2.0).fixed("base_link laser")
    for tick in range(100):
        now = BEGUN_NS + 3 * SECOND_NS + tick * SECOND_NS // 50
        history.observer.take([row("odom base_link", now)], static=False, gid=b"e", received_ns=now)
    assert messages(history.seen()) == {}
    history.fixed("base_link laser", b"t")
    history.observer.take_graph([Publisher(gid, "/static", static=True) for gid in (b"s", b"t")])
    assert set(messages(history.seen())) == {"TF822"}
    history.observer.take_graph([Publisher(b"e", "/drive", static=False), Publisher(b"t", "/static", static=True)])
    assert messages(history.seen()) == {}


def test_a_tree_whose_names_have_a_prefix_is_told_so() -> None:
    found = diagnose(robot().fixed("robot1/base_link camera").seen())
    assert [one.code for one in found] == ["TF830"]
    assert "frame_prefix" in found[0].help


def test_where_simulated_time_rules_the_one_with_system_time_is_named() -> None:
    sim = robot().moving("map odom", b"x").seen(clock_ns=100 * SECOND_NS, clock_moves=True)
    assert messages(sim) == {}, "a clock that nobody stamps with rules nothing"
    history = History().fixed("base_link laser").moving("map odom", b"x", stamp=lambda now: now - BEGUN_NS)
    history.moving("odom base_link").moving("base_link arm", b"x", stamp=lambda now: now - BEGUN_NS)
    found = messages(history.seen(clock_ns=5 * SECOND_NS, clock_moves=True))
    assert found == {"TF825": "/drive sends odom → base_link stamped with the system's time, while /clock says 5.0 s"}


def test_data_that_no_edge_reaches_are_in_the_future_or_in_the_past_and_else_nothing_is_said() -> None:
    def of(late_s: float, delay_s: float) -> dict[str, str]:
        history = History().moving("odom base_link", stamp=lambda now: now - int(late_s * SECOND_NS))
        data = StampedData("/scan", "base_link", ("/lidar",), (delay_s,) * 5)
        return messages(history.seen(stamped=(data,)))

    assert of(0.0, 0.1) == of(0.2, 0.0) == {}
    assert of(0.4, 0.0) == {
        "TF841": "/scan from /lidar is stamped 400 ms after the newest odom → base_link from /drive: "
        "extrapolation into the future"
    }
    assert of(0.0, 11.0)["TF841"].endswith("extrapolation into the past")


def test_a_scan_whose_clock_is_ahead_is_told_apart_from_an_edge_that_is_late() -> None:
    data = StampedData("/scan", "base_link", ("/lidar",), (-1.0,) * 5)
    found = diagnose(robot().seen(stamped=(data,)))
    assert [one.code for one in found] == ["TF841"]
    assert found[0].help.startswith("the clock behind /scan is 1 s ahead")


@pytest.mark.parametrize(
    ("history", "code", "text"),
    [
        (
            History().moving("odom base_link"),
            "TF811",
            "base_link → laser was never seen; its owner is static (/static)",
        ),
        (
            History().moving("odom base_link", b"x").fixed("base_link laser"),
            "TF801",
            "odom → base_link is published by /ekf; the owner is drive (/drive)",
        ),
        (
            robot().moving("map base_link", b"x"),
            "TF802",
            "base_link has two parents: map (from /ekf) and odom (from its owner drive (/drive))",
        ),
        (
            robot().moving("base_link arm", b"x"),
            "TF803",
            "base_link → arm is published by /ekf, but not declared",
        ),
        (
            History().moving("odom base_link", until_s=3.0).fixed("base_link laser"),
            "TF804",
            "drive (/drive) fell silent: nothing on odom → base_link for 2.02 s",
        ),
        (
            History().moving("odom base_link", hz=20.0).fixed("base_link laser"),
            "TF805",
            "odom → base_link comes at 20 Hz from drive (/drive), but 50 Hz is declared",
        ),
        (
            History().moving("odom base_link").moving("base_link laser", b"s"),
            "TF809",
            "base_link → laser is published on /tf by its owner /static, declared for /tf_static",
        ),
        (
            History().moving("odom base_link").fixed("base_link laser", x=0.02),
            "TF846",
            (
                "the pose of laser in base_link from /static is off by 20 mm: seen xyz 0.02 0 0 m, rpy 0 0 0 deg; "
                "expected xyz 0 0 0 m, rpy 0 0 0 deg"
            ),
        ),
        (
            robot().moving("odom base_link", b"e"),
            "TF801",
            "odom → base_link is published by another /drive; the owner is drive (/drive)",
        ),
    ],
    ids=["missing", "foreign", "parent", "undeclared", "silent", "slow", "topic", "pose", "twice"],
)
def test_with_a_plan_what_differs_from_it_is_found(history: History, code: str, text: str) -> None:
    assert messages(history.seen(plan=plan()))[code] == text


def test_what_a_strict_guard_passes_on_is_its_owners() -> None:
    strict = plan(guard=GuardPolicy("strict"))
    strict = replace(strict, processes=(*strict.processes, PlanProcess("guard", "guard", nodes=("/ekf",))))
    history = History().moving("odom base_link", b"x").fixed("base_link laser", b"x")
    assert messages(history.seen(plan=strict)) == {}
    assert set(messages(history.seen(plan=plan()))) == {"TF801"}


def test_where_nobody_publishes_no_owner_is_missed_by_name() -> None:
    assert set(messages(TreeState(SECONDS, plan=plan()))) == {"TF845"}


def test_an_edge_that_is_late_for_data_is_told_once() -> None:
    history = History().moving("odom base_link", stamp=lambda now: now - SECOND_NS)
    data = StampedData("/scan", "base_link", ("/lidar",), (0.0,) * 5)
    assert set(messages(history.seen(stamped=(data,)))) == {"TF841"}
    assert set(messages(history.seen())) == {"TF833"}


def test_an_edge_on_both_topics_is_told_once() -> None:
    assert set(messages(robot().fixed("odom base_link", b"x").seen())) == {"TF809"}


def test_processes_with_other_settings_are_not_looked_for_where_there_is_tf_below_a_namespace() -> None:
    other = RosProcess(9, "nav", {"ROS_DOMAIN_ID": "8"})
    seen = TreeState(SECONDS, processes=(other,))
    assert set(messages(seen)) == {"TF845", "TF908"}
    below = (Topic("/robot1/tf", "tf2_msgs/msg/TFMessage", ("/robot1/drive",)),)
    assert set(messages(replace(seen, graph=below))) == {"TF845"}


def test_edges_that_a_plan_allows_or_that_are_another_robots_are_no_finding() -> None:
    seen = (
        robot().moving("base_link tag_1", b"x").seen(plan=plan(guard=GuardPolicy(allow=(EdgePattern("*", "tag_*"),))))
    )
    assert messages(seen) == {}


def test_processes_with_other_settings_cannot_be_heard_and_why_is_said() -> None:
    ours = {"ROS_DOMAIN_ID": "7"}
    assert settings_apart({"ROS_DOMAIN_ID": "7", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, ours) == {}
    assert settings_apart({}, ours) == {"ROS_DOMAIN_ID": "0"}
    assert settings_apart({**ours, "ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, ours) == {RANGE: "OFF"}
    assert settings_apart({**ours, "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, ours) == {}, (
        "the default may be the same"
    )
    seen = TreeState(1.0, settings={**ours, "RMW_IMPLEMENTATION": "b"})
    other = RosProcess(9, "nav", {**ours, "ROS_DOMAIN_ID": "8", "RMW_IMPLEMENTATION": "a"})
    [found] = [one for one in diagnose(replace(seen, processes=(other,))) if one.code == "TF908"]
    assert found.message == (
        "a ROS process on this machine cannot be heard from here: started with ROS_DOMAIN_ID=8, RMW_IMPLEMENTATION=a, "
        "and here ROS_DOMAIN_ID is 7 and RMW_IMPLEMENTATION is b"
    )
    assert found.help.startswith("to look there: ROS_DOMAIN_ID=8 RMW_IMPLEMENTATION=a tfcompose doctor; ")


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"ROS_LOCALHOST_ONLY": "1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, "other machines are not heard"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LAN"}, "is none of SUBNET"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, "nobody is discovered"),
    ],
)
def test_settings_that_cannot_be_meant_are_found(settings: dict[str, str], word: str) -> None:
    assert word in messages(robot().seen(settings=settings))["TF909"]


def test_a_leak_is_one_where_the_robot_has_topics_of_its_own() -> None:
    tf = "tf2_msgs/msg/TFMessage"
    both = (Topic("/robot1/tf", tf, ("/robot1/drive",)), Topic("/tf", tf, ("/robot1/ekf", "/drive")))
    assert messages(robot().seen(graph=both)) == {
        "TF827": "/robot1/ekf publishes the global /tf, but its robot's TF is on /robot1/tf"
    }
    assert messages(robot().seen(graph=both[1:])) == {}, "a namespace without topics of its own"


def test_a_description_gives_its_moving_joints_and_nothing_where_it_is_none() -> None:
    text = "<robot name='r'><link name='a'/><link name='b'/>"
    text += "<joint name='j' type='revolute'><parent link='a'/><child link='b'/><mimic joint='k'/></joint>"
    text += "<joint name='f' type='fixed'><parent link='a'/><child link='c'/></joint></robot>"
    joints = joints_of(text)
    assert [(j.name, j.parent, j.child, j.mimic) for j in joints] == [("j", "a", "b", True)]
    assert joints_of("<robot") == joints_of("<!DOCTYPE a [<!ENTITY b 'c'>]><robot/>") == ()


def test_times_are_said_as_people_say_them() -> None:
    assert [duration(value) for value in (0.12, 3.21, 7200, 864000)] == ["120 ms", "3.21 s", "2 h", "10 days"]


def test_joint_states_of_a_robot_beside_are_not_this_ones() -> None:
    tf, states = "tf2_msgs/msg/TFMessage", "sensor_msgs/msg/JointState"
    heard = Topic("/robot1/joint_states", states, ("/robot1/wheels",), ("/robot1/joints",))
    beside = (Topic("/tf", tf, ("/drive",)), Topic("/robot1/tf", tf, ("/robot1/joints",)), heard)
    history = History().moving("odom base_link")
    assert "TF842" not in {one.code for one in diagnose(history.seen(graph=beside))}
    alone = (Topic("/tf", tf, ("/drive",)), heard)  # nobody below /robot1 publishes TF: they are meant for this tree
    assert "TF842" in {one.code for one in diagnose(history.seen(graph=alone))}
