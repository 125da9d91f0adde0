"""Mounts and joints' zeros that the stock robot_state_publisher publishes, while it runs."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tests.support.cli import tfcompose_in
from tests.support.running_robot import RunningRobot
from tests.support.waiting import until
from tfcompose.foundation.geometry import Pose, offset_of, quat_from_rpy
from tfcompose.tf.ros.node import TFSubscription
from tfcompose.tf.ros.tf_codec import decode

if TYPE_CHECKING:
    from tests.support.domains import Domain

PROGRAM = "lib/robot_state_publisher/robot_state_publisher"
PREFIXES = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
pytestmark = [
    pytest.mark.ros,
    pytest.mark.skipif(
        not any(Path(prefix, PROGRAM).is_file() for prefix in PREFIXES),
        reason="there is no robot_state_publisher",
    ),
]
ROBOT = """\
tfcompose: 1
robot: rover
ros: {state_publisher: stock, discovery: localhost, frame_prefix: r1/, namespace: rover}
links: {base_link: {}, head: {}}
joints:
  neck: {type: continuous, axis: [0, 0, 1], parent: base_link, child: head, xyz: [0, 0, 0.5]}
frames:
  lamp: {parent: head, xyz: [0, 0, 0.1]}
  imu: {parent: base_link, xyz: [0, -0.2, 0.05]}
processes:
  wheels: {simulate: {joints: zero, rate: 20 Hz}}
"""
#: Poses that differ less are the same, in metres and radians.
SAME = 1e-6


class Tree:
    """The last pose of each frame in its parent."""

    def __init__(self, node: Any) -> None:
        self._subscriptions = [TFSubscription(node, static=static) for static in (True, False)]
        self._poses: dict[str, Pose] = {}

    def has(self, child: str, pose: Pose) -> bool:
        """Return whether that is the frame's pose."""
        for subscription in self._subscriptions:
            for received in subscription.take():
                self._poses |= {
                    each.child: Pose(each.xyz, each.quat_xyzw) for each in decode(received.data)
                }
        return child in self._poses and max(offset_of(pose, self._poses[child])) < SAME


def test_it_takes_nudges_and_the_zero_of_a_joint_without_a_restart(
    domain: Domain, tmp_path: Path, node: Any
) -> None:
    assert domain
    file, tree = tmp_path / "robot.yaml", Tree(node)
    file.write_text(ROBOT)
    robot = RunningRobot(tmp_path, "robot.yaml")
    try:
        robot.says("tree complete")
        assert tfcompose_in(tmp_path, "nudge", "lamp", "--z", "+5cm").returncode == 0
        assert tfcompose_in(tmp_path, "nudge", "imu", "--yaw", "+90deg").returncode == 0
        turned = Pose((0, -0.2, 0.05), quat_from_rpy(0, 0, math.pi / 2))
        assert until(lambda: tree.has("r1/lamp", Pose((0, 0, 0.15))))
        assert until(lambda: tree.has("r1/imu", turned))
        file.write_text(ROBOT.replace("[0, 0, 0.5]", "[0, 0, 0.5], offset: 10 deg"))
        assert tfcompose_in(tmp_path, "up", "--update").returncode == 0
        corrected = Pose((0, 0, 0.5), quat_from_rpy(0, 0, math.pi / 18))
        assert until(lambda: tree.has("r1/head", corrected))
        assert until(lambda: tree.has("r1/lamp", Pose((0, 0, 0.1)))), "as in the file"
        assert len(robot.lines("started joints")) == 1
        assert [code for code in robot.codes() if code.startswith("TF8")] == []
    finally:
        robot.end()
