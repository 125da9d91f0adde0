"""Sliders that publish joint states: for whom, when, and when not."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tests.support.cli import tfcompose_in
from tests.tools.view.test_live import TEXT, robot_of
from tests.tools.view.test_view import ROVER
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.tools.view.joints import FOUND_S, JointSender, joint_topics

TWO = """
tfcompose: 1
robot: r
links: {base_link: {}, wheel: {}, other: {}}
joints:
  w: {type: continuous, parent: base_link, child: wheel, axis: [0, 1, 0]}
  o: {type: continuous, parent: base_link, child: other, axis: [0, 1, 0],
      mimic: {joint: w, multiplier: -2, offset: 0.5}}
"""
ROBOT = robot_of(TWO)


@dataclass
class Topic:
    """A topic that a sender uses, and who else does."""

    other_nodes: list[str] = field(default_factory=list)
    sent: list[tuple[int, list[float]]] = field(default_factory=list)
    publishers: int = 0

    @property
    def sender(self) -> JointSender:
        return JointSender(
            "/joint_states", {"w": "w", "o": "o"}, self.make, lambda: self.other_nodes
        )

    def make(self) -> "Topic":
        self.publishers += 1
        return self

    def publish(self, stamp_ns: int, positions: Sequence[float]) -> None:
        self.sent.append((stamp_ns, list(positions)))

    def close(self) -> None:
        self.publishers -= 1


def test_it_sends_after_a_while_and_mimics_follow() -> None:
    topic = Topic()
    sender = topic.sender
    for now in (0.0, FOUND_S / 2):
        sender.step(now, 1, ROBOT, {"w": 1.0})
    assert (sender.state, topic.publishers) == ("waiting", 0)
    sender.step(FOUND_S, 7, ROBOT, {"w": 1.0})
    assert sender.state == "sending"
    assert topic.sent == [(7, [1.0, -1.5])]


def test_it_refuses_where_somebody_publishes_and_names_who() -> None:
    topic = Topic(["/jsp"])
    sender = topic.sender
    for tick in range(100):
        sender.step(tick / 10, 1, ROBOT, {})
    assert (sender.state, sender.publishers_found, topic.sent) == ("refused", ("/jsp",), [])
    assert "/jsp" in sender.text


def test_it_stops_when_somebody_comes_and_stays_so_when_they_leave() -> None:
    topic = Topic()
    sender = topic.sender
    for tick in range(30):
        sender.step(tick / 10, 1, ROBOT, {})
    assert topic.sent
    topic.other_nodes, before = ["nobody knows"], len(topic.sent)
    sender.step(3.0, 1, ROBOT, {})
    topic.other_nodes = ["/arm_driver"]
    for tick in range(30, 60):
        sender.step(tick / 10, 1, ROBOT, {})
    assert len(topic.sent) - before <= 3
    assert (sender.state, topic.publishers) == ("stopped", 0)
    assert "/arm_driver" in sender.text
    topic.other_nodes, before = [], len(topic.sent)
    for tick in range(60, 90):
        sender.step(tick / 10, 1, ROBOT, {})
    assert len(topic.sent) == before


def test_nothing_is_sent_without_a_time() -> None:
    topic = Topic()
    sender = topic.sender
    for tick in range(50):
        sender.step(tick / 10, None, ROBOT, {})
    assert not topic.sent


def test_positions_go_to_the_plans_processes_by_their_own_names() -> None:
    text = ROVER.with_name("two_rovers.yaml").read_text("utf-8")
    file = str(ROVER.with_name("two_rovers.yaml"))
    robot = compile_robot(
        text, file, library(), read=lambda path: Path(path).read_text("utf-8")
    ).robot
    assert robot
    topics = joint_topics(robot, plan_of(robot.with_final_names()))
    assert set(topics) == {"/rover1/joint_states", "/rover2/joint_states"}
    names = topics["/rover1/joint_states"]
    assert set(names) == set(topics["/rover2/joint_states"])
    joints = {edge.joint.name for edge in robot.edges if edge.joint}
    assert {*names.values(), *topics["/rover2/joint_states"].values()} == joints


def test_they_need_a_running_robot(tmp_path: Path) -> None:
    (tmp_path / "r.yaml").write_text(TEXT, "utf-8")
    done = tfcompose_in(tmp_path, "view", "r.yaml", "--joints")
    assert done.returncode == 2
    assert done.stderr.startswith("tfcompose: --joints")
