"""Poses that are solved, presets that are expanded, owners that are given."""

import json
import re
from typing import Any

import pytest
import yaml
from scipy.spatial.transform import Rotation

from tests.support.texts import robot_in
from tfcompose.cli.commands.diff import differences
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.compiler.resolve.presets import holds
from tfcompose.foundation.geometry import Pose, angle_between
from tfcompose.model.plan.file import read_plan
from tfcompose.model.robot import Edge, Robot

HEAD = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"
CAMERA = "sensors: {c: {preset: realsense/d435i, parent: base_link, %s}}\n"


def compiled(text: str, *profiles: str) -> Compiled:
    return compile_robot(HEAD + text, "r.yaml", library(), profiles)


def robot_of(text: str, *profiles: str) -> Robot:
    return robot_in(compiled(text, *profiles))


def edge_of(robot: Robot, child: str) -> Edge:
    edge = robot.parent_edge(child)
    assert edge
    return edge


def pose_in_root(robot: Robot, frame: str) -> tuple[Rotation, Any]:
    """Return rotation and position of the frame in its root, computed by scipy."""
    rotation, xyz = Rotation.identity(), [0.0, 0.0, 0.0]
    while edge := robot.parent_edge(frame):
        edge_rotation = Rotation.from_quat(edge.pose.quat_xyzw)
        rotation, xyz = edge_rotation * rotation, edge_rotation.apply(xyz) + edge.pose.xyz
        frame = edge.parent
    return rotation, xyz


def assert_rotation(actual: Rotation, expected: Rotation) -> None:
    assert (actual.inv() * expected).magnitude() < 1e-9


def test_a_pose_relative_to_another_frame_keeps_the_parent() -> None:
    robot = robot_of(
        "frames:\n"
        "  mast: {parent: base_link, xyz: [1, 2, 3], rpy: [0, 0, 90 deg]}\n"
        "  plate: {parent: base_link, xyz: [0, 0, 1], rpy: [10 deg, 20 deg, 30 deg]}\n"
        "  sign: {parent: plate, relative_to: mast, xyz: [1, 0, 0], rpy: [5 deg, 0, 0]}\n"
    )
    assert edge_of(robot, "sign").parent == "plate"
    rotation, xyz = pose_in_root(robot, "sign")
    assert xyz == pytest.approx([1, 3, 3], abs=1e-12)
    assert_rotation(
        rotation,
        Rotation.from_euler("z", 90, degrees=True) * Rotation.from_euler("x", 5, degrees=True),
    )


def test_five_hundred_chained_relative_poses_resolve_in_any_order() -> None:
    frames = ", ".join(
        f"f{n}: {{parent: base_link, relative_to: f{n + 1}, xyz: [1, 0, 0]}}" for n in range(500)
    )
    robot = robot_of(f"frames: {{{frames}, f500: {{parent: base_link}}}}\n")
    assert edge_of(robot, "f0").pose.xyz == pytest.approx((500, 0, 0))


@pytest.mark.parametrize("count", [1, 2, 60, 300])
def test_poses_relative_to_each_other_are_one_finding(count: int) -> None:
    frames = ", ".join(
        f"f{n}: {{parent: base_link, relative_to: f{(n + 1) % count}}}" for n in range(count)
    )
    findings = compiled(f"frames: {{{frames}}}\n").findings
    assert [finding.code for finding in findings] == ["TF404"]


@pytest.mark.parametrize("frame", ["c_link", "c_color_optical_frame", "c_bottom_screw_frame"])
def test_the_pose_places_the_frame_and_the_edge_belongs_to_the_mount(frame: str) -> None:
    robot = robot_of(CAMERA % f"place: {frame}, xyz: [1, 2, 3], rpy: [10 deg, 20 deg, 30 deg]")
    rotation, xyz = pose_in_root(robot, frame)
    assert xyz == pytest.approx([1, 2, 3], abs=1e-12)
    assert_rotation(rotation, Rotation.from_euler("xyz", [10, 20, 30], degrees=True))
    assert edge_of(robot, "c_bottom_screw_frame").parent == "base_link"


@pytest.mark.parametrize(
    ("inspect", "direction"),
    [("forward", (1, 0, 0)), ("left", (0, 1, 0)), ("down", (0, 0, -1)), ("{down: 15 deg}", None)],
)
def test_an_optical_frame_views_along_z_and_other_frames_along_x(
    inspect: str, direction: tuple[int, ...] | None
) -> None:
    expected = direction or tuple(Rotation.from_euler("y", 15, degrees=True).apply([1, 0, 0]))
    text = CAMERA % f"place: c_color_optical_frame, look: {inspect}"
    assert pose_in_root(robot_of(text), "c_color_optical_frame")[0].apply(
        [0, 0, 1]
    ) == pytest.approx(expected, abs=1e-9)
    text = CAMERA % f"place: c_link, look: {inspect}"
    assert pose_in_root(robot_of(text), "c_link")[0].apply([1, 0, 0]) == pytest.approx(
        expected, abs=1e-9
    )
    assert pose_in_root(robot_of(text), "c_color_optical_frame")[0].apply(
        [0, 0, 1]
    ) == pytest.approx(expected, abs=1e-9)
    text = f"frames: {{a_optical_frame: {{parent: base_link, look: {inspect}}}}}\n"
    if direction:
        assert pose_in_root(robot_of(text), "a_optical_frame")[0].apply(
            [0, 0, 1]
        ) == pytest.approx(expected, abs=1e-9)


def test_an_image_of_a_camera_with_a_direction_is_upright() -> None:
    rotation, _ = pose_in_root(
        robot_of("frames: {a_optical_frame: {parent: base_link, look: forward}}\n"),
        "a_optical_frame",
    )
    assert rotation.apply([1, 0, 0]) == pytest.approx([0, -1, 0], abs=1e-12)
    assert rotation.apply([0, 1, 0]) == pytest.approx([0, 0, -1], abs=1e-12)


STREAMS = {
    "[color]": {"color"},
    "[depth]": {"depth"},
    "[infra1, infra2]": {"infra1", "infra2"},
    "[]": set(),
}


def params_of(robot: Robot, process: str = "c") -> dict[str, Any]:
    return next(p for p in robot.processes if p.name == process).params


@pytest.mark.parametrize("streams", STREAMS)
def test_an_option_sets_frames_and_the_drivers_parameters_together(streams: str) -> None:
    robot = robot_of(CAMERA % f"options: {{streams: {streams}}}")
    enabled = STREAMS[streams]
    for stream in ("color", "depth", "infra1", "infra2"):
        assert (f"c_{stream}_frame" in robot.frames) == (stream in enabled)
        assert params_of(robot)[f"enable_{stream}"] == (stream in enabled)
    assert "c_imu_frame" not in robot.frames
    assert params_of(robot)["enable_gyro"] is False


def test_the_imu_and_the_serial_number_reach_the_driver() -> None:
    robot = robot_of(CAMERA % "options: {imu: true, serial: '0123'}")
    assert {"c_imu_frame", "c_imu_optical_frame", "c_accel_frame", "c_gyro_frame"} <= set(
        robot.frames
    )
    params = params_of(robot)
    assert (params["enable_gyro"], params["unite_imu_method"], params["serial_no"]) == (
        True,
        2,
        "0123",
    )
    assert "serial_no" not in params_of(robot_of(CAMERA % "options: {}"))


def inner(robot: Robot) -> set[str]:
    return {edge.owner for edge in robot.edges if edge.child.startswith("c_color")}


def test_the_driver_is_switched_off_where_tfcompose_publishes_its_frames() -> None:
    default, by_driver, ours = (
        robot_of(CAMERA % f"options: {{}}{tf}") for tf in ("", ", tf: driver", ", tf: tfcompose")
    )
    assert inner(default) == inner(by_driver) == {"c"}
    assert inner(ours) == {"static"}
    assert params_of(default)["publish_tf"] is params_of(by_driver)["publish_tf"] is True
    assert params_of(ours)["publish_tf"] is False
    assert edge_of(default, "c_link").owner == "static"


def test_without_a_driver_tfcompose_publishes_and_nothing_is_started() -> None:
    robot = robot_of(CAMERA % "driver: none")
    assert inner(robot) == {"static"}
    assert [process.name for process in robot.processes] == ["static", "joints", "guard"]


def test_one_process_can_drive_several_sensors() -> None:
    robot = robot_of((CAMERA % "driver: bus") + "processes: {bus: {external: true}}\n")
    assert inner(robot) == {"bus"}
    assert "c" not in [process.name for process in robot.processes]


def test_a_users_driver_is_started_where_the_preset_has_none() -> None:
    robot = robot_of(
        "sensors: {l: {preset: generic/lidar2d, parent: base_link, driver: {run: {package: sick,"
        " executable: x}}}}\n"
    )
    driver = next(process for process in robot.processes if process.name == "l")
    assert (driver.kind, driver.package, driver.executable, driver.node) == (
        "run",
        "sick",
        "x",
        "/l",
    )


def test_a_users_keys_stand_over_the_presets_driver() -> None:
    robot = robot_of(
        CAMERA % "driver: {restart: always, node: /eye, params: {initial_reset: true}}"
    )
    driver = next(process for process in robot.processes if process.name == "c")
    assert (driver.package, driver.node, driver.restart) == ("realsense2_camera", "/eye", "always")
    assert driver.params["initial_reset"] is True
    assert driver.params["camera_name"] == "c"


def test_a_sensors_frame_takes_the_units_own_value_and_name() -> None:
    robot = robot_of(
        CAMERA % "tf: tfcompose, driver: none, frames: {c_color_frame: {xyz: [0, 0.0149, 0]},"
        " c_color_optical_frame: {name: eye_optical}}"
    )
    assert edge_of(robot, "c_color_frame").pose == Pose((0, 0.0149, 0))
    assert edge_of(robot, "eye_optical").parent == "c_color_frame"
    assert "c_color_optical_frame" not in robot.frames
    assert (
        angle_between(edge_of(robot, "eye_optical").pose.quat_xyzw, (-0.5, 0.5, -0.5, 0.5)) < 1e-12
    )


def test_a_sensor_frame_takes_the_units_rotation_and_the_presets_place() -> None:
    robot = robot_of(CAMERA % "frames: {c_color_frame: {rpy: [1 deg, 2 deg, 3 deg]}}")
    pose = edge_of(robot, "c_color_frame").pose
    assert pose.xyz == (0, 0.015, 0)
    assert_rotation(
        Rotation.from_quat(pose.quat_xyzw), Rotation.from_euler("xyz", [1, 2, 3], degrees=True)
    )


def test_placing_by_nominal_values_warns_until_the_unit_has_its_own() -> None:
    place = "place: c_color_frame"
    assert [finding.code for finding in compiled(CAMERA % place).findings] == ["TF405"]
    assert not compiled(
        CAMERA % f"{place}, frames: {{c_color_frame: {{xyz: [0, 0.0149, 0]}}}}"
    ).findings
    assert not compiled(CAMERA % f"{place}, tf: tfcompose").findings
    assert not compiled(CAMERA % "place: c_link").findings


def test_the_parameter_file_is_yaml_that_says_the_same() -> None:
    odd = [
        "a: b",
        "1",
        "true",
        "",
        "# no",
        "l1\nl2",
        "\u2028",
        "\x85",
        "\x7f",
        "\ufeff",
        "ü",
        "'\"\\",
        "${x",
    ]
    params = {f"k{n}": text for n, text in enumerate(odd[:-1])} | {
        "deep": {"er": [1, 2.5, True, "x"]},
        "empty": {},
    }
    text = (
        f"processes: {{p: {{run: {{package: a, executable: b}}, params: {json.dumps(params)}}}}}\n"
    )
    file = next(file for file in emit(robot_of(text)) if file.path == "params/p.yaml")
    assert yaml.safe_load(file.text) == {"/p": {"ros__parameters": params}}


@pytest.mark.parametrize(
    ("frames", "base"),
    [
        ("", "base_link"),
        ("frames: {base_footprint: {}, base_link: {parent: base_footprint}}\n", "base_footprint"),
    ],
)
def test_the_urdf_begins_at_base_link_or_a_fixed_base_footprint_above_it(
    frames: str, base: str
) -> None:
    assert robot_of(frames).base == base


FOOTPRINT = "frames: {base_footprint: {}, base_link: {parent: base_footprint}}\n"


@pytest.mark.parametrize(
    ("text", "ground"),
    [
        ("", None),
        ("ground: base_link\n", "base_link"),
        (FOOTPRINT, "base_footprint"),
        (
            f"ground: floor\n{FOOTPRINT[:-2]}, floor: {{parent: base_footprint}}}}\n",
            "floor",
        ),
    ],
)
def test_the_floor_is_at_base_footprint_or_the_frame_that_the_file_names(
    text: str, ground: str | None
) -> None:
    assert robot_of(text).ground == ground


def test_rates_come_from_the_edge_or_from_the_process_behind_it() -> None:
    robot = robot_of(
        "joints: {j: {type: continuous, parent: base_link, child: w}}\nframes: {map: {}, odom:"
        " {parent: map, owner: s, rate: 5 Hz}, base_link: {parent: odom, owner: s}, w:"
        " {}}\nprocesses: {joints: {rate: 30 Hz}, s: {simulate: {circle: {}, rate: 20 Hz}}}\n"
    )
    assert [edge_of(robot, child).rate for child in ("odom", "base_link", "w")] == [5, 20, 30]


def test_joints_gets_its_parameters_on_its_command_line() -> None:
    joint = "joints: {j: {type: continuous, parent: base_link, child: w}}\nframes: {w: {}}\n"
    robot = robot_of(
        joint + "processes: {joints: {params: {publish_frequency: 30, ignore_timestamp: true}}}\n"
    )
    plan = next(file.text for file in emit(robot) if file.path == "plan.json")
    argv = read_plan(plan, "plan.json").process("joints").argv
    assert argv[4:] == (
        "--ros-args",
        "-p",
        "ignore_timestamp:=true",
        "-p",
        "publish_frequency:=30.0",
    )


@pytest.mark.parametrize(
    ("params", "code", "words"),
    [
        ("publish_frequency: fast", "TF103", "30.0"),
        ("publish_frequency: true", "TF103", "30.0"),
        ("publish_frequency: 0", "TF106", "leave it out"),
        ("ignore_timestamp: 1", "TF103", "ignore_timestamp: true"),
        ("publish_frequenzy: 1", "TF101", "publish_frequency"),
    ],
)
def test_joints_takes_no_other_parameters_and_no_other_values(
    params: str, code: str, words: str
) -> None:
    (finding,) = compiled(f"processes: {{joints: {{params: {{{params}}}}}}}\n").errors
    assert finding.code == code
    assert words in (finding.help or "")


def test_names_are_below_the_namespace_unless_they_begin_with_a_slash() -> None:
    robot = robot_of(
        "ros: {namespace: fleet/r1}\nprocesses: {a: {external: true}, b: {external: true, node:"
        " /b}}\n"
    )
    nodes = {process.name: process.node for process in robot.processes}
    assert nodes == {
        "static": "/fleet/r1/tfcompose_static",
        "joints": "/fleet/r1/tfcompose_joints",
        "guard": "/fleet/r1/tfcompose_guard",
        "a": "/fleet/r1/a",
        "b": "/b",
    }


TOOL = """
ros: {frame_prefix: "r/"}
frames: {rack: {parent: base_link}, tool: {parent: [base_link, rack], owner: changer, rate: 10 Hz}}
processes: {changer: {external: true}}
"""


def test_an_edge_with_several_parents_hangs_on_the_first_and_names_all() -> None:
    robot = robot_of(TOOL)
    edge = edge_of(robot, "tool")
    assert (edge.parent, edge.switched, edge.kind) == ("base_link", ("rack",), "dynamic")
    files = {file.path: file.text for file in emit(robot)}
    (planned,) = [
        edge for edge in read_plan(files["plan.json"], "plan.json").edges if edge.child == "r/tool"
    ]
    assert (planned.parent, planned.switched) == ("r/base_link", ("r/rack",))
    assert "or on r/rack" in files["tree.txt"]
    joint = re.search(r'<parent link="(\w+)"/>\s*<child link="tool"/>', files["robot.urdf"])
    assert joint
    assert joint[1] == "base_link"
    more = robot_of(TOOL.replace("[base_link, rack]", "base_link"))
    assert list(map(str, differences(robot, more))) == [
        "switch base_link → tool: or on rack → no other parent"
    ]


def test_a_fixed_edge_has_the_name_of_a_joint_where_one_is_given() -> None:
    """The other edges of a sensor are named by build."""
    inside = "joint: c_fix, frames: {c_color_frame: {joint: lens_fix}}, driver: none"
    robot = robot_of(f"frames: {{tip: {{parent: base_link, joint: tip_fix}}}}\n{CAMERA % inside}")
    named = {edge.child: edge.joint_name for edge in robot.edges if edge.joint_name}
    assert named == {
        "tip": "tip_fix",
        "c_bottom_screw_frame": "c_fix",
        "c_color_frame": "lens_fix",
    }
    urdf = next(file.text for file in emit(robot) if file.path == "robot.state_publisher.urdf")
    assert all(f'<joint name="{name}" type="fixed">' in urdf for name in named.values())
    assert '<joint name="c_bottom_screw_frame_to_c_link" type="fixed">' in urdf


@pytest.mark.parametrize("parents", ["[]", "[base_link, base_link]", "[base_link, 3]"])
def test_a_list_of_parents_has_different_names(parents: str) -> None:
    findings = compiled(TOOL.replace("[base_link, rack]", parents)).findings
    assert [finding.code for finding in findings if finding.code.startswith("TF1")] != []


def test_a_frame_that_a_driver_sends_repeatedly_in_a_sensor_can_be_placed() -> None:
    """The inside of a sensor does not move, on whichever topic its driver sends it.

    What moves is refused.
    """
    text = (
        "sensors: {z: {preset: zed/zed2i, parent: base_link, place: z_left_camera_frame, xyz: [1,"
        " 0, 0]}}\n"
    )
    robot = robot_of(text)
    assert edge_of(robot, "z_left_camera_frame").kind == "dynamic"
    assert pose_in_root(robot, "z_left_camera_frame")[1] == pytest.approx([1, 0, 0])


def test_a_condition_on_several_values_of_an_option_needs_all_of_them() -> None:
    condition = {"streams": ["depth", "color"]}
    assert holds(condition, {"streams": ["color", "infra1", "depth"]}, "driver")
    assert not holds(condition, {"streams": ["depth"]}, "driver")
    assert not holds(condition, {"streams": ["color"]}, "driver")
    assert holds({"tf": "driver"}, {}, "driver")


def test_an_unknown_name_under_after_is_answered_with_known_processes() -> None:
    done = compiled(
        "parts:\n"
        "  arm: {xacro: arm.xacro, parent: base_link}\n"
        "  bare: {xacro: bare.xacro, parent: base_link, prefix: ''}\n"
        "joints: {lift: {type: revolute, parent: base_link, child: tray, axis: z}}\n"
        "processes: {drive: {run: [drive]}, map: {run: [map], after: {laser_scanner: ready}}}\n"
    )
    (unknown,) = [finding for finding in done.errors if finding.code == "TF813"]
    named = re.findall(r"[\w/]+", unknown.help)
    assert named[-4:] == ["drive", "guard", "joints", "static"]
