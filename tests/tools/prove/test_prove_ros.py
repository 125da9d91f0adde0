"""``tfcompose prove`` on a running robot: real nodes send an IMU's rates and odometry."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from tests.support.cli import tfcompose_in

pytestmark = pytest.mark.ros

ROBOT = """\
tfcompose: 1
robot: rover
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
  imu_link: {parent: base_link, rpy: [180 deg, 0, 0]}
processes:
  drive: {external: true, node: diff_drive}
"""


def yaw_rate(now_ns: int) -> float:
    return 0.8 * math.sin(3 * (now_ns % 10**12) / 1e9)


def stamp(message: Any, now_ns: int, frame: str) -> Any:
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(now_ns, 10**9)
    message.header.frame_id = frame
    return message


def odometry(now_ns: int) -> Odometry:
    message = stamp(Odometry(), now_ns, "odom")
    message.child_frame_id = "base_link"
    message.twist.twist.angular.z = yaw_rate(now_ns)
    return message


def imu(now_ns: int) -> Imu:
    """Return what an IMU measures that is not upside down."""
    message = stamp(Imu(), now_ns, "imu_link")
    message.linear_acceleration.z = 9.81
    message.angular_velocity.z = yaw_rate(now_ns)
    return message


def test_a_running_robot_shows_an_imu_that_is_not_upside_down(nodes: Any, tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(ROBOT, "utf-8")
    node = nodes.node("drive")
    nodes.typed(node, Imu, "/imu", imu, hz=100)
    nodes.typed(node, Odometry, "/odom", odometry, hz=50)
    words = ("prove", "robot.yaml", "--for", "5", "--fix", "--format", "json")
    done = tfcompose_in(tmp_path, *words)
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    answers = {each["check"]: each["answer"] for each in document["checks"]}
    assert answers["gravity"] == answers["yaw rate"] == "agrees"
    assert len(document["fixed"]) == 1
    assert (
        "imu_link: {parent: base_link, rpy: [0 deg, 0, 0]}"
        in (tmp_path / "robot.yaml").read_text()
    )
