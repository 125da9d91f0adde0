"""What the rules about views measure: sectors, depths, distances, each on a robot of its own."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import pytest

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.rays.bodies import _reach_frames

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Finding
    from tfcompose.foundation.geometry import Pose

HEAD = "tfcompose: 1\nrobot: r\nbase: base_link\n"
CIRCLE = "optics: {scan: {horizontal: 360 deg, near: 0.05, far: 10}}"


def findings_of(text: str, code: str) -> list[Finding]:
    done = compile_robot(HEAD + text, "r.yaml", library())
    assert not done.errors, done.errors
    return [finding for finding in done.findings if finding.code == code]


def scanner_at_a_wall(yaw_deg: float, scanner: str = CIRCLE) -> list[Finding]:
    """Return the findings about a scanner 1 m in front of a wall 4 m wide, turned by so much."""
    wall = (
        "links: {base_link: {}, wall: {parent: base_link, xyz: [1.01, 0, 0], visual: {box: [0.02,"
        " 4, 1]}}}\n"
    )
    turned = f"parent: base_link, xyz: [0, 0, 0.1], rpy: [0, 0, {yaw_deg} deg]"
    return findings_of(
        f"{wall}sensors: {{lidar: {{preset: generic/lidar2d, {turned}, {scanner}}}}}\n", "TF642"
    )


@pytest.mark.parametrize("yaw_deg", [0, 40, 150, 180, -115])
def test_a_blind_sector_is_where_the_wall_is_also_across_180_deg(yaw_deg: float) -> None:
    (blind,) = scanner_at_a_wall(yaw_deg)
    size, start, end = (float(number) for number in re.findall(r"-?\d+", blind.message)[:3])
    half = math.degrees(math.atan2(2, 1))
    assert size == pytest.approx(2 * half, abs=1.5)
    for angle, expected in ((start, -half - yaw_deg), (end, half - yaw_deg)):
        assert (angle - expected + 180) % 360 - 180 == pytest.approx(0, abs=1.1)


def test_a_sector_ends_with_the_view_of_a_scanner_of_270_deg() -> None:
    behind = "optics: {scan: {horizontal: 270 deg, near: 0.05, far: 10}}"
    assert scanner_at_a_wall(180, behind) == []  # twice 18 deg, at both ends
    assert len(scanner_at_a_wall(0, behind)) == 1


@pytest.mark.parametrize(
    ("height_cm", "is_inside"), [(10, False), (8.5, False), (7, True), (5, True)]
)
def test_a_sensor_is_inside_a_body_from_the_limit_on(height_cm: float, *, is_inside: bool) -> None:
    box = "links: {base_link: {visual: {box: [2, 2, 0.2]}}}\n"
    mount = f"parent: base_link, xyz: [0, 0, {height_cm} cm]"
    image = "optics: {image: {horizontal: 60 deg, vertical: 40 deg}}"
    assert (
        bool(
            findings_of(
                f"{box}sensors: {{eye: {{preset: generic/camera, {mount}, {image}}}}}\n", "TF640"
            )
        )
        == is_inside
    )


@pytest.mark.parametrize(("pitch_deg", "is_found"), [(60, True), (15, False), (-60, False)])
def test_a_camera_sees_only_floor_if_every_ray_meets_it_near_by(
    pitch_deg: float, *, is_found: bool
) -> None:
    wheels = "links: {base_link: {}, wheel: {visual: {sphere: {radius: 10 cm}}}}\n"
    wheels += (
        "joints: {axle: {type: continuous, parent: base_link, child: wheel, axis: [0, 1, 0]}}\n"
    )
    pose = f"parent: base_link, xyz: [0.5, 0, 0.1], rpy: [0, {pitch_deg} deg, 0]"
    image = "optics: {image: {horizontal: 60 deg, vertical: 40 deg}}"
    assert (
        bool(
            findings_of(
                f"{wheels}sensors: {{eye: {{preset: generic/camera, {pose}, {image}}}}}\n", "TF644"
            )
        )
        == is_found
    )


@pytest.mark.parametrize(("height_cm", "is_found"), [(0, True), (2, True), (4, False)])
def test_scanners_dazzle_each_other_if_a_plane_meets_the_others_window(
    height_cm: float, *, is_found: bool
) -> None:
    text = "frames: {base_link: {}}\nsensors:\n"
    for name, pose in (("left", "[0, 1, 0]"), ("right", f"[0, -1, {height_cm} cm]")):
        text += (
            f"  {name}: {{preset: generic/lidar2d, parent: base_link, xyz: {pose}, {CIRCLE}}}\n"
        )
    assert bool(findings_of(text, "TF645")) == is_found


def test_the_poses_of_fixed_frames_are_computed_once_a_robot(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    text = "frames: {base_link: {}}\nsensors:\n" + "".join(
        f"  l{number}: {{preset: generic/lidar2d, parent: base_link, xyz: [0, {number}, 0],"
        f" {CIRCLE}}}\n"
        for number in range(8)
    )
    walks: list[int] = []

    def walked(neighbours: Any, poses: dict[str, Pose]) -> dict[str, Pose]:
        walks.append(len(poses))
        return _reach_frames(neighbours, poses)

    monkeypatch.setattr("tfcompose.compiler.rays.bodies._reach_frames", walked)
    assert findings_of(text, "TF645")
    assert len(walks) == 2  # what is fixed, and what turns on it


def test_the_body_of_the_other_sensor_shields_nobody_from_it() -> None:
    facing = "parent: base_link, tf: tfcompose, driver: none, place: {0}_link"
    text = "links: {base_link: {}}\nsensors:\n"
    for name, pose in (("one", "xyz: [0, 0, 1]"), ("other", "xyz: [2, 0, 1], look: backward")):
        text += f"  {name}: {{preset: realsense/d435, {facing.format(name)}, {pose}}}\n"
    assert len(findings_of(text, "TF645")) == 1
    wall = "{parent: base_link, xyz: [1, 0, 1], visual: {box: [0.01, 1, 1]}}"
    assert (
        findings_of(text.replace("base_link: {}", f"base_link: {{}}, wall: {wall}"), "TF645") == []
    )


def test_named_sensors_or_all_of_a_kind_cover_a_zone() -> None:
    image = "optics: {image: {horizontal: 60 deg, vertical: 40 deg, far: 10}}"
    text = "frames: {base_link: {}}\nsensors:\n"
    for name, yaw in (("front", 0), ("back", 180)):
        text += (
            f"  {name}: {{preset: generic/camera, parent: base_link, rpy: [0, 0, {yaw} deg],"
            f" {image}}}\n"
        )
    text += "coverage: {ahead: {frame: base_link, center: [3, 0, 0], box: [1, 1, 0.5], by: %s}}\n"
    assert [
        len(findings_of(text % by, "TF646")) for by in ("front", "camera", "back", "lidar")
    ] == [
        0,
        0,
        1,
        1,
    ]
