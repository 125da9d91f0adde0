"""A launch file as a process, with the real ``ros2 launch``; left out where there is none."""

import os
import shutil
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from tests.support import processes
from tests.support.processes import Started
from tests.support.waiting import gone, until


def _can_launch() -> bool:
    ros2 = shutil.which("ros2")
    if ros2 is None:
        return False
    return processes.run([ros2, "launch", "--help"]).returncode == 0


pytestmark = [
    pytest.mark.ros,
    pytest.mark.skipif(not _can_launch(), reason="there is no ros2 launch"),
]

ROBOT = """
tfcompose: 1
robot: rover
ros: {discovery: localhost, namespace: rover, clock: sim}
frames: {base_link: {}, lidar: {parent: base_link, xyz: [0, 0, 0.3]}}
processes:
  demo: {run: {launch: demo/two.launch.py, args: {speed: "2.5"}}, remap: {chatter: loud}, ready: {topic: loud}}
"""  # noqa: E501 (a text as its reader has it)
LAUNCH = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

def generate_launch_description():
    speed = {"speed": LaunchConfiguration("speed")}
    return LaunchDescription([
        DeclareLaunchArgument("speed", default_value="1.0"),
        Node(package="demo", executable="talker", name="a", parameters=[speed]),
        Node(package="demo", executable="talker", name="b"),
    ])
"""
TALKER = f"""#!{sys.executable}
import rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("talker")
speed = node.declare_parameter("speed", 0.0).value
publisher = node.create_publisher(String, "chatter", 1)
print("I am", node.get_fully_qualified_name(), publisher.topic_name, node.get_parameter("use_sim_time").value, speed)
rclpy.spin(node)
"""  # noqa: E501 (a text as its reader has it)


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package with a launch file and a node."""
    talker = tmp_path / "ws/lib/demo/talker"
    for file, text in (
        (tmp_path / "ws/share/demo/launch/two.launch.py", LAUNCH),
        (tmp_path / "ws/share/ament_index/resource_index/packages/demo", ""),
        (talker, TALKER),
        (tmp_path / "robot.yaml", ROBOT),
    ):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, "utf-8")
    talker.chmod(0o755)
    return tmp_path


@pytest.mark.parametrize("how", ["is told to end", "is killed"])
def test_its_nodes_take_the_plans_settings_and_end_with_it(
    package: Path, start: Callable[..., Started], how: str
) -> None:
    paths = os.pathsep.join(
        filter(None, (str(package / "ws"), os.environ.get("AMENT_PREFIX_PATH")))
    )
    words = ("up", package / "robot.yaml", "-o", package / "build")
    up = start(*words, AMENT_PREFIX_PATH=paths)
    for output in (
        "I am /rover/a /rover/loud True 2.5",
        "I am /rover/b /rover/loud True 0.0",
        "ready demo",
    ):
        up.until_says(output)
    below = psutil.Process(up.process.pid).children(recursive=True)
    nodes = [
        process for process in below if str(package / "ws/lib/demo/talker") in process.cmdline()
    ]
    assert len(nodes) == 2
    if how == "is killed":
        os.kill(nodes[0].ppid(), signal.SIGKILL)
        assert up.process.wait(20) == 1
    else:
        assert up.end() == 0
    assert until(lambda: all(map(gone, below)))
