"""Launch files of ROS 1, imported without launch, and what is said where launch is not there."""

import io
import random
import sys
from pathlib import Path

import pytest

from tests.support.bringups import compiled, import_of, places, printed_errors
from tests.support.importing import PRESETS
from tfcompose.cli import compiling, main, reading
from tfcompose.tools.importers import launch


@pytest.fixture(autouse=True)
def _without_launch(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiling, "library", lambda: PRESETS)
    monkeypatch.setattr(launch, "has_launch", lambda: False)


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """The folder launch of a package in a source tree."""
    folder = tmp_path / "rover"
    (folder / "launch").mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>rover</name></package>", encoding="utf-8")
    return folder / "launch"


def source(folder: Path, name: str, text: str) -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.launch.py", "def generate_launch_description(): pass\n"),
        ("a.launch.xml", "<launch><node pkg='p' exec='e'/></launch>"),
        ("a.launch", "<launch><include file='$(find-pkg-share p)/a.launch.xml'/></launch>"),
        ("a.launch.yaml", "launch: []\n"),
        ("-", "<launch><node pkg='p' exec='e'/></launch>"),
    ],
)
def test_a_ros_2_launch_file_needs_launch_and_a_finding_tells_how(
    name: str,
    text: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(reading, "_standard_input", text.encode)
    file = name if name == "-" else str(source(tmp_path, name, text))
    assert main(["import", file]) == 2
    printed = printed_errors(capsys)
    assert places(printed, "TF901") == ["<stdin>:1" if name == "-" else f"{name}:1"]
    assert "setup" in printed


ROS1 = """<launch>
  <arg name="height" default="0.1"/>
  <node pkg="tf" type="static_transform_publisher" name="a" args="0.2 0 $(arg height) 0 0 0 base_link laser 100"/>
  <node pkg="tf2_ros" type="static_transform_publisher" name="b" args="0.1 0 0.2 0 0 0 1 base_link camera"/>
  <node pkg="tf2_ros" type="static_transform_publisher" name="c" args="0 0 0 -1.5707963 0 -1.5707963 camera optical"/>
  <group ns="front"><node pkg="drive" type="drive.py" name="drive" required="true"/></group>
</launch>
"""  # noqa: E501 (a text as its reader has it)


def test_launch_files_of_ros_1_are_read(tmp_path: Path) -> None:
    text, data = import_of(source(tmp_path, "robot.launch", ROS1), "height:=0.4")
    assert data["frames"] == {
        "base_link": {},
        "laser": {"parent": "base_link", "xyz": [0.2, 0, 0.4]},
        "camera": {"parent": "base_link", "xyz": [0.1, 0, 0.2]},
        "optical": {"parent": "camera", "rpy": [-1.5707963, 0, -1.5707963]},
    }
    assert data["processes"]["drive"] == {
        "run": {"package": "drive", "executable": "drive.py"},
        "namespace": "front",
        "required": True,
    }
    robot = compiled(text, tmp_path).robot
    assert robot


ROS1_DESCRIBED = """<launch>
  <param name="robot_description"
    command="$(find xacro)/xacro '$(find rover)/rover.xacro' wheels:=4"/>
  <param name="rate" value="20"/>
  <node pkg="robot_state_publisher" type="robot_state_publisher" name="robot_state_publisher"/>
  <node pkg="rviz" type="rviz" name="rviz" args="-d '$(find rover)/rviz/a b.rviz' --fullscreen"/>
</launch>
"""


def test_a_description_and_quotes_of_ros_1_are_read(
    package: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (package.parent / "rover.xacro").write_text(
        '<robot name="rover" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:arg name="wheels"'
        ' default="2"/><link name="base_link"/></robot>',
        encoding="utf-8",
    )
    _, data = import_of(source(package, "rover.launch", ROS1_DESCRIBED))
    (part,) = data["parts"].values()
    assert part["args"] == {"wheels": "4"}
    assert part["xacro"].endswith("rover.xacro")
    assert data["processes"]["rviz"]["run"]["args"] == [
        "-d",
        f"{package.parent}/rviz/a b.rviz",
        "--fullscreen",
    ]
    assert data["processes"]["rviz"]["params"] == {"rate": 20}
    assert places(printed_errors(capsys), "TF020") == ["rover.launch:5"]  # rate


def test_a_launch_file_comes_from_standard_input(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    reading._standard_input.cache_clear()
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(ROS1.encode())))
    assert main(["import", "-"]) == 0
    reading._standard_input.cache_clear()
    assert (
        "# <stdin>:3: in the order x y z yaw pitch roll frame child period"
        in capsys.readouterr().out
    )


SCOPES = """<launch>
  <arg name="sim" default="false"/>
  <arg name="side" default="left" doc="which  arm"/>
  <arg name="fixed" value="7"/>
  <env name="LEVEL" value="$(optenv NO_SUCH_LEVEL a b)"/>
  <remap from="scan" to="$(arg side)/scan"/>
  <group ns="front" unless="$(arg sim)">
    <env name="MODE" value="x"/>
    <node pkg="p" type="e" name="a" args="--side $(arg side) --n=$(eval 1)" launch-prefix="nice -n 5"
      respawn="true" respawn_delay="3"/>
    <node pkg="p" type="e" name="b" args="--side $(arg side) '$(arg fixed) 8'" ns="deep" output="log">
      <param name="k" value="1.5"/><param name="t" value="4" type="str"/>
      <remap from="odom" to="odometry"/>
      <env name="OWN" value="$(arg side)"/>
    </node>
  </group>
  <node pkg="p" type="e" name="gone" if="$(eval arg('fixed') == 8)"/>
  <node pkg="p" type="e" name="kept" if="$(eval fixed == 7)"/>
  <include file="$(dirname)/inner.launch"><arg name="side" value="$(arg side)"/></include>
  <include file="$(find gone)/launch/other.launch" ns="far"><arg name="x" value="$(arg side)"/></include>
  <rosparam command="load" file="a.yaml"/>
  <node pkg="p" type="e" name="told" bogus="1"/>
</launch>
"""  # noqa: E501 (a text as its reader has it)
INNER = """<launch><arg name="side"/><arg name="other" default="3"/>
<node pkg="p" type="e" name="inner" args="$(arg side) $(arg other)"/></launch>
"""


def test_scopes_arguments_and_conditions_of_ros_1(
    package: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source(package, "inner.launch", INNER)
    file = source(package, "a.launch", SCOPES)
    _, data = import_of(file, code=None)
    processes = data["processes"]
    common = {"remap": {"scan": "${args.side}/scan"}}
    run = {"package": "p", "executable": "e"}
    level = {"LEVEL": "a b"}
    assert data["args"] == {
        "side": {"type": "string", "default": "left", "description": "which arm"}
    }
    assert set(processes) == {"b", "kept", "inner", "other", "told"}
    assert processes["b"] == {
        "run": {**run, "args": ["--side", "${args.side}", "7 8"]},
        "namespace": "front/deep",
        "params": {"k": 1.5, "t": "4"},
        "remap": {**common["remap"], "odom": "odometry"},
        "env": {**level, "MODE": "x", "OWN": "${args.side}"},
        "output": "log",
    }
    assert processes["kept"] == {"run": run, **common, "env": level}
    assert processes["inner"] == {
        "run": {**run, "args": ["${args.side}", "3"]},
        **common,
        "env": level,
    }
    assert processes["other"] == {
        "run": {"launch": "gone/other.launch", "args": {"x": "${args.side}"}},
        "namespace": "far",
        "env": level,
    }
    lines = (2, 9, 17, 20, 21, 22)
    assert {f"a.launch:{line}" for line in lines} <= set(places(printed_errors(capsys), "TF020"))
    _, data = import_of(file, "--all-branches", code=None)
    assert data["processes"]["b"]["when"] == "${not (args.sim)}"
    assert "gone" in data["processes"]


def test_launch_files_that_include_each_other_are_named(
    package: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = """<launch><node pkg="p" type="e" name="n"/>
    <include file="$(find rover)/launch/a.launch"/></launch>"""
    import_of(source(package, "a.launch", text), code=None)
    assert places(printed_errors(capsys), "TF020") == ["a.launch:2"]


def test_no_launch_file_of_ros_1_makes_a_traceback(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What remains of a file with parts removed or doubled is imported or refused."""
    chance = random.Random(18)
    for text in (ROS1, SCOPES) * 3:
        lines = text.splitlines(keepends=True)
        for _ in range(chance.randint(1, 4)):
            index = chance.randrange(len(lines))
            kept = lines[index]
            lines[index : index + 1] = chance.choice(([], [kept] * 2, [kept[: len(kept) // 2]]))
        file = source(tmp_path, "a.launch", "".join(lines))
        assert main(["import", str(file)]) in {0, 1, 2}
        assert "Traceback" not in printed_errors(capsys), "".join(lines)
