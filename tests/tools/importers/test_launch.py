"""Launch files of ROS 2 in Python, XML and YAML, imported: read by ROS's own launch."""

import os
import platform
import random
import re
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.support.bringups import (
    compiled,
    import_of,
    needs_launch,
    places,
    printed_errors,
    started_with,
)
from tests.support.importing import PRESETS
from tfcompose.cli import compiling, main, reading
from tfcompose.compiler.emit import emit
from tfcompose.foundation import confined
from tfcompose.model.plan.file import read_plan
from tfcompose.spec.load import load

PYTHON = """
import os
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import *
from launch.actions import DeclareLaunchArgument, ExecuteProcess, GroupAction, OpaqueFunction, RegisterEventHandler
from launch.actions import SetEnvironmentVariable, Shutdown, TimerAction
from launch.conditions import IfCondition, UnlessCondition
from launch.event_handlers import OnProcessExit
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, PythonExpression
from launch_ros.actions import ComposableNodeContainer, LifecycleNode, Node, PushRosNamespace, SetParameter, SetRemap
from launch_ros.descriptions import ComposableNode, ParameterValue
from launch_ros.substitutions import FindPackageShare


def cameras(context):
    count = int(LaunchConfiguration("cameras").perform(context))
    made = {"package": "camera", "executable": "camera"}
    return [Node(**made, name=f"camera_{i}", parameters=[{"id": i}]) for i in range(count)]


def generate_launch_description():
    own = get_package_share_directory("rover")
    calibrate = ExecuteProcess(cmd=["python3", os.path.join(own, "calibrate.py")], cwd=own, name="calibrate")
    return LaunchDescription([
        DeclareLaunchArgument("cameras", default_value="2", description="how many"),
        DeclareLaunchArgument("rviz", default_value="false"),
        SetEnvironmentVariable("LEVEL", "3"),
        Node(package="tf2_ros", executable="static_transform_publisher", name="mount",
             arguments=["0.1", "0", "0.3", "0.5", "0", "-0.2", "base_link", "laser"]),
        OpaqueFunction(function=cameras),
        Node(package="rviz2", executable="rviz2", condition=IfCondition(LaunchConfiguration("rviz"))),
        Node(package="teleop", executable="keys", condition=UnlessCondition(LaunchConfiguration("rviz"))),
        GroupAction([
            PushRosNamespace("front"),
            SetParameter("speed", 20),
            SetRemap("scan", "scan_raw"),
            Node(package="drive", executable="drive", name="drive", namespace="left", respawn=True,
                 parameters=[os.path.join(own, "drive.yaml"), {
                     "wheels": {"count": 4}, "text": "4", "from_argument": LaunchConfiguration("cameras"),
                     "kept": ParameterValue(LaunchConfiguration("cameras"), value_type=str), "mixed": [1, 2.5],
                 }],
                 remappings=[("odom", "odometry")], ros_arguments=["--log-level", "debug"]),
        ]),
        LifecycleNode(package="map", executable="server", name="map_server", namespace=""),
        calibrate,
        RegisterEventHandler(OnProcessExit(target_action=calibrate, on_exit=[
            Node(package="slam", executable="slam", name="mapper")])),
        TimerAction(period=5.0, actions=[Node(package="late", executable="late", name="late")]),
        Node(package="safety", executable="stop", name="stop", on_exit=Shutdown(),
             arguments=["--rate", PythonExpression(["2 * ", LaunchConfiguration("cameras")])]),
        ComposableNodeContainer(
            name="perception", namespace="", package="rclcpp_components", executable="component_container",
            composable_node_descriptions=[
                ComposableNode(package="image_proc", plugin="image_proc::RectifyNode", name="rectify")]),
    ])
"""  # noqa: E501 (a text as its reader has it)


pytestmark = needs_launch


@pytest.fixture(autouse=True)
def _one_library(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiling, "library", lambda: PRESETS)


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """The folder launch of a package in a source tree."""
    folder = tmp_path / "rover"
    (folder / "launch").mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>rover</name></package>", encoding="utf-8")
    (folder / "drive.yaml").write_text("/**: {ros__parameters: {speed: 1.5}}\n", encoding="utf-8")
    return folder / "launch"


def source(folder: Path, name: str, text: str) -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def test_each_action_of_a_python_launch_file_has_its_entry(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(package)
    _, data = import_of(source(package, "rover.launch.py", PYTHON), code=None)
    assert data["frames"]["laser"] == {
        "parent": "base_link",
        "xyz": [0.1, 0, 0.3],
        "rpy": [-0.2, 0, 0.5],
    }
    processes = data["processes"]
    order = [
        "camera_0",
        "camera_1",
        "keys",
        "drive",
        "map_server",
        "calibrate",
        "stop",
        "rectify",
        "mapper",
        "late",
    ]
    assert list(processes) == order
    assert data["containers"] == {"perception": {"env": {"LEVEL": "3"}}}
    assert processes.pop("rectify") == {
        "component": "image_proc/image_proc::RectifyNode",
        "container": "perception",
    }
    assert all(process["env"] == {"LEVEL": "3"} for process in processes.values())
    assert [processes[f"camera_{i}"]["params"] for i in range(2)] == [{"id": 0}, {"id": 1}]
    drive = processes["drive"]
    assert drive["params"] == {
        "file": "../drive.yaml",
        "wheels.count": 4,
        "text": "4",
        "from_argument": "${args.cameras}",
        "kept": "2",
        "mixed": [1, 2.5],
    }
    assert drive["remap"] == {"scan": "scan_raw", "odom": "odometry"}
    assert (drive["namespace"], drive["restart"], drive["log_level"]) == (
        "front/left",
        "always",
        "debug",
    )
    assert processes["mapper"]["after"] == {"calibrate": "done"}
    (gate,) = processes["late"]["after"]
    assert processes[gate]["ready"] == {"time": "5 s"}
    assert (processes["stop"]["required"], processes["stop"]["run"]["args"]) == (
        True,
        ["--rate", "4"],
    )
    assert processes["calibrate"]["run"] == ["python3", str(package.parent / "calibrate.py")]


def test_what_is_not_taken_is_named_with_its_line(
    package: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, _ = import_of(source(package, "rover.launch.py", PYTHON), code=None)
    lines = PYTHON.splitlines()
    expected = ['"cameras", default', 'executable="rviz2"']
    reported = places(printed_errors(capsys), "TF020")
    for words in expected:
        line = next(
            number for number, text_line in enumerate(lines, start=1) if words in text_line
        )
        assert f"rover.launch.py:{line}" in reported
        assert f"rover.launch.py:{line}: " in text
    assert "cameras:=2" in text
    assert "rviz:=false" in text


def test_what_an_included_file_lacks_is_named_and_all_else_of_it_is_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "inner.launch.py").write_text(INNER, encoding="utf-8")
    _, data = import_of(source(tmp_path, "a.launch.py", OUTER))
    assert {name: process.get("params") for name, process in data["processes"].items()} == {
        "first": {"other": 1},
        "second": {"speed": "${args.unit}"},
    }
    reported = places(printed_errors(capsys), "TF020")
    assert reported == [
        "a.launch.py:8",
        "inner.launch.py:7",
        "inner.launch.py:8",
        "inner.launch.py:10",
    ]


OUTER = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription as Include
from launch.substitutions import LaunchConfiguration, ThisLaunchFileDir
from launch_ros.actions import Node
def generate_launch_description():
    return LaunchDescription([
        Include([ThisLaunchFileDir(), "/inner.launch.py"], launch_arguments=[("speed", LaunchConfiguration("gone"))]),
        DeclareLaunchArgument("unit", default_value="1"),
        Node(package="p", executable="e", name="second", parameters=[{"speed": LaunchConfiguration("unit")}]),
    ])
"""  # noqa: E501 (a text as its reader has it)
INNER = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
def generate_launch_description():
    return LaunchDescription([DeclareLaunchArgument("speed"),
        Node(package="p", executable="e", name="first",
             parameters=[{"speed": LaunchConfiguration("speed"), "other": 1}]),
        Node(package="p", executable="e", name="third", namespace=LaunchConfiguration("speed"))])
"""


def test_what_python_makes_at_random_is_the_same_at_each_import(tmp_path: Path) -> None:
    file = source(tmp_path, "a.launch.py", RANDOM)
    text, data = import_of(file)
    assert len(data["processes"]["n"]["remap"]) == 8
    assert text == import_of(file)[0]


RANDOM = """
import tempfile
from launch import LaunchDescription
from launch_ros.actions import Node
from nav2_common.launch import ParseMultiRobotPose
def generate_launch_description():
    assert not ParseMultiRobotPose("robots").value()
    return LaunchDescription([Node(package="p", executable="e", name="n", arguments=[tempfile.mktemp(suffix=".sdf")],
                                   remappings={(word, f"other_{word}") for word in "abcdefgh"})])
"""  # noqa: E501 (a text as its reader has it)


def test_files_that_a_launch_file_writes_come_with_the_robot_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, data = import_of(source(tmp_path, "a.launch.py", WRITING))
    process = data["processes"]["n"]
    assert process["params"]["file"] == "a_params/tmp0.yaml"
    assert process["run"]["args"] == [
        "-d",
        "${file(a_params/view.rviz)}",
        "${file(a_params/tmp1.txt)}",
    ]
    made = {path.name: path.read_text("utf-8") for path in (tmp_path / "a_params").iterdir()}
    assert yaml.safe_load(made["tmp0.yaml"])["n"]["ros__parameters"] == {"speed": 1.5}
    assert made["view.rviz"] == "Fixed Frame: map\n"
    assert made["tmp1.txt"] == "left right"
    assert not (tmp_path / "cache").exists()
    lines = [f"a.launch.py:{line}" for line in (20, 21)]
    assert places(printed_errors(capsys), "TF020") == lines, "an empty folder, an unused file"


WRITING = """
import os, tempfile, yaml
from pathlib import Path
from launch import LaunchDescription
from launch_ros.actions import Node
def generate_launch_description():
    here = Path(__file__).parent
    with tempfile.NamedTemporaryFile("w", suffix=".yaml", delete=False) as file:
        yaml.dump({"n": {"ros__parameters": {"speed": 1.5}}}, file)
    number, path = tempfile.mkstemp(suffix=".txt")
    os.write(number, b"left ")
    with os.fdopen(number, "a") as more:
        more.write("right")
    os.makedirs(here / "cache", exist_ok=True)
    view = here / "cache" / "view.rviz"
    view.write_text("Fixed Frame: map\\n")
    assert "map" in view.read_text()
    with open(file.name) as again:
        assert "speed" in again.read()
    os.mkdir(here / "empty")
    open(here / "unused", "w").close()
    return LaunchDescription([Node(package="p", executable="e", name="n", parameters=[file.name],
                                   arguments=["-d", str(view), path])])
"""


def test_an_address_of_a_package_that_the_source_writes_itself_is_a_text(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = source(tmp_path, "a.launch.xml", ADDRESSES)
    _, data = import_of(file)
    words = ["--mesh", "package://meshes/a.stl", "--map", "package://maps/b.yaml"]
    assert data["processes"]["n"]["run"]["args"] == words
    printed = printed_errors(capsys)
    assert "maps" in printed
    assert "meshes" not in printed


ADDRESSES = """<launch>
  <node pkg="p" exec="e" name="n"
        args="--mesh package://meshes/a.stl --map $(find-pkg-share maps)/b.yaml"/>
</launch>
"""


def test_a_double_stays_a_double_parameter_and_keeps_its_text_in_a_command(
    tmp_path: Path,
) -> None:
    file = source(tmp_path, "a.launch.py", DOUBLE)
    text, data = import_of(file)
    assert data["processes"]["n"]["run"]["args"] == ["--rate=10.0"]
    assert data["processes"]["n"]["params"] == {"rate": "${args.rate}", "topic": "10.0_hz"}
    for rate in ("10", "7"):
        robot = compiled(text, tmp_path, rate=rate).robot
        assert robot
        assert started_with(robot)["n"]["params"]["rate"] == f"{rate}.0"


DOUBLE = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
def generate_launch_description():
    rate = LaunchConfiguration("rate")
    return LaunchDescription([DeclareLaunchArgument("rate", default_value="10.0"),
        Node(package="p", executable="e", name="n", arguments=[["--rate=", rate]],
             parameters=[{"rate": rate, "topic": [rate, "_hz"]}])])
"""


#: What nav2_common makes of PARAMETERS, by the arguments of its RewrittenYaml.
REWRITES: dict[str, tuple[str, dict[str, Any]]] = {
    "a_key_at_any_depth": (
        "{'verbose': 'True'}",
        {"n": {"verbose": True, "plugin": {"rate": 5.0}}, "m": {"verbose": True}},
    ),
    "a_mapping_by_its_key": (
        "{'plugin': 'none'}",
        {"n": {"verbose": False, "plugin": "none"}, "m": {"verbose": False}},
    ),
    "a_path": (
        "{'n.ros__parameters.plugin.rate': '7', 'm.ros__parameters.verbose': 'true'},",
        {"n": {"verbose": False, "plugin": {"rate": "7"}}, "m": {"verbose": True}},
    ),
    "a_path_that_is_added": (
        "{'n.ros__parameters.map.file': 'a.yaml', 'n.plugin.depth': '1'}",
        {
            "n": {"verbose": False, "plugin": {"rate": 5.0}, "map": {"file": "a.yaml"}},
            "m": {"verbose": False},
        },
    ),
    "types": (
        "{'rate': '3', 'verbose': '1.2.3'}, convert_types=True",
        {"n": {"verbose": "1.2.3", "plugin": {"rate": 3}}, "m": {"verbose": "1.2.3"}},
    ),
    "no_types": (
        "{'rate': '3'}",
        {"n": {"verbose": False, "plugin": {"rate": "3"}}, "m": {"verbose": False}},
    ),
    "keys_and_values": (
        "{}, key_rewrites={'plugin': 'other'}, value_rewrites={'5.0': '6'}, convert_types=True",
        {"n": {"verbose": False, "other": {"rate": 6}}, "m": {"verbose": False}},
    ),
}
PARAMETERS = """
n: {ros__parameters: {verbose: false, plugin: {rate: 5.0}}}
m: {ros__parameters: {verbose: false}}
"""
REWRITTEN = """
from launch import LaunchDescription
from launch.conditions import IfCondition
from launch_ros.actions import Node
from launch_ros.descriptions import ParameterFile
from nav2_common.launch import HasNodeParams, ReplaceString, RewrittenYaml
def generate_launch_description():
    params = MADE
    return LaunchDescription([Node(package="p", executable="e", name="n", parameters=[params])])
"""


@pytest.mark.parametrize(("rewrites", "expected"), REWRITES.values(), ids=REWRITES)
def test_a_parameter_file_has_the_rewrites_of_nav2_common(
    rewrites: str, expected: dict[str, Any], tmp_path: Path
) -> None:
    made = f"RewrittenYaml('{source(tmp_path, 'nav2.yaml', PARAMETERS)}', {rewrites})"
    nodes = rewritten(made, tmp_path)
    assert {name: node["ros__parameters"] for name, node in nodes.items()} == expected


def rewritten(made: str, folder: Path) -> Any:
    """Return the one parameter file that import writes for what nav2_common makes."""
    _, data = import_of(source(folder, "a.launch.py", REWRITTEN.replace("MADE", made)))
    assert data["processes"]["n"]["params"] == {"file": "a_params/nav2.yaml"}
    (file,) = (folder / "a_params").iterdir()
    return yaml.safe_load(file.read_text("utf-8"))


@pytest.mark.parametrize(
    "made",
    [
        "RewrittenYaml(FILE, {}, root_key='front')",
        "RewrittenYaml(ReplaceString(FILE, {'5.0': '5.0'}), {}, root_key='front')",
        "RewrittenYaml(FILE, {}, root_key=HasNodeParams(FILE, 'n'), key_rewrites={})",
        "ParameterFile(RewrittenYaml(FILE, {}, root_key='$(env NAME front)'), allow_substs=True)",
    ],
)
def test_what_nav2_common_makes_of_a_file_it_makes_more_of(made: str, tmp_path: Path) -> None:
    path = repr(str(source(tmp_path, "nav2.yaml", PARAMETERS)))
    (name,) = rewritten(made.replace("FILE", path), tmp_path)
    assert name == ("True" if "HasNode" in made else "front")


def test_a_parameter_can_be_the_path_of_a_file_that_launch_makes(tmp_path: Path) -> None:
    path = source(tmp_path, "bridge.yaml", "- topic: old")
    made = f"{{'config': ReplaceString('{path}', {{'old': 'new'}})}}"
    _, data = import_of(source(tmp_path, "a.launch.py", REWRITTEN.replace("MADE", made)))
    assert data["processes"]["n"]["params"] == {"config": "${file(a_params/bridge.yaml)}"}
    assert (tmp_path / "a_params/bridge.yaml").read_text("utf-8") == "- topic: new"


def test_a_parameter_of_the_name_file_is_an_argument(tmp_path: Path) -> None:
    made = "{'file': 'model.sdf', 'x': 1.5}"
    text, data = import_of(source(tmp_path, "a.launch.py", REWRITTEN.replace("MADE", made)))
    process = data["processes"]["n"]
    assert process["params"] == {"x": 1.5}
    assert process["run"]["args"] == ["--ros-args", "-p", "file:='model.sdf'"]
    assert compiled(text, tmp_path).robot


def test_a_parameter_file_that_is_not_there_is_named_and_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = source(tmp_path, "a.launch.py", REWRITTEN.replace("MADE", "'/none/of/it.yaml'"))
    _, data = import_of(file)
    assert "params" not in data["processes"]["n"]
    assert "a.launch.py:9" in places(printed_errors(capsys), "TF020")


def test_a_file_that_nav2_common_leaves_as_it_is_is_named(tmp_path: Path) -> None:
    source(tmp_path, "nav2.yaml", PARAMETERS)
    path = repr(str(tmp_path / "nav2.yaml"))
    made = f"ReplaceString({path}, {{'5.0': '6.0'}}, condition=IfCondition('false'))"
    for unchanged in (made, f"RewrittenYaml({path}, {{}})"):
        file = source(tmp_path, "a.launch.py", REWRITTEN.replace("MADE", unchanged))
        assert import_of(file)[1]["processes"]["n"]["params"] == {"file": "nav2.yaml"}


def test_changes_in_a_file_of_a_package_that_is_not_found_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = "RewrittenYaml('package://nav2/a.yaml', {'verbose': 'true'}, root_key='front')"
    file = source(tmp_path, "a.launch.py", REWRITTEN.replace("MADE", made))
    text, _ = import_of(file, code=None)
    assert "a.launch.py:8" in places(printed_errors(capsys), "TF020")
    assert "verbose: true, all of it below: front" in text


def test_an_argument_that_is_the_clock_of_all_nodes_is_the_robots(tmp_path: Path) -> None:
    file = source(tmp_path, "a.launch.py", CLOCK)
    text, _ = import_of(file)
    for value, clock in (("true", "sim"), ("false", "wall")):
        robot = compiled(text, tmp_path, use_sim_time=value).robot
        assert robot
        assert robot.ros.clock == clock


CLOCK = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
def generate_launch_description():
    clock = {"use_sim_time": LaunchConfiguration("use_sim_time")}
    return LaunchDescription([DeclareLaunchArgument("use_sim_time", default_value="true")] + [
        Node(package="p", executable="e", name=name, parameters=[clock]) for name in ("a", "b")])
"""


SIMULATED = """<launch>
  <node pkg="p" exec="e" name="a"><param from="$(dirname)/sim.yaml"/></node>
  <node pkg="p" exec="e" name="b">
    <param from="$(dirname)/sim.yaml"/> <param name="use_sim_time" value="CLOCK"/>
  </node>
  <node pkg="p" exec="e" name="c" namespace="left"/>
  <executable cmd="ros2 topic list" name="listed"/>
</launch>
"""


def test_the_clock_of_parameter_files_is_the_robots_if_all_agree(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source(tmp_path, "sim.yaml", "a: {ros__parameters: {use_sim_time: true}}")
    file = source(tmp_path, "a.launch.xml", SIMULATED.replace("CLOCK", "true"))
    text, data = import_of(file)
    assert data["ros"]["clock"] == "sim"
    assert "for c: here they have the robot's clock" in text
    assert "a.launch.xml:6" in places(printed_errors(capsys), "TF020")
    text, data = import_of(source(tmp_path, "a.launch.xml", SIMULATED.replace("CLOCK", "false")))
    assert data["rules"] == {"TF335": "warning"}, "a clock of the source is no error"
    built = compiled(text, tmp_path)
    assert built.robot
    clocks = {
        process.name: process.params.get("use_sim_time") for process in built.robot.processes
    }
    assert (clocks["a"], clocks["b"], clocks["c"]) == ("true", False, None)


def test_the_robot_takes_a_state_publishers_clock_and_names_other_nodes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = '<param name="use_sim_time" value="true"/> </node>'
    file = source(tmp_path, "a.launch.xml", AROUND_A_COMMAND.replace("</node>", clock))
    text, data = import_of(file)
    assert data["ros"]["clock"] == "sim"
    assert "for inside, outside: here they have the robot's clock" in text
    assert "a.launch.xml:5" in places(printed_errors(capsys), "TF020")


def test_a_command_is_given_no_namespace(tmp_path: Path) -> None:
    _, data = import_of(source(tmp_path, "a.launch.xml", AROUND_A_COMMAND))
    assert data["ros"]["namespace"] == "left"
    assert data["processes"]["outside"]["namespace"] == "/"
    assert "namespace" not in data["processes"]["listed"]


AROUND_A_COMMAND = """<launch>
  <node pkg="robot_state_publisher" exec="robot_state_publisher" namespace="left">
    <param name="robot_description" value="&lt;robot name='r'>&lt;link name='l'/>&lt;/robot>"/>
  </node>
  <node pkg="p" exec="e" name="inside" namespace="left"/>
  <node pkg="p" exec="e" name="outside"/>
  <executable cmd="ros2 topic list" name="listed"/>
</launch>
"""


def test_a_description_of_an_installed_package_is_addressed_by_its_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    share = tmp_path / "install/share"
    for folder in ("ament_index/resource_index/packages", "rover_description/urdf"):
        (share / folder).mkdir(parents=True)
    (share / "ament_index/resource_index/packages/rover_description").touch()
    (share / "rover_description/urdf/rover.xacro").write_text(
        '<robot name="rover"><link name="base_link"/></robot>', encoding="utf-8"
    )
    prefixes = f"{share.parent}:{os.environ.get('AMENT_PREFIX_PATH', '')}"
    monkeypatch.setenv("AMENT_PREFIX_PATH", prefixes)
    _, data = import_of(source(tmp_path, "a.launch.xml", INSTALLED))
    assert data["parts"]["rover"]["xacro"] == "package://rover_description/urdf/rover.xacro"


INSTALLED = """<launch>
  <node pkg="robot_state_publisher" exec="robot_state_publisher">
    <param name="robot_description" value="$(command '$(find-pkg-prefix xacro)/bin/xacro
      $(find-pkg-share rover_description)/urdf/rover.xacro')"/>
  </node>
</launch>
"""


def test_arguments_that_nothing_reads_are_one_finding(
    package: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    unread = "".join(f'<arg name="unread_{number}" default="1"/>' for number in range(3))
    text = (
        f'<launch>{unread}<arg name="cameras" default="2"/><node pkg="a" exec="b" args="$(var'
        ' cameras)"/></launch>'
    )
    _, data = import_of(source(package, "unread.launch.xml", text), code=None)
    printed = printed_errors(capsys)
    assert places(printed, "TF020") == ["unread.launch.xml:1"]
    assert all(f"unread_{number}" in printed for number in range(3))
    assert list(data["args"]) == ["cameras"]


def test_arguments_are_given_and_conditions_passed_over(package: Path) -> None:
    file = source(package, "rover.launch.py", PYTHON)
    _, data = import_of(file, "cameras:=1", "rviz:=true", code=None)
    assert "camera_1" not in data["processes"]
    assert "rviz2" in data["processes"]
    assert "keys" not in data["processes"]
    out = file.with_name("imported.yaml")
    assert main(["import", str(file), "-o", str(out), "cameras:=3", "--force"]) == 0
    assert "camera_2" in load(out.read_text("utf-8"), str(out)).data["processes"]
    text, data = import_of(file, "--all-branches", code=None)
    assert data["args"] == {
        "cameras": {"default": 2, "description": "how many"},
        "rviz": {"default": False},
    }
    assert data["processes"]["rviz2"]["when"] == "${args.rviz}"
    assert data["processes"]["keys"]["when"] == "${not (args.rviz)}"
    robot = compiled(text, package).robot
    assert robot
    assert {"rviz2", "keys"} & {process.name for process in robot.processes} == {"keys"}


WITH_ARGUMENTS = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.conditions import IfCondition, LaunchConfigurationEquals, UnlessCondition
from launch.substitutions import EqualsSubstitution, LaunchConfiguration as Given
from launch_ros.actions import Node

def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument("mode", default_value="slam", choices=["slam", "fixed"]),
        DeclareLaunchArgument("rate", default_value="20"),
        DeclareLaunchArgument("loud", default_value="True"),
        DeclareLaunchArgument("height", default_value="0.5"),
        Node(package="a", executable="slam", name="slam", condition=LaunchConfigurationEquals("mode", "slam")),
        Node(package="a", executable="fixed", name="fixed",
             condition=IfCondition(EqualsSubstitution(Given("mode"), "fixed"))),
        Node(package="a", executable="b", name="b", arguments=["--mode", Given("mode"), ["--rate=", Given("rate")],
             Given("loud")], parameters=[{"rate": Given("rate"), "loud": Given("loud"),
             "topic": [Given("mode"), "/scan"], "number": [Given("rate"), "0"]}],
             remappings=[("scan", [Given("mode"), "/scan"])],
             condition=UnlessCondition(Given("loud"))),
        Node(package="tf2_ros", executable="static_transform_publisher",
             arguments=["--z", Given("height"), "--frame-id", "base_link", "--child-frame-id", "mast"]),
    ])
"""  # noqa: E501 (a text as its reader has it)


def test_launch_arguments_become_arguments_if_launch_reads_them_alike(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = source(tmp_path, "a.launch.py", WITH_ARGUMENTS)
    text, data = import_of(file, "--all-branches", code=None)
    assert data["args"] == {
        "mode": {"type": "string", "default": "slam", "choices": ["slam", "fixed"]},
        "rate": {"default": 20},
        "loud": {"default": True},
    }
    processes = data["processes"]
    assert processes["slam"]["when"] == "${args.mode == 'slam'}"
    assert processes["fixed"]["when"] == "${args.mode == 'fixed'}"
    assert processes["b"]["run"]["args"] == [
        "--mode",
        "${args.mode}",
        "--rate=${args.rate}",
        "True",
    ]
    assert processes["b"]["params"] == {
        "rate": "${args.rate}",
        "loud": True,
        "topic": "${args.mode}/scan",
        "number": 200,
    }
    assert processes["b"]["remap"] == {"scan": "${args.mode}/scan"}
    assert data["frames"]["mast"]["xyz"] == [0, 0, 0.5]
    assert sorted(places(printed_errors(capsys), "TF020")) == ["a.launch.py:11"]
    assert "rate:=20 loud:=True height:=0.5" in text
    assert compiled(text, tmp_path).robot


XML = """<launch>
  <arg name="name" default="front"/>
  <let name="twice" value="$(var name)_$(var name)"/>
  <node pkg="tf2_ros" exec="static_transform_publisher" args="--x 1 --yaw 0.5 --frame-id base_link
    --child-frame-id $(var name)_laser"/>
  <group>
    <push_ros_namespace namespace="$(var name)"/>
    <set_env name="LEVEL" value="3"/>
    <node pkg="drive" exec="drive" name="drive" if="$(eval '1 &lt; 2')" launch-prefix="gdb -ex run"
      respawn="true" respawn_delay="3.0">
      <param name="rate" value="20"/><param name="text" value="20" type="str"/>
      <param name="sub"><param name="a" value="1.5"/></param>
      <param from="$(find-pkg-share rover)/drive.yaml"/>
      <remap from="odom" to="$(var twice)"/>
      <env name="MODE" value="x"/>
    </node>
  </group>
  <executable cmd="echo $(env NO_SUCH_NAME 'a b') 'c d'" name="words"/>
  <timer period="2.0"><node pkg="late" exec="late" name="late"/></timer>
  <include file="$(dirname)/more.launch.xml"><arg name="name" value="rear"/></include>
</launch>
"""
YAML = """launch:
- arg: {name: name, default: front}
- let: {name: twice, value: "$(var name)_$(var name)"}
- node:
    pkg: tf2_ros
    exec: static_transform_publisher
    args: "--x 1 --yaw 0.5 --frame-id base_link --child-frame-id $(var name)_laser"
- group:
  - push_ros_namespace: {namespace: "$(var name)"}
  - set_env: {name: LEVEL, value: "3"}
  - node:
      pkg: drive
      exec: drive
      name: drive
      if: "$(eval '1 < 2')"
      launch-prefix: gdb -ex run
      respawn: "true"
      respawn_delay: 3.0
      param:
      - {name: rate, value: 20}
      - {name: text, value: "20", type: str}
      - {name: sub, param: [{name: a, value: 1.5}]}
      - {from: "$(find-pkg-share rover)/drive.yaml"}
      remap: [{from: odom, to: "$(var twice)"}]
      env: [{name: MODE, value: x}]
- executable: {cmd: "echo $(env NO_SUCH_NAME 'a b') 'c d'", name: words}
- timer: {period: 2.0, children: [{node: {pkg: late, exec: late, name: late}}]}
- include: {file: $(dirname)/more.launch.xml, arg: [{name: name, value: rear}]}
"""
MORE = '<launch><arg name="name"/><node pkg="scan" exec="scan" name="$(var name)_scan"/></launch>'


@pytest.mark.parametrize(
    ("name", "text"), [("rover.launch.xml", XML), ("rover.launch.yaml", YAML)]
)
def test_xml_and_yaml_say_the_same(
    name: str,
    text: str,
    package: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(package)
    source(package, "more.launch.xml", MORE)
    _, data = import_of(source(package, name, text), code=None)
    assert data["frames"]["front_laser"] == {
        "parent": "base_link",
        "xyz": [1, 0, 0],
        "rpy": [0, 0, 0.5],
    }
    processes = data["processes"]
    assert list(processes) == ["drive", "words", "rear_scan", "late"]
    assert processes["drive"]["params"] == {
        "rate": 20,
        "text": "20",
        "sub.a": 1.5,
        "file": "../drive.yaml",
    }
    assert processes["drive"]["remap"] == {"odom": "front_front"}
    assert processes["drive"]["env"] == {"LEVEL": "3", "MODE": "x"}
    assert processes["drive"]["namespace"] == "front"
    assert processes["drive"]["prefix"] == ["gdb", "-ex", "run"]
    assert (processes["drive"]["restart"], processes["drive"]["restart_delay"]) == (
        "always",
        "3 s",
    )
    assert processes["words"]["run"] == ["echo", "a b", "c d"]
    (gate,) = processes["late"]["after"]
    assert processes[gate]["ready"] == {"time": "2 s"}


BOXES_IN = {
    "boxes.launch.py": (
        """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, TimerAction
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import (
    ComposableNodeContainer, LoadComposableNodes, Node, PushRosNamespace, SetParameter, SetRemap)
from launch_ros.descriptions import ComposableNode, ParameterValue

def generate_launch_description():
    color = LaunchConfiguration("color")
    container = ComposableNodeContainer(
        name="perception", namespace="cam", package="rclcpp_components", executable="component_container_mt",
        emulate_tty=True, output="own_log", sigterm_timeout="9", arguments=["--ros-args", "--log-level", "debug"],
        composable_node_descriptions=[
            ComposableNode(
                package="image_proc", plugin="image_proc::RectifyNode", name="rectify", namespace="cam",
                parameters=[{"queue": 5, "sub": {"rate": 2.0}, "names": ["a", "b"], "n": color,
                             "text": ParameterValue(color, value_type=str)}],
                remappings=[("image", "image_raw")], extra_arguments=[{"use_intra_process_comms": True}]),
            ComposableNode(package="p", plugin="p::Never", name="never", condition=UnlessCondition(color)),
            ComposableNode(package="p", plugin="p::Color", name="color", condition=IfCondition(color)),
        ])
    return LaunchDescription([
        DeclareLaunchArgument("color", default_value="true"),
        container,
        GroupAction([
            PushRosNamespace("left"), SetParameter("speed", 3), SetRemap("scan", "scan_raw"),
            LoadComposableNodes(target_container=["/mine", "/box"], composable_node_descriptions=[
                ComposableNode(package="p", plugin="p::Grouped", name="grouped", namespace="deep",
                               remappings=[("scan", "late_rule")])]),
        ]),
        TimerAction(period=0.1, actions=[
            LoadComposableNodes(target_container="elsewhere", composable_node_descriptions=[
                ComposableNode(package="p", plugin="p::Late", name="late")])]),
        Node(package="own", executable="box", name="box", namespace="mine"),
        Node(package="rclcpp_components", executable="component_container_isolated", name="stock", namespace="",
             arguments=["--use_multi_threaded_executor", "--verbose"]),
    ])
"""  # noqa: E501 (a text as its reader has it)
    ),
    "boxes.launch.xml": (
        """<launch>
  <arg name="color" default="true"/>
  <node_container pkg="rclcpp_components" exec="component_container_mt" name="perception" namespace="cam"
    emulate_tty="true" output="own_log" sigterm_timeout="9" args="--ros-args --log-level debug">
    <composable_node pkg="image_proc" plugin="image_proc::RectifyNode" name="rectify" namespace="cam">
      <param name="queue" value="5"/><param name="sub"><param name="rate" value="2.0"/></param>
      <param name="names" value="a, b" value-sep=", "/>
      <param name="n" value="$(var color)"/><param name="text" value="$(var color)" type="str"/>
      <remap from="image" to="image_raw"/>
      <extra_arg name="use_intra_process_comms" value="true"/>
    </composable_node>
    <composable_node pkg="p" plugin="p::Never" name="never" unless="$(var color)"/>
    <composable_node pkg="p" plugin="p::Color" name="color" if="$(var color)"/>
  </node_container>
  <group>
    <push_ros_namespace namespace="left"/><set_parameter name="speed" value="3"/>
    <set_remap from="scan" to="scan_raw"/>
    <load_composable_node target="/mine/box">
      <composable_node pkg="p" plugin="p::Grouped" name="grouped" namespace="deep">
        <remap from="scan" to="late_rule"/>
      </composable_node>
    </load_composable_node>
  </group>
  <timer period="0.1">
    <load_composable_node target="elsewhere"><composable_node pkg="p" plugin="p::Late" name="late"/>
    </load_composable_node>
  </timer>
  <node pkg="own" exec="box" name="box" namespace="mine"/>
  <node pkg="rclcpp_components" exec="component_container_isolated" name="stock" namespace=""
    args="--use_multi_threaded_executor --verbose"/>
</launch>
"""  # noqa: E501 (a text as its reader has it)
    ),
    "boxes.launch.yaml": (
        """launch:
- arg: {name: color, default: "true"}
- node_container:
    pkg: rclcpp_components
    exec: component_container_mt
    name: perception
    namespace: cam
    emulate_tty: true
    output: own_log
    sigterm_timeout: 9.0
    args: --ros-args --log-level debug
    composable_node:
    - pkg: image_proc
      plugin: image_proc::RectifyNode
      name: rectify
      namespace: cam
      param:
      - {name: queue, value: 5}
      - {name: sub, param: [{name: rate, value: 2.0}]}
      - {name: names, value: [a, b]}
      - {name: n, value: $(var color)}
      - {name: text, value: $(var color), type: str}
      remap: [{from: image, to: image_raw}]
      extra_arg: [{name: use_intra_process_comms, value: "true"}]
    - {pkg: p, plugin: "p::Never", name: never, unless: $(var color)}
    - {pkg: p, plugin: "p::Color", name: color, if: $(var color)}
- group:
  - push_ros_namespace: {namespace: left}
  - set_parameter: {name: speed, value: "3"}
  - set_remap: {from: scan, to: scan_raw}
  - load_composable_node:
      target: /mine/box
      composable_node:
      - {pkg: p, plugin: "p::Grouped", name: grouped, namespace: deep, remap: [{from: scan, to: late_rule}]}
- timer:
    period: 0.1
    children:
    - load_composable_node:
        target: elsewhere
        composable_node: [{pkg: p, plugin: "p::Late", name: late}]
- node: {pkg: own, exec: box, name: box, namespace: mine}
- node:
    pkg: rclcpp_components
    exec: component_container_isolated
    name: stock
    namespace: ""
    args: --use_multi_threaded_executor --verbose
"""  # noqa: E501 (a text as its reader has it)
    ),
}


@pytest.mark.parametrize("name", BOXES_IN)
def test_composable_nodes_become_components_of_containers(name: str, tmp_path: Path) -> None:
    text, data = import_of(source(tmp_path, name, BOXES_IN[name]), code=None)
    assert data["containers"] == {
        "perception": {
            "executor": "multi",
            "namespace": "cam",
            "log_level": "debug",
            "output": "log",
            "emulate_tty": True,
            "stop": {"timeout": "9 s", "kill_timeout": "5 s"},
        },
        "box": {"package": "own", "executable": "box", "namespace": "mine"},
        "stock": {"isolation": "isolated", "executor": "multi", "args": ["--verbose"]},
        "elsewhere": {"external": True},
    }
    processes = data["processes"]
    assert processes["rectify"] == {
        "component": "image_proc/image_proc::RectifyNode",
        "container": "perception",
        "namespace": "cam",
        "params": {
            "queue": 5,
            "sub.rate": 2.0,
            "names": ["a", "b"],
            "n": "${args.color}",
            "text": "true",
        },
        "remap": {"image": "image_raw"},
        "extra_arguments": {"use_intra_process_comms": True},
    }
    assert processes["grouped"] == {
        "component": "p/p::Grouped",
        "container": "box",
        "namespace": "left/deep",
        "params": {"speed": 3},
        "remap": {"scan": "scan_raw"},
    }
    assert processes["late"]["container"] == "elsewhere"
    assert processes["late"]["after"]
    assert "never" not in processes
    assert text.count("TODO") == 2, "the argument, and what its value leaves out"
    _, data = import_of(tmp_path / name, "--all-branches", code=None)
    assert data["processes"]["never"]["when"] == "${not (args.color)}"
    assert data["processes"]["color"]["when"] == "${args.color}"
    assert data["processes"]["rectify"]["params"]["n"] == "${args.color}"


PUBLISHERS = """<launch>
  <node_container pkg="rclcpp_components" exec="component_container" name="box" namespace="">
    <composable_node pkg="tf2_ros" plugin="tf2_ros::StaticTransformBroadcasterNode" name="mount">
      <param name="translation.x" value="0.5"/><param name="rotation.z" value="1.0"/>
      <param name="rotation.w" value="0.0"/>
      <param name="frame_id" value="base_link"/><param name="child_frame_id" value="laser"/>
    </composable_node>
    <composable_node pkg="p" plugin="p::Moves" name="moves"><param name="robot_description" value="&lt;robot/>"/>
    </composable_node>
  </node_container>
  <load_composable_node target="">
    <composable_node pkg="p" plugin="p::Lost" name="lost"/>
  </load_composable_node>
</launch>
"""  # noqa: E501 (a text as its reader has it)


def test_a_static_publisher_component_is_a_frame_and_bad_ones_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, data = import_of(source(tmp_path, "a.launch.xml", PUBLISHERS), code=None)
    assert data["frames"]["laser"] == {
        "parent": "base_link",
        "xyz": [0.5, 0, 0],
        "rpy": [0, 0, "180 deg"],
    }
    assert list(data["processes"]) == ["moves"]
    lines = [
        number
        for number, line in enumerate(PUBLISHERS.splitlines(), start=1)
        if "p::Moves" in line or 'target=""' in line
    ]
    assert set(places(printed_errors(capsys), "TF020")) == {
        f"a.launch.xml:{line}" for line in lines
    }


ODD = """
from launch import LaunchDescription
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import ComposableNodeContainer, LoadComposableNodes, Node
from launch_ros.descriptions import ComposableNode
def generate_launch_description():
    return LaunchDescription([
        ComposableNodeContainer(name="bad", namespace="", package="a", executable="b",
            composable_node_descriptions=[None, 3]),
        Node(package="a", executable="b", output={"both": 3}),
        Node(package="a", executable="b", output="bogus"),
        Node(package="a", executable=LaunchConfiguration("gone")),
        LoadComposableNodes(target_container="", composable_node_descriptions=[ComposableNode(package="a", plugin="")]),
        3,
        Node(package="a", executable="c", name="sound", sigkill_timeout="-1", respawn=True, respawn_delay=float("nan")),
        ComposableNodeContainer(name="box", namespace="", package="a", executable="b", composable_node_descriptions=[
            ComposableNode(package="a", plugin="a::B::", name="odd")]),
    ])
"""  # noqa: E501 (a text as its reader has it)


def test_an_action_that_launch_would_refuse_later_does_not_end_the_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, data = import_of(source(tmp_path, "odd.launch.py", ODD), code=None)
    assert data["processes"]["sound"] == {
        "run": {"package": "a", "executable": "c"},
        "restart": "always",
    }
    assert data["processes"]["odd"] == {"component": "a/a::B::", "container": "box"}
    reported = places(printed_errors(capsys), "TF020")
    assert {f"odd.launch.py:{line}" for line in (8, 10, 11, 12, 13)} <= set(reported)


REFUSED = {
    "a.launch.xml": ("<launch>\n<group>\n<bogus/>\n</group></launch>\n", 3),
    "b.launch.xml": ('<launch>\n<node pkg="p"\n name="n"/>\n</launch>\n', 2),
    "c.launch.xml": ("<launch>\n<node\n</launch>\n", 3),
    "d.launch.yaml": ("launch:\n- arg: {name: a}\n- node: {pkg: p, exec: e, respawn: true}\n", 3),
    "e.launch.yaml": ("launch:\n- arg: {name: a\n", 2),
    "f.launch.py": (
        (
            "from launch_ros.actions import Node\n"
            "def generate_launch_description():\n"
            "    return [Node(package='p')]\n"
        ),
        3,
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_launch_refuses_is_its_error_with_its_place(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, line = REFUSED[name]
    assert main(["import", str(source(tmp_path, name, text))]) == 1
    assert places(printed_errors(capsys), "TF002") == [f"{name}:{line}"]


def test_an_include_that_launch_refuses_is_named_and_the_rest_is_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source(tmp_path, "bad.launch.xml", REFUSED["a.launch.xml"][0])
    text = """<launch>
      <include file="$(dirname)/bad.launch.xml"/>
      <node pkg="p" exec="e" name="n"/>
    </launch>"""
    _, data = import_of(source(tmp_path, "a.launch.xml", text))
    assert set(data["processes"]) == {"n"}
    printed = printed_errors(capsys)
    assert places(printed, "TF020") == ["a.launch.xml:2"]
    assert "line 3" in printed


LIFECYCLE = """
from launch import LaunchDescription
from launch.actions import EmitEvent
from launch.events import matches_action
from launch_ros.actions import LifecycleNode
from launch_ros.events.lifecycle import ChangeState
from lifecycle_msgs.msg import Transition
def generate_launch_description():
    node = LifecycleNode(package="map", executable="server", name="map_server", namespace="")
    change = ChangeState(lifecycle_node_matcher=matches_action(node),
                         transition_id=Transition.TRANSITION_ACTIVATE)
    return LaunchDescription([node, EmitEvent(event=change)])
"""


def test_an_event_that_activates_a_lifecycle_node_is_its_state(tmp_path: Path) -> None:
    _, data = import_of(source(tmp_path, "a.launch.py", LIFECYCLE))
    assert data["processes"]["map_server"]["lifecycle"] == "active"


def test_an_unnamed_node_keeps_its_name_and_its_parameters_go_to_all(
    tmp_path: Path,
) -> None:
    """__node would rename each controller that ros2_control_node loads."""
    text = """<launch>
      <node pkg="controller_manager" exec="ros2_control_node">
        <param name="rate" value="100"/>
      </node>
    </launch>"""
    imported, data = import_of(source(tmp_path, "a.launch.xml", text))
    (process,) = data["processes"].values()
    assert (process["params"], list(process["nodes"].values())) == ({"rate": 100}, [{}])
    robot = compiled(imported, tmp_path).robot
    assert robot
    files = {file.path: file.text for file in emit(robot)}
    plan = read_plan(files["plan.json"], "plan.json")
    (started,) = (process for process in plan.started if process.params_file)
    assert not [word for word in started.argv if word.startswith("__node:=")]
    assert started.params_file
    assert yaml.safe_load(files[started.params_file])["/**"]["ros__parameters"] == {"rate": 100}


LESS = """
from launch import LaunchDescription
from launch.actions import ExecuteProcess, RegisterEventHandler, SetEnvironmentVariable, SetLaunchConfiguration
from launch.event_handlers import OnProcessStart
from launch_ros.actions import Node, SetParameter
from launch_ros.substitutions import ExecutableInPackage

def generate_launch_description():
    first = Node(package="p", executable="e", name="first")
    late = Node(package="p", executable="e", name="late")
    static = "ros2 run tf2_ros static_transform_publisher --frame-id base_link --child-frame-id "
    return LaunchDescription([
        first,
        RegisterEventHandler(OnProcessStart(target_action=first, on_start=[late])),
        SetEnvironmentVariable("MODELS", "here"),
        Node(package="p", executable="e", name="shell", shell=True, arguments=["--a b", "--c"]),
        Node(package="p", executable="e", name="more", shell=True, arguments=["$HOME"]),
        ExecuteProcess(cmd=[static + "laser"], shell=True),
        ExecuteProcess(cmd=["sleep 1; " + static + "lost"], shell=True),
        ExecuteProcess(cmd=[ExecutableInPackage(package="q", executable="tool"), "--fast"]),
        SetLaunchConfiguration("launch-prefix", "nice -n 5"),
        SetLaunchConfiguration("launch-prefix-filter", "pre"),
        Node(package="p", executable="prefixed", name="prefixed"),
        SetParameter("text", "1"),
        Node(package="p", executable="e", name="last"),
    ])
"""  # noqa: E501 (a text as its reader has it)


def test_shells_prefixes_and_what_comes_later_are_as_launch_has_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, data = import_of(source(tmp_path, "a.launch.py", LESS), code=None)
    processes = data["processes"]
    assert processes["late"] == {
        "run": {"package": "p", "executable": "e"},
        "env": {"MODELS": "here"},
        "after": {"first": "started"},
    }
    assert processes["shell"]["run"]["args"] == ["--a", "b", "--c"]
    assert [name for name, process in processes.items() if "prefix" in process] == ["prefixed"]
    assert processes["prefixed"]["prefix"] == ["nice", "-n", "5"]
    assert processes["last"]["params"] == {"text": 1}
    assert processes["tool"]["run"] == {"package": "q", "executable": "tool", "args": ["--fast"]}
    assert "laser" in data["frames"]
    assert "lost" not in data["frames"]
    assert places(printed_errors(capsys), "TF020") == ["a.launch.py:17", "a.launch.py:19"]


def test_a_component_that_the_source_does_not_name_is_named_with_its_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = """
from launch import LaunchDescription
from launch_ros.actions import ComposableNodeContainer
from launch_ros.descriptions import ComposableNode

def generate_launch_description():
    camera = ComposableNode(package="camera_ros", plugin="camera::CameraNode")
    return LaunchDescription([ComposableNodeContainer(
        name="box", namespace="", package="rclcpp_components", executable="component_container",
        composable_node_descriptions=[camera])])
"""
    _, data = import_of(source(tmp_path, "a.launch.py", text), code=None)
    assert list(data["processes"]) == ["camera_node"]
    assert places(printed_errors(capsys), "TF020") == ["a.launch.py:7"]


NAMESPACED = """<launch>
  <group><push_ros_namespace namespace="leader"/>
    <node pkg="robot_state_publisher" exec="robot_state_publisher">
      <param name="robot_description" value="&lt;robot name='r'>&lt;link name='a'/>&lt;/robot>"/>
      REMAPPED
    </node>
    <node pkg="p" exec="e" name="same"/><node pkg="p" exec="e" name="below" namespace="deep"/>
  </group>
  OUTSIDE
</launch>"""


@pytest.mark.parametrize("remapped", ["", '<remap from="/tf" to="tf"/>'])
@pytest.mark.parametrize("outside", ["", '<node pkg="p" exec="e" name="outside"/>'])
def test_nodes_have_the_namespaces_that_launch_gives_them(
    remapped: str, outside: str, tmp_path: Path
) -> None:
    text = NAMESPACED.replace("REMAPPED", remapped).replace("OUTSIDE", outside)
    imported, data = import_of(source(tmp_path, "a.launch.xml", text), code=None)
    assert data["ros"]["namespace"] == "leader"
    robot = compiled(imported, tmp_path).robot
    assert robot
    nodes = {process.node for process in robot.processes if process.package}
    assert nodes == {"/leader/same", "/leader/deep/below", *(["/outside"] if outside else [])}


def test_a_second_robot_in_another_namespace_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = NAMESPACED.replace("REMAPPED", "").replace("OUTSIDE", "").replace("</launch>", "")
    second = (
        NAMESPACED.replace("<launch>", "").replace("leader", "follower").replace("same", "own")
    )
    second = second.replace("REMAPPED", "").replace("OUTSIDE", "").replace("below", "inner")
    import_of(source(tmp_path, "a.launch.xml", text + second), code=None)
    assert "follower" in printed_errors(capsys)


def test_a_parameter_file_lies_over_the_parameters_before_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    over = "/**: {ros__parameters: {a: {b: 5}}}\n/elsewhere: {ros__parameters: {d: 1}}\n"
    (tmp_path / "over.yaml").write_text(over, encoding="utf-8")
    text = f"""<launch><node pkg="p" exec="e" name="n">
      <param name="a"><param name="b" value="1"/><param name="c" value="2"/></param><param name="d" value="3"/>
      <param from="{tmp_path}/over.yaml"/><param name="e" value="4"/></node>
      <node pkg="p" exec="e" name="m"><param name="a" value="1"/><param from="{tmp_path}/none.yaml"/></node></launch>"""  # noqa: E501 (a text as its reader has it)
    _, data = import_of(source(tmp_path, "a.launch.xml", text), code=None)
    assert data["processes"]["n"]["params"] == {"file": "over.yaml", "a.c": 2, "d": 3, "e": 4}
    assert places(printed_errors(capsys), "TF020") == ["a.launch.xml:4"]


SUBSTITUTED = """
/**: {ros__parameters: {map: $(dirname)/map.yaml}}
n: {ros__parameters: {limit: $(var limit), word: "$(var limit)", home: $(env PLACE), share: $(find-pkg-share nav)}}
costmap/costmap: {ros__parameters: {radius: $(var limit)}}
"""  # noqa: E501 (a text as its reader has it)
SUBSTITUTING = """<launch><arg name="limit" default="2.5"/>
  <node pkg="p" exec="e" name="n" namespace=""><param from="$(dirname)/p.yaml" allow_substs="true"/></node>
  <node pkg="p" exec="e" name="n" namespace="b"><param from="$(dirname)/p.yaml"/></node></launch>"""  # noqa: E501 (a text as its reader has it)


def test_substitutions_in_a_parameter_file_are_made_for_the_robot_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PLACE", "barn")
    (tmp_path / "p.yaml").write_text(SUBSTITUTED, encoding="utf-8")
    file = source(tmp_path, "a.launch.xml", SUBSTITUTING)
    _, data = import_of(file, "limit:=3")
    named = [process["params"]["file"] for process in data["processes"].values()]
    assert named == ["a_params/p.yaml", "p.yaml"]
    made = yaml.safe_load((tmp_path / named[0]).read_text("utf-8"))
    assert made["n"]["ros__parameters"] == {
        "limit": 3,
        "word": "3",
        "home": "barn",
        "share": "package://nav",
    }
    assert made["/**"]["ros__parameters"] == {"map": f"{tmp_path}/map.yaml"}
    assert made["costmap/costmap"]["ros__parameters"] == {"radius": 3}
    printed = printed_errors(capsys)
    assert "limit:=3" in printed
    assert "a.launch.xml:2" in places(printed, "TF020")
    assert main(["import", str(file), "-o", str(tmp_path / "imported_again.yaml")]) == 2
    assert not (tmp_path / "imported_again.yaml").exists()


@pytest.mark.parametrize("text", ["a: $(var none)", "a: $(", "$(env PLACE):", "a: $(command x)"])
def test_substitutions_that_cannot_be_made_are_named(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "p.yaml").write_text(text, encoding="utf-8")
    _, data = import_of(source(tmp_path, "a.launch.xml", SUBSTITUTING), code=None)
    assert "params" not in data["processes"]["n"]
    assert "a.launch.xml:2" in places(printed_errors(capsys), "TF020")


#: As in bringups of MoveIt, TurtleBot 4 and Nav2.
BRINGUP = """
import launch
from launch import LaunchContext, LaunchDescription
from launch.substitutions import Command, EnvironmentVariable, PathJoinSubstitution, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare
from moveit_configs_utils import MoveItConfigsBuilder
from nav2_common.launch import HasNodeParams, LaunchConfigAsBool

def generate_launch_description():
    simple = EnvironmentVariable("NO_SUCH_SETTING", default_value="1").perform(LaunchContext())
    has_params = HasNodeParams(source_file=PathJoinSubstitution([
        FindPackageShare("arm_moveit_config"), "config", "diagnostics.yaml"]), node_name="analyzers")
    moveit = (MoveItConfigsBuilder("arm").robot_description(mappings={"ros2_control": "true"})
              .trajectory_execution(file_path="config/controllers.yaml").planning_pipelines("ompl", ["ompl"])
              .to_moveit_configs())
    xacro = Command(["xacro ", PathJoinSubstitution([FindPackageShare("no_such_arm"), "arm.xacro"]), " a:=b"])
    stop = Node(package="stop", executable="stop", parameters=[{"level": simple}])
    return LaunchDescription([
        launch.actions.DeclareLaunchArgument("loud", default_value="Yes"),
        launch.actions.DeclareLaunchArgument("quick", default_value="True"),
        Node(package="robot_state_publisher", executable="robot_state_publisher",
             parameters=[{"robot_description": ParameterValue(xacro, value_type=str)}],
             remappings=[("/tf", "tf"), ("/tf_static", "tf_static")]),
        Node(package="moveit_ros_move_group", executable="move_group", name="move_group", parameters=[
            moveit.robot_description_kinematics, moveit.trajectory_execution, moveit.planning_pipelines,
            moveit.planning_scene_monitor, moveit.joint_limits, {"loud": LaunchConfigAsBool("loud")}],
             condition=launch.conditions.IfCondition(has_params)),
        Node(package="diagnostic_aggregator", executable="aggregator_node",
             parameters=[PathJoinSubstitution([FindPackageShare("arm_moveit_config"), "config", "diagnostics.yaml"])]),
        Node(package="shy", executable="shy", name="shy",
             condition=launch.conditions.IfCondition(PythonExpression(["not ", LaunchConfigAsBool("quick")]))),
        stop,
        launch.actions.RegisterEventHandler(launch.event_handlers.OnProcessExit(
            target_action=stop, on_exit=[launch.actions.EmitEvent(event=launch.events.Shutdown())])),
    ])
"""  # noqa: E501 (a text as its reader has it)


def test_bringups_of_moveit_and_turtlebots_are_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "arm_moveit_config/config"
    config.mkdir(parents=True)
    (config.parent / "package.xml").write_text(
        "<package><name>arm_moveit_config</name></package>", encoding="utf-8"
    )
    for name, text in {
        "controllers": "{moveit_manage_controllers: true, trajectory: {names: [a, b]}}",
        "kinematics": "{arm: {kinematics_solver_timeout: 0.05}}",
        "joint_limits": "{default_scaling: 0.1}",
        "ompl_planning": "{planner: ompl}",
        "diagnostics": "{analyzers: {ros__parameters: {path: Robot}}}",
    }.items():
        (config / f"{name}.yaml").write_text(text, encoding="utf-8")
    _, data = import_of(source(tmp_path, "arm.launch.py", BRINGUP), code=None)
    processes = data["processes"]
    assert processes["move_group"]["params"] == {
        "robot_description_kinematics.arm.kinematics_solver_timeout": 0.05,
        "moveit_manage_controllers": True,
        "trajectory.names": ["a", "b"],
        "planning_pipelines": ["ompl"],
        "default_planning_pipeline": "ompl",
        "ompl.planner": "ompl",
        "publish_planning_scene": True,
        "publish_geometry_updates": True,
        "publish_state_updates": True,
        "publish_transforms_updates": True,
        "publish_robot_description": False,
        "publish_robot_description_semantic": False,
        "robot_description_planning.default_scaling": 0.1,
        "loud": True,
    }
    assert processes["analyzers"]["run"] == {
        "package": "diagnostic_aggregator",
        "executable": "aggregator_node",
    }
    assert (processes["stop"]["required"], processes["stop"]["params"]) == (True, {"level": "1"})
    (part,) = data["parts"].values()
    assert (part["xacro"], part["args"]) == ("package://no_such_arm/arm.xacro", {"a": "b"})
    assert "ros" not in data
    printed = printed_errors(capsys)
    assert "event handler" not in printed
    assert "remapped" not in printed
    _, data = import_of(tmp_path / "arm.launch.py", "--all-branches", code=None)
    assert data["processes"]["shy"]["when"] == "${not (args.quick)}"


DISPLAY = """
import os, xacro
from launch import LaunchDescription
from launch_ros.actions import Node
from ament_index_python.packages import get_package_share_directory

def generate_launch_description():
    folder = get_package_share_directory("rover")
    made = xacro.process_file(os.path.join(folder, "urdf", "rover.urdf.xacro"), mappings={"height": "0.5"}).toxml()
    return LaunchDescription([
        Node(package="robot_state_publisher", executable="robot_state_publisher", name="robot_state_publisher",
             parameters=[{"robot_description": made, "publish_frequency": 50.0}]),
        Node(package="joint_state_publisher_gui", executable="joint_state_publisher_gui"),
        Node(package="tf2_ros", executable="static_transform_publisher",
             arguments=["--frame-id", "mast", "--child-frame-id", "lamp", "--z", "0.1"]),
    ])
"""  # noqa: E501 (a text as its reader has it)
ROVER = """<robot name="rover" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="height" default="1"/>
<link name="base_link"/><link name="mast"/><link name="wheel"/>
<joint name="m" type="fixed"><parent link="base_link"/><child link="mast"/><origin xyz="0 0 $(arg height)"/></joint>
<joint name="w" type="continuous"><parent link="base_link"/><child link="wheel"/></joint></robot>
"""  # noqa: E501 (a text as its reader has it)


def test_a_robot_state_publisher_with_a_xacro_file_becomes_a_part(package: Path) -> None:
    (package.parent / "urdf").mkdir()
    source(package.parent / "urdf", "rover.urdf.xacro", ROVER)
    text, data = import_of(
        source(package, "display.launch.py", DISPLAY), "--package", f"rover={package.parent}"
    )
    assert data["parts"] == {
        "rover": {"xacro": "package://rover/urdf/rover.urdf.xacro", "args": {"height": "0.5"}},
    }
    assert data["processes"]["joint_state_publisher_gui"] == {
        "simulate": {"joints": "zero", "rate": "10 Hz"}
    }
    assert data["processes"]["joints"] == {"params": {"publish_frequency": 50}}
    robot = compiled(text, package).robot
    assert robot
    assert {(edge.name, edge.pose.xyz[2]) for edge in robot.edges} == {
        ("base_link → mast", 0.5),
        ("base_link → wheel", 0),
        ("mast → lamp", 0.1),
    }


def test_a_robot_state_publisher_with_a_urdf_becomes_links(package: Path) -> None:
    urdf = ROVER.replace('<xacro:arg name="height" default="1"/>', "").replace(
        "$(arg height)", "0.5"
    )
    source(package, "rover.urdf", urdf)
    reading = 'open(os.path.join(os.path.dirname(__file__), "rover.urdf")).read()'
    begin = DISPLAY.index("xacro.process_file")
    end = DISPLAY.index("\n", begin)
    text, data = import_of(
        source(package, "display.launch.py", DISPLAY[:begin] + reading + DISPLAY[end:])
    )
    assert data["joints"]["w"]["type"] == "continuous"
    robot = compiled(text, package).robot
    assert robot
    assert {edge.name for edge in robot.edges} == {
        "base_link → mast",
        "base_link → wheel",
        "mast → lamp",
    }


HOSTILE = """
import os, socket, subprocess, shutil
os.system("touch {mark}")
subprocess.run(["touch", "{mark}"])
for call in (lambda: subprocess.Popen(["touch", "{mark}"]), lambda: open("{mark}", "w"), lambda: os.fork(),
             lambda: os.posix_spawn("/usr/bin/touch", ["touch", "{mark}"], os.environ),
             lambda: socket.create_connection(("127.0.0.1", {port})), lambda: shutil.rmtree("{folder}")):
    try:
        call()
    except OSError:
        pass
from launch import LaunchDescription
from launch_ros.actions import Node
def generate_launch_description():
    return LaunchDescription([Node(package="a", executable="b")])
"""  # noqa: E501 (a text as its reader has it)


def test_a_launch_file_that_would_do_harm_is_contained_and_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mark, folder = tmp_path / "mark", tmp_path / "folder"
    folder.mkdir()
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        text = HOSTILE.format(mark=mark, folder=folder, port=port)
        import_of(source(tmp_path, "hostile.launch.py", text), code=None)
        server.settimeout(0)
        with pytest.raises(BlockingIOError):
            server.accept()
    assert not mark.exists()
    assert folder.is_dir()
    printed = printed_errors(capsys)
    assert places(printed, "TF020").count("hostile.launch.py:3") == 1
    for word in (
        "os.system",
        "subprocess.Popen",
        "os.fork",
        "os.posix_spawn",
        "socket.",
        "open for writing",
        "rmtree",
    ):
        assert word in printed


#: It takes the hook off, by which Python refuses, and calls the C library.
NATIVE = """
import ctypes, os, sys
import tfcompose.tools.importers.launch_process as reader
reader._REFUSED = frozenset()
libc = ctypes.CDLL(None)
made = {{
    "open": libc.open(b"{folder}/made", os.O_WRONLY | os.O_CREAT, 0o644), "creat": libc.creat(b"{folder}/made", 0o644),
    "unlink": libc.unlink(b"{folder}/kept"), "chmod": libc.chmod(b"{folder}/kept", 0), "socket": libc.socket(2, 1, 0),
    "rename": libc.rename(b"{folder}/kept", b"{folder}/made"), "kill": libc.kill(os.getppid(), 0), "fork": libc.fork(),
    "execv": libc.execl(b"/bin/true", b"true", None),
}}
libc.system(b"touch {folder}/made")
reads = open("{folder}/kept").read()
import threading
thread = threading.Thread(target=lambda: made.update(thread=0))
thread.start()
thread.join()
open(os.devnull, "w").write("nothing")
from launch import LaunchDescription
from launch_ros.actions import Node
def generate_launch_description():
    return LaunchDescription([Node(package="a", executable="b", arguments=[reads, str(made)])])
"""  # noqa: E501 (a text as its reader has it)


@pytest.mark.skipif(
    platform.machine() not in {"x86_64", "aarch64"}, reason="the kernel confines on these two"
)
def test_the_kernel_confines_a_launch_file_that_calls_the_c_library(tmp_path: Path) -> None:
    (tmp_path / "kept").write_text("what is in it", encoding="utf-8")
    _, data = import_of(
        source(tmp_path, "native.launch.py", NATIVE.format(folder=tmp_path)), code=None
    )
    reads, made = data["processes"]["b"]["run"]["args"]
    assert reads == (tmp_path / "kept").read_text("utf-8") == "what is in it"
    assert not (tmp_path / "made").exists()
    answers = yaml.safe_load(made)
    assert answers.pop("thread") == 0
    assert set(answers.values()) == {-1}


def test_a_launch_file_that_calls_the_c_library_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = "import ctypes\n\nctypes.CDLL(None)\n"
    assert main(["import", str(source(tmp_path, "native.launch.py", text))]) == 1
    assert places(printed_errors(capsys), "TF020") == ["native.launch.py:3"]


def test_a_launch_file_that_aborts_is_not_called_slow(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["import", str(source(tmp_path, "a.launch.py", "import os; os.abort()"))]) == 1
    printed = printed_errors(capsys)
    assert "SIGABRT" in printed
    assert "long" not in printed


@pytest.mark.parametrize(
    "text", ["while True: pass", "x = [0]\nwhile True: x = x * 2", "import os; os.abort()"]
)
def test_a_launch_file_without_end_is_ended(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(confined, "MOST_WALL_S", 3.0)
    assert main(["import", str(source(tmp_path, "endless.launch.py", text))]) == 1
    assert "endless.launch.py" in printed_errors(capsys)


@pytest.mark.parametrize(
    ("place", "text"),
    [
        ("a.launch.py:2", "\ndef generate_launch_description(:\n"),
        (
            "a.launch.py:3",
            "def generate_launch_description():\n    import gone\n    return 1 / 0\n",
        ),
        ("a.launch.py:2", "def generate_launch_description():\n    raise KeyboardInterrupt\n"),
        ("a.launch.py:1", "x = 1\n"),
        ("a.launch.py:1", "import os\nos._exit(0)\n"),
        ("a.launch.xml:2", "<launch>\n<node\n"),
        ("a.launch.xml:1", ""),
        ("<stdin>:2", "def generate_launch_description():\n    return 1 / 0\n"),
        ("<stdin>:1", "import os; os.abort()\ndef generate_launch_description(): pass\n"),
    ],
)
def test_a_launch_file_that_cannot_be_read_is_refused_at_its_line(
    place: str,
    text: str,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(reading, "_standard_input", text.encode)
    name = place.partition(":")[0]
    assert main(["import", "-" if name == "<stdin>" else source(tmp_path, name, text).name]) == 1
    printed = capfd.readouterr().err
    assert re.search(rf"^{re.escape(place)}:1: error\[TF00[28]\]", printed, re.MULTILINE), printed
    assert "Traceback" not in printed
    assert places(printed, "TF020") == (["a.launch.py:2"] if "gone" in text else [])


def test_ctrl_c_ends_an_import_without_a_traceback(tmp_path: Path) -> None:
    begun = tmp_path / "begun"
    os.mkfifo(begun)
    text = (
        f"def generate_launch_description():\n    open({str(begun)!r}).read()\n    while True:"
        " pass\n"
    )
    file = source(tmp_path, "endless.launch.py", text)
    words = [sys.executable, "-m", "tfcompose", "import", str(file)]
    with subprocess.Popen(
        words, stderr=subprocess.PIPE, start_new_session=True, text=True
    ) as process:
        begun.write_text("the launch file is read\n", encoding="utf-8")  # waits for its reader
        os.killpg(process.pid, signal.SIGINT)
        _, printed = process.communicate(timeout=60)
    assert (process.returncode, printed) == (130, "")


def test_no_launch_file_makes_a_traceback(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What remains of a file with parts removed or doubled is imported or refused."""
    chance = random.Random(18)
    for name, text in (
        ("a.launch.py", PYTHON),
        ("b.launch.xml", XML),
        ("c.launch.yaml", YAML),
    ):
        for _ in range(4):
            lines = text.splitlines(keepends=True)
            for _ in range(chance.randint(1, 4)):
                index = chance.randrange(len(lines))
                lines[index : index + 1] = chance.choice(
                    ([], [lines[index]] * 2, [lines[index][: len(lines[index]) // 2]])
                )
            code = main(["import", str(source(tmp_path, name, "".join(lines)))])
            printed = printed_errors(capsys)
            assert code in {0, 1, 2}
            assert "Traceback" not in printed, "".join(lines)


COMPOSED = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, TimerAction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import ComposableNodeContainer, LoadComposableNodes, Node, PushRosNamespace, SetParameter
from launch_ros.descriptions import ComposableNode

def generate_launch_description():
    mine = ComposableNodeContainer(name="mine", namespace="rear", package="my_package", executable="my_container")
    return LaunchDescription([
        DeclareLaunchArgument("rectify", default_value="false"),
        LoadComposableNodes(target_container="/front/box", composable_node_descriptions=[
            ComposableNode(package="early", plugin="early::HTTPServerNode")]),
        ComposableNodeContainer(
            name="box", namespace="front", package="rclcpp_components", executable="component_container_isolated",
            arguments=["--use_multi_threaded_executor", "--ros-args", "--log-level", "info"], output="log",
            emulate_tty=True, respawn=True, sigterm_timeout="3", sigkill_timeout="9",
            composable_node_descriptions=[
                ComposableNode(
                    package="image_proc", plugin="image_proc::RectifyNode", name="rectify", namespace="left",
                    remappings=[("image", "image_raw")], parameters=[{"size": 5, "a": {"b": [1.0, 2.0]}}],
                    extra_arguments=[{"use_intra_process_comms": True}],
                    condition=IfCondition(LaunchConfiguration("rectify"))),
                ComposableNode(package="image_proc", plugin="image_proc::CropNode", name="crop"),
            ]),
        Node(package="rclcpp_components", executable="component_container_mt", name="plain"),
        TimerAction(period=4.0, actions=[LoadComposableNodes(
            target_container="plain", composable_node_descriptions=[
                ComposableNode(package="depth", plugin="depth::Cloud", name="cloud")])]),
        LoadComposableNodes(target_container="some/where", composable_node_descriptions=[
            ComposableNode(package="demo", plugin="demo::Talker", name="talker")]),
        GroupAction([PushRosNamespace("g"), SetParameter("speed", 2), mine, LoadComposableNodes(
            target_container=mine, composable_node_descriptions=[
                ComposableNode(package="demo", plugin="demo::Talker", name="talker")])]),
    ])
"""  # noqa: E501 (a text as its reader has it)
BOX = {
    "isolation": "isolated",
    "executor": "multi",
    "namespace": "front",
    "restart": "always",
    "stop": {"timeout": "3 s", "kill_timeout": "9 s"},
    "output": "log",
    "emulate_tty": True,
    "log_level": "info",
}


def test_containers_have_their_components_whoever_loads_them(package: Path) -> None:
    file = source(package, "composed.launch.py", COMPOSED)
    _, data = import_of(file, code=None)
    assert data["containers"] == {
        "box": BOX,
        "plain": {"executor": "multi"},
        "mine": {
            "package": "my_package",
            "executable": "my_container",
            "namespace": "g/rear",
            "params": {"speed": 2},
        },
        "where": {"external": True, "namespace": "some"},
    }
    processes = data["processes"]
    (gate,) = processes["cloud"].pop("after")
    assert processes.pop(gate) == {"run": ["sleep", "4"]}
    assert processes == {
        "http_server_node": {"component": "early/early::HTTPServerNode", "container": "box"},
        "crop": {"component": "image_proc/image_proc::CropNode", "container": "box"},
        "cloud": {"component": "depth/depth::Cloud", "container": "plain"},
        "talker": {"component": "demo/demo::Talker", "container": "where"},
        "talker_2": {
            "component": "demo/demo::Talker",
            "container": "mine",
            "node": "talker",
            "namespace": "g",
            "params": {"speed": 2},
        },
    }
    _, data = import_of(file, "--all-branches", code=None)
    assert data["processes"]["rectify"] == {
        "component": "image_proc/image_proc::RectifyNode",
        "container": "box",
        "namespace": "left",
        "params": {"size": 5, "a.b": [1.0, 2.0]},
        "remap": {"image": "image_raw"},
        "extra_arguments": {"use_intra_process_comms": True},
        "when": "${args.rectify}",
    }


COMPOSED_XML = """<launch>
  <arg name="rectify" default="true"/>
  <node_container pkg="rclcpp_components" exec="component_container" name="box" namespace="front">
    <composable_node pkg="image_proc" plugin="image_proc::RectifyNode" name="rectify" unless="$(var rectify)">
      <param name="size" value="5"/>
      <remap from="image" to="image_raw"/>
      <extra_arg name="use_intra_process_comms" value="true"/>
    </composable_node>
  </node_container>
  <load_composable_node target="/front/box" if="$(var rectify)">
    <composable_node pkg="image_proc" plugin="image_proc::CropNode" name="crop"/>
  </load_composable_node>
</launch>
"""  # noqa: E501 (a text as its reader has it)


def test_components_find_their_container_though_earlier_ones_are_gone(tmp_path: Path) -> None:
    """Python gives the ``id`` of an object that is gone to another one."""
    _, data = import_of(source(tmp_path, "a.launch.py", GONE), code=None)
    containers = {name: process["container"] for name, process in data["processes"].items()}
    assert containers == {f"in_{count}": f"box_{count}" for count in range(50)}


GONE = """
from launch import LaunchDescription
from launch.actions import OpaqueFunction
from launch_ros.actions import ComposableNodeContainer
from launch_ros.descriptions import ComposableNode
def box(context, count):
    inside = [ComposableNode(package="p", plugin="p::C", name=f"in_{count}")]
    return [ComposableNodeContainer(package="p", executable="e", name=f"box_{count}", namespace="",
                                    composable_node_descriptions=inside)]
def generate_launch_description():
    return LaunchDescription([OpaqueFunction(function=box, args=[count]) for count in range(50)])
"""


def test_an_argument_that_a_command_makes_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "rover.xacro").write_text('<robot name="rover"/>', encoding="utf-8")
    text, data = import_of(source(tmp_path, "a.launch.py", SPAWNED))
    file = f"{tmp_path}/rover.xacro"
    assert data["processes"]["create"]["run"]["args"] == ["-string", file, f"-file={file}"]
    assert data["processes"]["a"]["run"] == {"launch": "gone/a.launch.py", "args": {"text": file}}
    assert places(printed_errors(capsys), "TF020") == [
        "a.launch.py:8",
        "a.launch.py:11",
        "a.launch.py:11",
    ]
    assert "U000" not in text


SPAWNED = """import os
from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription
from launch.substitutions import Command
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare
def generate_launch_description():
    return LaunchDescription([Node(package="ros_gz_sim", executable="create", arguments=[
        "-string", Command(["xacro ", os.path.join(os.path.dirname(__file__), "rover.xacro")]),
        ["-file=", os.path.join(os.path.dirname(__file__), "rover.xacro")]]),
        IncludeLaunchDescription([FindPackageShare("gone"), "/a.launch.py"], launch_arguments={
            "text": Command(["xacro ", os.path.join(os.path.dirname(__file__), "rover.xacro")])}.items())])
"""  # noqa: E501 (a text as its reader has it)


def test_a_condition_and_a_list_that_are_given_by_keyword_count(tmp_path: Path) -> None:
    file = source(tmp_path, "a.launch.py", BY_KEYWORD)
    _, data = import_of(file)
    assert set(data["processes"]) == {"kept"}
    assert data["processes"]["kept"]["params"] == {"names": ["a", "b"]}


BY_KEYWORD = """
from launch import LaunchDescription
from launch.conditions import IfCondition
from launch_ros.actions import Node
from launch_ros.descriptions import ParameterValue
def generate_launch_description():
    return LaunchDescription([
        Node(package="p", executable="e", name="gone", condition=IfCondition(predicate_expression="false")),
        Node(package="p", executable="e", name="kept", parameters=[{"names": ParameterValue(["a", "b"])}]),
    ])
"""  # noqa: E501 (a text as its reader has it)


def test_containers_of_an_xml_launch_file_too(package: Path) -> None:
    file = source(package, "composed.launch.xml", COMPOSED_XML)
    _, data = import_of(file, "--all-branches", code=None)
    assert data["containers"] == {"box": {"namespace": "front"}}
    assert data["processes"] == {
        "rectify": {
            "component": "image_proc/image_proc::RectifyNode",
            "container": "box",
            "params": {"size": 5},
            "remap": {"image": "image_raw"},
            "extra_arguments": {"use_intra_process_comms": True},
            "when": "${not (args.rectify)}",
        },
        "crop": {
            "component": "image_proc/image_proc::CropNode",
            "container": "box",
            "when": "${args.rectify}",
        },
    }
