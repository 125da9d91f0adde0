"""Every preset that comes with tfcompose, with every variant.

One tree, right axes, a driver that can be told.
"""

import json
import math
import re
from functools import cache
from itertools import product
from typing import Any

import pytest

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.resolve.presets import fill_name
from tfcompose.foundation.geometry import angle_between, rotate
from tfcompose.model.robot import Robot, is_optical

#: One worker makes the robots, for all tests.
pytestmark = pytest.mark.xdist_group("presets")
KNOWN = library()
NAMES = KNOWN.names
HEAD = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"
#: A frame in what is to be written for values that nobody knows.
REQUESTED = re.compile(r"(\w+): \{(?:xyz|rpy)")
OPTICAL_XYZW = (-0.5, 0.5, -0.5, 0.5)


def variants(name: str) -> list[dict[str, str]]:
    options = KNOWN.get(name).options
    choices = {
        key: list(option.variants) for key, option in options.items() if option.type == "choice"
    }
    return [dict(zip(choices, values, strict=True)) for values in product(*choices.values())]


def full(name: str) -> dict[str, Any]:
    """Return options that give the sensor all the frames it can have."""
    options = KNOWN.get(name).options
    sets = {key: list(option.values) for key, option in options.items() if option.type == "set"}
    return sets | {key: True for key, option in options.items() if option.type == "bool"}


def spec(name: str, options: dict[str, Any], tf: str, frames: dict[str, Any]) -> str:
    output = {"preset": name, "parent": "base_link", "options": options, "frames": frames} | (
        {"tf": tf} if tf else {}
    )
    return HEAD + "sensors: " + json.dumps({"s": output}) + "\n"


@cache
def robots(name: str) -> list[tuple[str, dict[str, Any], Robot]]:
    """Return the robot with this sensor, for each variant and each publisher it can have."""
    made = []
    driver = KNOWN.get(name).driver
    for variant in variants(name):
        options = full(name) | variant
        for tf in ("", "driver", "tfcompose"):
            plain = compile_robot(spec(name, options, tf, {}), "r.yaml", KNOWN)
            requested = [
                frame
                for finding in plain.findings
                if finding.code == "TF605"
                for frame in REQUESTED.findall(finding.help)
            ]
            frames = {frame: {"xyz": [0.1, 0.2, 0.3], "rpy": [0, 0, 0]} for frame in requested}
            done = compile_robot(spec(name, options, tf, frames), "r.yaml", KNOWN)
            assert done.robot
            can_all = driver is not None and (driver.off is not None or tf != "tfcompose")
            inside = any(sensor.driver_frames for sensor in done.robot.sensors)
            if not tf or (can_all and inside):
                assert not done.errors, (tf, options, done.errors)
                made.append((tf, options, done.robot))
            else:
                assert {finding.code for finding in done.errors} <= {"TF604"}
    return made


@pytest.mark.parametrize("name", NAMES)
def test_its_frames_are_one_tree_below_its_mount(name: str) -> None:
    for _tf, _options, robot in robots(name):
        children = [edge.child for edge in robot.edges]
        assert robot.roots() == ["base_link"]
        assert len(children) == len(set(children)) == len(robot.frames) - 1
        mount = robot.sensors[0].mount
        assert [edge.child for edge in robot.edges if edge.parent == "base_link"] == [mount]


@pytest.mark.parametrize("name", [name for name in NAMES if name != "realsense/t265"])
def test_its_optical_frames_have_z_forward_x_right_and_y_down(name: str) -> None:
    for _tf, _options, robot in robots(name):
        for edge in robot.edges:
            if not is_optical(edge.child) or is_optical(edge.parent):
                continue
            assert angle_between(edge.pose.quat_xyzw, OPTICAL_XYZW) < 1e-9
            for axis, expected in (
                ((0, 0, 1), (1, 0, 0)),
                ((1, 0, 0), (0, -1, 0)),
                ((0, 1, 0), (0, 0, -1)),
            ):
                assert math.dist(rotate(edge.pose.quat_xyzw, axis), expected) < 1e-9, edge.name
        cameras = {"camera", "stereo", "rgbd"}
        if KNOWN.get(name).kind in cameras and name != "microsoft/azure-kinect":
            assert any(map(is_optical, robot.frames))


def test_the_optical_frames_of_a_t265_have_x_right_y_up_and_z_backward() -> None:
    for _tf, _options, robot in robots("realsense/t265"):
        for edge in robot.edges:
            if is_optical(edge.child):
                for axis, expected in (
                    ((1, 0, 0), (0, -1, 0)),
                    ((0, 1, 0), (0, 0, 1)),
                    ((0, 0, 1), (-1, 0, 0)),
                ):
                    assert math.dist(rotate(edge.pose.quat_xyzw, axis), expected) < 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_what_stamps_its_messages_is_a_frame_of_the_robot(name: str) -> None:
    for tf, options, robot in robots(name):
        preset = KNOWN.get(name, {key: options[key] for key in (variants(name) or [{}])[0]})
        for topic, output in preset.topics.items():
            stamped = fill_name(output.frame, "s", preset.words)
            assert output.hard_coded is (stamped not in robot.frames), (tf, topic, stamped)


@pytest.mark.parametrize("name", NAMES)
def test_it_says_where_it_is_from(name: str) -> None:
    preset = KNOWN.get(name)
    assert preset.source or name.startswith("generic/")
    assert preset.about
    assert preset.about == preset.about.strip(". ")
