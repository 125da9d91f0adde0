"""A mount that moves while the robot runs: listeners, processes, guard and other commands."""

from __future__ import annotations

import json
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import pytest
from rclpy.serialization import deserialize_message
from std_msgs.msg import String

from tests.support.cli import tfcompose_in
from tests.support.running_robot import RunningRobot
from tests.support.waiting import in_one_of_a_few, until
from tfcompose.cli.adjusting import adjust, moved, running_plan
from tfcompose.cli.runs import chosen_run
from tfcompose.foundation.geometry import Pose
from tfcompose.tf.ros.node import LATCHED, Subscription, TFSubscription, open_node
from tfcompose.tf.ros.tf_codec import decode

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.support.domains import Domain
    from tfcompose.model.plan import Plan, PlanEdge

pytestmark = pytest.mark.ros
ROBOT = """\
tfcompose: 1
robot: rover
ros: {discovery: localhost}
guard: {mode: MODE}
overlays: {by: hostname, folder: overlays}
links: {base_link: {}, mast: {}}
joints:
  mast_joint: {type: continuous, axis: [0, 0, 1], parent: base_link, child: mast}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
  imu: {parent: base_link, xyz: [0, -0.2, 0.05]}
sensors:
  laser: {preset: generic/lidar2d, parent: base_link, xyz: [0.1, 0, 0.3]}
processes:
  drive: {simulate: {fixed: {xyz: [0, 0, 0]}, rate: 20 Hz}}
  wheels: {simulate: {joints: zero, rate: 20 Hz}}
"""
LASER = ("base_link", "laser_link")


@dataclass
class Listener:
    """Messages on /tf_static and /robot_description, from the latched ones on."""

    node: Any
    messages: list[dict[tuple[str, str], tuple[int, Pose]]] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._static = TFSubscription(self.node, static=True)
        self._description = Subscription(self.node, String, "/robot_description", LATCHED)

    def take(self) -> None:
        for received in self._static.take():
            edges = {
                (each.parent, each.child): (each.stamp_ns, Pose(each.xyz, each.quat_xyzw))
                for each in decode(received.data)
            }
            self.messages.append(edges)
        for received in self._description.take():
            self.texts.append(deserialize_message(received.data, String).data)

    def has(self, messages: int, texts: int) -> bool:
        self.take()
        return len(self.messages) == messages and len(self.texts) == texts

    def has_text(self, text: str) -> bool:
        """Return whether that is the last description."""
        self.take()
        return self.texts[-1] == text

    def pose(self, parent: str, child: str) -> Pose | None:
        """Return the last pose of an edge."""
        self.take()
        return self.messages[-1][parent, child][1] if self.messages else None

    def has_laser_at(self, x: float) -> bool:
        """Return whether that is its position along x, in metres."""
        pose = self.pose(*LASER)
        return pose is not None and pose.xyz == (x, 0.0, 0.3)


@pytest.fixture
def mode(request: pytest.FixtureRequest) -> str:
    """The guard's mode."""
    return str(getattr(request, "param", "watch"))


@pytest.fixture
def robot(domain: Domain, tmp_path: Path, mode: str) -> Iterator[RunningRobot]:
    """A running robot with all its edges."""
    assert domain
    (tmp_path / "overlays").mkdir()
    (tmp_path / "robot.yaml").write_text(ROBOT.replace("MODE", mode))
    running = RunningRobot(tmp_path, "robot.yaml")
    try:
        running.says("all ready")
        yield running
    finally:
        running.end()


def found_live(robot: RunningRobot) -> list[str]:
    """Return the codes of what the guard found."""
    return [code for code in robot.codes() if code.startswith("TF8")]


def nudge(robot: RunningRobot, *words: str, code: int = 0) -> str:
    done = tfcompose_in(robot.folder, "nudge", *words)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


def status(robot: RunningRobot) -> dict[str, Any]:
    (only,) = json.loads(tfcompose_in(robot.folder, "ps", "--format", "json").stdout)
    return dict(only)


def process_ids(robot: RunningRobot) -> dict[str, int]:
    return {process["name"]: process["pid"] for process in status(robot)["processes"]}


def test_one_edge_moves_for_listeners_and_every_process_runs_on(
    robot: RunningRobot, node: Any
) -> None:
    before, listener = process_ids(robot), Listener(node)
    assert until(lambda: listener.has(1, 1))
    nudge(robot, "laser", "--x", "+2mm", "--yaw", "-90deg")
    assert until(lambda: listener.has(2, 2))
    first, second = listener.messages
    assert second.keys() == first.keys(), "who joins later gets only the last message"
    assert {edge for edge in first if first[edge][1] != second[edge][1]} == {LASER}
    assert all(second[edge][0] > first[edge][0] for edge in first)
    assert second[LASER][1].xyz == (0.102, 0.0, 0.3)
    assert second[LASER][1].quat_xyzw == pytest.approx((0, 0, -(0.5**0.5), 0.5**0.5))
    changed = zip(listener.texts[0].split("\n"), listener.texts[1].split("\n"), strict=True)
    (lines,) = [(old, new) for old, new in changed if old != new]
    assert ("0.1 0 0.3" in lines[0], "0.102 0 0.3" in lines[1]) == (True, True)
    assert process_ids(robot) == before
    nudge(robot, "imu", "--z", "=6cm")
    assert until(lambda: listener.has(3, 3))
    assert listener.pose("base_link", "imu") == Pose((0, -0.2, 0.06))
    assert "wrote overlays/ant.yaml" in nudge(robot, "--save", "--as", "ant")
    assert "overlays/ant.yaml is up to date" in nudge(robot, "imu", "--save", "--as", "ant")
    nudge(robot, "laser", "--undo")
    assert until(lambda: listener.pose(*LASER) == first[LASER][1])
    nudge(robot, "--reset")
    assert until(lambda: listener.pose("base_link", "imu") == first["base_link", "imu"][1])
    assert until(lambda: listener.has_text(listener.texts[0])), "as built"
    assert process_ids(robot) == before
    assert found_live(robot) == []


def test_other_commands_name_it_and_a_restarted_publisher_sends_it_again(
    robot: RunningRobot, node: Any
) -> None:
    nudge(robot, "laser", "--x", "+2mm")
    assert tfcompose_in(robot.folder, "restart", "static").returncode == 0
    robot.says("live", "static", times=2)
    listener = Listener(node)
    assert until(lambda: listener.has(1, 1))
    assert listener.has_laser_at(0.102)
    assert "0.102 0 0.3" in listener.texts[-1]
    robot.child("guard").send_signal(signal.SIGKILL)
    robot.says("watches again")
    nudge(robot, "laser", "--x", "+1mm")
    assert until(lambda: listener.has_laser_at(0.103))
    (adjusted,) = status(robot)["adjusted"]
    assert adjusted == {
        "edge": "base_link → laser_link",
        "xyz_m": pytest.approx(0.003),
        "rot_rad": pytest.approx(0),
    }
    assert "adjusted by 3 mm" in tfcompose_in(robot.folder, "ps").stdout
    assert "adjusted by 3 mm" in tfcompose_in(robot.folder, "explain", *LASER).stdout
    running = tfcompose_in(robot.folder, "verify", "--running", "--for", "1")
    assert (running.returncode, "adjusted by 3 mm" in running.stderr) == (0, True), running
    declared = tfcompose_in(robot.folder, "verify", "robot.yaml", "--for", "1")
    assert "TF814" not in running.stdout
    assert (declared.returncode, "adjusted by 3 mm" in declared.stderr) == (1, True), declared
    assert "base_link → laser_link" in tfcompose_in(robot.folder, "up", "-d").stdout
    assert until(lambda: listener.has_laser_at(0.1)), "as the file has it"
    assert status(robot)["adjusted"] == []


@pytest.mark.parametrize("mode", ["strict"], indirect=True)
def test_a_strict_guard_lets_the_pose_pass_and_late_listeners_have_it(
    robot: RunningRobot, node: Any
) -> None:
    nudge(robot, "laser", "--x", "+2mm")
    listener = Listener(node)
    assert until(lambda: listener.has_laser_at(0.102))
    nudge(robot, "laser", "--undo")
    assert until(lambda: listener.has_laser_at(0.1))
    assert found_live(robot) == []


def test_refused_nudges_change_nothing(robot: RunningRobot, node: Any) -> None:
    listener = Listener(node)
    assert until(lambda: listener.has(1, 1))
    for name, code, owner in (
        ("lazer", "TF664", "laser"),
        ("base_link", "TF665", "drive"),
        ("mast", "TF665", "mast_joint"),
    ):
        text = nudge(robot, name, "--x", "+2mm", code=1)
        assert (f"[{code}]" in text, owner in text) == (True, True), text
    assert "[TF666]" in nudge(robot, "laser", "--undo", code=1)
    nudge(robot, "laser", "--x", "2mm", code=2)
    nudge(robot, "--x", "+2mm", code=2)
    nudge(robot, "laser", "--x", "+2mm", "--undo", code=2)
    nudge(robot, "laser", "--undo", "--save", code=2)
    nudge(robot, "laser", "--as", "ant", code=2)
    assert "no robot" in nudge(robot, "laser", "--x", "+2mm", "--robot", "cart", code=1)
    assert "as built" in nudge(robot, "laser")
    assert status(robot)["adjusted"] == []
    assert listener.has(1, 1)


@pytest.mark.usefixtures("robot")
def test_no_step_is_lost_where_several_people_adjust() -> None:
    runtime_dir = chosen_run(None, "nudge")

    def step(plan: Plan) -> dict[str, PlanEdge]:
        edge = next(edge for edge in plan.edges if edge.child == "laser_link")
        x, y, z = edge.pose.xyz
        return {edge.child: moved(edge, Pose((x + 0.001, y, z), edge.pose.quat_xyzw))}

    def adjust_often() -> None:
        for _ in range(10):
            adjust(runtime_dir, step)

    with ThreadPoolExecutor() as people:
        for person in [people.submit(adjust_often) for _ in range(3)]:
            person.result()
    (edge,) = running_plan(runtime_dir).plan.adjusted
    assert edge.pose.xyz[0] == pytest.approx(0.1 + 0.001 * 30)
    assert len(edge.earlier) == 30


#: The time within which a listener has an adjusted pose, in seconds.
WITHIN_S = 0.15


@pytest.mark.slow
@pytest.mark.alone
@pytest.mark.usefixtures("robot")
def test_a_listener_has_the_pose_150_ms_after_the_request() -> None:
    runtime_dir = chosen_run(None, "nudge")
    with open_node("listener", "") as node:
        listener = Listener(node)
        assert until(lambda: listener.has(1, 1))

        def is_quick(number: int) -> bool:
            def step(plan: Plan) -> dict[str, PlanEdge]:
                edge = next(edge for edge in plan.edges if edge.child == "laser_link")
                return {edge.child: moved(edge, Pose((number + 1.0, 0, 0.3)))}

            begun = time.monotonic()
            adjust(runtime_dir, step)
            assert until(lambda: listener.has_laser_at(number + 1.0))
            return time.monotonic() - begun < WITHIN_S

        assert in_one_of_a_few(is_quick)
