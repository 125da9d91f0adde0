"""Offsets of joints' zeros: in every output a position q with the offset o is q + o without."""

import copy
import json
import random
from argparse import ArgumentParser
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from tests.support.random_robot import MOVING, spec
from tests.support.texts import robot_in
from tests.support.urdf_readers import Pinocchio, Reader, Yourdfpy
from tfcompose.cli.compiling import compile_file, library
from tfcompose.cli.options import add_variant
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.compiler.mounts.kinematics import joint_positions, poses_in_roots
from tfcompose.model.robot import Robot

READERS: dict[str, Callable[[str, str], Reader]] = {"yourdfpy": Yourdfpy, "pinocchio": Pinocchio}
FAR_M = 1e-9


def robot_of(data: dict[str, Any]) -> Robot:
    return robot_in(compile_robot(json.dumps(data), "r.yaml", library()))


def urdf_of(data: dict[str, Any]) -> str:
    (text,) = (file.text for file in emit(robot_of(data)) if file.path == "robot.urdf")
    return text


def without_offsets(data: dict[str, Any]) -> dict[str, Any]:
    """Return the robot with neither offsets nor followers: each joint can be moved alone."""
    data = copy.deepcopy(data)
    for joint in data["joints"].values():
        joint.pop("offset", None)
        joint.pop("mimic", None)
    return data


def corrected(joints: dict[str, Any], reported: dict[str, float]) -> dict[str, float]:
    """Return where each joint really is, at the reported positions of those without ``mimic``."""
    positions: dict[str, float] = {}
    for name, joint in joints.items():
        position = reported.get(name, 0.0)
        if mimic := joint.get("mimic"):
            position = mimic["multiplier"] * positions[mimic["joint"]] + mimic["offset"]
        positions[name] = position + joint.get("offset", 0.0)
    return positions


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("seed", range(3))
def test_a_reported_position_is_the_corrected_one_without_offsets(seed: int, name: str) -> None:
    data = spec(seed, ("fixed", *MOVING))
    joints = {name: joint for name, joint in data["joints"].items() if joint["type"] in MOVING}
    assert {"mimic" in joint for joint in joints.values()} == {True, False}
    chance = random.Random(seed)
    with_offsets = READERS[name](urdf_of(data), "base_link")
    without = READERS[name](urdf_of(without_offsets(data)), "base_link")
    for _ in range(5):
        leaders = {name: chance.uniform(-2, 2) for name in joints if "mimic" not in joints[name]}
        positions = corrected(joints, leaders)
        reported = {name: value - joints[name]["offset"] for name, value in positions.items()}
        exact_poses = without.poses(positions)
        for frame, pose in with_offsets.poses(reported).items():
            assert np.abs(exact_poses[frame] - pose).max() < FAR_M, frame


def test_our_own_poses_and_positions_of_followers_are_those_of_the_readers() -> None:
    data = spec(1, ("fixed", *MOVING))
    robot, exact = robot_of(data), robot_of(without_offsets(data))
    joints = {name: joint for name, joint in data["joints"].items() if joint["type"] in MOVING}
    leaders = {name: 0.3 for name in joints if "mimic" not in joints[name]}
    positions = corrected(joints, leaders)
    reported = {name: value - joints[name]["offset"] for name, value in positions.items()}
    assert joint_positions(robot, leaders) == pytest.approx(reported)
    exact_poses = poses_in_roots(exact, positions)
    for frame, pose in poses_in_roots(robot, leaders).items():
        assert pose.xyz == pytest.approx(exact_poses[frame].xyz, abs=FAR_M), frame


HEAD = """\
tfcompose: 1
robot: humanoid
overlays: {by: hostname, folder: units}
links: {torso: {}, neck_link: {}, head_link: {}}
joints:
  neck:
    type: revolute
    parent: torso
    child: neck_link
    xyz: [0, 0, 0.3]
    axis: [0, 0, 1]
    limit: {lower: -90 deg, upper: 90 deg, effort: 1, velocity: 2}
    safety_controller: {soft_lower_limit: -80 deg, soft_upper_limit: 80 deg, k_velocity: 1}
    calibration: {rising: 10 deg}
  lift:
    type: prismatic
    parent: neck_link
    child: head_link
    axis: [0, 0, 1]
    limit: {lower: 0, upper: 5 cm}
"""
DEG = np.pi / 180


def test_what_a_joint_reports_is_shifted_and_its_range_is_not() -> None:
    data = yaml.safe_load(HEAD)
    data["joints"]["neck"]["offset"] = "0.4 deg"
    data["joints"]["lift"]["offset"] = "3 mm"
    joints = {edge.joint.name: edge.joint for edge in robot_of(data).edges if edge.joint}
    neck, lift = joints["neck"], joints["lift"]
    assert neck.limit
    assert neck.safety
    assert neck.reference
    assert lift.limit
    assert (neck.limit.lower, neck.limit.upper) == pytest.approx((-90.4 * DEG, 89.6 * DEG))
    assert (neck.limit.effort, neck.limit.velocity) == (1, 2)
    assert neck.safety.soft_lower_limit == pytest.approx(-80.4 * DEG)
    assert neck.safety.soft_upper_limit == pytest.approx(79.6 * DEG)
    assert neck.reference.rising == pytest.approx(9.6 * DEG)
    assert neck.reference.falling is None
    assert (lift.limit.lower, lift.limit.upper) == pytest.approx((-0.003, 0.047))


PART = """\
<robot name="head">
  <link name="base"/><link name="head"/><link name="ear"/><link name="jaw"/>
  <joint name="neck" type="revolute"><parent link="base"/><child link="head"/>
    <origin xyz="0 0 0.5"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
  <joint name="ear" type="revolute"><parent link="head"/><child link="ear"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
    <mimic joint="neck" multiplier="2" offset="0.1"/></joint>
  <joint name="jaw" type="prismatic"><parent link="head"/><child link="jaw"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="0.1" effort="1" velocity="1"/></joint>
</robot>
"""
HUMANOID = """\
tfcompose: 1
robot: humanoid
links: {torso: {}, hat: {}}
parts:
  head: {xacro: head.xacro, prefix: r_, parent: torso}
joints:
  hat: {type: continuous, parent: r_head, child: hat, mimic: {joint: r_neck, multiplier: 3}}
"""


@pytest.fixture
def humanoid(tmp_path: Path) -> Callable[[str], Compiled]:
    """Return a function that compiles a robot whose head is xacro, with an overlay."""
    (tmp_path / "head.xacro").write_text(PART)
    (tmp_path / "robot.yaml").write_text(HUMANOID)
    parser = ArgumentParser()
    add_variant(parser)

    def compile_with(overlay: str) -> Compiled:
        (tmp_path / "unit7.yaml").write_text(overlay)
        options = parser.parse_args(["--overlay", str(tmp_path / "unit7.yaml")])
        options.arg_values = {}
        return compile_file(str(tmp_path / "robot.yaml"), options)

    return compile_with


def test_an_overlay_corrects_a_joint_of_a_part(humanoid: Callable[[str], Compiled]) -> None:
    robot = humanoid("joints: {r_neck: {offset: 10 deg}, r_jaw: {offset: 2 mm}}\n").robot
    exact = humanoid("{}\n").robot
    assert robot
    assert exact
    reported = {"r_neck": 0.3, "r_jaw": 0.01}
    positions = {"r_neck": 0.3 + 10 * DEG, "r_jaw": 0.012}
    exact_poses = poses_in_roots(exact, joint_positions(exact, positions))
    for frame, pose in poses_in_roots(robot, joint_positions(robot, reported)).items():
        assert pose.xyz == pytest.approx(exact_poses[frame].xyz, abs=FAR_M), frame
        assert pose.quat_xyzw == pytest.approx(exact_poses[frame].quat_xyzw), frame
    joints = {edge.joint.name: edge.joint for edge in robot.edges if edge.joint}
    neck = joints["r_neck"]
    assert neck.limit
    assert (neck.limit.lower, neck.zero_offset) == pytest.approx((-1 - 10 * DEG, 10 * DEG))
    assert joints["r_ear"].zero_offset == 0


@pytest.mark.parametrize(
    ("joint", "code", "column"),
    [
        ("neck: {offset: 1 deg}", "TF703", 10),
        ("r_neck: {offset: 1 mm}", "TF104", 27),
        ("r_jaw: {offset: 1 deg}", "TF104", 26),
    ],
)
def test_an_offset_of_no_joint_or_with_another_unit_is_reported(
    joint: str, code: str, column: int, humanoid: Callable[[str], Compiled]
) -> None:
    (finding,) = humanoid(f"joints: {{{joint}}}\n").errors
    assert finding.span
    assert (finding.code, Path(finding.span.file).name) == (code, "unit7.yaml")
    assert (finding.span.line, finding.span.column) == (1, column)
