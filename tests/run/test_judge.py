"""Histories replayed to the guard's judge with a clock that is set by hand."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tfcompose.plan import Claim, GuardPolicy, Plan, PlanEdge, PlanProcess, RosSettings
from tfcompose.pose import Pose
from tfcompose.run.events import Clear, Complete, Found, GuardEvent, Live, OwnerReady, Recovered, Taken
from tfcompose.run.guard.health import statuses
from tfcompose.run.guard.judge import Judge, Message, Writer

if TYPE_CHECKING:
    from tfcompose.diagnostic import Diagnostic
    from tfcompose.plan import EdgeKind

LOOK_S = 0.1
SETTLE_S = 1.0


def edge(names: str, owner: str, kind: EdgeKind = "dynamic", rate: float | None = None) -> PlanEdge:
    parent, child = names.split()
    return PlanEdge(parent, child, kind, owner, f"/{owner}", Pose(), rate, ("rover.yaml", 7))


EDGES = (
    edge("map odom", "slam"),
    edge("odom base", "drive"),
    edge("base left", "joints", "joint"),
    edge("base lidar", "static", "static"),
    edge("base camera", "static", "static"),
)
TOOL = replace(edge("arm tool", "changer"), switched=("rack_1", "rack_2"))
PROCESSES = (
    PlanProcess("static", "static"),
    PlanProcess("joints", "joints"),
    PlanProcess("slam", "run"),
    PlanProcess("drive", "external"),
    PlanProcess("guard", "guard"),
)
FIXED = "base lidar, base camera"


@dataclass
class Publisher:
    """A publisher of the history; ``sent`` counts its messages."""

    node: str | None
    static: bool = False
    volatile: bool = False
    gid: bytes = b""
    sent: int = 0


@dataclass
class History:
    """A judge that looks every tenth of a second, and the publishers that it sees."""

    guard: GuardPolicy = field(default_factory=GuardPolicy)
    processes: tuple[PlanProcess, ...] = PROCESSES
    clock: str = "wall"
    settle_s: float = SETTLE_S
    gids: bool = True
    says_who: bool = True
    edges: tuple[PlanEdge, ...] = EDGES
    claims: tuple[Claim, ...] = ()
    now: float = 1000.0
    events: list[GuardEvent] = field(default_factory=list)
    graph: list[Publisher] = field(default_factory=list)
    made: int = 0
    judge: Judge = field(init=False)
    looked: float = field(init=False)

    def __post_init__(self) -> None:
        settings = RosSettings(clock=self.clock)
        plan = Plan("rover", "0", "base", settings, self.edges, self.processes, self.guard, self.claims)
        self.judge = Judge(plan, self.settle_s, self.now, self.wall_ns(), says_who=self.says_who)
        self.looked = self.now

    def wall_ns(self) -> int:
        return 1_700_000_000_000_000_000 + round(self.now * 1e9)

    def joins(
        self, node: str | None, *, static: bool = False, volatile: bool = False, hidden: bool = False
    ) -> Publisher:
        """Let a publisher come; one that is hidden is not in the graph yet."""
        self.made += 1
        publisher = Publisher(node, static, volatile, bytes([self.made]) * 16)
        if not hidden:
            self.graph.append(publisher)
        return publisher

    def leaves(self, publisher: Publisher) -> None:
        self.graph.remove(publisher)

    def send(
        self,
        publisher: Publisher,
        edges: str,
        *,
        static: bool | None = None,
        ago: float = 0.0,
        stamp_s: float | None = None,
    ) -> History:
        """Let a message arrive that was sent ``ago`` seconds before, stamped so."""
        publisher.sent += 1
        pairs = tuple((names.split()[0], names.split()[1]) for names in edges.split(", "))
        kind = publisher.static if static is None else static
        gid = (publisher.gid if self.says_who else publisher.gid[:8] + bytes(8)) if self.gids else None
        sent_ns = self.wall_ns() - round(ago * 1e9)
        stamps = () if stamp_s is None else (round(stamp_s * 1e9),) * len(pairs)
        message = Message(pairs, kind, gid, sent_ns, publisher.sent, stamps, self.wall_ns())
        self.events += self.judge.message(message, self.now)
        return self

    def look(self) -> History:
        writers = [Writer(p.gid, p.node, p.static, p.volatile) for p in self.graph]
        self.events += self.judge.graph(writers, self.now)
        self.events += self.judge.tick(self.now)
        return self

    def wait(self, seconds: float) -> History:
        """Let time pass, in looks."""
        end = self.now + seconds
        while self.now < end - 1e-9:
            self.now = min(end, self.now + LOOK_S)
            self.look()
        return self

    def repeat(self, publisher: Publisher, edges: str, times: int, every: float = 0.1) -> History:
        """Let a publisher send, and the guard look, so many times."""
        for _ in range(times):
            self.send(publisher, edges).wait(every)
        return self

    def clear(self) -> History:
        """Look until all is clear."""
        self.wait(self.settle_s + LOOK_S)
        assert Clear() in self.events
        return self

    def dies(self, down_s: float = 1.5) -> History:
        """Let another judge follow with this one's memory, after a time in which nobody looked, and forget events."""
        memory = json.loads(json.dumps(self.judge.memory()))
        self.now += down_s
        self.judge = Judge(self.judge.plan, 0.0, self.now, 0)
        self.events = self.judge.recall(memory, self.now)
        return self

    def found(self) -> list[Diagnostic]:
        return [event.found for event in self.events if isinstance(event, (Found, Taken))]

    def said(self) -> list[str]:
        return [
            f"{event.found.code} {event.found.message}" for event in self.events if isinstance(event, (Found, Taken))
        ]

    def all(self, kind: type[GuardEvent]) -> list[GuardEvent]:
        return [event for event in self.events if isinstance(event, kind)]


@pytest.fixture
def history() -> History:
    return History()


@pytest.fixture
def running() -> History:
    return History().clear()


# Owners.


def test_owners_are_live_and_nothing_is_found(running: History) -> None:
    static, joints = running.joins("/static", static=True), running.joins("/joints")
    slam, drive = running.joins("/slam"), running.joins("/drive")
    running.send(static, FIXED)
    for _ in range(40):
        running.send(joints, "base left").send(slam, "map odom").send(drive, "odom base").wait(0.1)
    live = (("static", ("lidar", "camera")), ("joints", ("left",)), ("slam", ("odom",)), ("drive", ("base",)))
    assert running.all(Live) == [Live(owner, children) for owner, children in live]
    assert running.all(OwnerReady) == [OwnerReady(name) for name in ("static", "joints", "slam", "drive")]
    assert running.all(Complete) == [Complete(5)]
    assert running.said() == []


def test_all_is_clear_after_the_settling_time_when_nobody_sends(history: History) -> None:
    history.wait(SETTLE_S - 0.05)
    assert history.events == []
    assert history.wait(LOOK_S).events == [Clear()]


def test_an_external_owner_that_is_there_before_the_start_is_right(history: History) -> None:
    drive = history.joins("/drive")
    history.repeat(drive, "odom base", 30)
    assert history.said() == []
    assert Live("drive", ("base",)) in history.events


def test_a_restarted_owner_is_right_also_while_its_old_publisher_is_still_in_the_graph(running: History) -> None:
    for _ in range(4):
        running.repeat(running.joins("/slam"), "map odom", 10)
    assert running.said() == []


def test_an_owner_may_send_other_edges_that_are_allowed() -> None:
    running = History(GuardPolicy(unknown_edges="error", allow=(("map", "goal_*"),))).clear()
    running.repeat(running.joins("/slam"), "map odom, map goal_1", 5)
    assert running.said() == []


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(st.sampled_from(("/static", "/joints", "/slam", "/drive")), st.floats(0, 0.3), st.floats(0, 0.65)),
        max_size=40,
    )
)
def test_rightful_messages_are_never_found_however_they_are_ordered_and_their_names_delayed(
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
        for at, publisher, name in named:
            publisher.node = name if running.now >= at else publisher.node
        running.send(publishers[node], edges[node], ago=min(delay, running.now - 1000 - SETTLE_S - LOOK_S)).wait(pause)
    for _, publisher, name in named:
        publisher.node = name
    running.wait(2)
    assert running.said() == []
    assert {e.owner for e in running.all(Live) if isinstance(e, Live)} == {name[1:] for name in publishers}


# Foreign publishers.


def test_a_foreign_publisher_is_named_once_and_within_a_look(running: History) -> None:
    rogue = running.joins("/rogue")
    running.send(rogue, "map odom").wait(LOOK_S)
    assert running.said() == ["TF801 map → odom is published by /rogue; the owner is slam (/slam)"]
    running.repeat(rogue, "map odom", 100)
    assert len(running.found()) == 1
    assert running.found()[0].severity == "error"
    assert [note.message for note in running.found()[0].notes] == ["map → odom is declared in rover.yaml:7"]


def test_a_foreign_publisher_that_ended_is_said_to_have_and_is_reported_when_it_comes_again(running: History) -> None:
    rogue = running.joins("/rogue")
    running.repeat(rogue, "map odom", 5)
    running.leaves(rogue)
    assert running.wait(4).all(Recovered) == [Recovered("map → odom is no longer published by /rogue")]
    running.repeat(running.joins("/rogue"), "map odom", 5)
    assert len(running.found()) == 2


def test_a_foreign_publisher_that_sends_every_five_seconds_is_reported_once(running: History) -> None:
    rogue = running.joins("/rogue")
    running.repeat(rogue, "map odom", 10, every=5)
    assert len(running.found()) == 1
    assert running.all(Recovered) == []
    assert len(running.wait(31).all(Recovered)) == 1


def test_a_foreign_publisher_that_pauses_for_long_is_reported_again_when_it_goes_on(running: History) -> None:
    rogue = running.joins("/rogue")
    running.repeat(rogue, "map odom", 5).wait(40).repeat(rogue, "map odom", 5)
    assert (len(running.found()), len(running.all(Recovered))) == (2, 1)


def test_a_latched_offence_lasts_while_its_publisher_does(running: History) -> None:
    rogue = running.joins("/rogue", static=True)
    running.send(rogue, "base lidar").wait(120)
    assert (len(running.found()), running.all(Recovered)) == (1, [])
    running.leaves(rogue)
    assert len(running.wait(4).all(Recovered)) == 1


def test_many_edges_of_one_node_are_one_finding_also_when_each_comes_in_a_message_of_its_own(running: History) -> None:
    rogue = running.joins("/rogue", static=True)
    running.send(rogue, "base lidar").send(rogue, "base camera").wait(LOOK_S)
    assert running.said() == [
        "TF801 base → lidar and 1 more edge are published by /rogue; the owner is static (/static)"
    ]
    assert [note.message for note in running.found()[0].notes][:2] == ["base → lidar", "base → camera"]


def test_edges_of_several_owners_are_one_finding_that_names_all_owners(running: History) -> None:
    running.send(running.joins("/rogue"), "map odom, odom base, odom base").wait(LOOK_S)
    assert running.said() == [
        "TF801 map → odom and 1 more edge are published by /rogue; the owners are slam (/slam), drive (/drive)"
    ]


def test_edges_that_an_offender_adds_later_are_reported_too_and_those_of_a_flood_together(running: History) -> None:
    rogue = running.joins("/rogue")
    for n in range(100):
        running.send(rogue, f"base thing_{n}").wait(0.02)
    running.wait(1)
    assert 2 <= len(running.found()) <= 6
    assert len(running.found()[1].notes) <= 13
    running.send(rogue, "map odom").wait(LOOK_S)
    assert running.found()[-1].code == "TF801"


def test_a_second_parent_is_reported_with_both_parents(running: History) -> None:
    running.send(running.joins("/rogue"), "base_footprint base").wait(LOOK_S)
    message = "base has a second parent: /rogue publishes base_footprint → base, drive (/drive) odom → base"
    assert running.said() == [f"TF802 {message}"]


def test_a_second_parent_is_reported_also_when_the_owner_itself_sends_it(running: History) -> None:
    drive = running.joins("/drive")
    running.repeat(drive, "odom base, map base", 10)
    assert [found.code for found in running.found()] == ["TF802"]
    assert "base hangs on map: its owner drive (/drive) publishes map → base, " in running.found()[0].message


@pytest.mark.parametrize(("policy", "severities"), [("ignore", []), ("warn", ["warning"]), ("error", ["error"])])
def test_an_undeclared_edge_is_reported_as_the_policy_says(policy: str, severities: list[str]) -> None:
    running = History(GuardPolicy(unknown_edges=policy)).clear()  # type: ignore[arg-type]
    running.repeat(running.joins("/tracker"), "map person", 10)
    assert [(found.code, found.severity) for found in running.found()] == [("TF803", one) for one in severities]


def test_only_undeclared_edges_that_no_pattern_allows_are_reported() -> None:
    running = History(GuardPolicy(allow=(("map", "person_*"),))).clear()
    tracker = running.joins("/tracker")
    running.repeat(tracker, "map person_1, odom person_2, map person", 3)
    (found,) = running.found()
    assert found.message.startswith("odom → person_2 and 1 more edge are published by /tracker, and nobody declared")
    assert [note.message for note in found.notes] == ["odom → person_2", "map → person"]


def test_an_owner_on_the_wrong_topic_is_reported(running: History) -> None:
    running.repeat(running.joins("/slam", static=True), "map odom", 3)
    (found,) = running.found()
    assert (found.code, "on /tf_static, declared for /tf" in found.message) == ("TF809", True)


def test_a_volatile_writer_of_static_edges_is_reported_once_with_what_it_owns(running: History) -> None:
    running.joins("/static", static=True, volatile=True)
    running.joins("/slam", volatile=True)
    running.wait(5)
    (found,) = running.found()
    assert (found.code, "/static writes /tf_static with durability volatile" in found.message) == ("TF806", True)
    assert "base → lidar" in found.notes[0].message


@pytest.mark.parametrize("late", [0.0, 5.0])
def test_an_owner_that_replaced_a_latched_edge_before_it_was_heard_is_told_once_with_what_is_lost(late: float) -> None:
    running = History().clear().wait(late)
    static = running.joins("/static", static=True)
    static.sent = 1  # with base → lidar, before the guard had found it
    running.send(static, "base camera").wait(1)
    assert running.said() == []
    running.wait(5)
    (found,) = running.found()
    assert (found.code, found.severity) == ("TF850", "warning")
    assert found.message == (
        "/static sent 1 message on /tf_static before anybody heard it, and none since holds base → lidar"
    )
    running.dies()
    running.wait(10)
    assert running.found() == []


@pytest.mark.parametrize("edges", ["base lidar, base camera", "base camera"])
def test_an_owner_whose_latched_messages_were_all_heard_or_hold_all_replaced_nothing(edges: str) -> None:
    running = History().clear()
    static = running.joins("/static", static=True)
    static.sent = 0 if edges == "base camera" else 3
    running.send(static, edges).wait(5)
    running.send(static, FIXED).wait(5)
    assert running.said() == []


# Names that come late, or never.


def test_a_publisher_whose_name_comes_later_is_judged_when_it_is_known(running: History) -> None:
    rogue = running.joins(None)
    running.send(rogue, "map odom").wait(0.4)
    assert running.said() == []
    rogue.node = "/rogue"
    assert "published by /rogue" in running.wait(LOOK_S).said()[0]


def test_an_owner_whose_name_comes_after_seconds_is_not_blamed(running: History) -> None:
    slam = running.joins(None)
    running.repeat(slam, "map odom", 40)
    slam.node = "/slam"
    running.repeat(slam, "map odom", 10)
    assert running.said() == []
    assert Live("slam", ("odom",)) in running.events


def test_a_publisher_without_a_name_is_reported_within_a_second_where_the_owner_is_known(running: History) -> None:
    slam, stranger = running.joins("/slam"), running.joins(None)
    for _ in range(9):
        running.send(slam, "map odom").send(stranger, "map odom").wait(0.1)
    assert running.said() == [
        "TF801 map → odom is published by a publisher without a node name; the owner is slam (/slam)"
    ]


def test_a_publisher_that_gets_its_name_after_it_was_reported_is_named_once_and_not_said_to_have_ended(
    running: History,
) -> None:
    slam, stranger = running.joins("/slam"), running.joins(None)
    running.send(slam, "map odom").repeat(stranger, "map odom", 15)
    stranger.node = "/rogue"
    running.repeat(stranger, "map odom", 350)
    assert [said.split(" is published by ")[1].split(";")[0] for said in running.said()] == [
        "a publisher without a node name",
        "/rogue",
    ]
    assert running.all(Recovered) == []


def test_a_publisher_that_never_gets_a_name_is_reported_at_last(running: History) -> None:
    running.repeat(running.joins(None), "map odom", 60)
    assert [found.code for found in running.found()] == ["TF801"]


def test_a_publisher_that_sends_once_and_leaves_is_named(running: History) -> None:
    rogue = running.joins("/rogue")
    running.look().leaves(rogue)
    assert "/rogue" in running.send(rogue, "map odom").wait(LOOK_S).said()[0]


# Who was there first.


def test_a_planned_edge_that_is_published_before_the_start_is_taken_and_the_node_named(history: History) -> None:
    history.repeat(history.joins("/rogue"), "map odom", 20)
    (event,) = history.all(Taken)
    assert history.events[0] == event
    assert history.said() == ["TF807 map → odom: published by /rogue before the start"]
    assert "node: /rogue" in history.found()[0].help


def test_a_namesake_of_what_the_plan_starts_is_refused_before_the_start(history: History) -> None:
    history.repeat(history.joins("/slam"), "map odom", 10)
    assert history.said() == ["TF807 map → odom: published by another /slam before the start"]
    assert "is the robot running already?" in history.found()[0].help
    assert "external" not in history.found()[0].help


def test_a_second_parent_before_the_start_is_taken_and_says_so(history: History) -> None:
    history.repeat(history.joins("/rogue"), "world odom", 10)
    assert history.said() == [
        "TF807 world → odom: published by /rogue before the start, and the plan hangs odom on map"
    ]


def test_an_undeclared_edge_before_the_start_keeps_nothing_from_starting(history: History) -> None:
    history.repeat(history.joins("/tracker"), "map person", 20)
    assert (history.all(Taken), [found.code for found in history.found()]) == ([], ["TF803"])
    assert Clear() in history.events


def test_all_is_not_clear_while_a_sender_of_a_planned_edge_has_no_name(history: History) -> None:
    drive = history.joins(None)
    history.repeat(drive, "odom base", 30)
    assert Clear() not in history.events
    drive.node = "/drive"
    assert Clear() in history.repeat(drive, "odom base", 3).events


@pytest.mark.parametrize("hertz", [5, 10, 50, 200])
def test_a_publisher_that_was_there_first_and_is_discovered_late_is_taken(running: History, hertz: int) -> None:
    rogue = running.joins("/rogue")
    rogue.sent = 5 * hertz
    running.wait(2).repeat(rogue, "map odom", hertz, every=1 / hertz)
    assert [type(event) for event in running.events if isinstance(event, (Found, Taken))] == [Taken]


def test_a_latched_message_from_before_the_start_is_taken_however_late_it_comes(running: History) -> None:
    running.wait(4).send(running.joins("/rogue", static=True), "base lidar", ago=10).wait(1)
    assert len(running.all(Taken)) == 1


@pytest.mark.parametrize("hertz", [5, 10, 50, 200])
def test_a_publisher_that_began_after_the_start_is_found_within_a_second(running: History, hertz: int) -> None:
    rogue = running.joins("/rogue")
    rogue.sent = max(1, hertz // 5)
    running.wait(0.5).repeat(rogue, "map odom", round(0.9 * hertz), every=1 / hertz)
    assert [type(event) for event in running.events if isinstance(event, (Found, Taken))] == [Found]


def test_a_publisher_that_began_just_before_the_start_is_found_and_not_taken_for_first(running: History) -> None:
    running.send(running.joins("/rogue", static=True), "base lidar", ago=0.4).wait(1)
    assert [type(event) for event in running.events if isinstance(event, (Found, Taken))] == [Found]


def test_lost_messages_do_not_turn_a_newcomer_into_one_that_was_first(running: History) -> None:
    rogue = running.joins("/rogue")
    running.wait(0.3)
    rogue.sent = 10
    for _ in range(12):
        rogue.sent += 3
        running.send(rogue, "map odom").wait(0.08)
    assert (running.all(Taken), len(running.found())) == ([], 1)


@settings(max_examples=100, deadline=None)
@example(50, [0.0] * 12, 0, 0.6, 0.2)
@given(
    st.sampled_from((5, 10, 50, 200)),
    st.lists(st.floats(-0.9, 0.9), min_size=12, max_size=12),
    st.integers(0, 11),
    st.floats(0, 0.8),
    st.floats(0, 0.2),
)
def test_jitter_and_a_hiccup_do_not_turn_a_newcomer_into_one_that_was_first(
    hertz: int, jitter: list[float], at: int, hiccup: float, unheard_s: float
) -> None:
    running = History().clear()
    rogue = running.joins("/rogue")
    running.wait(unheard_s)
    rogue.sent = int(unheard_s * hertz)
    for index, part in enumerate(jitter):
        running.send(rogue, "map odom", ago=part * 0.5 / hertz).wait(1 / hertz + (hiccup if index == at else 0))
    running.wait(1)
    assert running.all(Taken) == []
    assert len(running.found()) == 1


def test_a_publisher_is_not_taken_for_first_long_after_the_start(running: History) -> None:
    running.wait(20).send(running.joins("/rogue", static=True), "base lidar", ago=60).wait(1)
    assert [type(event) for event in running.events if isinstance(event, (Found, Taken))] == [Found]


# Two of one name.


def test_two_publishers_of_one_name_that_take_turns_are_reported_and_the_edge_is_not_silent() -> None:
    rated = tuple(replace(one, rate=10.0) if one.owner == "slam" else one for one in EDGES)
    running = History()
    running.judge = Judge(
        Plan("r", "0", "base", RosSettings(), rated, PROCESSES), SETTLE_S, running.now, running.wall_ns()
    )
    running.clear()
    a, b = running.joins("/slam"), running.joins("/slam")
    for _ in range(20):
        running.send(a, "map odom").wait(0.1).send(b, "map odom").wait(0.1)
    assert running.said() == ["TF801 map → odom is published by another /slam; the owner is slam (/slam)"]


def test_a_second_static_process_is_reported_while_both_are_there_and_over_when_it_has_left(running: History) -> None:
    first, second = (running.joins("/static", static=True) for _ in range(2))
    running.send(first, FIXED).wait(2).send(second, FIXED).wait(10)
    assert running.said() == [
        "TF801 base → lidar and 1 more edge are published by another /static; the owner is static (/static)"
    ]
    assert running.all(Recovered) == []
    running.leaves(second)
    assert len(running.wait(4).all(Recovered)) == 2


def test_a_static_process_in_the_place_of_one_that_has_left_is_right(running: History) -> None:
    first = running.joins("/static", static=True)
    running.send(first, FIXED).wait(1).leaves(first)
    running.send(running.joins("/static", static=True), FIXED).wait(1)
    assert running.said() == []


def test_a_static_owner_that_leaves_is_reported_once(running: History) -> None:
    static = running.joins("/static", static=True)
    running.send(static, FIXED).wait(1).leaves(static)
    running.wait(10)
    assert [found.code for found in running.found()] == ["TF804"]


# Where the rmw does not say who sent a message.


def test_without_ids_nobody_is_blamed_where_the_owner_may_have_sent_it() -> None:
    running = History(gids=False).clear()
    slam, rogue = running.joins("/slam"), running.joins("/slam_helper")
    for _ in range(10):
        running.send(slam, "map odom").send(rogue, "map odom").wait(0.1)
    assert running.said() == []


def test_without_ids_one_of_those_that_may_have_sent_it_is_blamed_once_and_nobody_was_first() -> None:
    running = History(gids=False)
    drive = running.joins("/drive")
    running.repeat(drive, "odom base", 20)
    rogue = running.joins("/rogue")
    running.joins("/static", static=True)
    running.repeat(rogue, "map odom", 10)
    running.joins("/late")
    running.repeat(rogue, "map odom", 20)
    assert running.said() == ["TF801 map → odom is published by one of /drive, /rogue; the owner is slam (/slam)"]
    assert running.all(Taken) == []


def test_ids_that_do_not_say_whose_they_are_tell_two_that_take_turns_apart() -> None:
    running = History(says_who=False).clear()
    slam, rogue = running.joins("/slam"), running.joins("/rogue")
    running.repeat(slam, "map odom", 5)
    for _ in range(20):
        running.send(slam, "map odom").send(rogue, "map odom").wait(0.1)
    assert running.said() == ["TF801 map → odom is published by one of /rogue, /slam; the owner is slam (/slam)"]
    running.leaves(rogue)
    running.repeat(slam, "map odom", 400)
    assert len(running.all(Recovered)) == 1


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
    assert running.said() == []
    assert {child for one in running.all(Live) if isinstance(one, Live) for child in one.children} >= {"odom", "base"}


def test_ids_that_do_not_say_whose_they_are_name_all_who_may_have_sent_what_nobody_there_owns() -> None:
    running = History(says_who=False).clear()
    drive, rogue = running.joins("/drive"), running.joins("/rogue")
    for _ in range(30):
        running.send(drive, "odom base").send(rogue, "map odom, base cup").wait(0.1)
    assert running.said() == [
        "TF801 map → odom is published by one of /drive, /rogue; the owner is slam (/slam)",
        "TF803 base → cup is published by one of /drive, /rogue, and nobody declared it",
    ]


def test_a_name_that_is_part_of_the_owners_does_not_pass_for_it() -> None:
    running = History(gids=False).clear()
    running.joins("/slam_toolbox")
    running.repeat(running.joins("/other"), "map odom", 10)
    assert [found.code for found in running.found()] == ["TF801"]


# A tool that changes its parent.


def test_the_owner_may_hang_a_switched_edge_on_each_of_its_parents_and_on_no_other() -> None:
    history = History(edges=(*EDGES, TOOL)).clear()
    changer = history.joins("/changer")
    for parent in ("arm", "rack_1", "rack_2", "arm"):
        history.repeat(changer, f"{parent} tool", 5)
    assert history.said() == []
    history.repeat(changer, "table tool", 10)
    message = "tool hangs on table: its owner changer (/changer) publishes table → tool, declared is arm → tool"
    assert history.said() == [f"TF802 {message}"]


def test_another_node_may_not_publish_a_switched_edge_on_any_of_its_parents() -> None:
    history = History(edges=(*EDGES, TOOL)).clear()
    history.repeat(history.joins("/changer"), "arm tool", 5)
    history.repeat(history.joins("/rogue"), "rack_1 tool", 10)
    assert [found.code for found in history.found()] == ["TF801"]
    assert "/rogue" in history.found()[0].message


# The tree that is seen.


@pytest.mark.parametrize("policy", [GuardPolicy(), GuardPolicy(allow=(("*", "*"),)), GuardPolicy("watch", "ignore")])
def test_an_edge_that_closes_a_loop_is_an_error_whatever_is_allowed_and_the_loop_is_named(policy: GuardPolicy) -> None:
    running = History(policy).clear()
    running.repeat(running.joins("/rogue"), "base map", 5)
    assert running.said() == ["TF820 /rogue publishes base → map, which closes the loop map → odom → base → map"]
    assert running.found()[0].severity == "error"
    assert "end /rogue" in running.found()[0].help


def test_a_second_parent_among_its_own_descendants_is_a_loop(running: History) -> None:
    running.repeat(running.joins("/rogue"), "base odom", 5)
    assert running.said() == ["TF820 /rogue publishes base → odom, which closes the loop odom → base → odom"]


def test_a_loop_through_several_strangers_is_found_when_the_last_edge_comes(running: History) -> None:
    one, other = running.joins("/one"), running.joins("/other")
    for _ in range(5):
        running.send(one, "base cup").send(other, "cup map").wait(0.1)
    assert next(said.partition(", which")[0] for said in running.said() if "TF820" in said) == (
        "TF820 /other publishes cup → map"
    )
    assert "the loop map → odom → base → cup → map" in next(said for said in running.said() if "TF820" in said)


def test_a_loop_among_frames_of_others_is_not_the_robots_business_where_these_are_allowed() -> None:
    running = History(GuardPolicy(allow=(("cup", "saucer"), ("saucer", "cup")))).clear()
    running.repeat(running.joins("/waiter"), "cup saucer, saucer cup", 10)
    assert running.said() == []


def test_an_edge_that_others_stopped_sending_closes_no_loop_any_more(running: History) -> None:
    one = running.joins("/one")
    running.repeat(one, "base cup", 3).leaves(one)
    running.wait(12).repeat(running.joins("/other"), "cup map", 3)
    assert [said[:5] for said in running.said()] == ["TF803", "TF803"]


def test_a_stranger_that_sends_for_long_closes_a_loop_all_the_same(running: History) -> None:
    one = running.joins("/one")
    running.repeat(one, "base cup", 200)
    running.send(running.joins("/other"), "cup map").send(one, "base cup").wait(0.2)
    assert "TF820" in [said[:5] for said in running.said()]


def test_a_loop_is_said_to_be_over_and_to_have_been_there_before_the_start(running: History) -> None:
    rogue = running.joins("/rogue")
    running.repeat(rogue, "base map", 5).leaves(rogue)
    assert running.wait(4).all(Recovered) == [Recovered("base → map is no longer published by /rogue")]
    early = History()
    early.repeat(early.joins("/rogue"), "base map", 20)
    assert early.all(Found) == []
    assert isinstance(early.events[0], Taken)
    assert early.said() == [
        "TF807 base → map: published by /rogue before the start, which closes the loop map → odom → base → map"
    ]


def test_a_frame_in_itself_is_said_to_be_dropped_and_is_no_second_parent(running: History) -> None:
    running.repeat(running.joins("/slam"), "odom odom", 5)
    assert running.said() == ["TF821 /slam publishes odom → odom, a frame in itself, which tf2 drops"]
    assert running.found()[0].severity == "warning"
    assert not [event for event in running.events if type(event).__name__ == "Live"]


def test_two_nodes_that_publish_one_allowed_frame_are_named(running: History) -> None:
    running = History(GuardPolicy(allow=(("*", "person_*"),))).clear()
    a, b = running.joins("/a"), running.joins("/b")
    for _ in range(10):
        running.send(a, "map person_1").send(b, "odom person_1").wait(0.1)
    assert len(running.said()) in {1, 2}
    assert "person_1 is published by /" in running.said()[0]
    assert {"/a", "/b"} <= set(running.said()[0].replace(",", "").split())
    assert {found.code for found in running.found()} == {"TF822"}


def test_a_node_that_was_started_anew_is_no_second_writer() -> None:
    running = History(GuardPolicy(allow=(("*", "person_*"),))).clear()
    for _ in range(3):
        tracker = running.joins("/tracker")
        running.repeat(tracker, "map person_1", 5).leaves(tracker)
    assert running.said() == []


@pytest.mark.parametrize("static", [False, True])
def test_a_best_effort_writer_is_reported_once(running: History, static: bool) -> None:  # noqa: FBT001
    writer = Writer(b"w" * 16, "/slam", static, volatile=False, best_effort=True)
    for _ in range(5):
        running.events += running.judge.graph([writer], running.now)
    topic = "/tf_static" if static else "/tf"
    assert [(found.code, f"/slam writes {topic} best effort" in found.message) for found in running.found()] == [
        ("TF826", True)
    ]


def test_only_the_plans_own_nodes_leak_to_the_global_topic() -> None:
    plan = Plan("rover", "0", "base", RosSettings("/rover"), EDGES, PROCESSES)
    judge = Judge(plan, SETTLE_S, 0.0, 0)
    writers = [
        Writer(bytes([n]) * 16, node, static=n == 1, volatile=False)
        for n, node in enumerate(["/rover/ekf", "/rover/static", "/other/ekf", None, "/roverette/ekf"])
    ]
    events = [event for _ in range(3) for event in judge.leaks(writers, ("/rover/tf", "/rover/tf_static"))]
    said = [event.found.message for event in events if isinstance(event, Found)]
    assert said == [
        "/rover/ekf writes the global /tf, and its robot keeps its own on /rover/tf",
        "/rover/static writes the global /tf_static, and its robot keeps its own on /rover/tf_static",
    ]


def test_where_a_publisher_runs_is_a_note(running: History) -> None:
    rogue = running.joins("/rogue")
    running.events += running.judge.graph(
        [Writer(rogue.gid, "/rogue", static=False, volatile=False, where="on another machine")], running.now
    )
    running.send(rogue, "map odom")
    running.events += running.judge.tick(running.now + 0.1)
    assert "/rogue runs on another machine" in [note.message for note in running.found()[0].notes]


def test_the_process_that_can_be_stopped_is_named_only_where_it_is_sure() -> None:
    running = History(processes=tuple(replace(one, nodes=(f"/{one.name}",)) for one in PROCESSES)).clear()
    running.repeat(running.joins("/slam"), "odom base", 3)
    running.repeat(running.joins("/rogue"), "base lidar", 3)
    running.repeat(running.joins("/drive"), "base camera", 3)
    found = [event for event in running.events if isinstance(event, Found)]
    assert [(event.found.code, event.process) for event in found] == [("TF801", "slam"), ("TF801", ""), ("TF801", "")]


# Stamps.


def stamped(running: History, publisher: Publisher, edges: str, stamps: list[float]) -> History:
    """Let the publisher send with these stamps, in seconds, ten times a second."""
    for stamp in stamps:
        running.send(publisher, edges, stamp_s=stamp).wait(0.1)
    return running


def wall(running: History) -> float:
    return running.wall_ns() / 1e9


def test_an_owner_that_stamps_with_another_clock_is_reported_and_when_it_is_right_again(running: History) -> None:
    slam = running.joins("/slam")
    stamped(running, slam, "map odom", [5 + n / 10 for n in range(10)])
    (found,) = running.found()
    assert (found.code, found.severity) == ("TF825", "error")
    assert found.message.startswith("/slam stamps map → odom with 5.")
    assert "simulated time" in found.message
    for _ in range(40):
        running.send(slam, "map odom", stamp_s=wall(running)).wait(0.1)
    assert running.all(Recovered) == [Recovered("/slam stamps map → odom as it should again")]
    assert len(running.found()) == 1


@pytest.mark.parametrize(
    ("off", "said"),
    [
        (-60.0, "60 s behind the system's time"),
        (3600.0, "1 h ahead of"),
        (-9.0, ""),
        (9.0, ""),
        (None, "without"),
    ],
)
def test_a_clock_that_is_more_than_ten_seconds_off_is_wrong(running: History, off: float | None, said: str) -> None:
    slam = running.joins("/slam")
    for _ in range(10):
        running.send(slam, "map odom", stamp_s=0 if off is None else wall(running) + off).wait(0.1)
    assert [found.code for found in running.found() if found.code != "TF823"] == (["TF825"] if said else [])
    assert not said or said in running.said()[0]


def test_one_stray_stamp_is_no_wrong_clock(running: History) -> None:
    slam = running.joins("/slam")
    for n in range(50):
        running.send(slam, "map odom", stamp_s=wall(running) - 100 * (n % 10 == 0)).wait(0.1)
    assert "TF825" not in {found.code for found in running.found()}


def test_in_simulated_time_the_systems_time_is_the_wrong_one_and_clock_decides() -> None:
    running = History(clock="sim").clear()
    slam, drive = running.joins("/slam"), running.joins("/drive")
    for n in range(20):
        running.send(slam, "map odom", stamp_s=wall(running))
        running.send(drive, "odom base", stamp_s=100 + n / 10).wait(0.1)
    assert running.said() == []  # nothing on /clock, so nothing is known
    for n in range(20):
        running.judge.clock(round((102 + n / 10) * 1e9))
        running.send(slam, "map odom", stamp_s=wall(running))
        running.send(drive, "odom base", stamp_s=102 + n / 10).wait(0.1)
    (found,) = running.found()
    assert found.message == "/slam stamps map → odom with the system's time, and /clock says 102.2 s"


def test_simulated_time_that_begins_again_takes_the_stamps_with_it() -> None:
    running = History(clock="sim").clear()
    drive = running.joins("/drive")
    for n in range(60):
        running.judge.clock(round((20 + n % 30 / 10) * 1e9))
        running.send(drive, "odom base", stamp_s=20 + n % 30 / 10).wait(0.1)
    assert running.said() == []


def test_the_same_stamp_again_and_again_is_a_warning_and_now_and_then_is_nothing(running: History) -> None:
    slam, drive = running.joins("/slam"), running.joins("/drive")
    begun = wall(running)
    for n in range(40):
        running.send(slam, "map odom", stamp_s=begun + min(n, 5) / 10)
        running.send(drive, "odom base", stamp_s=begun + (n - (n % 4 == 0)) / 10).wait(0.1)
    assert [(found.code, found.severity) for found in running.found()] == [("TF823", "warning")]
    assert "/slam sends map → odom with the same stamp again and again" in running.said()[0]


@pytest.mark.parametrize(("steps", "codes"), [([-3.0], ["TF824"]), ([-0.2], []), ([-0.3] * 4, ["TF824"])])
def test_stamps_that_go_back_are_a_warning_if_far_or_often(
    running: History, steps: list[float], codes: list[str]
) -> None:
    slam = running.joins("/slam")
    stamps = [wall(running) + n / 10 for n in range(10)]
    for step in steps:
        stamps += [stamps[-1] + step, stamps[-1]]
    stamped(running, slam, "map odom, base camera", stamps)
    assert [found.code for found in running.found() if found.code != "TF801"] == codes


def test_the_stamps_of_fixed_edges_and_of_strangers_are_not_judged(running: History) -> None:
    static, rogue = running.joins("/static", static=True), running.joins("/rogue")
    for _ in range(10):
        running.send(static, FIXED, stamp_s=0).send(rogue, "map odom", stamp_s=0).wait(0.1)
    assert [found.code for found in running.found()] == ["TF801"]


# Speed: what was judged once holds.


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.sampled_from("sdrjx"), st.sampled_from((0.0, 0.05, 0.1, 0.7))), max_size=60))
def test_remembered_verdicts_are_those_that_would_be_given_anew(sends: list[tuple[str, float]]) -> None:
    """The same history, judged with and without memory of what was judged before."""
    said = []
    for forgets in (False, True):
        running = History(GuardPolicy(allow=(("map", "person"),))).clear()
        senders = {
            "s": (running.joins("/slam"), "map odom"),
            "d": (running.joins("/drive"), "odom base, map person"),
            "r": (running.joins("/rogue"), "map odom, base cup"),
            "j": (running.joins("/slam"), "map odom"),
            "x": (running.joins("/x"), "map person, cup map"),
        }
        for who, pause in sends:
            if forgets:
                running.judge._streams.forget()
            running.send(*senders[who]).wait(pause)
        running.wait(1)
        said.append(running.events)
    assert said[0] == said[1]


def test_edges_that_waited_for_a_name_share_a_history_all_the_same(running: History) -> None:
    rates = tuple(
        PlanEdge("base", f"part_{n}", "dynamic", "drive", "/drive", Pose(), 10.0, ("r.yaml", 1)) for n in range(99)
    )
    running = History(edges=rates).clear()
    drive, names = running.joins(None), ", ".join(f"base part_{n}" for n in range(99))
    running.repeat(drive, names, 3)
    drive.node = "/drive"
    running.repeat(drive, names, 10)
    assert len(running.judge.live.tracks) == 1
    assert [len(one.children) for one in running.all(Live) if isinstance(one, Live)] == [99]


# What is known, edge by edge.


def test_each_edge_has_its_publisher_rate_age_and_delay_and_is_not_seen_before_it_came() -> None:
    rated = tuple(replace(one, rate=10.0) if one.owner == "slam" else one for one in EDGES)
    running = History(edges=rated).clear()
    slam, static = running.joins("/slam"), running.joins("/static", static=True)
    running.send(static, FIXED)
    for _ in range(30):
        running.send(slam, "map odom", stamp_s=wall(running) - 0.25).wait(0.1)
    running.wait(0.2)
    health = {one.edge.child: one for one in running.judge.health(running.now)}
    odom = health["odom"]
    assert odom.publisher == "/slam"
    assert odom.rate is not None
    assert odom.age_s is not None
    assert odom.delay_s is not None
    assert [round(value, 2) for value in (odom.rate, odom.age_s, odom.delay_s)] == [10.0, 0.3, 0.25]
    assert (health["lidar"].text, health["base"].text) == ("latched, from /static", "not seen yet")
    levels = {line.name: line.level for line in statuses("rover", list(health.values()), running.judge.wrong())}
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


# What a node publishes by default.


@pytest.mark.parametrize(("switch", "advice"), [
    ("enable_odom_tf: false", "/diff publishes it by default: set enable_odom_tf: false"),
    ("", "/diff publishes it by default and has no switch: let its process own the edge"),
])  # fmt: skip
def test_the_guard_names_the_switch_of_a_node_that_publishes_by_default(switch: str, advice: str) -> None:
    history = History(claims=(Claim("/diff", "odom", "base", switch),)).clear()
    history.repeat(history.joins("/drive"), "odom base", 5)
    history.repeat(history.joins("/diff"), "odom base", 10)
    (found,) = history.found()
    assert (found.code, found.help) == ("TF801", advice)


def test_the_guard_names_no_switch_for_another_node_or_edge() -> None:
    history = History(claims=(Claim("/diff", "odom", "base", "x: false"),)).clear()
    history.repeat(history.joins("/other"), "odom base", 10)
    history.repeat(history.joins("/diff"), "map odom", 10)
    assert [("set" in found.help) for found in history.found()] == [False, False]


# A guard that follows one that died.


def test_a_judge_that_follows_another_tells_nothing_twice_and_goes_on(running: History) -> None:
    static, slam, rogue = running.joins("/static", static=True), running.joins("/slam"), running.joins("/rogue")
    volatile = running.joins("/volatile", static=True, volatile=True)
    running.send(static, FIXED).repeat(slam, "map odom", 5).repeat(rogue, "map odom, map cup", 5)
    assert [line[:5] for line in running.said()] == ["TF806", "TF801", "TF803"]
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
    assert [type(event) for event in running.events[1:]] == [Recovered, Recovered]
    running.repeat(running.joins("/other"), "map odom", 5)
    assert running.said() == ["TF801 map → odom is published by /other; the owner is slam (/slam)"]


def test_a_judge_that_follows_another_does_not_miss_whom_it_has_not_found_yet(running: History) -> None:
    running = History(edges=(edge("map odom", "slam", rate=10.0), edge("base lidar", "static", "static"))).clear()
    static, slam, rogue = running.joins("/static", static=True), running.joins("/slam"), running.joins("/rogue")
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
    assert sorted(line[:10] for line in running.said()) == ["TF804 slam", "TF804 stat"]


def test_an_owner_that_was_silent_is_not_said_to_be_again_and_is_back_when_it_is() -> None:
    running = History(edges=(edge("map odom", "slam", rate=10.0),)).clear()
    slam = running.joins("/slam")
    running.repeat(slam, "map odom", 30).wait(2)
    assert [line[:5] for line in running.said()] == ["TF804"]
    running.dies().wait(8)
    assert running.events == [Clear()]
    running.repeat(slam, "map odom", 5)
    assert [event for event in running.events if not isinstance(event, Clear)] == running.all(Recovered) != []


def test_a_namesake_is_still_told_from_the_owner_after_the_guard_died(running: History) -> None:
    slam, other = running.joins("/slam"), running.joins("/slam")
    running.repeat(slam, "map odom", 5).dies()
    running.send(other, "map odom").repeat(slam, "map odom", 5)
    assert running.said()[0].startswith("TF801 map → odom is published by another /slam")


def test_a_message_may_pass_when_all_of_it_is_its_senders_and_only_once_that_has_a_name(running: History) -> None:
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
        running.look().send(slam, edges)
        assert running.judge.admitted == admitted, edges
        running.send(slam, edges)
        assert running.judge.admitted == admitted, edges


def test_only_an_offender_that_is_surely_of_the_run_can_be_stopped_for_it() -> None:
    processes = (PlanProcess("slam", "run", nodes=("/slam",)), PlanProcess("drive", "external", nodes=("/drive",)))
    for namesakes, process in ((0, "slam"), (1, "")):
        running = History(processes=processes).clear()
        slam = running.joins("/slam")
        for _ in range(namesakes):
            running.joins("/slam")
        running.repeat(slam, "odom base", 5)
        assert [event.process for event in running.events if isinstance(event, Found)] == [process]


@pytest.mark.parametrize(("ours", "process"), [(True, "slam"), (False, ""), (None, "slam")])
def test_an_offender_whose_process_is_seen_is_of_the_run_or_is_not(*, ours: bool | None, process: str) -> None:
    running = History(processes=(PlanProcess("slam", "run", nodes=("/slam",)),)).clear()
    slam = running.joins("/slam")
    running.send(slam, "odom base")
    running.judge.graph([Writer(slam.gid, "/slam", static=False, volatile=False, ours=ours)], running.now)
    (found,) = running.judge.tick(running.now + 0.2)
    assert isinstance(found, Found)
    assert found.process == process
