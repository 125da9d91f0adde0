"""A driver that publishes as realsense2_camera does, started by its preset, and guarded."""

import os
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import psutil
import pytest

from tests.support.running_robot import RunningRobot
from tests.support.waiting import TIMEOUT_S, until

pytestmark = pytest.mark.ros

#: What it does by its parameters is from realsense2_camera's tfs.cpp: each enabled stream below
#: the link, its optical frame below that; streams of index 1 once more, as aligned depth; imu
#: below gyro with unite_imu_method. Like tf2's static broadcaster it keeps one transform a child,
#: the one that it was given last. Its values are a unit's own.
STAND_IN = """
import os, signal, sys, threading, time
import rclpy
from rclpy.node import Node
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.ros.node import TFPublisher
rclpy.init(args=sys.argv)
node = Node("camera", automatically_declare_parameters_from_overrides=True)
parameters = {name: node.get_parameter(name).value for name in node._parameters}
streams = {"depth": True, "color": True, "infra1": False, "infra2": False, "gyro": False, "accel": False}
streams = {name: parameters.get("enable_" + name, default) for name, default in streams.items()}
streams |= {name: True for name in os.environ.get("STAND_IN_ALSO", "").split()}
prefix = parameters.get("tf_prefix", "") + parameters.get("camera_name", "camera") + "_"
base = prefix + parameters.get("base_frame_id", "link")
kept = {}
off = dict(word.split(":") for word in os.environ.get("STAND_IN_OFF", "").split())
places = {"color": (0.0, 0.015, 0.0), "infra2": (0.0, -0.05, 0.0)}
places |= dict.fromkeys(["gyro", "accel"], (-0.01174, -0.00552, 0.0051))
def send(parent, child, xyz=(0.0, 0.0, 0.0), optical=False):
    turn = (-0.5, 0.5, -0.5, 0.5) if optical else (0.0, 0.0, 0.0, 1.0)
    xyz = (xyz[0], xyz[1] + float(off.get(child.removeprefix(prefix), 0.0)), xyz[2])
    kept[child] = SentTransform(time.time_ns(), parent, child, xyz, turn)
for name in (stream for stream, enabled in streams.items() if enabled):
    frame, optical = f"{prefix}{name}_frame", f"{prefix}{name}_optical_frame"
    x, y, z = places.get(name, (0.0, 0.0, 0.0))
    own = (x + 0.0004, y - 0.0012, z + 0.0003) if name != "depth" else (x, y, z)
    send(base, frame, own)
    send(frame, optical, optical=True)
    if name == "infra1":
        aligned = f"{prefix}aligned_depth_to_{name}_frame"
        send(base, aligned, own)
        send(aligned, optical, optical=True)
if streams["gyro"] and parameters.get("unite_imu_method", 0) > 0:
    send(f"{prefix}gyro_frame", f"{prefix}imu_frame")
    send(f"{prefix}imu_frame", f"{prefix}imu_optical_frame", optical=True)
if parameters.get("publish_tf", True) or os.environ.get("STAND_IN_IGNORES"):
    publisher = TFPublisher(node, static=True)
    publisher.publish(encode(list(kept.values())))
if "STAND_IN_FORCES" in os.environ:
    node.set_parameters([rclpy.Parameter("publish_tf", value=os.environ["STAND_IN_FORCES"] == "true")])
print("stand-in:", node.get_fully_qualified_name(), parameters.get("serial_no"), len(kept), flush=True)
def spin():
    try:
        rclpy.spin(node)
    except Exception:
        pass
if "STAND_IN_SLEEPS" not in os.environ:
    threading.Thread(target=spin, daemon=True).start()
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGTERM, lambda *_: sys.exit())
try:
    while True:
        time.sleep(0.05)
except KeyboardInterrupt:
    pass
node.destroy_node()
rclpy.try_shutdown()
"""  # noqa: E501 (a text as its reader has it)
ROVER = """
tfcompose: 1
robot: rover
ros: {discovery: localhost}
links: {base_link: {}}
sensors:
  front: {preset: realsense/d435i, parent: base_link, options: {%s}
"""
EVERYTHING = 'streams: [depth, color, infra1, infra2], imu: true, serial: "0042"'


@pytest.fixture
def up(domain: object, tmp_path: Path) -> Iterator[Callable[..., RunningRobot]]:
    """Build and run this robot with the stand-in as its installed driver."""
    assert domain
    program = tmp_path / "ros" / "lib" / "realsense2_camera" / "realsense2_camera_node"
    program.parent.mkdir(parents=True)
    program.write_text(f"#!{sys.executable}\n{STAND_IN}", encoding="utf-8")
    program.chmod(0o755)
    running: list[RunningRobot] = []

    def run(text: str, *words: str, **environment: str) -> RunningRobot:
        (tmp_path / "rover.yaml").write_text(text, encoding="utf-8")
        prefixes = os.pathsep.join(
            filter(None, [str(tmp_path / "ros"), os.environ.get("AMENT_PREFIX_PATH")])
        )
        env = {"AMENT_PREFIX_PATH": prefixes} | environment
        running.append(RunningRobot(tmp_path, "rover.yaml", *words, env=env))
        return running[-1]

    yield run
    for robot in running:
        below = robot.below() if robot.popen.poll() is None else []
        robot.end()
        assert not psutil.wait_procs(below, TIMEOUT_S)[1]


@pytest.mark.parametrize(
    ("options", "environment"),
    [
        (f"{EVERYTHING}}}, tf: driver", {}),
        (f"{EVERYTHING}}}, tf: tfcompose", {}),
        (f"{EVERYTHING}}}, tf: driver", {"STAND_IN_SLEEPS": "1"}),
    ],
    ids=["all", "switched off", "answers nothing"],
)
def test_a_driver_that_does_as_its_preset_says_is_let_alone(
    up: Callable[..., RunningRobot], options: str, environment: dict[str, str]
) -> None:
    robot = up(ROVER % options, "--for", "5", **environment)
    robot.wait()
    assert robot.codes() == []
    assert "tree complete" in robot.text
    if "STAND_IN_SLEEPS" not in environment:
        assert f"stand-in: /front/front{' 0042' if 'serial' in options else ''}" in robot.text


def has_printed(robot: RunningRobot, *words: str) -> bool:
    return all(word in robot.text for word in words)


@pytest.mark.parametrize(
    ("options", "environment", "expected"),
    [
        (
            f"{EVERYTHING}}}, tf: tfcompose",
            {"STAND_IN_IGNORES": "1"},
            {"TF801": ("publish_tf: false", "front (realse")},
        ),
        (  # an infra2 that is 4.5 cm further to the right is that of a D455
            "streams: [depth, infra2]}, tf: driver",
            {"STAND_IN_ALSO": "infra1", "STAND_IN_OFF": "infra2_frame:-0.045"},
            {
                "TF803": ("front_infra1", "sensors.front"),
                "TF828": (
                    "front_infra2_frame",
                    "front_link",
                    " 46.",
                    "xyz 0.0004 -0.0962 0.0003 m",
                    "xyz 0 -0.05 0 m",
                    "sensors: {front: {frames: {front_infra2_frame: {xyz: [0.0004, -0.0962,",
                ),
            },
        ),
        (
            f"{EVERYTHING}}}, tf: tfcompose",
            {"STAND_IN_FORCES": "true"},
            {"TF829": ("publish_tf: true", "publish_tf: false", "front (realsense/d435i)")},
        ),
    ],
    ids=["ignores its switch", "another stream and a nominal frame", "forces"],
)
def test_a_driver_that_does_otherwise_is_named_once(
    up: Callable[..., RunningRobot],
    options: str,
    environment: dict[str, str],
    expected: dict[str, tuple[str, ...]],
) -> None:
    robot = up(ROVER % options, **environment)
    for code, names in expected.items():
        assert until(partial(has_printed, robot, code, "/front/front", *names)), robot.text
    robot.end()
    codes = robot.codes()
    assert all(codes.count(code) == 1 for code in expected), codes
