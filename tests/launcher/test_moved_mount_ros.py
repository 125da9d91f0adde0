"""A mount that moves while stock listeners run: tf2's buffers in C++ and Python take the new pose.

tf2 keeps one transform for a fixed edge. The newest message replaces it, whatever its stamp.
"""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
import rclpy.context
import rclpy.executors
from rclpy.time import Time

from tests.support import processes
from tests.support.cli import tfcompose_in
from tests.support.processes import Started
from tests.support.running_robot import RunningRobot
from tests.support.waiting import until

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tests.support.domains import Domain

tf2_ros = pytest.importorskip("tf2_ros", reason="tf2_ros comes with a distribution only")

PROGRAM = next(
    (
        program
        for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
        if (program := Path(prefix, "lib/tf2_ros/tf2_echo")).is_file()
    ),
    None,
)
pytestmark = [
    pytest.mark.ros,
    pytest.mark.slow,
    pytest.mark.skipif(PROGRAM is None, reason="there is no tf2_echo"),
]
ROBOT = """\
tfcompose: 1
robot: rover
ros: {discovery: localhost}
frames:
  base_link: {}
  lidar: {parent: base_link, xyz: [0.1, 0, LIDAR_Z]}
  imu: {parent: base_link, xyz: [0, -0.2, 0.05]}
"""


@pytest.fixture
def robot(domain: Domain, tmp_path: Path) -> Iterator[RunningRobot]:
    """A running robot with all its edges."""
    assert domain
    write(tmp_path, 0.2)
    running = RunningRobot(tmp_path, "robot.yaml")
    try:
        running.says("static", "live")
        yield running
    finally:
        running.end()


def write(folder: Path, lidar_z: float) -> None:
    """Write the robot file with the lidar at this height, in metres."""
    (folder / "robot.yaml").write_text(ROBOT.replace("LIDAR_Z", str(lidar_z)))


def update(folder: Path) -> None:
    write(folder, 0.202)
    assert tfcompose_in(folder, "up", "--update").returncode == 0


def nudge(folder: Path) -> None:
    assert tfcompose_in(folder, "nudge", "lidar", "--z", "+2mm").returncode == 0


#: How the lidar comes to be 2 mm higher.
move = pytest.mark.parametrize("move", [update, nudge])


@move
def test_a_stock_listener_takes_a_moved_mount_and_keeps_the_others(
    robot: RunningRobot, domain: Domain, move: Callable[[Path], None]
) -> None:
    context = rclpy.context.Context()
    rclpy.init(context=context, domain_id=domain.id)
    node = rclpy.create_node("listener", context=context)
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(node)
    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer, node)

    def pose(child: str) -> tuple[float, ...]:
        transform = buffer.lookup_transform("base_link", child, Time()).transform
        to, rotated = transform.translation, transform.rotation
        return to.x, to.y, to.z, rotated.x, rotated.y, rotated.z, rotated.w

    def lidar_is_at(z: float) -> bool:
        executor.spin_once(timeout_sec=0.05)
        return buffer.can_transform("base_link", "lidar", Time()) and pose("lidar")[2] == z

    try:
        assert until(lambda: lidar_is_at(0.2)), robot.text
        imu = pose("imu")
        assert imu[:3] == (0.0, -0.2, 0.05)
        move(robot.folder)
        assert until(lambda: lidar_is_at(0.202)), robot.text
        assert pose("imu") == imu
    finally:
        listener.unregister()
        executor.shutdown()
        node.destroy_node()  # type: ignore[no-untyped-call]
        rclpy.shutdown(context=context)


@move
def test_a_stock_listener_in_cpp_takes_a_moved_mount(
    robot: RunningRobot, domain: Domain, move: Callable[[Path], None]
) -> None:
    echo = Started(
        processes.start(
            [str(PROGRAM), "base_link", "lidar", "20"],
            env=domain.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
    )

    def last() -> tuple[float, ...] | None:
        heard = re.findall(r"Translation: \[(\S+), (\S+), (\S+)\]", echo.output)
        return tuple(map(float, heard[-1])) if heard else None

    try:
        assert until(lambda: last() == (0.1, 0.0, 0.2)), robot.text
        move(robot.folder)
        assert until(lambda: last() == (0.1, 0.0, 0.202)), robot.text
    finally:
        echo.close()
