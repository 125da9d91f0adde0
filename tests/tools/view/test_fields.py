"""Fields of view are drawn as the placement rules compute them, blocked parts too."""

import re

import numpy as np
import pytest
import viser

from tests.tools.view.test_view import PRESETS
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.mounts.kinematics import poses_in_roots
from tfcompose.compiler.rays import contains, directions, is_plane
from tfcompose.foundation.geometry import Pose
from tfcompose.model.robot import Robot
from tfcompose.tools.view.fields import FieldsOfView, outline, rims, streams, surface

HEAD = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"
CONE = "{range: {horizontal: 60 deg, vertical: 20 deg, near: 0.1, far: 0.4}}"


def robot_of(entry: str, more: str = "") -> Robot:
    robot = compile_robot(
        f"{HEAD}{more}sensors: {{s: {{{entry}, parent: base_link}}}}\n", "r.yaml", PRESETS
    ).robot
    assert robot
    return robot


def test_a_rim_bounds_what_each_preset_sees() -> None:
    count = 0
    for name in PRESETS.names:
        for _, optics in streams(robot_of(f"preset: {name}, xyz: [1, 0, 1]")):
            made = rims(optics)
            points = np.concatenate(made)
            assert all(contains(optics, tuple(point)) for point in points), name
            length = 1 if optics.kind == "camera" and optics.projection != "fisheye" else None
            depth = np.abs(points[:, 2]) if length else np.linalg.norm(points, axis=1)
            assert depth == pytest.approx(1)
            if (
                optics.kind == "camera" and optics.projection != "fisheye"
            ):  # what is sampled stays within the corners
                ways = np.array(directions(optics))
                corners, pixels = points[:, :2], ways[:, :2] / np.abs(ways[:, 2:])
                assert (corners.min(axis=0) <= pixels.min(axis=0)).all(), name
                assert (corners.max(axis=0) >= pixels.max(axis=0)).all(), name
            elif is_plane(optics):
                assert len(made) == 1
            count += 1
    assert count > 80


@pytest.mark.parametrize(("requested", "drawn"), [(0.2, 0.2), (5.0, 0.4)])
def test_a_cone_is_drawn_as_far_as_requested_and_no_farther_than_it_sees(
    requested: float, drawn: float
) -> None:
    robot = robot_of(f"preset: generic/ultrasonic, xyz: [1, 0, 1], optics: {CONE}")
    ((_, optics),) = streams(robot)
    distances = np.linalg.norm(outline(optics, requested).reshape(-1, 3), axis=1)
    assert (distances.min(), distances.max()) == pytest.approx((0.1, drawn))
    vertices, faces = surface(optics, requested)
    assert np.linalg.norm(vertices, axis=1).max() == pytest.approx(drawn)
    assert faces.max() == len(vertices) - 1


WALL = """  wall:
    parent: base_link
    xyz: [0.3, 0, 0.3]
    collision: {box: [0.02, 0.15, 0.4]}
"""


def test_what_is_blocked_is_what_the_rule_says(server: viser.ViserServer) -> None:
    text = HEAD.replace("links: {base_link: {}}\n", f"links:\n  base_link: {{}}\n{WALL}")
    text += (
        "sensors: {s: {preset: realsense/d455, parent: base_link, xyz: [0.1, 0, 0.3], driver:"
        " none}}\n"
    )
    text += "rules: {TF641: {limit: 1 %}}\n"
    done = compile_robot(text, "r.yaml", PRESETS)
    assert done.robot
    (rule,) = (finding for finding in done.findings if finding.code == "TF641")
    number = re.search(r"(\d+) %.*\((\w+)\)", rule.message)
    assert number
    fields = FieldsOfView(server.scene, done.robot)
    fields.update(poses_in_roots(done.robot, {}))
    lines = fields.show_blocked(done.robot)
    assert f"s ({number[2]}): {number[1]}% blocked by wall" in lines
    fields.show("s", visible=False)
    assert fields.show_blocked(done.robot) == []


def test_a_field_of_view_is_where_its_frame_is(server: viser.ViserServer) -> None:
    robot = robot_of(
        "preset: generic/camera, xyz: [1, 2, 3], optics: {image: {horizontal: 60 deg, vertical: 40"
        " deg}}"
    )
    fields = FieldsOfView(server.scene, robot)
    poses = poses_in_roots(robot, {})
    fields.update(poses)
    ((_, optics),) = streams(robot)
    assert fields.pose(0) == poses[optics.frame] != Pose()
    assert fields.visible == {"s": True}
