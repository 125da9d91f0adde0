"""Lidars and a depth camera of a simulated rover, against mounts that are wrong.

MuJoCo casts the rays; SciPy rotates the mounts.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.simulated_rover import (
    HEIGHT,
    MOUNTS,
    OPTICAL,
    Measured,
    Mount,
    simulate,
)
from tfcompose.tools.prove.clouds import Cloud
from tfcompose.tools.prove.messages import Odometry
from tfcompose.tools.prove.ranging import RangingCheck
from tfcompose.tools.prove.travel import track_of
from tfcompose.tools.prove.verdict import CheckResult

LIMITS = (math.radians(3), 0.03)


@pytest.fixture(scope="module")
def driven() -> Measured:
    return simulate(seed=2, seconds=20)


@pytest.fixture(scope="module")
def at_rest() -> Measured:
    return simulate(seed=2, seconds=4, moves=False)


def judge(  # noqa: PLR0913 (a measurement, and what the file declares)
    measured: Measured,
    name: str,
    declared: Mount | None = None,
    *,
    transform: Callable[[Any], Any] = lambda points: points,
    is_scan: bool = False,
    ground: float | None = -HEIGHT,
) -> dict[str, CheckResult]:
    """Return the answers about a sensor in the mount that the file declares."""
    mount = declared or MOUNTS[name]
    rotation = mount.rotation * OPTICAL if name == "camera" else mount.rotation
    axes = OPTICAL.as_matrix() if name == "camera" else np.identity(3)
    generator = np.random.default_rng(1)
    clouds = [
        Cloud(at_s, transform(generator.permutation(points)[:1500]) @ axes, is_scan)
        for at_s, points in measured.clouds[name]
    ]
    rows = np.array(measured.odometry)
    track = track_of(Odometry(rows[:, 0], rows[:, 1:3], rows[:, 3]))
    check = RangingCheck(clouds, track, rotation.as_matrix(), np.array(mount.xyz), ground, *LIMITS)
    return {result.check: result for result in check.judge()}


def differing(results: dict[str, CheckResult]) -> dict[str, str]:
    return {name: each.code for name, each in results.items() if each.answer == "differs"}


@pytest.mark.parametrize("name", ["front", "rear", "camera"])
def test_true_mounts_agree(name: str, driven: Measured) -> None:
    results = judge(driven, name)
    assert not differing(results)
    assert results["floor"].answer == results["height"].answer == "agrees"
    if name != "camera":
        assert results["forward"].answer == results["left and right"].answer == "agrees"


#: The declared mount of the front lidar, and the check that differs. Its true one is not rotated.
FAULTS = {
    "upside down": ((180, 0, 0), "floor"),
    "pitch": ((0, 5, 0), "floor"),
    "to the left": ((0, 0, 90), "forward"),
    "to the right": ((0, 0, -90), "forward"),
    "backward": ((0, 0, 180), "forward"),
    "yaw": ((0, 0, 12), "forward"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_another_rotation_differs_with_the_one_that_fits(name: str, driven: Measured) -> None:
    angles, check = FAULTS[name]
    results = judge(driven, "front", Mount(MOUNTS["front"].xyz, angles))
    assert differing(results) == {check: "TF650"}
    fitting = results[check].base_from_frame_xyzw
    assert fitting is not None
    assert Rotation.from_quat(fitting).magnitude() < math.radians(0.5)


def test_a_height_differs_with_the_position_that_fits(driven: Measured) -> None:
    for name in ("front", "camera"):
        x, y, z = MOUNTS[name].xyz
        results = judge(driven, name, Mount((x, y, z - 0.04), MOUNTS[name].rpy_deg))
        assert differing(results) == {"height": "TF653"}
        fitting = results["height"].base_from_frame_xyz
        assert fitting == pytest.approx((x, y, z), abs=0.005)


def test_a_camera_pitched_up_instead_of_down_differs(driven: Measured) -> None:
    results = judge(driven, "camera", Mount(MOUNTS["camera"].xyz, (0, -20, 0)))
    fitting = results["floor"].base_from_frame_xyzw
    assert fitting is not None
    true = MOUNTS["camera"].rotation * OPTICAL
    assert (Rotation.from_quat(fitting) * true.inv()).magnitude() < math.radians(0.5)


def test_swapped_sides_are_the_drivers_fault(driven: Measured) -> None:
    results = judge(driven, "front", transform=lambda points: points * [1, -1, 1])
    assert differing(results) == {"left and right": "TF651"}


def test_a_scan_that_is_mirrored_is_upside_down(driven: Measured) -> None:
    def level(points: Any) -> Any:
        return points[np.abs(points[:, 2]) < 0.3] * [1, -1, 0]

    results = judge(driven, "front", transform=level, is_scan=True)
    assert differing(results) == {"left and right": "TF650"}
    fitting = results["left and right"].base_from_frame_xyzw
    assert fitting is not None
    assert (Rotation.from_quat(fitting) * Rotation.from_rotvec([math.pi, 0, 0])).magnitude() < 0.01


def test_at_rest_only_the_floor_is_known(at_rest: Measured) -> None:
    answers = {name: each.answer for name, each in judge(at_rest, "front").items()}
    assert answers == {
        "floor": "agrees",
        "height": "agrees",
        "forward": "cannot tell",
        "left and right": "cannot tell",
    }
    upside_down = judge(at_rest, "front", Mount(MOUNTS["front"].xyz, (180, 0, 0)))
    assert upside_down["floor"].answer == "cannot tell", "it could be a ceiling"


def test_a_uniform_corridor_shows_no_heading(driven: Measured) -> None:
    def corridor(points: Any) -> Any:
        count = np.linspace(-6, 6, len(points))
        sides = np.where(np.arange(len(points)) % 2, 1.5, -1.5)
        return np.column_stack([count, sides, np.zeros(len(points))])

    results = judge(driven, "front", transform=corridor, is_scan=True)
    assert {each.answer for each in results.values()} == {"cannot tell"}


def test_without_a_declared_ground_no_height_is_judged(driven: Measured) -> None:
    results = judge(driven, "front", Mount((0.3, 0.2, 9.0)), ground=None)
    assert (results["height"].answer, results["floor"].answer) == ("cannot tell", "agrees")
