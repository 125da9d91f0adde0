"""Robots side by side: prefixes, shared frames, topics in a namespace, process names."""

import xml.etree.ElementTree as ET

import pytest

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.model.plan import EdgePattern
from tfcompose.model.plan.file import read_plan

ROBOT = """
tfcompose: 1
robot: r
ros: {namespace: robot1, ROS}
links: {base_link: {}}
frames:
  map: {}
  odom: {parent: map, owner: ekf, rate: 30 Hz}
  base_link: {parent: odom, owner: ekf, rate: 30 Hz}
sensors:
  camera: {preset: realsense/d435i, parent: base_link}
processes:
  ekf:
    run: {package: robot_localization, executable: ekf_node, args: ["--to=${frame(map)}"]}
    params: {odom_frame: "${frame(odom)}", list: ["${frame(map)}", "a ${frame(base_link)} b"]}
    remap: {odometry: odom}
rules: {TF306: off, TF318: off}
guard: {allow: [{parent: camera_link, child: "tag:*"}, {parent: "*", child: thing}]}
"""


def robot(ros: str, **changes: str) -> Compiled:
    text = ROBOT.replace("ROS", ros)
    for old, new in changes.items():
        text = text.replace(old, new)
    return compile_robot(text, "r.yaml", library())


def built(ros: str) -> dict[str, str]:
    compiled = robot(ros)
    assert compiled.robot
    assert not compiled.errors, compiled.errors
    return {file.path: file.text for file in emit(compiled.robot)}


def test_frames_get_the_namespace_as_prefix_and_shared_ones_do_not() -> None:
    plan = read_plan(built("isolate: frames, shared_frames: [map]")["plan.json"], "plan.json")
    names = {frame for edge in plan.edges for frame in (edge.parent, edge.child)}
    assert "map" in names
    assert all(name.startswith("robot1/") for name in names - {"map"})
    assert plan.base == "robot1/base_link"
    assert plan.process("ekf").owns == (
        ("map", "robot1/odom"),
        ("robot1/odom", "robot1/base_link"),
    )


def test_a_prefix_is_emitted_in_front_as_it_is() -> None:
    plan = read_plan(built('frame_prefix: "a_"')["plan.json"], "plan.json")
    assert plan.base == "a_base_link"
    assert plan.edges[0].parent == "a_map"


def test_topics_move_below_the_namespace_for_every_process_that_is_started() -> None:
    plan = read_plan(built("isolate: topics")["plan.json"], "plan.json")
    moved = {"/tf": "/robot1/tf", "/tf_static": "/robot1/tf_static"}
    assert {
        process.name: moved.items() <= process.remap.items() for process in plan.processes
    } == dict.fromkeys((process.name for process in plan.processes), True)
    assert plan.base == "base_link"
    argv = plan.process("ekf").argv
    assert [
        argv[index + 1]
        for index, word in enumerate(argv)
        if word == "-r" and ":=" in argv[index + 1]
    ] == [
        "__node:=ekf",
        "__ns:=/robot1",
        "/tf:=/robot1/tf",
        "/tf_static:=/robot1/tf_static",
        "odometry:=odom",
    ]


def test_processes_are_given_final_names() -> None:
    files = built("isolate: both, shared_frames: [map]")
    assert '"odom_frame": "robot1/odom"' in files["params/ekf.yaml"]
    assert '"list": ["map", "a robot1/base_link b"]' in files["params/ekf.yaml"]
    assert "--to=map" in read_plan(files["plan.json"], "p").process("ekf").argv


def test_the_driver_gets_the_prefix_and_only_where_there_is_one() -> None:
    assert '"tf_prefix": "robot1/"' in built("isolate: frames")["params/camera.yaml"]
    assert "tf_prefix" not in built("isolate: topics")["params/camera.yaml"]


def test_what_the_guard_allows_is_allowed_under_the_final_name() -> None:
    plan = read_plan(built("isolate: frames")["plan.json"], "plan.json")
    assert plan.guard.allow == (
        EdgePattern("robot1/camera_link", "tag:*"),
        EdgePattern("*", "thing"),
    )


def test_urdf_keeps_the_plain_names() -> None:
    links = {
        link.get("name")
        for link in ET.fromstring(built("isolate: both")["robot.urdf"]).iter("link")  # noqa: S314
    }
    assert "base_link" in links


@pytest.mark.parametrize(
    ("ros", "changes", "expected"),
    [
        ("isolate: both", {"namespace: robot1, ": ""}, ["TF304"]),
        ("isolate: frames", {"namespace: robot1, ": ""}, ["TF304"]),
        ('isolate: frames, frame_prefix: "a/"', {"namespace: robot1, ": ""}, []),
        ("shared_frames: [mpa]", {}, ["TF203"]),
        ("isolate: both", {"frame(odom)": "frame(odm)"}, ["TF203"]),
        ("isolate: sometimes", {}, ["TF106"]),
    ],
)
def test_what_cannot_be_isolated_is_a_finding(
    ros: str, changes: dict[str, str], expected: list[str]
) -> None:
    assert [finding.code for finding in robot(ros, **changes).findings] == expected
