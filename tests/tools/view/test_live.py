"""What is shown of a tree that runs, as data.

Where frames are, ghosts, what is red, and what is said of an edge.
"""

import math
import random
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.foundation.geometry import Offset, Pose, offset_of, quat_from_rpy
from tfcompose.model.plan.topics import GLOBAL
from tfcompose.model.robot import Robot
from tfcompose.tf.live.edges import TreeObserver
from tfcompose.tf.live.publishers import Publisher
from tfcompose.tools.view.forest import FrameForest, pose_of, row_of
from tfcompose.tools.view.live import FOUND_S, OVER_S, LiveTree

TEXT = """
tfcompose: 1
robot: rover
links: {base_link: {}, wheel: {}}
joints: {wheel_joint: {type: continuous, parent: base_link, child: wheel, xyz: [0, 0.2, 0], axis: [0, 1, 0]}}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
  mast: {parent: base_link, xyz: [0, 0, 0.5]}
  lidar: {parent: mast, xyz: [0.1, 0, 0.3]}
processes: {drive: {external: true, node: drive}}
"""  # noqa: E501 (a text as its reader has it)
START_NS = 1_700_000_000_000_000_000
TOLERANCE = Offset(1e-3, math.radians(0.1))
STATIC, JOINTS, DRIVE, ROGUE = (bytes([number] * 16) for number in (1, 2, 3, 4))
NODES = {
    STATIC: "/tfcompose_static",
    JOINTS: "/tfcompose_joints",
    DRIVE: "/drive",
    ROGUE: "/rogue",
}


def robot_of(text: str = TEXT) -> Robot:
    robot = compile_robot(text, "r.yaml", library()).robot
    assert robot
    return robot


class Live:
    """A tree whose messages the test sends, at seconds that it says."""

    def __init__(self, robot: Robot | None = None) -> None:
        self.robot = robot or robot_of()
        self.plan = plan_of(self.robot.with_final_names())
        self.observer = TreeObserver(5.0)
        self.tree = LiveTree(self.robot, self.plan, {GLOBAL: self.observer}, TOLERANCE)
        self.publishers: set[bytes] = set()

    def send(
        self, gid: bytes, at_s: float, *edges: tuple[str, str, Pose], static: bool = False
    ) -> None:
        now_ns = START_NS + round(at_s * 1e9)
        stamp = divmod(now_ns, 1_000_000_000)
        rows = [
            (parent, child, *stamp, *pose.xyz, *pose.quat_xyzw) for parent, child, pose in edges
        ]
        self.observer.take(rows, static=static, gid=gid, received_ns=now_ns)
        self.observe(at_s, self.publishers | {gid})

    def observe(self, at_s: float, present: Iterable[bytes]) -> None:
        self.publishers = set(present)
        self.observer.observed_ns = START_NS + round(at_s * 1e9)
        self.observer.take_graph(
            [Publisher(gid, NODES[gid], static=gid == STATIC) for gid in self.publishers]
        )

    def run(self, until_s: float = 4.0, **wrong: Pose) -> None:
        """Send all of the robot's edges from 0 s to ``until_s``, except those named elsewhere."""
        fixed = {"mast": ("base_link", Pose((0, 0, 0.5))), "lidar": ("mast", Pose((0.1, 0, 0.3)))}
        rows = [(parent, child, wrong.get(child, pose)) for child, (parent, pose) in fixed.items()]
        self.send(STATIC, 0.0, *rows, static=True)
        for tick in range(round(until_s * 20)):
            self.send(DRIVE, tick / 20, ("odom", "base_link", Pose((1, 0, 0))))
            self.send(
                JOINTS, tick / 20, ("base_link", "wheel", wrong.get("wheel", Pose((0, 0.2, 0))))
            )


def test_frames_are_at_published_poses_and_the_rest_as_in_the_robot() -> None:
    live = Live()
    live.send(DRIVE, 0.0, ("odom", "base_link", Pose((3, 0, 0), quat_from_rpy(0, 0, math.pi / 2))))
    picture = live.tree.next_picture()
    assert picture
    assert picture.poses["base_link"].xyz == (3, 0, 0)
    assert picture.poses["lidar"].xyz == pytest.approx((3, 0.1, 0.8))
    assert picture.poses.keys() == live.robot.frames.keys()


def test_nothing_is_returned_while_nothing_moves() -> None:
    live = Live()
    live.run(0.1)
    assert live.tree.next_picture()
    assert live.tree.next_picture() is None
    live.send(DRIVE, 0.5, ("odom", "base_link", Pose((2, 0, 0))))
    assert live.tree.next_picture()


def test_a_right_tree_has_neither_findings_nor_ghosts() -> None:
    live = Live()
    live.run()
    assert live.tree.judge(FOUND_S).findings == ()
    picture = live.tree.next_picture()
    assert picture
    assert (picture.ghosts, picture.wrong, picture.further) == ({}, (), {})


def test_a_frame_beyond_the_tolerance_has_a_ghost_with_its_subtree() -> None:
    live = Live()
    live.run(mast=Pose((0, 0, 0.6)))
    judgement = live.tree.judge(FOUND_S)
    assert [finding.code for finding in judgement.findings] == ["TF846"]
    assert judgement.off["mast"].xyz_m == pytest.approx(0.1)
    picture = live.tree.next_picture()
    assert picture
    assert set(picture.ghosts) == {"mast", "lidar"}
    assert picture.ghosts["lidar"].xyz == pytest.approx((1.1, 0, 0.8))
    assert picture.poses["lidar"].xyz == pytest.approx((1.1, 0, 0.9))
    assert picture.wrong == (("base_link", "mast"),)
    assert "off by 100 mm" in live.tree.about("mast")


def test_what_is_off_by_less_has_none() -> None:
    live = Live()
    live.run(mast=Pose((0, 0, 0.5009)))
    assert not live.tree.judge(FOUND_S).off


def test_a_moving_joint_is_not_off_and_a_misplaced_one_keeps_its_angle() -> None:
    live, angle = Live(), quat_from_rpy(0, 1, 0)
    live.run(wheel=Pose((0, 0.2, 0), angle))
    assert not live.tree.judge(FOUND_S).off
    live = Live()
    live.run(wheel=Pose((0, 0.25, 0), angle))
    live.tree.judge(FOUND_S)
    picture = live.tree.next_picture()
    assert picture
    assert picture.ghosts["wheel"].xyz == pytest.approx((1, 0.2, 0))
    assert picture.ghosts["wheel"].quat_xyzw == pytest.approx(angle)


def test_a_stolen_edge_is_red_until_the_thief_has_left() -> None:
    live = Live()
    live.run()
    live.send(ROGUE, 4.0, ("odom", "base_link", Pose((9, 0, 0))))
    judgement = live.tree.judge(4.0)
    assert [finding.code for finding in judgement.findings] == ["TF801"]
    assert "/rogue" in judgement.findings[0].message
    picture = live.tree.next_picture()
    assert picture
    assert picture.wrong == (("odom", "base_link"),)
    assert picture.poses["base_link"].xyz == (9, 0, 0)
    assert any(line.startswith("/rogue in odom") for line in live.tree.about("base_link"))
    live.send(DRIVE, 4.05, ("odom", "base_link", Pose()))
    live.observe(4.1, {STATIC, JOINTS, DRIVE})
    assert not live.tree.judge(4.1).findings
    picture = live.tree.next_picture()
    assert picture
    assert not picture.wrong


def test_a_frame_stays_where_a_departed_thief_put_it_until_its_owner_sends() -> None:
    live = Live()
    live.run()
    live.send(ROGUE, 4.1, ("base_link", "mast", Pose((2, 0, 0))))
    live.observe(4.3, live.publishers - {ROGUE})
    judgement = live.tree.judge(4.3)
    assert (judgement.findings, set(judgement.off)) == ((), {"mast"})
    assert "mast" in judgement.summary
    picture = live.tree.next_picture()
    assert picture
    assert (picture.poses["mast"].xyz, picture.ghosts["mast"].xyz) == ((3, 0, 0), (1, 0, 0.5))
    live.send(STATIC, 4.4, ("base_link", "mast", Pose((0, 0, 0.5))), static=True)
    assert not live.tree.judge(4.4).off


def test_a_silent_edge_is_red() -> None:
    live = Live()
    live.run()
    live.observe(8.0, {STATIC, JOINTS, DRIVE})
    judgement = live.tree.judge(8.0)
    assert judgement.wrong == {"base_link"}
    assert {finding.code for finding in judgement.findings} == {"TF804"}


@pytest.mark.parametrize("silence_s", [2.0, 25.0])
def test_a_silence_that_is_over_is_red_for_some_seconds_only(silence_s: float) -> None:
    live = Live()
    live.run(8.0)

    def send(seconds: float, begun_s: float) -> float:
        for tick in range(round(seconds * 20)):
            live.send(DRIVE, begun_s + tick / 20, ("odom", "base_link", Pose((1, 0, 0))))
        return begun_s + seconds

    at_s = send(OVER_S - 0.5, 8.0 + silence_s)
    [finding] = live.tree.judge(at_s).findings
    assert finding.code == "TF804"
    assert live.tree.judgement.wrong == {"base_link"}
    at_s = send(1.0, at_s)
    assert not live.tree.judge(at_s).findings


def test_what_may_still_come_is_not_missing() -> None:
    live = Live()
    live.send(DRIVE, 0.0, ("odom", "base_link", Pose()))
    assert not live.tree.judge(FOUND_S / 2).findings
    assert live.tree.judge(FOUND_S).wrong == {"mast", "lidar", "wheel"}
    assert live.tree.about("mast")[0] == "nothing came from static yet"


def test_frames_that_nobody_declared_are_shown_where_they_are() -> None:
    live = Live()
    live.run()
    live.send(ROGUE, 4.0, ("lidar", "<b>spy</b>", Pose((1, 0, 0))))
    assert [finding.code for finding in live.tree.judge(4.0).findings] == ["TF803"]
    picture = live.tree.next_picture()
    assert picture
    assert picture.further["<b>spy</b>"].xyz == pytest.approx((2.1, 0, 0.8))


def test_a_frame_below_another_parent_moves_there_and_its_line_with_it() -> None:
    live = Live()
    live.run()
    live.send(ROGUE, 4.0, ("base_link", "lidar", Pose((0, 0, 2))), static=False)
    assert live.tree.judge(4.0).wrong == {"lidar"}
    picture = live.tree.next_picture()
    assert picture
    assert picture.poses["lidar"].xyz == pytest.approx((1, 0, 2))
    edge = picture.robot.parent_edge("lidar")
    assert edge
    assert edge.parent == "base_link"
    assert picture.wrong == (("base_link", "lidar"),)


def test_what_tf2_does_not_take_moves_nothing_and_is_red() -> None:
    live = Live()
    live.run()
    live.send(DRIVE, 4.0, ("odom", "base_link", Pose((math.nan, 0, 0))))
    assert live.tree.judge(4.0).wrong == {"base_link"}
    picture = live.tree.next_picture()
    assert picture
    assert all(math.isfinite(value) for pose in picture.poses.values() for value in pose.xyz)


def test_what_is_in_one_tree_with_the_fixed_frame_is_shown_from_there() -> None:
    live = Live()
    live.run(mast=Pose((0, 0, 0.6), quat_from_rpy(0, 0, math.pi / 2)))
    live.send(ROGUE, 4.0, ("island", "palm", Pose((7, 0, 0))))
    live.tree.judge(FOUND_S)
    assert live.tree.next_picture()
    live.tree.fixed = "mast"
    picture = live.tree.next_picture()
    assert picture
    assert picture.poses["mast"].xyz == pytest.approx((0, 0, 0))
    assert picture.poses["lidar"].xyz == pytest.approx((0.1, 0, 0.3))
    assert picture.poses["odom"].xyz == pytest.approx((0, 1, -0.6))
    assert picture.ghosts["mast"].xyz == pytest.approx((0, 0, -0.1))
    assert picture.further["palm"].xyz == (7, 0, 0)
    assert live.tree.next_picture() is None


def test_a_loop_is_shown_all_the_same() -> None:
    live = Live()
    live.run()
    live.send(ROGUE, 4.0, ("lidar", "base_link", Pose((1, 0, 0))))
    picture = live.tree.next_picture()
    assert picture
    assert picture.poses.keys() == live.robot.frames.keys()


def test_names_on_the_tree_may_have_a_prefix() -> None:
    robot = robot_of(
        TEXT.replace(
            "robot: rover", "robot: rover\nros: {frame_prefix: r1/, shared_frames: [odom]}"
        )
    )
    live = Live(robot)
    live.send(DRIVE, 0.0, ("odom", "r1/base_link", Pose((2, 0, 0))))
    picture = live.tree.next_picture()
    assert picture
    assert picture.poses["base_link"].xyz == (2, 0, 0)
    assert not picture.further


def test_poses_in_roots_are_those_of_the_tree_walked_edge_by_edge() -> None:
    rng = random.Random(7)
    frames = [f"f{number}" for number in range(60)]
    parents = {
        frame: frames[rng.randrange(index)] for index, frame in enumerate(frames) if index % 20
    }
    rng.shuffle(frames)
    number = rng.random
    poses = {
        frame: Pose((number(), number(), number()), quat_from_rpy(number(), number(), 3))
        for frame in frames
    }
    forest = FrameForest(frames, parents)
    rows = forest.in_roots(np.array([row_of(poses[frame]) for frame in frames]))
    for frame, row in zip(frames, rows.tolist(), strict=True):
        expected, ancestor = Pose(), frame
        while ancestor in parents:
            expected, ancestor = poses[ancestor] @ expected, parents[ancestor]
        off = offset_of(expected, pose_of(row))
        assert max(off) < 1e-7


def test_the_plan_is_judged_of_which_the_robot_is_another_version() -> None:
    """Frames of the plan that the shown robot lacks are shown like undeclared ones."""
    live = Live()
    smaller = replace(
        live.robot,
        frames={frame: span for frame, span in live.robot.frames.items() if frame != "lidar"},
        edges=tuple(edge for edge in live.robot.edges if edge.child != "lidar"),
    )
    live.tree = LiveTree(smaller, live.plan, {GLOBAL: live.observer}, TOLERANCE)
    live.run()
    assert not live.tree.judge(FOUND_S).findings
    picture = live.tree.next_picture()
    assert picture
    assert set(picture.further) == {"lidar"}
