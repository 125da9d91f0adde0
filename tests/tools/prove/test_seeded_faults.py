"""Fifteen seeded faults of a simulated rover, and clean runs with other noise and routes.

Messages are those of a recording; the robot file is compiled for each fault. With
TFCOMPOSE_TEST_CLEAN_RUNS=30 there are thirty clean runs, which take minutes.
"""

import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.bags import STORE
from tests.support.simulated_rover import (
    FRAMES,
    HEIGHT,
    MOUNTS,
    Measured,
    Mount,
    messages_of,
    robot_file,
    simulate,
)
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.tools.prove.proof import Proof
from tfcompose.tools.prove.recording import Measurements
from tfcompose.tools.prove.verdict import SensorVerdict

CLEAN_RUNS = int(os.environ.get("TFCOMPOSE_TEST_CLEAN_RUNS", "3"))
pytestmark = pytest.mark.slow

#: A fault is found within these.
WITHIN_RAD, WITHIN_M = math.radians(0.5), 0.02


def prove(
    measured: Measured, text: str, frames: dict[str, str] = FRAMES
) -> tuple[list[SensorVerdict], float]:
    """Return all answers, and the seconds of computing that they took."""
    compiled = compile_robot(text, "robot.yaml", library())
    assert compiled.robot is not None
    assert not compiled.errors, compiled.errors
    sent = [
        (topic, type_, bytes(STORE.serialize_cdr(message, type_)))
        for topic, _, type_, message in messages_of(measured, frames)
    ]
    begin = time.process_time()
    measurements = Measurements()
    for topic, type_, data in sent:
        measurements.take(topic, type_, data)
    texts = {"robot.yaml": text}
    proof = Proof(compiled.robot, compiled.sources[0], texts, measurements)
    return proof.verdicts(), time.process_time() - begin


@pytest.fixture(scope="module")
def driven() -> Measured:
    return simulate(seed=11)


def with_imu(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Measured], Measured]:
    """Return what changes the rates of an IMU."""
    return lambda measured: replace(
        measured, imu=[(time_s, force, change(rates)) for time_s, force, rates in measured.imu]
    )


def mirrored(measured: Measured) -> Measured:
    front = [(time_s, points * [1, -1, 1]) for time_s, points in measured.clouds["front"]]
    return replace(measured, clouds=measured.clouds | {"front": front})


def inverse(mount: Mount) -> Mount:
    back = mount.rotation.inv()
    x, y, z = -back.apply(mount.xyz)
    roll, pitch, yaw = back.as_euler("xyz", degrees=True)
    return Mount((float(x), float(y), float(z)), (float(roll), float(pitch), float(yaw)))


def declare(name: str, rpy_deg: tuple[float, float, float], z: float = 0.0) -> str:
    """Return a robot file with another mount of a sensor."""
    x, y, height = MOUNTS[name].xyz
    return robot_file(MOUNTS | {name: Mount((x, y, height + z), rpy_deg)})


@dataclass(frozen=True)
class Fault:
    """A fault in the robot file, in the data, or in the frames of messages, and its findings."""

    #: The sensors, checks and codes of the findings.
    findings: set[tuple[str, str, str]]
    text: str = robot_file()
    data: Callable[[Measured], Measured] = lambda measured: measured
    frames: tuple[tuple[str, str], ...] = ()


#: NED: x forward, y right, z down.
NED = (180.0, 0.0, 0.0)
SWAPPED = (("front", "rear_link"), ("rear", "front_link"))
FAULTS = {
    "IMU upside down": Fault({("imu", "gravity", "TF650")}, declare("imu", (180, 0, 0))),
    "sign of the yaw rate": Fault(
        {("imu", "yaw rate", "TF651")}, data=with_imu(lambda rates: rates * [1, 1, -1])
    ),
    "IMU with y up": Fault({("imu", "gravity", "TF650")}, declare("imu", (90, 0, 0))),
    "NED": Fault({("imu", "gravity", "TF650")}, declare("imu", NED)),
    "lidar upside down": Fault({("front", "floor", "TF650")}, declare("front", (180, 0, 0))),
    "yaw of 90 degrees": Fault({("front", "forward", "TF650")}, declare("front", (0, 0, 90))),
    "pitch of 5 degrees": Fault({("rear", "floor", "TF650")}, declare("rear", (0, 5, 180))),
    "height of 40 mm": Fault({("front", "height", "TF653")}, declare("front", (0, 0, 0), -0.04)),
    "left and right": Fault({("front", "left and right", "TF651")}, data=mirrored),
    "a mount on the other side": Fault(
        {("rear", "overlap", "TF654")},
        robot_file(MOUNTS | {"rear": replace(MOUNTS["rear"], xyz=(-0.25, 0.2, 0.3))}),
    ),
    "degrees for radians": Fault({("imu", "yaw rate", "TF651")}, data=with_imu(np.degrees)),
    "inverse calibration": Fault(
        {("camera_optical_frame", "floor", "TF650"), ("camera_optical_frame", "height", "TF653")},
        robot_file(MOUNTS | {"camera": inverse(MOUNTS["camera"])}),
    ),
    "serial numbers": Fault(
        {
            (name, check, code)
            for name in ("front", "rear")
            for check, code in (("height", "TF653"), ("forward", "TF650"))
        },
        frames=SWAPPED,
    ),
    "frame of the body": Fault(
        {("camera_link", "floor", "TF650")}, frames=(("camera", "camera_link"),)
    ),
    "wrong parent": Fault(
        {("camera_optical_frame", "height", "TF653")}, robot_file(parent="front_link")
    ),
}


def differing(verdicts: list[SensorVerdict]) -> set[tuple[str, str, str]]:
    return {
        (verdict.sensor, verdict.judgement.check, verdict.judgement.code)
        for verdict in verdicts
        if verdict.judgement.answer == "differs"
    }


@pytest.mark.parametrize("name", FAULTS)
def test_a_seeded_fault_differs_at_its_sensor_only(name: str, driven: Measured) -> None:
    fault = FAULTS[name]
    verdicts, _ = prove(fault.data(driven), fault.text, FRAMES | dict(fault.frames))
    assert differing(verdicts) == fault.findings
    if fault.frames:
        return
    for verdict in verdicts:
        judgement = verdict.judgement
        if judgement.base_from_frame_xyzw is not None:
            sensor = verdict.sensor.split("_")[0]
            body = Rotation.from_quat(judgement.base_from_frame_xyzw)
            if sensor == "camera":
                body *= Rotation.from_euler("xyz", [-90, 0, -90], degrees=True).inv()
            assert (body * MOUNTS[sensor].rotation.inv()).magnitude() < WITHIN_RAD
        if judgement.base_from_frame_xyz is not None:
            height = MOUNTS[verdict.sensor.split("_")[0]].xyz[2] + HEIGHT
            assert judgement.base_from_frame_xyz[2] == pytest.approx(height, abs=WITHIN_M)


@pytest.mark.parametrize("seed", range(100, 100 + CLEAN_RUNS))
def test_a_clean_run_has_no_finding(seed: int) -> None:
    verdicts, _ = prove(simulate(seed=seed), robot_file())
    assert differing(verdicts) == set()
    answers = [each.judgement.answer for each in verdicts]
    assert answers.count("agrees") >= 14, "nearly all checks can tell"


@pytest.mark.alone
def test_half_a_minute_is_judged_within_ten_seconds_of_a_core(driven: Measured) -> None:
    assert prove(driven, robot_file())[1] < 10


def test_at_rest_checks_that_need_motion_cannot_tell() -> None:
    verdicts, _ = prove(simulate(seed=12, moves=False, seconds=6), robot_file())
    moving = {"yaw rate", "heading", "forward", "left and right"}
    answers = {
        (each.sensor, each.judgement.check): each.judgement.answer
        for each in verdicts
        if each.judgement.check in moving
    }
    assert set(answers.values()) == {"cannot tell"}
    assert differing(verdicts) == set()
