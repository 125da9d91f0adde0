"""Frame chains of the vendors, computed by hand from what they publish.

No preset file is read for what is expected.

Positions are metres in the mount frame, with the axes of the mount. A rotation is the frame's
three axes there.
"""

import json
import math
from typing import Any

import pytest

from tests.support.texts import robot_in
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.foundation.geometry import Pose, Vector, rotate
from tfcompose.model.robot import Robot

KNOWN = library()
HEAD = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"

Axes = tuple["Vector", "Vector", "Vector"]
BODY: Axes = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
OPTICAL: Axes = ((0, -1, 0), (0, 0, -1), (1, 0, 0))
BACK: Axes = ((-1, 0, 0), (0, -1, 0), (0, 0, 1))  # yaw 180 degrees
S, C = math.sin(0.05), math.cos(0.05)  # the slope of ZED and ZED 2: looking down
SLOPE: Axes = ((C, 0, -S), (0, 1, 0), (S, 0, C))
SLOPE_OPTICAL: Axes = ((0, -1, 0), (-S, 0, -C), (C, 0, -S))
DOWN: Axes = ((0, 0, -1), (0, 1, 0), (1, 0, 0))  # pitch 90 degrees

ALL = {"streams": ["depth", "color", "infra1", "infra2"]}
IMU = ALL | {"imu": True}

#: preset, options, frame, position, axes
TABLE: list[tuple[str, dict[str, Any], str, Vector, Axes]] = [
    # RealSense: screw → link, then each stream's place on the link, added.
    ("realsense/d405", ALL, "s_link", (0.01085, 0.009, 0.021), BODY),
    ("realsense/d405", ALL, "s_depth_optical_frame", (0.01085, 0.009, 0.021), OPTICAL),
    ("realsense/d405", ALL, "s_infra2_optical_frame", (0.01085, -0.009, 0.021), OPTICAL),
    ("realsense/d405", ALL, "s_color_optical_frame", (0.01085, 0.009, 0.021), OPTICAL),
    ("realsense/d415", ALL, "s_link", (0, 0.020, 0.0115), BODY),
    ("realsense/d415", ALL, "s_infra2_optical_frame", (0, -0.035, 0.0115), OPTICAL),
    ("realsense/d415", ALL, "s_color_optical_frame", (0, 0.035, 0.0115), OPTICAL),
    ("realsense/d435", ALL, "s_infra1_optical_frame", (0.0106, 0.0175, 0.0125), OPTICAL),
    ("realsense/d435", ALL, "s_infra2_optical_frame", (0.0106, -0.0325, 0.0125), OPTICAL),
    ("realsense/d435", ALL, "s_color_optical_frame", (0.0106, 0.0325, 0.0125), OPTICAL),
    ("realsense/d435i", IMU, "s_accel_optical_frame", (-0.00114, 0.01198, 0.0176), OPTICAL),
    ("realsense/d435i", IMU, "s_imu_optical_frame", (-0.00114, 0.01198, 0.0176), OPTICAL),
    ("realsense/d435i", IMU, "s_imu_frame", (-0.00114, 0.01198, 0.0176), BODY),
    ("realsense/d436", IMU, "s_color_frame", (0.00505, 0.0325, 0.0125), BODY),
    ("realsense/d455", IMU, "s_link", (0.01115, 0.0475, 0.0145), BODY),
    ("realsense/d455", IMU, "s_infra2_optical_frame", (0.01115, -0.0475, 0.0145), OPTICAL),
    ("realsense/d455", IMU, "s_color_optical_frame", (0.01115, -0.0115, 0.0145), OPTICAL),
    ("realsense/d455", IMU, "s_gyro_optical_frame", (-0.00487, 0.01728, 0.0219), OPTICAL),
    ("realsense/d456", IMU, "s_color_optical_frame", (0, -0.059, 0), OPTICAL),
    ("realsense/d456", IMU, "s_gyro_frame", (-0.01602, -0.03022, 0.0074), BODY),
    ("realsense/d585", IMU, "s_color_optical_frame", (0.0363, 0, 0.0215), OPTICAL),
    ("realsense/d585", IMU, "s_accel_frame", (0.0477, 0.028, 0.0215), BODY),
    ("realsense/l515", {}, "s_color_optical_frame", (0.0075, 0, 0.04515), OPTICAL),
    # ZED: screw → middle, half the case's height; the lenses half a baseline to the side and 1 cm
    # behind.
    ("zed/zed", {}, "s_camera_center", (0, 0, 0.015), SLOPE),
    ("zed/zed", {}, "s_left_camera_frame", (-0.01 * C, 0.06, 0.015 + 0.01 * S), SLOPE),
    (
        "zed/zed2",
        {},
        "s_right_camera_frame_optical",
        (-0.01 * C, -0.06, 0.015 + 0.01 * S),
        SLOPE_OPTICAL,
    ),
    ("zed/zed-mini", {}, "s_left_camera_frame_optical", (0, 0.0315, 0.01325), OPTICAL),
    ("zed/zed2i", {}, "s_left_camera_frame_optical", (-0.01, 0.06, 0.015), OPTICAL),
    (
        "zed/zed2i",
        {"wrapper": "before-5.1"},
        "s_left_camera_optical_frame",
        (-0.01, 0.06, 0.015),
        OPTICAL,
    ),
    ("zed/zed2i", {}, "s_right_camera_frame_optical", (-0.01, -0.06, 0.015), OPTICAL),
    ("zed/zedx", {}, "s_right_camera_frame", (-0.01, -0.06, 0.016), BODY),
    ("zed/zedx-mini", {}, "s_left_camera_frame", (-0.01, 0.025, 0.016), BODY),
    ("zed/zedx-hdr-max", {}, "s_left_camera_frame", (-0.01, 0.085, 0.016), BODY),
    ("zed/zedx-nano", {}, "s_right_camera_frame", (-0.01, -0.009, 0.01525), BODY),
    ("zed/zedx-one-gs", {}, "s_camera_frame_optical", (-0.005, 0, 0.0155), OPTICAL),
    (
        "zed/zedx-one-hdr",
        {"wrapper": "before-5.1"},
        "s_camera_optical_frame",
        (0, 0, 0.0125),
        OPTICAL,
    ),
    # OAK: the origin is the colour camera, the two others half a baseline to its sides.
    ("oak/oak-d", {}, "s_rgb_camera_optical_frame", (0, 0, 0), OPTICAL),
    ("oak/oak-d", {}, "s_left_camera_optical_frame", (0, 0.0375, 0), OPTICAL),
    ("oak/oak-d", {}, "s_imu_frame", (0, -0.015, -0.013662), DOWN),
    ("oak/oak-d-pro", {}, "s_right_camera_optical_frame", (0, -0.0375, 0), OPTICAL),
    (
        "oak/oak-d-pro",
        {},
        "s_imu_frame",
        (-0.008, -0.037945, -0.00079),
        ((0, 0, -1), (0, -1, 0), (-1, 0, 0)),
    ),
    ("oak/oak-d-lr", {}, "s_left_camera_frame", (0, 0.1, 0), BODY),
    ("oak/oak-d-lr", {}, "s_right_camera_frame", (0, -0.05, 0), BODY),
    ("oak/oak-d-sr", {}, "s_right_camera_optical_frame", (0, -0.01, 0), OPTICAL),
    ("oak/oak-d-sr-poe", {}, "s_right_camera_frame", (0, 0.0175, 0), BODY),
    # Ouster: the lidar is turned by 180 degrees above the base.
    ("ouster/os0", {}, "s_lidar", (0, 0, 0.03618), BACK),
    ("ouster/os1", {}, "s_imu", (0.006253, -0.011775, 0.007645), BODY),
    ("ouster/os1", {"revision": 7}, "s_lidar", (0, 0, 0.038195), BACK),
    ("ouster/os1", {"revision": 7}, "s_imu", (-0.002441, -0.009725, 0.007533), BODY),
    ("ouster/os2", {}, "s_lidar", (0, 0, 0.078296), BACK),
    ("ouster/os2", {"revision": "os-2-32"}, "s_lidar", (0, 0, 0.074296), BACK),
    ("ouster/os2", {"revision": "os-2-128-omega"}, "s_imu", (-0.006253, 0.011775, 0.011645), BODY),
    # RPLIDAR: seen from its base the scan looks back, unless the driver does not turn it.
    ("rplidar/a2", {}, "s", (0, 0, 0.031), BACK),
    ("rplidar/a2", {"yaw": 0}, "s", (0, 0, 0.031), BODY),
]


def robot_of(preset: str, options: dict[str, Any], **keys: Any) -> Robot:
    output = {"preset": preset, "parent": "base_link", "options": options} | keys
    return robot_in(
        compile_robot(HEAD + "sensors: " + json.dumps({"s": output}) + "\n", "r.yaml", KNOWN)
    )


def in_mount(robot: Robot, frame: str) -> Pose:
    pose = Pose()
    while frame != robot.sensors[0].mount:
        edge = robot.parent_edge(frame)
        assert edge
        pose, frame = edge.pose @ pose, edge.parent
    return pose


@pytest.mark.parametrize(("preset", "options", "frame", "xyz", "axes"), TABLE)
def test_a_frame_is_where_the_vendor_has_it(
    preset: str, options: dict[str, Any], frame: str, xyz: Vector, axes: Axes
) -> None:
    pose = in_mount(robot_of(preset, options), frame)
    assert math.dist(pose.xyz, xyz) < 1e-9
    for unit, axis in zip(BODY, axes, strict=True):
        assert math.dist(rotate(pose.quat_xyzw, unit), axis) < 1e-9


def test_a_calibrated_lens_is_placed_by_the_sum_of_the_table() -> None:
    """The mount is solved so that the colour lens is where it was measured.

    Its place in the mount, subtracted.
    """
    robot = robot_of(
        "realsense/d405",
        ALL,
        place="s_color_optical_frame",
        xyz=[0.1, 0.2, 0.3],
        look="forward",
        tf="tfcompose",
    )
    mount = robot.parent_edge("s_bottom_screw_frame")
    assert mount
    assert math.dist(mount.pose.xyz, (0.1 - 0.01085, 0.2 - 0.009, 0.3 - 0.021)) < 1e-9
