"""Each format gives the pose that scipy computes, in the direction that its tool means."""

import math
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.support.texts import reader
from tfcompose.cli.compiling import disk, library
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.foundation.findings import Span
from tfcompose.foundation.geometry import Pose, angle_between
from tfcompose.model.robot import Edge
from tfcompose.spec.language import BuildInputs
from tfcompose.spec.language.calibration import read_calibration

#: A robot of two metres, so that no measured pose is outside of it; every sensor is inside.
HEAD = (
    "tfcompose: 1\nrobot: r\nlinks: {base_link: {visual: {box: [2, 2, 2]}}}\nrules: {TF640: off}\n"
)
CAMERA = (
    "sensors: {camera: {preset: realsense/d435i, parent: base_link, tf: tfcompose, driver: none,"
    " %s}}\n"
)
OPTICAL = "camera_color_optical_frame"

ROTATION = Rotation.from_euler("xyz", [0.3, -0.5, 1.1])
QUAT = [float(part) for part in ROTATION.as_quat()]
XYZ = [0.12, -0.34, 0.56]
MEASURED = Pose((0.12, -0.34, 0.56), (QUAT[0], QUAT[1], QUAT[2], QUAT[3]))
ROWS = [
    [*map(float, row), offset] for row, offset in zip(ROTATION.as_matrix(), XYZ, strict=True)
] + [[0.0, 0.0, 0.0, 1.0]]


def compiled(robot: str, **files: str) -> Compiled:
    """Compile the robot beside calibration files: a_yaml is the file a.yaml."""
    texts = {name.replace("_", "."): text for name, text in files.items()}

    return compile_robot(HEAD + robot, "r.yaml", library(), read=reader(texts))


def edge_of(result: Compiled, child: str) -> Edge:
    assert not result.findings, [finding.message for finding in result.findings]
    edge = result.robot and result.robot.parent_edge(child)
    assert edge
    return edge


def assert_same(a: Pose, b: Pose) -> None:
    assert math.dist(a.xyz, b.xyz) < 1e-9
    assert angle_between(a.quat_xyzw, b.quat_xyzw) < 1e-9


def autoware(parent: str = "base_link", child: str = "lens") -> str:
    roll, pitch, yaw = ROTATION.as_euler("xyz")
    return (
        f"{parent}:\n  {child}:\n    x: 0.12\n    y: -0.34\n    z: 0.56\n"
        f"    roll: {roll}\n    pitch: !radians {pitch}\n    yaw: !degrees {math.degrees(yaw)}\n"
    )


def message(parent: str = "base_link", child: str = "lens", indent: str = "") -> str:
    x, y, z, w = QUAT
    lines = [
        "header:",
        "  stamp:",
        "    sec: 0",
        "    nanosec: 0",
        f"  frame_id: {parent}",
        f"child_frame_id: {child}",
        "transform:",
        "  translation:",
        "    x: 0.12",
        "    y: -0.34",
        "    z: 0.56",
        "  rotation:",
        f"    x: {x!r}",
        f"    y: {y!r}",
        f"    z: {z!r}",
        f"    w: {w!r}",
    ]
    return "".join(f"{indent}{line}\n" for line in lines)


def handeye2(kind: str = "eye_on_base", child: str = "lens") -> str:
    x, y, z, w = QUAT
    base, effector = ("base_link", "flange") if kind == "eye_on_base" else ("world", "base_link")
    return (
        f"parameters:\n  name: cell\n  calibration_type: {kind}\n  robot_base_frame: {base}\n "
        f" robot_effector_frame: {effector}\n  tracking_base_frame: {child}\n "
        " tracking_marker_frame: marker\n  freehand_robot_movement: true\ntransform:\n "
        f" translation:\n    x: 0.12\n    y: -0.34\n    z: 0.56\n  rotation:\n    x: {x!r}\n    y:"
        f" {y!r}\n    z: {z!r}\n    w: {w!r}\n"
    )


def handeye(*, flat: bool) -> str:
    x, y, z, w = QUAT
    indent = "" if flat else "  "
    names = {
        "eye_on_hand": "false",
        "robot_base_frame": "base_link",
        "tracking_base_frame": "lens",
    }
    output = "".join(f"{indent}{key}: {value}\n" for key, value in names.items())
    values = (
        f"transformation: {{qw: {w!r}, qx: {x!r}, qy: {y!r}, qz: {z!r}, x: 0.12, y: -0.34, z:"
        " 0.56}\n"
    )
    return ("" if flat else "parameters:\n") + output + values


def moveit_launch() -> str:
    numbers = " ".join(map(repr, XYZ)) + "   " + " ".join(map(repr, QUAT))
    return (
        '<launch>\n  <!-- <node type="static_transform_publisher" args="9 9 9 0 0 0 1 a b"/> -->\n'
        '  <node pkg="tf2_ros" type="static_transform_publisher" name="camera_link_broadcaster"\n'
        f'      args="{numbers} base_link lens" />\n</launch>\n'
    )


def moveit_python(*, euler: bool = False) -> str:
    turned = dict(zip(("qx", "qy", "qz", "qw"), QUAT, strict=True))
    if euler:
        turned = dict(
            zip(("roll", "pitch", "yaw"), map(float, ROTATION.as_euler("xyz")), strict=True)
        )
    values = {
        "frame-id": "base_link",
        "child-frame-id": "lens",
        **dict(zip("xyz", XYZ, strict=True)),
        **turned,
    }
    words = "".join(
        f'                "--{key}",\n                "{value}",\n'
        for key, value in values.items()
    )
    return (
        '""" Static transform publisher, EYE-TO-HAND: base_link -> lens """\nfrom launch import'
        " LaunchDescription\nfrom launch_ros.actions import Node\n\ndef"
        " generate_launch_description():\n    nodes = [\n        Node(\n           "
        ' package="tf2_ros",\n            executable="static_transform_publisher",\n           '
        f' arguments=[\n{words}                # "--roll",\n            ],\n        ),\n    ]\n   '
        " return LaunchDescription(nodes)\n"
    )


def rows(separator: str = " ") -> str:
    return "# lens in base_link\n" + "".join(separator.join(map(repr, row)) + "\n" for row in ROWS)


def blocks() -> str:
    return "".join("- - " + "\n  - ".join(map(repr, row)) + "\n" for row in ROWS)


STRAIGHT = {
    "autoware": autoware(),
    "easy_handeye2": handeye2(),
    "easy_handeye2 in hand": handeye2("eye_in_hand"),
    "easy_handeye2 first version": handeye(flat=False),
    "easy_handeye2 easy_handeye": handeye(flat=True),
    "moveit launch": moveit_launch(),
    "moveit python": moveit_python(),
    "moveit python rpy": moveit_python(euler=True),
    "transform_stamped": message(),
    "transform_stamped with slashes": message("/base_link", "/lens"),
    "transform_stamped list": "transforms:\n- " + message(indent="  ")[2:] + "---\n",
    "transform_stamped twice": message() + "---\n" + message() + "---\n",
    "matrix": rows(),
    "matrix with commas": rows(", "),
    "matrix as YAML": blocks(),
    "matrix in brackets": repr(ROWS),
}


@pytest.mark.parametrize("case", STRAIGHT)
@pytest.mark.parametrize("explicit", [False, True])
def test_each_format_gives_the_measured_pose(case: str, *, explicit: bool) -> None:
    form = case.split(maxsplit=1)[0]
    output = f"{{file: c.txt, format: {form}}}" if explicit else "c.txt"
    edge = edge_of(
        compiled(
            f"frames: {{lens: {{parent: base_link, calibration: {output}}}}}\n",
            c_txt=STRAIGHT[case],
        ),
        "lens",
    )
    assert_same(edge.pose, MEASURED)
    made = edge.calibration
    assert made
    assert (made.format, made.parent, made.child, made.span.file) == (
        form,
        "base_link",
        "lens",
        "c.txt",
    )
    assert not made.inverted


def test_degrees_and_radians_are_xacros_tags_and_other_tags_are_refused() -> None:
    values = "{x: 0, y: 0, z: 0, roll: !degrees 90, pitch: 0, yaw: !radians 0.5}"
    robot = "frames: {lens: {parent: base_link, calibration: c.yaml}}\n"
    edge = edge_of(compiled(robot, c_yaml=f"base_link: {{lens: {values}}}\n"), "lens")
    expected = Rotation.from_euler("xyz", [math.pi / 2, 0, 0.5])
    assert (expected.inv() * Rotation.from_quat(edge.pose.quat_xyzw)).magnitude() < 1e-12
    for wrong in (
        "!degrees a",
        "!degrees 90/2",
        "!meters 1",
        '"${radians(15)}"',
        "15 deg",
        "null",
        "[1]",
        ".nan",
    ):
        text = f"base_link: {{lens: {values.replace('!degrees 90', wrong)}}}\n"
        assert {finding.code for finding in compiled(robot, c_yaml=text).findings} == {"TF610"}, (
            wrong
        )


KALIBR = (
    "cam0: {{camera_model: pinhole, T_cam_imu: {0}}}\ncam1: {{T_cn_cnm1: {0}, rostopic: /cam1}}\n"
)


def test_kalibr_maps_imu_to_camera_and_gives_the_imu_in_the_camera() -> None:
    """A point at p in the IMU is at T_cam_imu p in the camera.

    The camera's pose in the IMU is the inverse.
    """
    robot = CAMERA % f"place: {OPTICAL}, calibration: {{file: c.yaml, parent: imu0, child: cam0}}"
    result = compiled(
        robot.replace("parent: base_link", "parent: imu") + "frames: {imu: {parent: base_link}}\n",
        c_yaml=KALIBR.format(ROWS),
    )
    assert result.robot
    mount = edge_of(result, "camera_bottom_screw_frame")
    assert mount.calibration
    assert mount.calibration.inverted
    assert mount.calibration.name.endswith("c.yaml:1 (kalibr T_cam_imu, inverted)")
    assert_same(mount.calibration.pose, MEASURED.inverse())
    point_in_imu = [0.3, 0.2, 0.9]
    in_camera = ROTATION.apply(point_in_imu) + XYZ
    back = mount.calibration.pose
    again = Rotation.from_quat(back.quat_xyzw).apply(in_camera) + back.xyz
    assert again == pytest.approx(point_in_imu)


def test_kalibr_gives_the_camera_before_in_the_next_one() -> None:
    robot = (
        "frames: {{a: {{parent: base_link}}, b: {{parent: a, calibration: {{file: c.yaml,"
        " {}}}}}}}\n"
    )
    assert_same(
        edge_of(
            compiled(robot.format("parent: cam1, child: cam0"), c_yaml=KALIBR.format(ROWS)), "b"
        ).pose,
        MEASURED,
    )
    turned = edge_of(
        compiled(robot.format("parent: cam0, child: cam1"), c_yaml=KALIBR.format(ROWS)), "b"
    )
    assert_same(turned.pose, MEASURED.inverse())


@pytest.mark.parametrize("form", ["autoware", "easy_handeye2", "transform_stamped"])
def test_an_extrinsic_calibration_of_the_lens_solves_the_mount(form: str) -> None:
    text = {"autoware": autoware, "easy_handeye2": handeye2, "transform_stamped": message}[form](
        child=OPTICAL
    )
    result = compiled(CAMERA % "calibration: c.yaml", c_yaml=text)
    mount = edge_of(result, "camera_bottom_screw_frame")
    robot = result.robot
    assert robot
    pose, frame = Pose(), OPTICAL
    while frame != "base_link":
        edge = robot.parent_edge(frame)
        assert edge
        pose, frame = edge.pose @ pose, edge.parent
    assert_same(pose, MEASURED)
    assert mount.calibration
    assert mount.calibration.child == OPTICAL


def test_a_calibration_in_another_frame_is_solved_through_fixed_edges() -> None:
    robot = (
        "frames: {kit: {parent: base_link, xyz: [1, 0, 0], look: left}, lens: {parent: kit,"
        " calibration: %s}}\n"
    )
    edge = edge_of(
        compiled(robot % "{file: c.yaml, parent: base_link}", c_yaml=autoware()), "lens"
    )
    kit = Pose((1.0, 0.0, 0.0), (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))
    assert_same(kit @ edge.pose, MEASURED)
    assert "TF612" in {
        finding.code for finding in compiled(robot % "c.yaml", c_yaml=autoware()).findings
    }


def test_a_matrix_is_taken_the_way_that_parent_and_child_say() -> None:
    robot = (
        "frames: {lens: {parent: base_link, calibration: {file: c.txt, parent: %s, child: %s}}}\n"
    )
    assert_same(
        edge_of(compiled(robot % ("base_link", "lens"), c_txt=rows()), "lens").pose, MEASURED
    )
    turned = edge_of(compiled(robot % ("lens", "base_link"), c_txt=rows()), "lens")
    assert_same(turned.pose, MEASURED.inverse())
    assert turned.calibration
    assert (turned.calibration.parent, turned.calibration.child) == ("base_link", "lens")


def test_an_entry_the_other_way_round_is_taken_inverted() -> None:
    edge = edge_of(
        compiled(
            "frames: {lens: {parent: base_link, calibration: c.yaml}}\n",
            c_yaml=message("lens", "base_link"),
        ),
        "lens",
    )
    assert_same(edge.pose, MEASURED.inverse())
    assert edge.calibration
    assert edge.calibration.inverted


def test_a_complete_file_is_applied_and_its_chain_too() -> None:
    text = autoware("base_link", "kit") + autoware("kit", "camera_link").replace("0.12", "0.1")
    robot = "calibrations: c.yaml\nframes: {kit: {parent: base_link}}\n" + (CAMERA % "").replace(
        "base_link", "kit"
    )
    result = compiled(robot.replace(", }", "}"), c_yaml=text)
    assert_same(edge_of(result, "kit").pose, MEASURED)
    mount = edge_of(result, "camera_bottom_screw_frame").calibration
    assert mount
    assert (mount.parent, mount.child, mount.span.line) == ("kit", "camera_link", 10)
    assert_same(mount.pose, Pose((0.1, -0.34, 0.56), MEASURED.quat_xyzw))


#: Three calibrations of one mount, each 1 cm further along x; none holds on 2026-05-01.
DATED = (
    "[{file: a.yaml, valid: {to: 2026-03-01}},"
    " {file: b.yaml, valid: {from: 2026-03-02, to: 2026-04-30}},"
    " {file: c.yaml, valid: {from: 2026-05-02}}]"
)
MOUNTS = {
    "of the mount": f"frames: {{lens: {{parent: base_link, calibration: {DATED}}}}}\n",
    "of the robot": f"calibrations: {DATED}\nframes: {{lens: {{parent: base_link}}}}\n",
}


def compiled_on(day: str | None, robot: str) -> Compiled:
    texts = {
        f"{name}.yaml": autoware().replace("0.12", x)
        for name, x in zip("abc", ("0.12", "0.13", "0.14"), strict=True)
    }
    inputs = BuildInputs(day=date.fromisoformat(day) if day else None)
    return compile_robot(HEAD + robot, "r.yaml", library(), read=reader(texts), inputs=inputs)


@pytest.mark.parametrize("robot", MOUNTS.values(), ids=MOUNTS)
@pytest.mark.parametrize(
    ("day", "x"),
    [
        (None, 0.14),
        ("1970-01-01", 0.12),
        ("2026-03-01", 0.12),
        ("2026-03-02", 0.13),
        ("2026-05-02", 0.14),
    ],
)
def test_the_calibration_of_the_day_is_taken(robot: str, day: str | None, x: float) -> None:
    assert edge_of(compiled_on(day, robot), "lens").pose.xyz[0] == x


@pytest.mark.parametrize("robot", MOUNTS.values(), ids=MOUNTS)
@pytest.mark.parametrize(
    ("day", "old", "new"),
    [("2026-05-01", "", ""), (None, "{from: 2026-05-02}", "{to: 2026-06-01}")],
)
def test_a_day_without_a_calibration_is_a_finding(
    robot: str, day: str | None, old: str, new: str
) -> None:
    findings = compiled_on(day, robot.replace(old, new) if old else robot).findings
    column = robot.splitlines()[0].index("a.yaml") + 1
    assert [(each.code, str(each.span)) for each in findings] == [("TF608", f"r.yaml:5:{column}")]


@pytest.mark.parametrize(
    ("calibrations", "code", "named"),
    [
        ("[a.yaml, b.yaml]", "TF613", "b.yaml"),
        ("[{file: a.yaml, valid: {to: 2026-3-2}}, b.yaml]", "TF103", "2026-3-2"),
        ("[{file: a.yaml, valid: {to: 20260302}}, b.yaml]", "TF103", "20260302"),
        ("[{file: a.yaml, valid: {from: 2026-03-02, to: 2026-03-01}}]", "TF106", "{from"),
        ("[{file: d.yaml, valid: {to: 2026-03-02}}, b.yaml]", "TF610", "d.yaml"),
    ],
)
def test_wrong_days_are_findings(calibrations: str, code: str, named: str) -> None:
    robot = f"frames: {{lens: {{parent: base_link, calibration: {calibrations}}}}}\n"
    findings = compiled_on(None, robot).findings
    place = f"r.yaml:5:{robot.index(named) + 1}"
    assert [(each.code, str(each.span)) for each in findings] == [(code, place)]


PROBLEMS = {
    "TF611": ["", "a: 1\n", "cam0: {camera_model: pinhole}\n", "[1, 2]\n", "just a text\n"],
    "TF610": [
        "base_link: {lens: {x: 1}}\n",
        "a: [\n",
        "- [1, 2]\n",
        "a\n\0",
        "transforms: 5\n",
        "1 2\n3 4\n",
        "a: 1\na: 2\n",
    ],
    "TF614": [
        rows().replace("0.0 0.0 0.0 1.0", "0.1 0.0 0.0 1.0"),
        rows().replace(repr(ROWS[0][0]), "0.9"),
    ],
    "TF613": [message() + "---\n" + message().replace("0.12", "0.13")],
}


@pytest.mark.parametrize(
    ("code", "text"), [(code, text) for code, texts in PROBLEMS.items() for text in texts]
)
def test_an_unusable_file_is_reported_at_its_name_with_a_note_into_it(
    code: str, text: str
) -> None:
    findings = compiled(
        "frames: {lens: {parent: base_link, calibration: c.yaml}}\n", c_yaml=text
    ).findings
    assert {finding.code for finding in findings} == {code}
    assert {finding.span.file for finding in findings if finding.span} == {"r.yaml"}
    assert {note.span.file for finding in findings for note in finding.notes if note.span} == {
        "c.yaml"
    }


def test_a_missing_file_and_a_missing_reader_are_findings() -> None:
    robot = "frames: {lens: {parent: base_link, calibration: c.yaml}}\n"
    assert [finding.code for finding in compiled(robot).findings] == ["TF610"]
    assert [
        finding.code for finding in compile_robot(HEAD + robot, "r.yaml", library()).findings
    ] == ["TF610"]


def test_paths_are_relative_to_the_file_that_writes_them() -> None:
    requested: list[str] = []
    base = "frames: {lens: {parent: base_link, calibration: cal/c.yaml}}\n"

    def read(name: str) -> str:
        requested.append(name)
        return {"robots/common/base.yaml": base, "robots/common/cal/c.yaml": autoware()}[name]

    text = HEAD + "include: common/base.yaml\n"
    assert not compile_robot(text, "robots/r.yaml", library(), read=read).findings
    assert requested == ["robots/common/base.yaml", "robots/common/cal/c.yaml"]


NOMINAL = (
    "frames: {lens: {parent: base_link, xyz: [0.12, -0.34, 0.5], quat_xyzw: %s, calibration:"
    " {file: c.yaml%s}}}\n"
)


@pytest.mark.parametrize(
    ("limit", "codes"),
    [
        ("", {"TF616"}),
        (", limit: {xyz: 7 cm}", set()),
        (", limit: {xyz: 5 cm, rot: 1 deg}", {"TF616"}),
    ],
)
def test_a_change_from_nominal_beyond_the_limit_is_a_finding(limit: str, codes: set[str]) -> None:
    assert {
        finding.code for finding in compiled(NOMINAL % (QUAT, limit), c_yaml=autoware()).findings
    } == codes


def test_the_distance_from_nominal_is_that_of_the_frame_that_was_measured() -> None:
    nominal = f"place: {OPTICAL}, xyz: [0.12, -0.34, 0.53], quat_xyzw: {QUAT}"
    mount = edge_of(
        compiled(CAMERA % f"{nominal}, calibration: c.yaml", c_yaml=autoware(child=OPTICAL)),
        "camera_bottom_screw_frame",
    )
    assert mount.calibration
    assert mount.calibration.off(mount.calibration.pose) == pytest.approx((0.03, 0.0), abs=1e-7)


def test_the_nominal_pose_is_taken_to_the_frame_in_which_it_was_measured() -> None:
    """The kit looks to the left, so that a nominal pose in it is another one in base_link."""
    kit = Pose((1.0, 0.0, 0.0), (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))
    in_kit = kit.inverse() @ MEASURED
    robot = (
        "frames: {kit: {parent: base_link, xyz: [1, 0, 0], look: left}, lens: {parent: kit, %s,"
        " calibration: "
    )
    robot += "{file: c.yaml, parent: base_link, limit: {xyz: 10 mm, rot: 1 deg}}}}\n"
    declared = f"xyz: {list(in_kit.xyz)}, quat_xyzw: {list(in_kit.quat_xyzw)}"
    done = compiled(robot % declared, c_yaml=autoware())
    calibration = edge_of(done, "lens").calibration
    assert calibration
    assert calibration.nominal
    assert_same(calibration.nominal, MEASURED)
    assert not {finding.code for finding in done.findings} & {"TF615", "TF616"}


def test_the_nominal_pose_or_the_bodies_reveal_an_inverse() -> None:
    back = MEASURED.inverse()
    nominal = f"xyz: {list(back.xyz)}, quat_xyzw: {list(back.quat_xyzw)}, "
    robot = "frames: {lens: {parent: base_link, %scalibration: c.yaml}}\n"
    findings = compiled(robot % nominal, c_yaml=autoware()).findings
    assert [(finding.code, finding.severity) for finding in findings] == [("TF615", "warning")]
    assert "c.yaml:2 (autoware)" in findings[0].message
    assert "0 mm and 0 deg" in findings[0].message, "the distance of the inverse"
    # A body 1 m to the left; the sensor is said to be 1 m ahead, looking left, so the way back
    # leads to that body.
    mast = "joints: {j: {type: fixed, parent: base_link, child: mast, xyz: [0, 1, 0]}}\n"
    head = HEAD.replace(
        "base_link: {visual: {box: [2, 2, 2]}}",
        "base_link: {}, mast: {visual: {box: [0.2, 0.2, 0.2]}}",
    )
    text = "base_link: {lens: {x: 1.0, y: 0, z: 0, roll: 0, pitch: 0, yaw: !degrees 90}}\n"
    outside = compile_robot(
        head + mast + robot % "", "r.yaml", library(), read=lambda _: text
    ).findings
    assert [(finding.code, finding.severity) for finding in outside] == [("TF615", "warning")]
    assert not compiled(robot % "", c_yaml=autoware()).findings


@pytest.mark.parametrize(("length_m", "codes"), [(3.0, set()), (1.0, {"TF615"})])
@pytest.mark.parametrize("kind", ["capsule", "mesh"])
def test_a_calibration_is_outside_of_what_a_capsule_or_a_mesh_fills(
    tmp_path: Path, kind: str, length_m: float, codes: set[str]
) -> None:
    """The middle of a rod is 1 m up.

    The lens is 65 cm below the origin, off a short rod, and the way back is on it.
    """
    rod = f"capsule: {{radius: 0.1, length: {length_m - 0.2}}}"
    if kind == "mesh":
        trimesh.creation.capsule(radius=100, height=1000 * length_m - 200).export(
            tmp_path / "rod.stl"
        )
        rod = "mesh: {uri: rod.stl, scale: 0.001}"
    robot = HEAD.replace("visual: {box: [2, 2, 2]}", f"visual: {{{rod}, xyz: [0, 0, 1]}}")
    robot += "frames: {lens: {parent: base_link, calibration: c.yaml}}\n"
    text = "base_link: {lens: {x: 0, y: 0, z: -0.65, roll: 0, pitch: 0, yaw: 0}}\n"
    done = compile_robot(
        robot, str(tmp_path / "r.yaml"), library(), read=lambda _: text, disk=disk()
    )
    assert {finding.code for finding in done.findings} == codes


def test_an_inverse_that_is_nearer_and_not_near_is_a_wrong_nominal_pose() -> None:
    """Half a turn and 12 mm from nominal; inverted it would be a quarter turn and 11 cm."""
    frames = (
        "frames: {lens: {parent: base_link, xyz: [0, 0, 0.05], rpy: [90 deg, 0, -90 deg],"
        " calibration: c.yaml}}\n"
    )
    text = "base_link: {lens: {x: 0.0125, y: 0, z: 0.05, roll: 0, pitch: 0, yaw: !degrees 90}}\n"
    findings = compiled(frames, c_yaml=text).findings
    assert [finding.code for finding in findings] == ["TF616"]
    assert "12.5 mm and 180 deg" in findings[0].message
    head = HEAD.replace("TF640: off", "TF640: off, TF615: off")
    findings = compile_robot(
        head + frames, "r.yaml", library(), read=reader({"c.yaml": text})
    ).findings
    assert [finding.code for finding in findings] == ["TF616"]


def test_a_quaternion_with_w_first_is_given_in_the_right_order() -> None:
    frames = (
        "frames: {lens: {parent: base_link, xyz: [0, 0, 0.05], rpy: [0, 0, 90 deg],"
        " calibration: c.yaml}}\n"
    )
    text = (
        "header: {frame_id: base_link}\nchild_frame_id: lens\ntransform:\n"
        "  translation: {x: 0, y: 0, z: 0.05}\n  rotation: {x: 0.7071, y: 0, z: 0, w: 0.7071}\n"
    )
    (finding,) = compiled(frames, c_yaml=text).findings
    assert finding.code == "TF616"
    assert "x: 0, y: 0, z: 0.707107, w: 0.707107" in finding.help


@pytest.mark.parametrize(
    ("frame", "nominal", "measured", "advice"),
    [
        (
            "lens",
            "quat_xyzw: [0.9659, 0, 0, 0.2588]",
            "roll: 0, pitch: 0, yaw: !degrees 30",
            "[0, 0, 0.2588",
        ),
        (
            "lens_optical_frame",
            "rpy: [0, 0, 30 deg]",
            "roll: !degrees -90, pitch: 0, yaw: !degrees -60",
            "x forward",
        ),
        (
            "lens_optical_frame",
            "rpy: [-90 deg, 0, -60 deg]",
            "roll: 0, pitch: 0, yaw: !degrees 30",
            "as place",
        ),
        (
            "lens_frame",
            "rpy: [0, 0, 30 deg]",
            "roll: !degrees -90, pitch: 0, yaw: !degrees -60",
            "raise limit",
        ),
    ],
)
def test_a_nominal_pose_with_w_first_or_of_the_body_is_named(
    frame: str, nominal: str, measured: str, advice: str
) -> None:
    frames = (
        f"frames: {{{frame}: {{parent: base_link, xyz: [0, 0, 0.05], {nominal}, calibration:"
        " c.yaml}}\n"
    )
    text = f"base_link: {{{frame}: {{x: 0, y: 0, z: 0.05, {measured}}}}}\n"
    findings = [
        finding for finding in compiled(frames, c_yaml=text).findings if finding.code == "TF616"
    ]
    assert [advice in finding.help for finding in findings] == [True]


def test_the_robots_bodies_are_found_above_and_below_the_measured_frame() -> None:
    robot = (
        "frames: {kit: {parent: base_link, xyz: [5, 0, 0], look: left}, lens: {parent: kit,"
        " calibration: c.yaml}}\n"
    )
    text = "kit: {lens: {x: 0.0, y: 4.9, z: 0, roll: 0, pitch: 0, yaw: 0}}\n"
    assert not compiled(robot, c_yaml=text.replace("4.9", "5.1")).findings, (
        "kit's y points to the rear"
    )
    assert [
        finding.code for finding in compiled(robot, c_yaml=text.replace("4.9", "-4.9")).findings
    ] == ["TF615"]


def test_comments_in_launch_files_are_no_entries_and_each_publisher_is_one() -> None:
    read = partial(read_calibration, file="c.launch", form="auto", span=Span("r.yaml"))
    assert [entry.name for entry in read(moveit_launch()).entries] == ["base_link → lens"]
    two = moveit_launch().replace(
        "</launch>", moveit_launch().partition("-->")[2].replace("lens", "other")
    )
    assert [entry.child for entry in read(two).entries] == ["lens", "other"]
    angles = '<launch><node type="static_transform_publisher" args="1 2 3 0 0 0.5 a b"/></launch>'
    assert [finding.code for finding in read(angles).findings] == ["TF610"]


def test_a_profile_takes_another_file_and_a_missing_one_has_no_place() -> None:
    robot = "frames: {lens: {parent: base_link, calibration: c.yaml}}\n"
    robot += "profiles: {night: {frames: {lens: {calibration: {file: d.yaml}}}}}\n"
    texts = {"c.yaml": autoware(), "d.yaml": autoware().replace("0.12", "0.2")}
    night = compile_robot(HEAD + robot, "r.yaml", library(), ["night"], read=texts.__getitem__)
    assert edge_of(night, "lens").pose.xyz[0] == 0.2
    missing = compiled(robot).findings
    assert [(finding.code, finding.notes) for finding in missing] == [("TF610", ())]


def test_a_lens_that_the_driver_places_is_a_finding_at_the_calibration() -> None:
    robot = (
        "sensors:\n  camera:\n    preset: realsense/d435i\n    parent: base_link\n    calibration:"
        " c.yaml\n"
    )
    findings = compiled(robot, c_yaml=autoware(child=OPTICAL)).findings
    assert [(finding.code, finding.span.line) for finding in findings if finding.span] == [
        ("TF405", 9)
    ]


TEXTS = [*STRAIGHT.values(), KALIBR.format(ROWS)]
ODD = ["", "{", "---", "!degrees x", "1e999", "9" * 400, "&a", "*a"]
WORDS = [*sorted({word for text in TEXTS for word in text.split()}), *ODD]
ROBOT = (
    "calibrations: c.yaml\nframes: {lens: {parent: base_link, xyz: [1, 0, 0], calibration: {file:"
    " c.yaml%s}}}\n"
)


def settle(text: str, form: str) -> None:
    for output in ("", f", format: {form}", ", parent: cam0, child: imu"):
        result = compiled(ROBOT % output, c_yaml=text)
        assert result.robot
        assert "TF903" not in {finding.code for finding in result.findings}
        assert all(
            "\n" not in finding.message and len(finding.message) < 2000
            for finding in result.findings
        )


@st.composite
def mutated(draw: st.DrawFn) -> str:
    text = draw(st.sampled_from(TEXTS))
    for _ in range(draw(st.integers(1, 4))):
        lines = text.split("\n")
        index = draw(st.integers(0, len(lines) - 1))
        words = lines[index].split(" ")
        words[draw(st.integers(0, len(words) - 1))] = draw(
            st.sampled_from(WORDS) | st.text(max_size=4)
        )
        lines[index] = " ".join(words)
        if draw(st.booleans()):
            del lines[draw(st.integers(0, len(lines) - 1))]
        text = "\n".join(lines)
    return text


FORMATS: Any = st.sampled_from(
    ["autoware", "easy_handeye2", "moveit", "kalibr", "matrix", "transform_stamped"]
)


@given(st.text() | st.binary().map(lambda data: data.decode("latin-1")), FORMATS)
@settings(max_examples=80, deadline=None)
def test_any_text_as_a_calibration_file_gives_findings_and_a_robot(text: str, form: str) -> None:
    settle(text, form)


@given(mutated(), FORMATS)
@settings(max_examples=150, deadline=None)
def test_any_change_of_a_calibration_file_gives_findings_and_a_robot(text: str, form: str) -> None:
    settle(text, form)


def test_of_two_files_for_an_edge_the_first_counts_and_one_is_reported() -> None:
    files = {"a_yaml": message(), "b_yaml": message().replace("0.12", "0.13")}
    result = compiled(
        "calibrations: [a.yaml, b.yaml]\nframes: {lens: {parent: base_link}}\n", **files
    )
    (finding,) = result.errors
    assert (finding.code, finding.notes[0].span and finding.notes[0].span.file) == (
        "TF613",
        "a.yaml",
    )
    edge = result.robot and result.robot.parent_edge("lens")
    assert edge
    assert edge.pose.xyz == pytest.approx(XYZ)
