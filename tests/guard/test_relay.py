"""What a strict guard relays and latches, from histories, without ROS."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, cast

import pytest

from tfcompose.guard import relay
from tfcompose.guard.relay import Feedback, Relay
from tfcompose.tf.live.publishers import Message, Publisher
from tfcompose.tf.live.topics import TFData
from tfcompose.tf.ros.node import Received
from tfcompose.tf.ros.tf_codec import SentTransform, decode, encode

if TYPE_CHECKING:
    from rclpy.node import Node

    from tfcompose.tf.live.topics import TFGraph

SLAM, DRIVE, CAMERA = b"s" * 16, b"d" * 16, b"c" * 16
TOPICS = ("/tf", "/tf_static")


class Sender:
    """One of the relay's publishers: it keeps what it is given."""

    def __init__(self, node: Bus, *, static: bool, topic: str, qos: int | None = None) -> None:
        node.senders.append(self)
        self.depth = qos
        self.static, self.topic = static, topic
        self.publisher = self
        self.raw_gid = len(node.senders).to_bytes(16, "big")
        self.sent: list[bytes] = []

    def publish(self, data: bytes) -> None:
        self.sent.append(data)


@dataclass
class Bus:
    """The node and the graph of a relay: who sends, and how many listen on each topic."""

    topics: tuple[str, str] = TOPICS
    gid_identifies_node: bool = True
    fenced: dict[bytes, bool | None] = field(default_factory=dict)
    senders: list[Sender] = field(default_factory=list)
    listeners: dict[str, int] = field(default_factory=dict)

    def destroy_publisher(self, sender: Sender) -> None:
        self.senders.remove(sender)

    def count_subscribers(self, topic: str) -> int:
        return self.listeners.get(topic, 1)

    def may_pass(self, gid: bytes) -> bool | None:
        return self.fenced.get(gid, True)

    def where(self, gid: bytes) -> str:
        return f"on this machine as pid 7: {gid.decode()}"

    def latched(self, topic: str = TOPICS[1]) -> list[set[tuple[str, str]]]:
        """Return the edges of the newest message of each latched publisher on the topic."""
        return [
            edges_of(sender.sent[-1])
            for sender in self.senders
            if sender.static and sender.topic == topic and sender.sent
        ]

    def moving(self, topic: str = TOPICS[0]) -> list[set[tuple[str, str]]]:
        return [
            edges_of(data)
            for sender in self.senders
            if not sender.static and sender.topic == topic
            for data in sender.sent
        ]


@pytest.fixture(autouse=True)
def _senders_that_remember(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(relay, "TFPublisher", Sender)


def edges_of(data: bytes) -> set[tuple[str, str]]:
    return {(transform.parent, transform.child) for transform in decode(data)}


def pairs(edges: str) -> tuple[tuple[str, str], ...]:
    return tuple((names.split()[0], names.split()[1]) for names in edges.split(", "))


def message_of(gid: bytes, edges: str, *, static: bool) -> Message:
    return Message(pairs(edges), static, gid, 0, 1)


def data_of(
    gid: bytes, edges: str, *, static: bool, fenced: bool = True, process: str = ""
) -> TFData:
    transforms = [
        SentTransform(0, parent, child, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
        for parent, child in pairs(edges)
    ]
    return TFData(Received(encode(transforms), gid, 0, 0, 1, gid), static, fenced, process)


def publisher(gid: bytes, node: str, *, static: bool = True, fenced: bool = True) -> Publisher:
    return Publisher(gid, node, static, fenced=fenced)


@dataclass
class Passing:
    """A relay, and who is in its graph."""

    remapped: dict[str, tuple[str, str]] | None = None
    bus: Bus = field(default_factory=Bus)
    own_gids: set[bytes | None] = field(default_factory=set)
    here: list[Publisher] = field(default_factory=list)
    now: float = 100.0

    def __post_init__(self) -> None:
        node, graph = cast("Node", self.bus), cast("TFGraph", self.bus)
        feedback = None if self.remapped is None else Feedback(node, self.remapped, self.own_gids)
        self.relay = Relay(node, graph, self.own_gids, feedback)

    def send(
        self, gid: bytes, edges: str, admitted: str | None = None, *, who: str = "/x", **more: Any
    ) -> Passing:
        """Let a message come, of which these edges are admitted; None: all."""
        static = more.pop("static", True)
        may = None if admitted is None else frozenset(pairs(admitted) if admitted else ())
        data = data_of(gid, edges, static=static, **more)
        self.relay.pass_on(data, message_of(gid, edges, static=static), may, who)
        return self

    def observe(self, *here: Publisher) -> Passing:
        self.relay.update(here, self.now)
        return self


def test_fixed_edges_of_one_who_has_left_are_latched_no_more() -> None:
    running = Passing().send(SLAM, "map odom").send(CAMERA, "base camera")
    running.observe(publisher(SLAM, "/slam"), publisher(CAMERA, "/camera"))
    assert running.bus.latched() == [{("map", "odom")}, {("base", "camera")}]
    before = running.relay.changes
    running.observe(publisher(CAMERA, "/camera"))
    assert running.bus.latched() == [{("base", "camera")}]
    assert running.relay.changes > before
    assert list(running.relay.memory()) == [f"latched:{CAMERA.hex()}"]
    running.send(SLAM, "map odom").observe(publisher(SLAM, "/slam"), publisher(CAMERA, "/camera"))
    assert running.bus.latched() == [{("base", "camera")}, {("map", "odom")}]


def test_fixed_edges_of_a_sender_come_together_without_refused_ones() -> None:
    running = (
        Passing()
        .send(CAMERA, "base camera", who="/camera")
        .send(CAMERA, "base lidar, map odom", "base lidar")
    )
    assert running.bus.latched() == [{("base", "camera"), ("base", "lidar")}]
    assert running.relay.held.counts == {("/x", "map", "odom"): 1}
    running.send(SLAM, "map odom", "")
    assert len(running.bus.latched()) == 1
    assert running.relay.held.report() == "2 × map → odom from /x"
    assert not running.relay.held.report()


def test_a_following_guard_latches_again_and_forgets_nobody_too_early() -> None:
    memory = (
        Passing().send(CAMERA, "base camera, base lidar").send(SLAM, "map odom").relay.memory()
    )
    following = Passing()
    following.relay.recall(
        memory, lambda message: {("base", "camera")} & {*message.edges}, until=105.0
    )
    assert following.bus.latched() == [{("base", "camera")}]
    following.observe()
    assert following.bus.latched() == [{("base", "camera")}]
    following.now = 105.0
    following.observe()
    assert following.bus.latched() == []


def test_moving_edges_pass_byte_for_byte_or_without_what_is_not_admitted() -> None:
    running = Passing()
    sent = data_of(DRIVE, "odom base, base arm", static=False)
    running.relay.pass_on(
        sent, message_of(DRIVE, "odom base, base arm", static=False), None, "/drive"
    )
    assert running.bus.senders[0].sent == [sent.received.data]
    running.send(DRIVE, "odom base, base arm", "odom base", static=False).send(
        DRIVE, "base arm", "", static=False
    )
    assert running.bus.moving() == [{("odom", "base"), ("base", "arm")}, {("odom", "base")}]


def test_incomplete_frame_names_are_sent_as_judged() -> None:
    running = Passing()
    message = replace(message_of(DRIVE, "odom base", static=False), exact=False)
    sent = data_of(DRIVE, "odom base_more", static=False)
    sent = replace(
        sent,
        received=replace(
            sent.received, data=sent.received.data.replace(b"base_more", b"base\0more")
        ),
    )
    running.relay.pass_on(sent, message, None, "/drive")
    assert running.bus.moving() == [{("odom", "base")}]
    assert running.bus.senders[0].sent != [sent.received.data]


def test_edges_past_the_fence_or_from_unknown_senders_are_not_passed_on() -> None:
    running = Passing()
    running.send(DRIVE, "odom base", fenced=False, static=False)
    running.bus.fenced[SLAM] = False
    running.send(SLAM, "map odom", static=False, who="/slam").send(SLAM, "map odom")
    running.send(DRIVE, "odom base", who="", static=False)
    assert running.bus.moving() == [] == running.relay.waiting
    running.send(CAMERA, "base camera", who="")
    running.bus.fenced[CAMERA] = None
    running.send(CAMERA, "base lidar", who="/camera")
    assert [message.edges for _, message in running.relay.waiting] == [
        pairs("base camera"),
        pairs("base lidar"),
    ]


def test_a_refused_publisher_is_named_once_by_its_process(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Its node may have an owner's name, which would accuse the owner."""
    running = Passing()
    running.bus.fenced |= {SLAM: False, DRIVE: True}
    running.send(DRIVE, "map odom", "", who="/slam", fenced=False)
    assert not capsys.readouterr().out
    for _ in range(3):
        running.send(SLAM, "map odom", static=False, who="/slam")
    log = capsys.readouterr().out
    assert log.count("as pid 7: ") == len(log.splitlines()) == 1
    assert "/slam" not in log


def test_a_remapped_process_receives_the_tree_without_its_own_edges() -> None:
    private = {"slam": ("/slam/tf", "/slam/tf_static"), "drive": ("/drive/tf", "/drive/tf_static")}
    running = Passing(private)
    running.bus.listeners |= dict.fromkeys((*private["slam"], *private["drive"]), 2)
    running.observe().send(SLAM, "map odom", process="slam").send(
        CAMERA, "base camera", fenced=False
    )
    running.observe(publisher(SLAM, "/slam"), publisher(CAMERA, "/camera", fenced=False))
    assert running.bus.latched("/slam/tf_static") == [{("base", "camera")}]
    assert running.bus.latched("/drive/tf_static") == [{("map", "odom"), ("base", "camera")}]
    running.send(DRIVE, "odom base", process="drive", static=False)
    assert running.bus.moving("/slam/tf") == [{("odom", "base")}]
    assert running.bus.moving("/drive/tf") == []
    running.observe(publisher(SLAM, "/slam"))  # a stranger's edges, too, are those of who is there
    assert running.bus.latched("/drive/tf_static") == [{("map", "odom")}]
    running.observe()
    assert running.bus.latched("/drive/tf_static") == [set()]


def test_a_burst_beyond_tf2s_queue_is_kept_for_slow_listeners() -> None:
    passing = Passing({"slam": ("/slam/tf", "/slam/tf_static")})
    passing.bus.listeners = {"/slam/tf": 2, "/slam/tf_static": 2}
    passing.observe()
    depths = {(sender.topic, sender.depth) for sender in passing.bus.senders}
    assert depths == {("/tf", relay.KEPT), ("/slam/tf", relay.KEPT), ("/slam/tf_static", None)}
    assert relay.KEPT >= 2 * 200
