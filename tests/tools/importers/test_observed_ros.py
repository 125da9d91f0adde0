"""A running robot with sensors, imported: what is written passes ``verify`` on the same robot."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.bringups import compiled
from tests.support.doctor import at_last
from tests.support.fake_nodes import FakeNodes
from tfcompose.model.robot import Robot
from tfcompose.spec.load import load

pytestmark = pytest.mark.ros

#: The driver of the front camera publishes its frames, stock nodes what is fixed else.
ROBOT = """
tfcompose: 1
robot: rover
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
  mast: {parent: base_link, xyz: [0, 0, 1]}
sensors:
  camera:
    preset: realsense/d435i
    parent: base_link
    xyz: [0.3, 0, 0.2]
    rpy: [0, 10 deg, 0]
    options: {imu: true}
    tf: driver
    driver: camera_node
  rear: {preset: realsense/d435i, parent: mast, xyz: [0.1, 0, 0], driver: none, options: {imu: true}}
processes:
  drive: {external: true}
  camera_node: {external: true, node: /camera/camera}
"""  # noqa: E501 (a text as its reader has it)


@pytest.fixture
def nodes(domain: object) -> Iterator[FakeNodes]:
    assert domain
    nodes = FakeNodes()
    yield nodes
    nodes.close()


def run(nodes: FakeNodes, robot: Robot) -> None:
    """Publish the robot's edges as its drivers and stock nodes do."""
    owners = {edge.owner for edge in robot.edges}
    for owner in owners - {"drive"}:
        node = (
            nodes.node("camera", "/camera")
            if owner == "camera_node"
            else nodes.node("robot_state_publisher")
        )
        mine = [edge for edge in robot.edges if edge.owner == owner]
        nodes.latched(
            node, *((edge.parent, edge.child, edge.pose.xyz, edge.pose.quat_xyzw) for edge in mine)
        )
    nodes.moving(nodes.node("drive"), "odom base_link", hz=20)


def tfcompose(*words: str) -> None:
    done = processes.run([sys.executable, "-m", "tfcompose", *words])
    assert done.returncode == 0, done.stdout + done.stderr


def test_sensors_of_a_running_robot_get_presets_and_verify_finds_them(
    nodes: FakeNodes, tmp_path: Path
) -> None:
    robot = compiled(ROBOT, tmp_path).robot
    assert robot
    run(nodes, robot)
    out = tmp_path / "imported.yaml"

    def is_imported(seconds: float) -> None:
        tfcompose("import", "--live", "--for", str(seconds), "-o", str(out), "--force")
        data = load(out.read_text("utf-8"), str(out)).data
        camera, rear = data["sensors"]["camera"], data["sensors"]["rear"]
        assert (camera["preset"], camera["tf"], camera["driver"]) == (
            "realsense/d435i",
            "driver",
            "camera_driver",
        )
        assert data["processes"]["camera_driver"] == {"external": True, "node": "/camera/camera"}
        assert (camera["xyz"], camera["rpy"]) == ([0.3, 0, 0.2], [0, "10 deg", 0])
        assert (rear["preset"], rear["driver"], rear["parent"]) == (
            "realsense/d435i",
            "none",
            "mast",
        )
        assert list(data["frames"]) == ["odom", "base_link", "mast"]
        tfcompose("verify", str(out), "--live", "--for", str(seconds))

    at_last(is_imported)
