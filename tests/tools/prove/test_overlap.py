"""Two lidars of a simulated rover that see the same room, with mounts that do not fit."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.simulated_rover import MOUNTS, Measured, Mount, simulate
from tfcompose.foundation.geometry import Pose
from tfcompose.tools.prove.clouds import Cloud
from tfcompose.tools.prove.messages import Odometry
from tfcompose.tools.prove.overlap import (
    Residual,
    judge_overlap,
    pairs_of,
    points_in_base,
    residual_of,
)
from tfcompose.tools.prove.travel import BasePath, track_of
from tfcompose.tools.prove.verdict import CheckResult

#: Half a minute of a simulated room.
pytestmark = pytest.mark.slow
LIMITS = (0.05, math.radians(3))


@pytest.fixture(scope="module")
def driven() -> Measured:
    return simulate(seed=2, seconds=6)


def clouds_of(measured: Measured, name: str) -> list[Cloud]:
    generator = np.random.default_rng(1)
    return [
        Cloud(at_s, generator.permutation(points)[:1200]) for at_s, points in measured.clouds[name]
    ]


def pose_of(mount: Mount) -> Pose:
    x, y, z, w = map(float, mount.rotation.as_quat())
    return Pose(mount.xyz, (x, y, z, w))


def residual(
    pairs: Sequence[tuple[Cloud, Cloud]],
    rear: Mount = MOUNTS["rear"],
    path: BasePath | None = None,
) -> Residual | str:
    poses = (pose_of(MOUNTS["front"]), pose_of(rear))
    return residual_of([points_in_base(pair, poses, path) for pair in pairs])


def judge(measured: Residual | str, rear: Mount = MOUNTS["rear"]) -> CheckResult:
    return judge_overlap(measured, ("front", "rear"), np.array(rear.xyz), *LIMITS)


def test_true_mounts_agree_in_millimetres(driven: Measured) -> None:
    result = judge(residual(pairs_of(clouds_of(driven, "front"), clouds_of(driven, "rear"), None)))
    assert (result.answer, result.code) == ("agrees", "")
    assert result.values["off_m"] < 0.02
    assert result.values["off_rad"] < math.radians(0.5)


def test_another_mount_differs_by_the_motion_that_fits(driven: Measured) -> None:
    x, y, z = MOUNTS["rear"].xyz
    rear = Mount((x + 0.05, y + 0.3, z), (0.0, 0.0, 184.0))
    pairs = pairs_of(clouds_of(driven, "front"), clouds_of(driven, "rear"), None)
    measured = residual(pairs, rear)
    assert judge(measured, rear).code == "TF654"
    assert not isinstance(measured, str)
    assert measured.move(np.array(rear.xyz)) == pytest.approx(MOUNTS["rear"].xyz, abs=0.02)
    back = Rotation.from_matrix(measured.matrix) * rear.rotation
    assert (back * MOUNTS["rear"].rotation.inv()).magnitude() < math.radians(0.5)


def test_the_base_moves_between_clouds_at_different_times(driven: Measured) -> None:
    """The rover drives at 0.6 m/s, so that it moves by 120 mm between them."""
    front, rear = clouds_of(driven, "front"), clouds_of(driven, "rear")
    pairs = list(zip(front[15:25], rear[16:26], strict=True))
    rows = np.array(driven.odometry)
    path = track_of(Odometry(rows[:, 0], rows[:, 1:3], rows[:, 3]))
    assert judge(residual(pairs, path=path)).answer == "agrees"
    differs = judge(residual(pairs))
    assert differs.values["off_m"] == pytest.approx(0.12, abs=0.02)


def test_clouds_at_other_times_or_of_the_floor_alone_tell_nothing(driven: Measured) -> None:
    front, rear = clouds_of(driven, "front"), clouds_of(driven, "rear")
    later = [Cloud(cloud.stamp_s + 0.05, cloud.points) for cloud in rear]
    assert pairs_of(front, later, None) == []
    assert pairs_of([], rear, None) == []
    assert judge(residual([])).answer == "cannot tell"
    empty = [(Cloud(0.0, np.zeros((5, 3))), cloud) for cloud in rear]
    assert judge(residual(empty)).answer == "cannot tell"
    edges = [(Cloud(0.0, np.outer(np.arange(99.0), [1.0, 0, 0])), cloud) for cloud in rear]
    assert judge(residual(edges)).answer == "cannot tell"
    floors = [
        (
            Cloud(0.0, a.points[a.points[:, 2] < -0.55]),
            Cloud(0.0, b.points[b.points[:, 2] < -0.45]),
        )
        for a, b in pairs_of(front, rear, None)
    ]
    assert judge(residual(floors)).answer == "cannot tell"
