"""What a robot's sensors see.

The preset's values, the user's over them, and where each is from.
"""

import math

import pytest

from tests.support.texts import robot_in
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.model.robot import Optics, OpticsSource

HEAD = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"


def compiled(sensor: str) -> Compiled:
    return compile_robot(
        f"{HEAD}sensors:\n  s: {{parent: base_link, {sensor}}}\n", "r.yaml", library()
    )


def optics_in(done: Compiled) -> dict[str, Optics]:
    assert not done.errors, done.errors
    return {
        stream_optics.stream: stream_optics
        for sensor in robot_in(done).sensors
        for stream_optics in sensor.optics
    }


def test_what_nobody_says_is_not_known() -> None:
    image = optics_in(compiled("preset: generic/camera"))["image"]
    assert (image.kind, image.frame, image.active) == ("camera", "s_optical_frame", False)
    unknown = (
        image.horizontal,
        image.vertical,
        image.diagonal,
        image.resolution,
        image.near,
        image.far,
    )
    assert {*unknown, image.shutter, image.channels, image.rate} == {None}
    assert not image.sources


def test_the_field_of_view_of_a_generic_sensor_comes_from_the_users_file() -> None:
    optics = optics_in(
        compiled(
            "preset: generic/camera, optics: {image: {horizontal: 90 deg, resolution: [640, 480]}}"
        )
    )
    image = optics["image"]
    assert image.horizontal == pytest.approx((-math.pi / 4, math.pi / 4))
    assert (image.resolution, image.vertical) == ((640, 480), None)
    assert image.sources == (
        OpticsSource(("horizontal", "resolution"), "r.yaml:5:59", "robot file"),
    )
    assert (image.span.line, image.span.column) == (5, 59)


def test_a_scanner_in_one_plane_has_a_sector_and_no_height() -> None:
    scan = optics_in(
        compiled(
            "preset: generic/lidar2d, optics: {scan: {horizontal: [-100 deg, 135 deg], far: 10}}"
        )
    )["scan"]
    assert scan.horizontal == pytest.approx((math.radians(-100), math.radians(135)))
    assert (scan.kind, scan.vertical, scan.far, scan.near, scan.active) == (
        "lidar",
        (0, 0),
        10,
        None,
        True,
    )


def test_elevations_give_the_number_of_channels_and_their_range() -> None:
    lidar = "preset: generic/lidar3d, optics: {cloud: {elevations: [-15 deg, 0, 5 deg]}}"
    cloud = optics_in(compiled(lidar))["cloud"]
    assert cloud.channels == 3
    assert cloud.vertical == pytest.approx((math.radians(-15), math.radians(5)))


def test_a_frame_of_the_optics_goes_by_the_name_that_the_user_gives_it() -> None:
    camera = "preset: generic/camera, frames: {s_optical_frame: {name: lens}}"
    assert optics_in(compiled(camera))["image"].frame == "lens"
    extra = "preset: generic/imu, optics: {eye: {frame: s_link, kind: camera}}"
    assert optics_in(compiled(extra))["eye"].frame == "s_link"


@pytest.mark.parametrize(
    ("sensor", "code", "word"),
    [
        ("preset: generic/camera, optics: {other: {far: 1}}", "TF102", "other"),
        ("preset: generic/camera, optics: {other: {frame: s_lnk}}", "TF203", "s_lnk"),
        ("preset: generic/imu, optics: {eye: {frame: s_link}}", "TF102", "eye"),
        ("preset: generic/camera, optics: {image: {horizontal: 87}}", "TF106", "87 deg"),
        ("preset: generic/camera, optics: {image: {horizontal: -3}}", "TF106", "-3"),
        ("preset: generic/camera, optics: {image: {horizontal: [1, -1]}}", "TF106", "deg"),
        ("preset: generic/camera, optics: {image: {diagonal: 95}}", "TF106", "95 deg"),
        ("preset: generic/camera, optics: {image: {near: 50 cm, far: 40 cm}}", "TF106", "0.5 m"),
        ("preset: generic/camera, optics: {image: {resolution: [0, 480]}}", "TF106", "0"),
        (
            "preset: generic/lidar3d, optics: {cloud: {channels: 3, elevations: [0]}}",
            "TF106",
            "3 channels",
        ),
    ],
)
def test_optics_that_cannot_be_true_are_refused(sensor: str, code: str, word: str) -> None:
    findings = compiled(sensor).errors
    assert [finding.code for finding in findings] == [code], findings
    assert word in findings[0].message + findings[0].help
