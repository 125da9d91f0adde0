"""Arguments of static_transform_publisher in all their orders, and the edges that they publish."""

import math

import pytest
from scipy.spatial.transform import Rotation

from tfcompose.foundation.geometry import angle_between, normalise
from tfcompose.tools.importers.static_transforms import (
    ArgumentsRefusedError,
    reader_of,
    static_transform,
)

#: Arguments, who reads them, and what tf2's setRPY (fixed axes) and the program make of them:
#: ends, xyz, roll, pitch, yaw in rad.
ARGUMENTS = [
    ("0.0 0.0 0.3 0 0 0 base_link lidar_link", "ros2", (0, 0, 0.3), (0, 0, 0)),
    ("0.1 0.0 0.2 1.5707963 0 0 base_link lidar_link", "ros2", (0.1, 0, 0.2), (0, 0, 1.5707963)),
    ("0 0 0 -1.5707963 0.3 -1.2 base_link lidar_link", "ros2", (0, 0, 0), (-1.2, 0.3, -1.5707963)),
    ("0.2 0 0.1 0.4 0.5 0.6 base_link lidar_link 100", "tf", (0.2, 0, 0.1), (0.6, 0.5, 0.4)),
    (
        "0.2 0 0.1 0 0 0.7071067811865476 0.7071067811865476 /base_link /lidar_link 10",
        "tf",
        (0.2, 0, 0.1),
        (0, 0, math.pi / 2),
    ),
    ("0.2 0 0.1 0 0 0 1 base_link lidar_link", "tf2_ros", (0.2, 0, 0.1), (0, 0, 0)),
    (
        "--yaw 0.1 --pitch 0.2 --roll 0.3 --z 4 --frame-id base_link --child-frame-id lidar_link",
        "ros2",
        (0, 0, 4),
        (0.3, 0.2, 0.1),
    ),
    (
        "--frame-id base_link --child-frame-id lidar_link --ros-args -r __node:=a -p use_sim_time:=true",  # noqa: E501 (a text as its reader has it)
        "ros2",
        (0, 0, 0),
        (0, 0, 0),
    ),
    (
        "--qx 1 --qw 0 --frame-id base_link --child-frame-id lidar_link",
        "ros2",
        (0, 0, 0),
        (math.pi, 0, 0),
    ),
    ("1 2 3 90 0 0 base_link lidar_link __name:=tf", "ros2", (1, 2, 3), (0, 0, 90)),
    (
        "--qz 0.05 --frame-id base_link --child-frame-id lidar_link",
        "ros2",
        (0, 0, 0),
        (0, 0, 2 * math.atan(0.05)),
    ),
    (
        "--ros-args -r __node:=a -- --x 2 --frame-id base_link --child-frame-id lidar_link",
        "ros2",
        (2, 0, 0),
        (0, 0, 0),
    ),
]


@pytest.mark.parametrize(
    ("words", "reader", "xyz", "rpy"), ARGUMENTS, ids=[row[0] for row in ARGUMENTS]
)
def test_arguments_say_the_edge_that_the_program_publishes(
    words: str, reader: str, xyz: object, rpy: object
) -> None:
    transform = static_transform(words.split(), reader)  # type: ignore[arg-type]
    assert (transform.parent, transform.child, transform.pose.xyz) == (
        "base_link",
        "lidar_link",
        xyz,
    )
    assert ("slashes" in transform.order) is ("/base_link" in words), "a comment says so"
    expected = Rotation.from_euler("xyz", rpy).as_quat()  # lower case: about fixed axes
    assert angle_between(normalise(transform.pose.quat_xyzw), tuple(expected)) < 1e-9


REFUSED = [
    ("0 0 0 0 0 0 base_link laser 100", "ros2"),
    ("0 0 0 0 0 0 base_link laser", "tf"),
    ("0 0 0 0 0 0 0.7 base_link laser", "ros2"),
    ("--qx 1 --yaw 1 --frame-id a --child-frame-id b", "ros2"),
    ("--frame-id a --child-frame-id a", "ros2"),
    ("--frame-id a", "ros2"),
    ("--x", "ros2"),
    ("--x nan --frame-id a --child-frame-id b", "ros2"),
    ("0 0 0 90deg 0 0 a b", "ros2"),
    ("0 0 0 0 0 0 -- a b", "ros2"),
    ("0 0 0 --yaw 1 0 0 a b --frame-id a", "ros2"),
    ("", "ros2"),
]


@pytest.mark.parametrize(
    ("words", "reader"), REFUSED, ids=[f"{reader}: {words}" for words, reader in REFUSED]
)
def test_arguments_that_the_program_refuses_are_refused(words: str, reader: str) -> None:
    with pytest.raises(ArgumentsRefusedError):
        static_transform(words.split(), reader)  # type: ignore[arg-type]


def test_a_period_behind_two_frames_tells_tf_from_its_successors() -> None:
    assert reader_of(["0", "0", "0", "0", "0", "0", "base_link", "laser", "100"]) == "tf"
    assert reader_of(["0", "0", "0", "0", "0", "0", "1", "base_link", "laser"]) == "ros2"
    assert reader_of(["0", "0", "0", "0", "0", "0", "1", "2", "3"]) == "ros2"
