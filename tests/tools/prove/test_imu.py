"""Checks of an IMU that MuJoCo simulates, with faults by SciPy's rotations."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tests.support.simulated_rover import MOUNTS, Measured, simulate
from tfcompose.tools.prove.imu import ImuCheck
from tfcompose.tools.prove.messages import Imu, Odometry
from tfcompose.tools.prove.motion import means, motion_of
from tfcompose.tools.prove.verdict import CheckResult  # noqa: TC001 (named in annotations)

Array = NDArray[np.float64]
LIMIT_RAD = math.radians(3)


@pytest.fixture(scope="module")
def driven() -> Measured:
    return simulate(seed=3, cloud_rate=0)


@pytest.fixture(scope="module")
def at_rest() -> Measured:
    return simulate(seed=3, cloud_rate=0, moves=False, seconds=5)


@dataclass(frozen=True)
class Fault:
    """A fault in what the driver sends: a rotation of the device, and factors on its axes."""

    rpy_deg: tuple[float, float, float] = (0, 0, 0)
    force: tuple[float, float, float] = (1, 1, 1)
    rate: tuple[float, float, float] = (1, 1, 1)
    rate_axes: tuple[int, int, int] = (0, 1, 2)

    def judge(
        self, measured: Measured, *, with_odometry: bool = True, declared: Rotation | None = None
    ) -> dict[str, CheckResult]:
        """Return the judgements by check on the faulty measurements."""
        device = Rotation.from_euler("xyz", self.rpy_deg, degrees=True).inv().as_matrix()
        times, forces, rates = (np.array(column) for column in zip(*measured.imu, strict=True))
        imu = Imu(
            times,
            forces @ device.T * self.force,
            (rates @ device.T)[:, self.rate_axes] * self.rate,
        )
        rows = np.array(measured.odometry)
        odometry = Odometry(rows[:, 0], rows[:, 1:3], rows[:, 3])
        motion = motion_of(imu, odometry if with_odometry else None, np.array(MOUNTS["imu"].xyz))
        matrix = (declared or Rotation.identity()).as_matrix()
        return {
            judgement.check: judgement for judgement in ImuCheck(motion, matrix, LIMIT_RAD).judge()
        }


#: The device's true rotation in a base that declares none.
MOUNTED = {
    "upside down about x": (180, 0, 0),
    "upside down about y": (0, 180, 0),
    "y up": (90, 0, 0),
    "z forward": (0, -90, 0),
    "x up": (0, 90, 0),
    "to the left": (0, 0, 90),
    "backward": (0, 0, 180),
}
#: What no mount explains: the check that differs.
DRIVERS = {
    "yaw rate of the wrong sign": (Fault(rate=(1, 1, -1)), "yaw rate"),
    "degrees per second": (Fault(rate=(180 / math.pi,) * 3), "yaw rate"),
    "radians twice": (Fault(rate=(math.pi / 180,) * 3), "yaw rate"),
    "no rates": (Fault(rate=(0, 0, 0)), "yaw rate"),
    "swapped rates": (Fault(rate_axes=(2, 0, 1)), "yaw rate"),
    "gravity instead of the force against it": (Fault(force=(-1, -1, -1)), "gravity"),
    "in g": (Fault(force=(1 / 9.80665,) * 3), "gravity"),
    "without gravity": (Fault(force=(0.02, 0.02, 0.02)), "gravity"),
}


@pytest.mark.parametrize("name", MOUNTED)
def test_another_mount_differs_with_the_rotation_that_fits(name: str, driven: Measured) -> None:
    judgements = Fault(MOUNTED[name]).judge(driven)
    differing = [judgement for judgement in judgements.values() if judgement.answer == "differs"]
    assert [judgement.code for judgement in differing] == ["TF650"]
    fitting = differing[0].base_from_frame_xyzw
    assert fitting is not None
    true = Rotation.from_euler("xyz", MOUNTED[name], degrees=True)
    assert (Rotation.from_quat(fitting) * true.inv()).magnitude() < math.radians(0.5)
    declared = Fault(MOUNTED[name]).judge(driven, declared=Rotation.from_quat(fitting))
    assert {judgement.answer for judgement in declared.values()} == {"agrees"}


def test_a_tilt_differs_and_keeps_the_heading(driven: Measured) -> None:
    judgement = Fault((0, 8, 0)).judge(driven)["gravity"]
    assert (judgement.answer, judgement.code) == ("differs", "TF650")
    assert judgement.base_from_frame_xyzw is not None
    roll, pitch, yaw = Rotation.from_quat(judgement.base_from_frame_xyzw).as_euler(
        "xyz", degrees=True
    )
    assert (abs(roll), abs(yaw)) < (1.5, 0.5)
    assert pitch == pytest.approx(8, abs=1.5), "the accelerometer's bias is up to 0.6 degrees"


@pytest.mark.parametrize("name", DRIVERS)
def test_what_no_mount_explains_is_the_drivers(name: str, driven: Measured) -> None:
    fault, check = DRIVERS[name]
    judgements = fault.judge(driven)
    differing = {
        judgement.check for judgement in judgements.values() if judgement.answer == "differs"
    }
    assert differing == {check}
    assert (judgements[check].code, judgements[check].base_from_frame_xyzw) == ("TF651", None)


def test_without_motion_only_gravity_is_known(at_rest: Measured) -> None:
    judgements = Fault().judge(at_rest)
    assert {name: judgement.answer for name, judgement in judgements.items()} == {
        "gravity": "agrees",
        "yaw rate": "cannot tell",
        "heading": "cannot tell",
    }
    assert Fault().judge(at_rest, with_odometry=False)["yaw rate"].answer == "cannot tell"


def test_upside_down_at_rest_has_no_fit_for_the_sign_may_be_wrong(at_rest: Measured) -> None:
    judgement = Fault((180, 0, 0)).judge(at_rest)["gravity"]
    assert (judgement.answer, judgement.base_from_frame_xyzw) == ("differs", None)
    sideways = Fault((90, 0, 0)).judge(at_rest)["gravity"]
    assert sideways.base_from_frame_xyzw is not None


def test_a_handful_of_messages_tells_nothing() -> None:
    few = np.zeros((3, 3))
    motion = motion_of(Imu(np.arange(3.0), few, few), None, np.zeros(3))
    answers = {each.answer for each in ImuCheck(motion, np.identity(3), LIMIT_RAD).judge()}
    assert answers == {"cannot tell"}


def test_means_over_intervals_are_areas_below_the_lines_between_samples() -> None:
    stamps = np.array([0.0, 0.2, 0.5, 1.0])
    values = stamps[:, None] * [2.0, -1.0]
    expected = [[0.5, -0.25], [1.5, -0.75]]
    assert np.allclose(means(stamps, values, np.array([0.0, 0.5, 1.0])), expected)


def test_a_heading_without_accelerations_is_not_measured(at_rest: Measured) -> None:
    odometry = at_rest.odometry
    rotating = Measured(
        [
            (time_s, force, rate + np.array([0, 0, math.sin(time_s)]))
            for time_s, force, rate in at_rest.imu
        ],
        [(time_s, 0.0, 0.0, math.sin(time_s)) for time_s, *_ in odometry],
    )
    judgements = Fault().judge(rotating)
    assert {name: result.answer for name, result in judgements.items()} == {
        "gravity": "agrees",
        "yaw rate": "agrees",
        "heading": "cannot tell",
    }
    flipped = Fault((180, 0, 0)).judge(rotating)["gravity"]
    assert flipped.base_from_frame_xyzw is not None
    assert "heading is not measured" in flipped.help
