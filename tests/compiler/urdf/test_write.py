"""Another reader finds in the URDF what the robot and the tutorial say."""

import io
import json
import math
import random
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest
import yourdfpy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.support.texts import robot_in
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.compiler.urdf.write import urdf
from tfcompose.foundation.geometry import (
    Pose,
    Quaternion,
    angle_between,
    quat_from_axis_angle,
    quat_from_rpy,
)
from tfcompose.foundation.numbers import clean_quat, clean_rpy, number
from tfcompose.model.robot import JOINTS, STATIC, Robot

ROBOTS = Path(__file__).parents[3] / "robots"
CASES = [("my_robot", ()), ("autonomous_robot", ()), ("autonomous_robot", ("demo",))]
HEAD = "tfcompose: 1\nrobot: r\n"


def robot_of(text: str, profiles: tuple[str, ...] = ()) -> Robot:
    return robot_in(compile_robot(text, "r.yaml", library(), profiles))


def example(name: str, profiles: tuple[str, ...] = ()) -> Robot:
    return robot_of((ROBOTS / f"{name}.yaml").read_text("utf-8"), profiles)


def xml_of(text: str) -> ET.Element:
    return ET.fromstring(text)  # noqa: S314 (this package wrote it)


def read_back(text: str) -> Any:
    return yourdfpy.URDF.load(
        io.StringIO(text), load_meshes=False, build_collision_scene_graph=False
    )


def pose_in_base(robot: Robot, frame: str, positions: dict[str, float]) -> Pose:
    """Return the frame's pose in the base with the joints at their positions."""
    pose = Pose()
    while frame != robot.base:
        edge = robot.parent_edge(frame)
        assert edge
        motion = Pose()
        if edge.joint:
            motion = Pose(
                (0, 0, 0),
                quat_from_axis_angle(edge.joint.axis, positions.get(edge.joint.name, 0.0)),
            )
        pose, frame = edge.pose @ motion @ pose, edge.parent
    return pose


def assert_close(mine: Pose, theirs: Any) -> None:
    x, y, z, w = Rotation.from_matrix(theirs[:3, :3]).as_quat()
    assert mine.xyz == pytest.approx(tuple(theirs[:3, 3]), abs=1e-9)
    assert angle_between(mine.quat_xyzw, (x, y, z, w)) < 1e-9


@pytest.mark.parametrize(("name", "profiles"), CASES)
def test_yourdfpy_agrees_on_every_frame_below_base_at_any_wheel_angle(
    name: str, profiles: tuple[str, ...]
) -> None:
    robot = example(name, profiles)
    theirs = read_back(urdf(robot)[0])
    chance = random.Random(1)
    assert set(theirs.link_map) == {f for f in robot.frames if f not in {"map", "odom"}}
    for sample in range(20):
        positions = {
            joint: chance.uniform(-10, 10) if sample else 0.0
            for joint in theirs.actuated_joint_names
        }
        theirs.update_cfg(positions)
        for frame in theirs.link_map:
            assert_close(
                pose_in_base(robot, frame, positions), theirs.get_transform(frame, robot.base)
            )


@pytest.mark.parametrize(("name", "profiles"), CASES)
def test_edges_float_in_robot_urdf_exactly_if_another_node_publishes_them(
    name: str, profiles: tuple[str, ...]
) -> None:
    robot = example(name, profiles)
    joints = xml_of(urdf(robot)[1]).findall("joint")
    kinds = {
        child.get("link"): joint.get("type")
        for joint in joints
        for child in joint.findall("child")
    }
    below = [edge for edge in robot.edges if edge.child in kinds]
    assert {child for child, kind in kinds.items() if kind == "floating"} == {
        edge.child for edge in below if edge.owner not in {STATIC, JOINTS}
    }
    full = {joint.get("type") for joint in xml_of(urdf(robot)[0]).iter("joint")}
    assert full == {"fixed", "continuous"}


GIMBAL = """
links: {base_link: {}}
sensors:
  eye: {preset: zed/zed2i, parent: base_link, owner: gimbal, rate: 50 Hz}
processes: {gimbal: {external: true}}
"""


def test_a_sensor_with_lenses_on_tf_is_one_body_that_a_gimbal_moves() -> None:
    robot = robot_of(HEAD + GIMBAL)
    assert {
        edge.child for edge in robot.edges if edge.kind == "dynamic" and edge.owner == "eye"
    } == {
        "eye_left_camera_frame",
        "eye_right_camera_frame",
    }
    joints = xml_of(urdf(robot)[0]).iter("joint")
    types = {joint.attrib["name"]: joint.attrib["type"] for joint in joints}
    assert types.pop("base_link_to_eye_camera_link") == "floating"
    assert set(types.values()) == {"fixed"}


def test_only_with_a_real_driver_something_floats() -> None:
    assert 'type="floating"' in urdf(example("autonomous_robot"))[1]
    assert 'type="floating"' not in urdf(example("autonomous_robot", ("demo",)))[1]


# Tutorial, section 8.1: origin xyz and rpy of each joint, child by child.
MY_ROBOT = {
    "laser_link": ((0, 0, 0.3), (0, 0, 0)),
    "camera_link": ((0.1, 0, 0.2), (0, 0, 0)),
    "camera_optical_frame": ((0.1, 0, 0.2), (-math.pi / 2, 0, -math.pi / 2)),
    "wheel_left_link": ((0, 0.15, -0.05), (-math.pi / 2, 0, 0)),
}
# Tutorial, chapter 13; its camera's pitch has the wrong sign: looking down is positive.
AUTONOMOUS_ROBOT = {
    "laser_link": ((0, 0, 0.3), (0, 0, 0)),
    "camera_link": ((0.2, 0, 0.1), (0, math.pi / 12, 0)),
    "imu_link": ((0, 0, 0), (0, 0, 0)),
    "wheel_left_link": ((0, 0.2, -0.1), (-math.pi / 2, 0, 0)),
    "wheel_right_link": ((0, -0.2, -0.1), (math.pi / 2, 0, 0)),
}


@pytest.mark.parametrize(
    ("name", "frame", "xyz", "rpy"),
    [("my_robot", frame, *pose) for frame, pose in MY_ROBOT.items()]
    + [("autonomous_robot", frame, *pose) for frame, pose in AUTONOMOUS_ROBOT.items()],
)
def test_a_frame_of_the_tutorial_is_where_the_tutorial_has_it(
    name: str, frame: str, xyz: tuple[float, ...], rpy: tuple[float, ...]
) -> None:
    transform = read_back(urdf(example(name))[0]).get_transform(frame, "base_link")
    assert tuple(transform[:3, 3]) == pytest.approx(xyz, abs=1e-9)
    assert transform[:3, :3] == pytest.approx(
        Rotation.from_euler("xyz", rpy).as_matrix(), abs=1e-9
    )


def test_the_bodies_are_those_of_the_tutorial() -> None:
    mine = read_back(urdf(example("my_robot"))[0]).link_map
    assert tuple(mine["base_link"].visuals[0].geometry.box.size) == (0.5, 0.3, 0.1)
    assert tuple(mine["base_link"].collisions[0].geometry.box.size) == (0.5, 0.3, 0.1)
    assert (
        mine["laser_link"].visuals[0].geometry.cylinder.radius,
        mine["laser_link"].visuals[0].geometry.cylinder.length,
    ) == (0.05, 0.05)
    links = read_back(urdf(example("autonomous_robot"))[0]).link_map
    assert tuple(links["base_link"].visuals[0].geometry.box.size) == (0.5, 0.4, 0.15)
    assert links["base_link"].inertial.mass == 10
    # A solid box: m/12 (b² + c²). The tutorial's 0.1 on every axis belongs to no box of this size.
    expected = [
        10 / 12 * (0.4**2 + 0.15**2),
        10 / 12 * (0.5**2 + 0.15**2),
        10 / 12 * (0.5**2 + 0.4**2),
    ]
    assert list(links["base_link"].inertial.inertia.diagonal()) == pytest.approx(expected)


@pytest.mark.parametrize("frame", ["camera_depth_optical_frame", "camera_color_optical_frame"])
def test_the_camera_points_15_degrees_down_and_its_images_are_upright(frame: str) -> None:
    rotation = read_back(urdf(example("autonomous_robot"))[0]).get_transform(frame, "base_link")[
        :3, :3
    ]
    down = math.radians(15)
    right, image_down, forward = rotation[:, 0], rotation[:, 1], rotation[:, 2]
    assert forward == pytest.approx((math.cos(down), 0, -math.sin(down)), abs=1e-9)
    assert right == pytest.approx((0, -1, 0), abs=1e-9)
    assert image_down == pytest.approx((-math.sin(down), 0, -math.cos(down)), abs=1e-9)


def test_the_cameras_screw_is_where_the_vendors_own_numbers_put_it() -> None:
    transform = read_back(urdf(example("autonomous_robot"))[0]).get_transform(
        "camera_link", "camera_bottom_screw_frame"
    )
    assert tuple(transform[:3, 3]) == pytest.approx((0.0106, 0.0175, 0.0125), abs=1e-9)


@pytest.mark.parametrize("name", ["a & b", 'say "hi"', "it's", "<x>", "a\nb"])
def test_a_name_unsafe_in_xml_reaches_no_file_and_would_be_escaped(
    name: str,
) -> None:
    text = HEAD + f"links: {{base_link: {{}}, {json.dumps(name)}: {{parent: base_link}}}}\n"
    compiled = compile_robot(text, "r.yaml", library())
    assert [finding.code for finding in compiled.errors] == ["TF501"]
    assert compiled.robot
    read = xml_of(urdf(compiled.robot)[0])
    assert [link.get("name") for link in read.iter("link")] == ["base_link", name]


def test_no_two_joints_share_a_name_even_if_the_user_took_a_generated_one() -> None:
    text = (
        HEAD + "links: {base_link: {}, w: {}, v: {parent: base_link}}\n"
        "joints: {base_link_to_v: {type: continuous, parent: base_link, child: w}}\n"
    )
    names = [joint.get("name") for joint in xml_of(urdf(robot_of(text))[0]).iter("joint")]
    assert len(names) == len(set(names)) == 2


def test_two_colours_without_a_name_stay_two_colours() -> None:
    text = (
        HEAD + "links:\n  base_link: {visual: {box: [1, 1, 1], material: {rgba: [1, 0, 0, 1]}}}\n"
        "  a: {parent: base_link, visual: {box: [1, 1, 1], material: {rgba: [0, 0.25, 0, 1]}}}\n"
    )
    materials = list(xml_of(urdf(robot_of(text))[0]).iter("material"))
    assert len({material.get("name") for material in materials}) == 2


def test_a_mimic_joint_and_its_limits_are_read_back() -> None:
    text = (
        HEAD + "links: {base_link: {}, a: {}, b: {}}\njoints:\n"
        "  left: {type: prismatic, parent: base_link, child: a, axis: [0, 2, 0],\n"
        "    limit: {lower: 0, upper: 4 cm, effort: 5}}\n"
        "  right: {type: prismatic, parent: base_link, child: b, limit: {lower: 0, upper: 1},\n"
        "    mimic: {joint: left, multiplier: -1}}\n"
    )
    joints = read_back(urdf(robot_of(text))[0]).joint_map
    assert tuple(joints["left"].axis) == (0, 1, 0)
    assert (
        joints["left"].limit.lower,
        joints["left"].limit.upper,
        joints["left"].limit.effort,
    ) == (0, 0.04, 5)
    assert (joints["right"].mimic.joint, joints["right"].mimic.multiplier) == ("left", -1)


def test_a_process_that_waits_for_an_idle_one_waits_for_nothing() -> None:
    text = (
        HEAD + "links: {base_link: {}}\nprocesses: {a: {run: [x], after: {joints: started, static:"
        " started}}}\n"
    )
    plan = json.loads(next(file.text for file in emit(robot_of(text)) if file.path == "plan.json"))
    names = [process["name"] for process in plan["processes"]]
    assert names == ["static", "a", "guard"]
    assert next(process for process in plan["processes"] if process["name"] == "a")["after"] == {
        "static": "started"
    }


angles = st.floats(-math.pi, math.pi)
near_the_pole = st.builds(
    lambda sign, off: sign * (math.pi / 2 - off), st.sampled_from([1, -1]), st.floats(0, 1e-3)
)
quaternions = st.builds(quat_from_rpy, angles, angles | near_the_pole, angles)


@given(quaternions)
@settings(max_examples=150)
def test_the_angles_that_are_emitted_are_the_rotation_that_is_meant(quat: Quaternion) -> None:
    expected: Quaternion = tuple(Rotation.from_euler("xyz", clean_rpy(quat)).as_quat())
    assert (
        angle_between(quat, expected) < 2e-9
    )  # the worst is where a pitch begins to count as ±π/2


@given(quaternions)
def test_a_quaternion_and_its_negative_have_one_text(quat: Quaternion) -> None:
    x, y, z, w = quat
    assert clean_quat((-x, -y, -z, -w)) == clean_quat(quat)


@pytest.mark.parametrize(
    "quat", [(1.0, 0, 0, 1e-17), (1.0, 0, 0, -1e-17), (-1.0, 0, 0, 1e-17), (-1.0, 0.0, 0.0, 0.0)]
)
def test_noise_does_not_flip_the_sign_of_a_half_rotation(quat: Quaternion) -> None:
    assert clean_quat(quat) == (1, 0, 0, 0)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_reads_back_the_same_and_has_no_negative_zero(value: float) -> None:
    assert float(number(value)) == value
    assert not number(value).startswith("-0") or value != 0


def test_rotations_that_differ_in_the_sign_of_a_zero_are_printed_alike() -> None:
    rotations = [(0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 1.0, -0.0), (-0.0, 0.0, 1.0, -0.0)]
    assert len({clean_rpy(rotation) for rotation in rotations}) == 1
