"""``expect: {like: golden.mcap}``: a tree against a recording of how it was."""

from collections.abc import Iterable
from math import cos, inf, nan, radians, sin
from pathlib import Path

import pytest

from tests.support.bags import UP, Sent, write_bag
from tests.support.cli import tfcompose_in
from tfcompose.foundation.geometry import Offset, Pose
from tfcompose.tools.treetest.golden import EdgePath

ROBOT = """\
tfcompose: 1
robot: cart
frames:
  odom: {}
  base_link: {parent: odom, owner: drive}
  laser: {parent: base_link, xyz: [0.24, 0, 0.3]}
processes:
  drive: {external: true, node: drive}
"""
LASER: Sent = ("/tf_static", 0.0, "base_link", "laser", 0.0, (0.24, 0.0, 0.3), UP)


def circle(
    begin_s: float = 0.0, end_s: float = 4.0, *, rate: float = 20.0, radius: float = 1.0
) -> list[Sent]:
    """The base drives on a circle: 4 cm between two samples at 20 Hz, and 5 mm at 160 Hz."""
    sent: list[Sent] = []
    for index in range(round((end_s - begin_s) * rate)):
        at_s = begin_s + index / rate
        angle = 0.8 * at_s
        xyz = (radius * cos(angle), radius * sin(angle), 0.0)
        quat = (0.0, 0.0, sin(angle / 2), cos(angle / 2))
        sent.append(("/tf", at_s + 0.002, "odom", "base_link", at_s, xyz, quat))
    return sent


GOLDEN = [LASER, *circle()]


def moved(xyz: tuple[float, float, float], topic: str = "/tf_static", at_s: float = 0.0) -> Sent:
    return (topic, at_s, "base_link", "laser", at_s, xyz, UP)


def compare(folder: Path, sent: Iterable[Sent], within: str = "[2 mm, 0.1 deg]") -> list[str]:
    """Return lines and columns of the findings, with their messages."""
    (folder / "robot.yaml").write_text(ROBOT, "utf-8")
    write_bag(folder / "golden", GOLDEN)
    write_bag(folder / "bag", sent)
    (folder / "cart.test.yaml").write_text(
        "robot: robot.yaml\ncases:\n  - name: drives\n    bag: bag\n    expect:\n"
        f"      like: golden\n      within: {within}\n",
        "utf-8",
    )
    done = tfcompose_in(folder, "test")
    heads = [line for line in done.stdout.splitlines() if "error[TF931]" in line]
    assert done.returncode == bool(heads), done.stdout + done.stderr
    return heads


@pytest.mark.parametrize(
    "sent",
    [
        GOLDEN,
        [LASER, *circle(0.5, 3.0)],
        [LASER, *circle(0.5, 3.0, rate=160.0)],
        [LASER, *circle(1.0, 3.5, rate=7.0)],
        [moved((0.241, 0.0, 0.3)), *circle()],
        [moved((0.9, 0.0, 0.3)), moved((0.24, 0.0, 0.3), at_s=0.5), *circle()],
    ],
    ids=["itself", "a part", "more often", "less often", "within", "the newest pose"],
)
def test_a_tree_on_the_recorded_poses_and_paths_passes(sent: list[Sent], tmp_path: Path) -> None:
    assert not compare(tmp_path, sent)


@pytest.mark.parametrize(
    ("sent", "texts"),
    [
        (circle(), ["base_link → laser"]),
        ([LASER], ["odom → base_link"]),
        (
            [*GOLDEN, ("/tf", 1.0, "laser", "tag", 1.0, (0.0, 0.0, 0.0), UP)],
            ["laser → tag", "1.0"],
        ),
        ([moved((0.24, 0.003, 0.3)), *circle()], ["base_link → laser", "3 mm"]),
        ([*GOLDEN, moved((0.24, 0.0, 0.4), at_s=2.0)], ["base_link → laser", "100 mm", "2.0"]),
        ([moved((0.24, 0.0, 0.3), "/tf"), *circle()], ["base_link → laser", "moving"]),
        ([LASER, *circle(radius=1.01)], ["odom → base_link", "mm"]),
        ([LASER, *circle(3.0, 5.0)], ["odom → base_link", "4.0"]),
    ],
    ids=["no laser", "no base", "more", "moved", "moves", "on /tf", "path", "farther"],
)
def test_what_is_not_as_recorded_is_named(
    sent: list[Sent], texts: list[str], tmp_path: Path
) -> None:
    (head,) = compare(tmp_path, sent)
    assert head.startswith("cart.test.yaml:6:13: "), head
    for text in texts:
        assert text in head


def test_within_is_the_limit(tmp_path: Path) -> None:
    sent = [moved((0.24, 0.003, 0.3)), *circle(radius=1.003)]
    assert not compare(tmp_path, sent, "4 mm")
    (tmp_path / "cart.test.yaml").write_text(
        (tmp_path / "cart.test.yaml").read_text("utf-8").replace("4 mm", "2.9 mm"), "utf-8"
    )
    assert tfcompose_in(tmp_path, "test").stdout.count("error[TF931]") == 2


@pytest.mark.parametrize(
    ("expect", "expected"),
    [
        ("{like: none.mcap}", "5:20: error[TF907]"),
        ("{within: 2 mm, complete: 3 s}", "5:22: error[TF106]"),
    ],
)
def test_a_golden_recording_that_is_not_there_is_refused(
    expect: str, expected: str, tmp_path: Path
) -> None:
    compare(tmp_path, GOLDEN)
    (tmp_path / "cart.test.yaml").write_text(
        f"robot: robot.yaml\ncases:\n  - name: drives\n    bag: bag\n    expect: {expect}\n",
        "utf-8",
    )
    done = tfcompose_in(tmp_path, "test")
    assert done.returncode == 2
    assert f"cart.test.yaml:{expected}" in done.stderr, done.stderr


def turned(degrees: float, x: float = 0.0) -> Pose:
    half = radians(degrees) / 2
    return Pose((x, 0.0, 0.0), (0.0, 0.0, sin(half), cos(half)))


@pytest.mark.parametrize(
    ("path", "pose", "xyz_m", "degrees"),
    [
        ([turned(0), turned(10, 3e-6)], turned(5, -2e-6), 4e-6, 0.0),
        ([turned(0, 2e-6), turned(10)], turned(7, 9e-6), 9e-6, 0.0),
        ([turned(0), turned(10)], turned(-1), 0.0, 1.0),
        ([turned(0), turned(10), turned(0)], turned(11), 0.0, 1.0),
        ([turned(0)], turned(1), 0.0, 1.0),
        ([turned(0), turned(0, 1.0)], turned(0.0, 0.25), 0.0, 0.0),
        ([turned(0), turned(0, 1.0)], turned(0.0, 1.5), 0.5, 0.0),
        ([turned(0), turned(0, 1e200)], turned(0.0, 5e199), 0.0, 0.0),
        ([turned(0), turned(0, 1.0)], turned(0.0, 1e200), 1e200, 0.0),
    ],
)
def test_a_pose_is_compared_with_the_nearest_on_the_way(
    path: list[Pose], pose: Pose, xyz_m: float, degrees: float
) -> None:
    offset, _ = EdgePath(static=False, poses=path).nearest(pose, Offset(1e-3, radians(0.1)), 0)
    assert offset.xyz_m <= xyz_m + 1e-9
    assert offset.rot_rad == pytest.approx(radians(degrees), abs=1e-9)


@pytest.mark.parametrize("x", [nan, inf])
def test_transforms_that_tf2_rejects_are_on_no_path(x: float, tmp_path: Path) -> None:
    moving: Sent = ("/tf", 1.0, "odom", "base_link", 1.0, (x, 0.0, 0.0), UP)
    (head,) = compare(tmp_path, [LASER, moving])
    assert "odom → base_link" in head
