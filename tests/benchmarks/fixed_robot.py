"""A robot of fixed edges only, started by each contender, and a listener that waits for them."""

from __future__ import annotations

import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from tests.benchmarks.contenders import LAUNCH, RCLPY, STATIC_PUBLISHERS, TFCOMPOSE_ON_ROS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tests.benchmarks.benchmark import Contender, Workspace

PROGRAMS = Path(__file__).with_name("programs")
EDGES = 30
_LAUNCH = """
from launch import LaunchDescription
from launch_ros.actions import Node
def generate_launch_description():
    return LaunchDescription([{nodes}])
"""


def built_plan(workspace: Workspace) -> list[str]:
    """Build the robot and return the command that starts its plan."""
    frames = "".join(
        f"  frame_{n}: {{parent: base_link, xyz: [{n / 10:g}, 0, 0]}}\n" for n in range(EDGES)
    )
    text = f"tfcompose: 1\nrobot: bench\nframes:\n  base_link: {{}}\n{frames}"
    (workspace.folder / "robot.yaml").write_text(text, encoding="utf-8")
    workspace.run(sys.executable, "-m", "tfcompose", "build", "robot.yaml", "-o", "built")
    return [sys.executable, "-m", "tfcompose", "up", "built/plan.json"]


def plain(workspace: Workspace) -> list[str]:
    """Return the command of a plain rclpy process."""
    del workspace
    return [sys.executable, str(PROGRAMS / "plain_static.py"), str(EDGES)]


def launched_state_publisher(workspace: Workspace) -> list[str]:
    """Write a launch file with robot_state_publisher and return the command."""
    links = "".join(f'<link name="frame_{n}"/>' for n in range(EDGES))
    joints = "".join(
        f'<joint name="joint_{n}" type="fixed"><parent link="base_link"/><child link="frame_{n}"/>'
        f'<origin xyz="{n / 10:g} 0 0"/></joint>'
        for n in range(EDGES)
    )
    urdf = f'<robot name="bench"><link name="base_link"/>{links}{joints}</robot>'
    node = (
        "Node(package='robot_state_publisher', executable='robot_state_publisher',"
        f" parameters=[{{'robot_description': {urdf!r}}}])"
    )
    return _launch(workspace, node)


def launched_static_publishers(workspace: Workspace) -> list[str]:
    """Write a launch file with a static_transform_publisher for each edge; return the command."""
    nodes = "".join(
        "Node(package='tf2_ros', executable='static_transform_publisher', arguments=['--x',"
        f" '{n / 10:g}', '--frame-id', 'base_link', '--child-frame-id', 'frame_{n}']),"
        for n in range(EDGES)
    )
    return _launch(workspace, nodes)


def _launch(workspace: Workspace, nodes: str) -> list[str]:
    file = workspace.folder / "robot.launch.py"
    file.write_text(_LAUNCH.format(nodes=nodes), encoding="utf-8")
    return ["ros2", "launch", str(file)]


#: How each contender starts the robot: a function that prepares it and returns the command.
COMMANDS: dict[Contender, Callable[[Workspace], list[str]]] = {
    TFCOMPOSE_ON_ROS: built_plan,
    RCLPY: plain,
    LAUNCH: launched_state_publisher,
    STATIC_PUBLISHERS: launched_static_publishers,
}


@contextmanager
def listening(
    workspace: Workspace, environment: dict[str, str] | None = None
) -> Iterator[Callable[[], tuple[float, float]]]:
    """Run a stock listener; yield a function that waits until it has all edges.

    It returns the seconds since before the listener's ``rclpy.init``, and the time on the
    machine's monotonic clock.
    """
    command = (sys.executable, PROGRAMS / "listener.py", str(EDGES))
    with workspace.running(*command, environment=environment, stdout=subprocess.PIPE) as process:
        assert process.stdout
        assert process.stdout.readline() == "listens\n"
        output = process.stdout

        def wait() -> tuple[float, float]:
            took, moment = output.readline().split()
            # Killed, it would stay in the lists of the others, and delay them.
            process.wait(20)
            return float(took), float(moment)

        yield wait
