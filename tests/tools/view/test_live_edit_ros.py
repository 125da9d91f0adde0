"""Mounts that are dragged in the view of a running robot, beside a listener of ROS."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from tests.support.running_robot import RunningRobot
from tests.support.waiting import until
from tests.tools.view.test_live_ros import following
from tests.tools.view.test_view import session_of
from tfcompose.foundation.geometry import Pose
from tfcompose.tf.ros.node import TFSubscription
from tfcompose.tf.ros.tf_codec import decode

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.support.domains import Domain
    from tests.tools.view.test_live_ros import View

pytestmark = pytest.mark.ros
ROBOT = """\
tfcompose: 1
robot: rover
ros: {discovery: localhost}
links: {base_link: {}, mast: {}}
joints:
  mast_joint: {type: continuous, parent: base_link, child: mast, xyz: [0, 0, 0.5]}
frames:
  imu: {parent: base_link, xyz: [0, -0.2, 0.05]}
sensors:
  laser: {preset: generic/lidar2d, parent: base_link, xyz: [0.1, 0, 0.3]}
processes:
  wheels: {simulate: {joints: zero, rate: 20 Hz}}
"""
UP = (0.0, 0.0, 0.0, 1.0)


@pytest.fixture
def view(domain: Domain, tmp_path: Path) -> Iterator[View]:
    """A view that edits the mounts of a robot that really runs."""
    assert domain
    file = tmp_path / "robot.yaml"
    file.write_text(ROBOT, "utf-8")
    robot = RunningRobot(tmp_path, "robot.yaml")
    try:
        robot.says("all ready")
        with following(session_of(file), edit=True) as view_of_robot:
            yield view_of_robot
    finally:
        robot.end()


class Listener:
    """Positions on /tf_static, in the order of arrival."""

    def __init__(self, node: Any) -> None:
        self._static = TFSubscription(node, static=True)
        self._positions: dict[str, tuple[float, float, float]] = {}

    def has(self, child: str, xyz: tuple[float, float, float]) -> bool:
        for received in self._static.take():
            self._positions |= {each.child: each.xyz for each in decode(received.data)}
        return self._positions.get(child) == xyz


def test_the_running_robot_follows_a_drag_and_its_undo(view: View, node: Any) -> None:
    listener, panel = Listener(node), view.panel
    assert until(lambda: listener.has("laser_link", (0.1, 0, 0.3)))
    panel.tree.select("laser_link")
    panel.gizmo.position = (0.1204, 0.0, 0.3)  # snaps to whole millimetres
    panel._take_dragged()
    assert until(lambda: listener.has("laser_link", (0.12, 0, 0.3)))
    assert listener.has("imu", (0, -0.2, 0.05))
    assert "adjusted by 20 mm" in panel.report.content
    assert panel.gizmo.position == pytest.approx((0.12, 0, 0.3))
    assert until(lambda: "laser_link" in view.judgement.off), "it is not where the file has it"
    panel.save()
    assert until(lambda: "laser_link" not in view.judgement.off), "the file has it there now"
    assert "xyz: [0.12, 0, 0.3]" in next(iter(view.panel.session.texts.values()))


def test_undo_moves_it_back_and_another_window_keeps_its_own_moves(view: View, node: Any) -> None:
    listener, panel = Listener(node), view.panel
    panel.tree.select("imu")
    panel.move(Pose((0.0, -0.25, 0.05), UP))
    assert until(lambda: listener.has("imu", (0, -0.25, 0.05)))
    panel.tree.select("laser_link")
    panel.move(Pose((0.2, 0.0, 0.3), UP))
    assert until(lambda: listener.has("laser_link", (0.2, 0, 0.3)))
    panel._again(panel.session.undo())
    assert until(lambda: listener.has("laser_link", (0.1, 0, 0.3)))
    assert listener.has("imu", (0, -0.25, 0.05))


def test_a_joint_is_moved_with_the_file(view: View) -> None:
    panel = view.panel
    panel.tree.select("mast")
    panel.move(Pose((0.0, 0.0, 0.6), UP))
    assert "base_link → mast moves after save" in panel.report.content
