"""Named views, parallel lines, and what of a robot is in the picture."""

import math
from pathlib import Path

import numpy as np
import pytest
import viser

from tests.tools.view.test_view import PRESETS, session_of
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.mounts.kinematics import poses_in_roots
from tfcompose.tools.view.camera import VIEWS, Bounds
from tfcompose.tools.view.panel import Panel
from tfcompose.tools.view.scene import RobotScene


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("is_parallel", [False, True])
def test_all_that_is_shown_is_in_each_view(view: str, is_parallel: bool) -> None:  # noqa: FBT001
    bounds = Bounds.around(np.array([[1.0, 2.0, 3.0], [1.0, 4.0, 3.0]]), 0.0)
    position = bounds.position(view, is_parallel=is_parallel)
    angle = math.radians(1 if is_parallel else 75)
    away = np.linalg.norm(position - bounds.middle)
    assert 0.5 < bounds.radius / (math.sin(angle / 2) * away) < 1.0
    assert np.dot((position - bounds.middle) / away, VIEWS[view]) == pytest.approx(
        np.linalg.norm(VIEWS[view])
    )


def test_fields_of_view_are_in_the_first_picture(server: viser.ViserServer) -> None:
    text = "tfcompose: 1\nrobot: r\nframes: {base_link: {}}\nsensors: {c: {preset: %s, parent: base_link}}\n"  # noqa: E501 (a text as its reader has it)
    robot = compile_robot(text % "realsense/d435i", "r.yaml", PRESETS).robot
    assert robot
    scene = RobotScene(server.scene, robot)
    poses = poses_in_roots(robot, {})
    ends = scene.fields.points(poses)
    assert ends[:, 0].max() > 0.1
    bounds = scene.add_grid(poses)
    assert np.linalg.norm(ends - bounds.middle, axis=1).max() <= bounds.radius


def test_a_fixed_mount_is_grey_and_the_distance_of_two_frames_is_shown(
    rover: Path, server: viser.ViserServer
) -> None:
    panel = Panel(server, session_of(rover), edit=True)
    for frame, is_grey in (("odom", True), ("front_link", False), ("front_depth_frame", True)):
        panel.tree.select(frame)
        assert {handle.disabled for handle in panel._numbers} == {is_grey}
    panel._base.value = "rear_link"
    poses = panel.poses()
    away = math.dist(poses["rear_link"].xyz, poses["front_depth_frame"].xyz)
    assert f"{away * 1000:.4g} mm away" in panel._about.content
    ruler = server.scene.get_handle_by_name("/ruler")
    assert ruler
    panel._base.value = "front_depth_frame"
    assert server.scene.get_handle_by_name("/ruler") is None


def test_the_limits_of_sliders_are_rounded(server: viser.ViserServer, tmp_path: Path) -> None:
    (tmp_path / "r.yaml").write_text(
        """tfcompose: 1
robot: r
links: {a: {}, b: {}}
joints: {j: {type: revolute, parent: a, child: b, limit: {lower: -1.5708, upper: 2.0943, effort: 1, velocity: 1}}}
"""  # noqa: E501 (a text as its reader has it)
    )
    panel = Panel(server, session_of(tmp_path / "r.yaml"), edit=False)
    slider = next(iter(panel.sliders))
    assert (slider.min, slider.max) == (-90.0, 120.0)
    slider.value = 120.0
    assert panel.positions["j"] == 2.0943
