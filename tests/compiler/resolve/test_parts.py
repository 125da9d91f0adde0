"""A robot file as a part of another one.

Names, poses, processes, and what is said when it does not fit.
"""

import xml.etree.ElementTree as ET
from typing import Any

import pytest
from scipy.spatial.transform import Rotation

from tests.support.findings import words
from tests.support.texts import reader, robot_in
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.model.plan.file import read_plan

ROVER = """
tfcompose: 1
robot: rover
vars: {mast: 20 cm, serial: ""}
links: {base_link: {visual: {box: [0.5, 0.4, 0.15]}}, wheel_link: {}, caster_link: {}}
joints:
  wheel_joint: {type: continuous, parent: base_link, child: wheel_link, xyz: [0, 0.2, 0], axis: [0, 1, 0]}
  caster_joint:
    {type: continuous, parent: base_link, child: caster_link, axis: [0, 1, 0], mimic: {joint: wheel_joint}}
frames:
  map: {}
  odom: {parent: map, owner: slam, rate: 10 Hz}
  base_link: {parent: odom, owner: drive, rate: 50 Hz}
sensors:
  camera: {preset: realsense/d435i, parent: base_link, xyz: [0, 0, "${mast}"], options: {serial: "${serial}"}}
processes:
  drive: {external: true, node: diff_drive}
  slam: {run: {package: slam_toolbox, executable: node}, params: {odom: "${frame(odom)}", map: "${frame(map)}"}}
  wheels: {simulate: {joints: {wheel_joint: 1}}, after: {slam: started}}
guard: {allow: [{parent: camera_link, child: "tag:*"}]}
profiles: {bare: {sensors: null}}
"""  # noqa: E501 (a text as its reader has it)

FLEET = """
tfcompose: 1
robot: fleet
ros: {shared_frames: [map]}
frames: {map: {}, dock: {parent: map, xyz: [1, 0, 0]}}
parts:
  one: {spec: robots/rover.yaml, prefix: r1/, namespace: first, vars: {serial: "1"}}
  two: {spec: robots/rover.yaml, prefix: r2/, namespace: second, vars: {mast: 0.4, serial: "2"}}
"""

ARM = """
tfcompose: 1
robot: arm
links: {foot: {visual: {box: [0.2, 0.2, 0.1]}}, upper: {}}
joints:
  shoulder: {type: revolute, parent: foot, child: upper, limit: {lower: -1, upper: 1, effort: 1, velocity: 1}}
frames: {tool: {parent: upper, xyz: [0, 0, 0.5]}, camera_frame: {parent: foot, xyz: [0.1, 0, 0.3], rpy: [0, 0.2, 0]}}
processes: {shaker: {simulate: {joints: zero}, after: {static: started}}}
"""  # noqa: E501 (a text as its reader has it)

CELL = """
tfcompose: 1
robot: cell
links: {table: {visual: {box: [1, 1, 0.1]}}}
parts:
  left: {spec: arm.yaml, prefix: left_, parent: table, EXTRA}
"""


def compiled(text: str, **files: str) -> Compiled:
    """Compile the text as fleet.yaml, beside robots/rover.yaml, arm.yaml and further files.

    A_yaml is a.yaml.
    """
    texts = {"robots/rover.yaml": ROVER, "arm.yaml": ARM}
    texts |= {name.replace("_", "."): text for name, text in files.items()}

    return compile_robot(text, "fleet.yaml", library(), read=reader(texts))


def sound(text: str, **files: str) -> Any:
    return robot_in(compiled(text, **files))


def built(text: str, **files: str) -> dict[str, str]:
    return {file.path: file.text for file in emit(sound(text, **files))}


def codes(result: Compiled) -> set[str]:
    return {finding.code for finding in result.errors}


def only(result: Compiled, code: str) -> Any:
    assert codes(result) == {code}, [(finding.code, finding.message) for finding in result.errors]
    return next(finding for finding in result.findings if finding.code == code)


def test_a_component_of_a_part_is_in_the_container_of_the_part() -> None:
    eye = """
tfcompose: 1
robot: arm
links: {base: {}}
containers: {loader: {}}
processes:
  eye: {component: lens/Eye, container: loader}
"""
    robot = sound(CELL.replace(", EXTRA", ""), arm_yaml=eye)
    processes = {process.name: process for process in robot.processes}
    component = processes["left/eye"].component
    assert component
    assert component.container == "left/loader"
    assert component.container in processes


def test_two_robots_from_one_file_share_a_map_and_nothing_else() -> None:
    robot = sound(FLEET)
    assert robot.roots() == ["map"]
    assert len(robot.frames) == len(set(robot.frames))
    for prefix, name, mast in (("r1/", "one", 0.2), ("r2/", "two", 0.4)):
        assert robot.parent_edge(f"{prefix}odom").parent == "map"
        assert robot.parent_edge(f"{prefix}base_link").owner == f"{name}/drive"
        mount = robot.parent_edge(f"{prefix}camera_bottom_screw_frame")
        assert (mount.parent, mount.owner, mount.pose.xyz) == (
            f"{prefix}base_link",
            f"{name}/static",
            (0, 0, mast),
        )


def test_processes_of_a_part_use_its_namespace_and_final_frame_names() -> None:
    files = built(FLEET)
    plan = read_plan(files["plan.json"], "plan.json")
    slam = plan.process("one/slam")
    assert slam.nodes == ("/first/slam",)
    assert slam.owns == (("map", "r1/odom"),)
    assert plan.process("two/wheels").after == {"two/slam": "started"}
    assert plan.process("one/drive").nodes == ("/first/diff_drive",)
    assert '"/first/slam":' in files["params/one/slam.yaml"]
    assert '"odom": "r1/odom"' in files["params/one/slam.yaml"]
    assert '"map": "map"' in files["params/one/slam.yaml"]
    assert '"tf_prefix": "r2/"' in files["params/two/camera.yaml"]


def test_an_own_robot_has_its_own_publishers_description_and_joint_names() -> None:
    files = built(FLEET)
    plan = read_plan(files["plan.json"], "plan.json")
    assert plan.process("one/joints").description == "one/robot.urdf"
    assert plan.process("one/joints").nodes == ("/first/tfcompose_joints",)
    assert {edge.joint.name for edge in plan.edges if edge.joint} == {
        "wheel_joint",
        "caster_joint",
    }
    assert {edge.joint.mimic for edge in plan.edges if edge.joint} == {None, "wheel_joint"}
    simulate = plan.process("two/wheels").simulate
    assert simulate
    assert simulate.joints == {"wheel_joint": 1.0}
    two, full = (ET.fromstring(files[f"{part}robot.urdf"]) for part in ("two/", ""))  # noqa: S314 (our own text)
    links = {link.get("name") for link in two.iter("link")}
    assert {"base_link", "wheel_link"} <= links
    assert not any(name and name.startswith("r2/") for name in links)
    joints = [joint.get("name") for joint in full.findall("joint")]
    assert len(joints) == len(set(joints))
    mimics = {mimic.get("joint") for mimic in full.iter("mimic")}
    assert mimics == {"r1/wheel_joint", "r2/wheel_joint"}


def test_isolated_topics_belong_to_each_robot_even_for_external_nodes() -> None:
    files = built(FLEET.replace("[map]}", "[map], isolate: topics}"))
    plan = read_plan(files["plan.json"], "plan.json")
    moved = {process.name: process.remap.get("/tf", "/tf") for process in plan.processes}
    assert moved.pop("static") == moved.pop("guard") == "/tf"
    assert {topic for name, topic in moved.items() if name.startswith("one/")} == {"/first/tf"}
    assert {topic for name, topic in moved.items() if name.startswith("two/")} == {"/second/tf"}


def test_isolated_frames_have_the_namespace_as_prefix() -> None:
    text = (
        FLEET.replace("[map]}", "[map], isolate: frames}")
        .replace("prefix: r1/, ", "")
        .replace("prefix: r2/, ", "")
    )
    robot = sound(text)
    assert {"map", "dock", "first/base_link", "second/odom"} <= set(robot.frames)
    assert '"odom": "first/odom"' in built(text)["params/one/slam.yaml"]


def test_a_prefix_of_the_robot_stands_before_the_parts() -> None:
    files = built(FLEET.replace("[map]}", "[map], frame_prefix: site_, namespace: site}"))
    plan = read_plan(files["plan.json"], "plan.json")
    assert {"map", "site_dock", "site_r1/odom"} <= {
        f for edge in plan.edges for f in (edge.parent, edge.child)
    }
    assert '"odom": "site_r1/odom"' in files["params/one/slam.yaml"]
    assert plan.process("one/slam").nodes == ("/site/first/slam",)


def test_a_part_without_a_namespace_is_a_piece_of_the_robot() -> None:
    files = built(CELL.replace("EXTRA", "xyz: [0, 0.3, 0]"))
    plan = read_plan(files["plan.json"], "plan.json")
    owners = {(edge.parent, edge.child): edge.owner for edge in plan.edges}
    assert owners["table", "left_foot"] == "static"
    assert owners["left_foot", "left_upper"] == "joints"
    assert [process.name for process in plan.processes] == [
        "static",
        "joints",
        "left/shaker",
        "guard",
    ]
    assert next(edge.joint.name for edge in plan.edges if edge.joint) == "left_shoulder"
    shaker = plan.process("left/shaker")
    assert shaker.simulate
    assert shaker.simulate.joints == {"left_shoulder": 0.0}
    assert shaker.after == {"static": "started"}
    assert "left_shoulder" in files["robot.urdf"]


def test_a_frame_of_the_part_is_placed_and_the_mount_edge_solved() -> None:
    pose = "place: left_camera_frame, xyz: [1, 2, 3], rpy: [0.1, 0.2, 0.3]"
    edge = sound(CELL.replace("EXTRA", pose)).parent_edge("left_foot")
    rotation = (
        Rotation.from_euler("xyz", [0.1, 0.2, 0.3]) * Rotation.from_euler("xyz", [0, 0.2, 0]).inv()
    )
    assert edge.pose.xyz == pytest.approx([1, 2, 3] - rotation.apply([0.1, 0, 0.3]), abs=1e-12)
    measured = Rotation.from_quat(edge.pose.quat_xyzw)
    assert (measured.inv() * rotation).magnitude() < 1e-12


def test_a_part_is_placed_by_a_calibration_of_a_frame_in_it() -> None:
    extra = "calibration: {file: c.yaml, parent: table, child: left_camera_frame}"
    text = "table:\n  left_camera_frame: {x: 0.1, y: 0, z: 0.8, roll: 0, pitch: 0.2, yaw: 0}\n"
    edge = sound(CELL.replace("EXTRA", extra), c_yaml=text).parent_edge("left_foot")
    assert edge.pose.xyz == pytest.approx((0, 0, 0.5), abs=1e-12)


def test_a_joint_on_the_way_to_the_placed_frame_is_named() -> None:
    finding = only(compiled(CELL.replace("EXTRA", "place: left_tool")), "TF404")
    assert "left_shoulder" in words(finding)


def test_an_outer_frame_hangs_on_a_part_and_a_free_root_gets_an_outer_edge() -> None:
    text = (
        CELL.replace("parent: table, EXTRA", "")
        + "frames: {left_foot: {parent: table, xyz: [0, 0, 1]}, tip: {parent: left_tool}}\n"
    )
    robot = sound(text)
    assert robot.parent_edge("left_foot").pose.xyz == (0, 0, 1)
    assert robot.parent_edge("tip").parent == "left_tool"


def test_only_what_is_below_the_root_is_taken() -> None:
    text = FLEET.replace("prefix: r1/", "prefix: r1/, root: base_link, parent: dock")
    robot = sound(text)
    assert robot.parent_edge("r1/base_link").parent == "dock"
    assert "r1/odom" not in robot.frames


def test_what_a_sensors_driver_publishes_has_the_parts_names_too() -> None:
    robot = compiled(FLEET).robot
    assert robot
    for sensor in robot.sensors:
        prefix = {"one": "r1/", "two": "r2/"}[sensor.name.partition("/")[0]]
        assert sensor.driver_frames
        assert all(
            frame.startswith(prefix)
            for frame in (sensor.mount, *sensor.frames, *sensor.driver_frames)
        )
    assert {sensor.name for sensor in robot.sensors} == {"one/camera", "two/camera"}


def test_drivers_of_sensors_that_are_removed_are_removed_and_others_stay() -> None:
    cameras = """sensors:
  low: {preset: realsense/d435i, parent: foot, options: {serial: "1"}}
  high: {preset: realsense/d435i, parent: upper, options: {serial: "2"}}
"""
    hardware = "ros2_control: {h: {plugin: a/B, joints: {shoulder: {command: [position]}}}}\n"
    arm = ARM.replace("processes:", f"{cameras}{hardware}processes:")
    full, trimmed = (
        sound(CELL.replace("EXTRA", extra), arm_yaml=arm) for extra in ("", "root: upper")
    )
    drivers = [
        {process.name for process in robot.processes if process.kind == "run"}
        for robot in (full, trimmed)
    ]
    assert drivers == [{"left/low", "left/high"}, {"left/high"}]
    assert [[block.name for block in robot.hardware] for robot in (full, trimmed)] == [
        ["left_h"],
        [],
    ]
    assert "left_low_link" not in trimmed.frames


def test_only_parameters_that_name_a_frame_or_joint_are_renamed() -> None:
    """As in the raw block of a URDF part, so that both forms of an arm move alike."""
    shoulder = (
        "shoulder: {command: [position], state: {effort: {source: shoulder}}, params: {mimic:"
        " shoulder, k: 1}}"
    )
    hardware = (
        "ros2_control: {h: {plugin: a/B, params: {tip: upper, port: upper_1}, joints:"
        f" {{{shoulder}}}}}}}\n"
    )
    (node,) = sound(
        CELL.replace("EXTRA", ""), arm_yaml=ARM.replace("processes:", f"{hardware}processes:")
    ).hardware
    (joint,) = node.components
    assert node.params == {"tip": "left_upper", "port": "upper_1"}
    assert joint.params == {"mimic": "left_shoulder", "k": "1"}
    assert joint.state[0].params == {"source": "shoulder"}


def test_one_owner_takes_every_edge_of_the_part_and_not_its_mount() -> None:
    text = CELL.replace("EXTRA", "owner: ur") + "processes: {ur: {external: true}}\n"
    owners = {edge.child: edge.owner for edge in sound(text).edges}
    assert owners == {
        "left_foot": "static",
        "left_upper": "ur",
        "left_tool": "ur",
        "left_camera_frame": "ur",
    }


def test_a_profile_of_the_parts_file_is_laid_over_it() -> None:
    robot = sound(FLEET.replace("prefix: r1/", "prefix: r1/, profiles: [bare]"))
    assert "r1/camera_link" not in robot.frames
    assert "r2/camera_link" in robot.frames


def test_a_part_can_have_parts() -> None:
    station = (
        "tfcompose: 1\nrobot: station\nlinks: {desk: {}}\nparts: {arm: {spec: arm.yaml, parent:"
        " desk}}\n"
    )
    text = FLEET + "  three: {spec: station.yaml, prefix: s_, parent: dock, namespace: third}\n"
    robot = sound(text, station_yaml=station)
    assert robot.parent_edge("s_foot").parent == "s_desk"
    assert {"three/arm/shaker", "three/joints"} <= {process.name for process in robot.processes}
    plan = read_plan(built(text, station_yaml=station)["plan.json"], "plan.json")
    assert [
        edge.joint.name for edge in plan.edges if edge.joint and edge.owner == "three/joints"
    ] == ["shoulder"]


def test_the_digest_changes_with_the_parts_file() -> None:
    def digest(**files: str) -> str:
        return read_plan(built(FLEET, **files)["plan.json"], "plan.json").spec_digest

    assert digest() == digest()
    assert digest() != digest(**{"robots/rover_yaml": ROVER.replace("10 Hz", "11 Hz")})


def test_a_name_that_both_robots_bring_is_refused_with_both_places() -> None:
    finding = only(compiled(FLEET.replace("prefix: r2/, ", "prefix: r1/, ")), "TF505")
    assert "two" in words(finding)
    assert "r1/" in finding.message
    assert {note.span.file for note in finding.notes if note.span} == {"robots/rover.yaml"}
    assert finding.span.file == "fleet.yaml"


def test_a_frame_that_is_not_shared_gets_the_prefix() -> None:
    result = compiled(FLEET.replace("ros: {shared_frames: [map]}\n", ""))
    finding = only(result, "TF204")
    assert "r1/map" in finding.message


@pytest.mark.parametrize(
    ("old", "new", "code", "message", "place"),
    [
        (
            "spec: robots/rover.yaml, prefix: r1/",
            "spec: gone.yaml, prefix: r1/",
            "TF001",
            "",
            "gone.yaml",
        ),
        (
            "spec: robots/rover.yaml, prefix: r1/",
            "spec: fleet.yaml",
            "TF015",
            "fleet.yaml → fleet.yaml",
            "fleet.yaml",
        ),
        ("prefix: r1/", "prefix: r1/, root: nowhere", "TF203", "nowhere", "fleet.yaml"),
        ("prefix: r1/", "prefix: r1/, profiles: [dmo]", "TF009", "dmo", ""),
        ('serial: "1"', 'serial: "1", msat: 3', "TF105", "msat", "fleet.yaml"),
        ("prefix: r1/", "prefix: r1/, parent: dock", "TF313", "one", "fleet.yaml"),
    ],
)
def test_what_does_not_fit_is_reported_once_with_its_place(
    old: str, new: str, code: str, message: str, place: str
) -> None:
    result = compiled(FLEET.replace(old, new))
    finding = only(result, code)
    assert message in finding.message
    assert finding.span
    assert place in finding.span.file
    assert len(result.errors) == 1


def test_what_a_missing_part_would_have_brought_is_not_missed_too() -> None:
    text = FLEET.replace("spec: robots/rover.yaml, prefix: r1/", "spec: gone.yaml, prefix: r1/")
    text += "sensors: {laser: {preset: generic/lidar2d, parent: r1/base_link}}\n"
    text += "processes: {view: {external: true, after: {one/slam: started}}}\n"
    assert codes(compiled(text)) == {"TF001"}


def test_a_clock_of_the_parts_own_is_refused() -> None:
    rover = ROVER + "ros: {clock: sim}\n"
    finding = only(compiled(FLEET, **{"robots/rover_yaml": rover}), "TF312")
    assert finding.span.file == "fleet.yaml"
    assert finding.notes[0].span.file == "robots/rover.yaml"


def test_a_fault_in_the_parts_file_is_reported_there_and_names_the_part() -> None:
    rover = ROVER.replace("xyz: [0, 0.2, 0]", "xyz: [0, 0.2]")
    finding, *further = (
        entry
        for entry in compiled(FLEET, **{"robots/rover_yaml": rover}).findings
        if entry.code == "TF103"
    )
    assert finding.span
    assert finding.span.file == "robots/rover.yaml"
    assert [note.message for note in finding.notes][-2:] == ["as the part one", "as the part two"]
    assert not further


def test_a_finding_of_a_rule_about_the_parts_file_names_the_parts() -> None:
    rover = ROVER.replace("wheel_link: {}", "wheel_lnk: {}")
    finding = next(
        entry
        for entry in compiled(FLEET, **{"robots/rover_yaml": rover}).findings
        if entry.code == "TF203"
    )
    assert [note.message for note in finding.notes if note.message.startswith("as the part")] == [
        "as the part one",
        "as the part two",
    ]


def test_the_owner_of_a_part_that_is_carried_about_owns_its_mount() -> None:
    text = CELL.replace("parent: table, EXTRA", "parent: [table, rack], owner: robot")
    text += (
        "frames: {rack: {parent: table, xyz: [1, 0, 0]}}\nprocesses: {robot: {external: true}}\n"
    )
    edge = sound(text).parent_edge("left_foot")
    assert (edge.parent, edge.switched, edge.owner) == ("table", ("rack",), "robot")


def test_a_comment_in_the_parts_file_allows_its_finding() -> None:
    rover = ROVER.replace(
        "  slam: {run",
        "  idle: {external: true} # tfcompose: allow TF815 because it logs\n  slam: {run",
    )
    assert "TF815" not in {
        finding.code for finding in compiled(FLEET, **{"robots/rover_yaml": rover}).findings
    }


def test_parts_that_multiply_come_to_an_end() -> None:
    def level(below: str) -> str:
        parts = "".join(
            f"  p{i}: {{spec: {below}, prefix: p{i}_, parent: base}}\n" for i in range(8)
        )
        return f"tfcompose: 1\nrobot: r\nframes: {{base: {{}}}}\nparts:\n{parts}"

    files = {f"l{i}_yaml": level(f"l{i + 1}.yaml") for i in range(5)}
    result = compiled(
        level("l0.yaml"), **files, l5_yaml="tfcompose: 1\nrobot: r\nframes: {base: {}}\n"
    )
    assert "TF008" in codes(result)
