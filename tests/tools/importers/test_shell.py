"""Shell scripts and lines of a terminal, imported."""

import io
import json
import math
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.bringups import compiled, import_of, places, printed_errors
from tests.support.cli import tfcompose_in
from tests.support.domains import Domain
from tfcompose.cli import main, reading


@pytest.fixture(autouse=True)
def _input_of_its_own() -> Iterator[None]:
    reading._standard_input.cache_clear()
    yield
    reading._standard_input.cache_clear()


def script(folder: Path, text: str) -> Path:
    file = folder / "start.sh"
    file.write_text(text, encoding="utf-8")
    return file


def test_lines_of_a_script_become_frames_and_processes_in_their_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # from where the script is started: its files are named from there
    source = script(
        tmp_path,
        """#!/bin/bash
source /opt/ros/jazzy/setup.bash
HEIGHT="0.3"   # metres
ros2 run tf2_ros static_transform_publisher 0 0 ${HEIGHT} 0 0 0 base_link lidar &
rosrun tf static_transform_publisher 0 0 0 -1.5707963 0 -1.5707963 \\
    lidar optical 100
export RCUTILS_COLORIZED_OUTPUT=1
ROS_DOMAIN_ID=3 ros2 run drive node --ros-args -r __node:=base -r __ns:=/front -p rate:=20 -p 'name:="x y"' \\
  --params-file drive.yaml -r scan:=front/scan --log-level debug >/tmp/log 2>&1 &
ros2 launch camera rs.launch.py name:=front
python3 scripts/mission.py --fast
wait
""",  # noqa: E501 (a text as its reader has it)
    )
    (tmp_path / "drive.yaml").write_text(
        "/**: {ros__parameters: {speed: 1.5}}\n", encoding="utf-8"
    )
    _, data = import_of(source, code=None)
    assert data["frames"] == {
        "base_link": {},
        "lidar": {"parent": "base_link", "xyz": [0, 0, 0.3]},
        "optical": {"parent": "lidar", "rpy": [-1.5707963, 0, -1.5707963]},
    }
    assert list(data["processes"]) == ["base", "rs", "mission"]
    base = data["processes"]["base"]
    file = base["params"].pop("file")
    assert ((tmp_path / file).is_file(), base["params"]) == (True, {"rate": 20, "name": "x y"})
    assert base["run"] == {"package": "drive", "executable": "node"}
    assert (base["namespace"], base["remap"], base["log_level"]) == (
        "front",
        {"scan": "front/scan"},
        "debug",
    )
    assert base["env"] == {"RCUTILS_COLORIZED_OUTPUT": "1", "ROS_DOMAIN_ID": "3"}
    assert data["processes"]["rs"]["run"] == {
        "launch": "camera/rs.launch.py",
        "args": {"name": "front"},
    }
    assert data["processes"]["mission"]["run"] == ["python3", "scripts/mission.py", "--fast"]


def test_what_only_a_shell_can_do_is_a_comment_and_a_finding(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = script(
        tmp_path,
        """ros2 run tf2_ros static_transform_publisher 0 0 1 0 0 0 base_link a
sleep 3
for i in 1 2; do ros2 run drive node --id $i & done
ros2 run drive node --host $(hostname)
ros2 bag play x | tee log
ros2 run tf2_ros static_transform_publisher 0 0 1 0 0 0 base_link b 100
ros2 run tf2_ros static_transform_publisher 0 0 2 0 0 0 base_link a
""",
    )
    text, data = import_of(source)
    assert set(data["frames"]) == {"base_link", "a"}
    assert "processes" not in data
    reported = places(printed_errors(capsys), "TF020")
    assert sorted(set(reported)) == [f"start.sh:{line}" for line in range(2, 8)]
    for line in range(2, 8):
        assert f"start.sh:{line}: " in text


def test_a_program_that_only_shows_or_runs_once_is_no_process(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, data = import_of(
        script(tmp_path, "ls -la\nmkdir -p log\npkill gzserver\nros2 run drive node\n")
    )
    assert list(data["processes"]) == ["node"]
    assert places(printed_errors(capsys), "TF020") == ["start.sh:2", "start.sh:3"]


def test_degrees_are_not_guessed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = script(
        tmp_path, "ros2 run tf2_ros static_transform_publisher 0 0 1 90 0 0 base_link a\n"
    )
    _, data = import_of(source)
    assert data["frames"]["a"]["rpy"] == [0, 0, 90]
    assert "TF410" in printed_errors(capsys)


def test_lines_come_from_standard_input(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    line = (
        b"$ ros2 run tf2_ros static_transform_publisher --frame-id base_link --child-frame-id a"
        b" --x 1\n"
    )
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(line)))
    assert main(["import", "-"]) == 0
    result = compiled(capsys.readouterr().out, tmp_path)
    assert result.robot
    assert [(edge.name, edge.pose.xyz) for edge in result.robot.edges] == [
        ("base_link → a", (1, 0, 0))
    ]


PUBLISH = "ros2 run tf2_ros static_transform_publisher 0 0 1 0 0 0 base_link"


@pytest.mark.parametrize(
    "line",
    [
        f"  512  {PUBLISH} a",
        f" 513* 2026-01-02 10:00:00 {PUBLISH} a",
        f"me@host:~/ws$ {PUBLISH} a",
        f"$ {PUBLISH} a",
        f"nohup {PUBLISH} a >/dev/null 2>&1 &",
        f"xterm -e {PUBLISH} a &",
        f'gnome-terminal -- bash -c "{PUBLISH} a; exec bash"',
        f"bash -c 'source /opt/ros/jazzy/setup.bash && {PUBLISH} a'",
        '<node pkg="tf2_ros" exec="static_transform_publisher" args="0 0 1 0 0 0 base_link a"/>',
    ],
)
def test_what_stands_around_a_command_in_a_terminal_is_no_part_of_it(
    line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        sys,
        "stdin",
        io.TextIOWrapper(io.BytesIO(f"{line}\n 600  history | grep static\n".encode())),
    )
    assert main(["import", "-"]) == 0
    result = compiled(capsys.readouterr().out, tmp_path)
    assert result.robot
    assert [(edge.name, edge.pose.xyz) for edge in result.robot.edges] == [
        ("base_link → a", (0, 0, 1))
    ]
    assert not [process.name for process in result.robot.processes if process.argv]


def test_a_publisher_behind_an_unknown_program_is_named_and_prefixes_stay(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = script(
        tmp_path,
        f"""export ROS_DOMAIN_ID=7
{PUBLISH} a
sudo {PUBLISH} b
tmux send-keys -t tf "{PUBLISH} c" C-m
nice -n 5 ros2 run drive node
{PUBLISH} d 100
""",
    )
    _, data = import_of(source)
    assert set(data["frames"]) == {"base_link", "a"}
    assert data["ros"] == {"domain_id": 7}
    assert list(data["processes"].values()) == [
        {
            "run": {"package": "drive", "executable": "node"},
            "nodes": {"node": {}},
            "prefix": ["nice", "-n", "5"],
        }
    ]
    assert places(printed_errors(capsys), "TF020") == [f"start.sh:{line}" for line in (3, 4, 6)]


def test_a_text_without_anything_of_ros_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "passwd"
    source.write_text("root:x:0:0:root:/root:/bin/bash\n", encoding="utf-8")
    assert main(["import", str(source)]) == 1
    assert places(printed_errors(capsys), "TF002") == ["passwd:1"]


@pytest.mark.parametrize("word", ["x:=1", "more.sh"])
def test_a_script_takes_neither_arguments_nor_a_second_file(word: str, tmp_path: Path) -> None:
    source = script(tmp_path, "ros2 run drive node\n")
    assert main(["import", str(source), word]) == 2


def test_a_source_that_starts_nothing_is_refused(tmp_path: Path) -> None:
    source = script(tmp_path, "echo hello\n")
    assert main(["import", str(source)]) == 1


@pytest.mark.parametrize(
    "line", ['" " &', '"" &', 'exec " "', "> a &", "2>&1", "< a > b &", 'x" " > a']
)
def test_a_command_without_a_name_is_no_fault_of_the_program(line: str, tmp_path: Path) -> None:
    (tmp_path / "up.sh").write_text(f"#!/bin/sh\n{line}\nros2 run a b &\n", "utf-8")
    done = tfcompose_in(tmp_path, "import", "up.sh")
    assert done.returncode == 0, done.stderr
    assert "executable: b" in done.stdout


WORDS = (
    "[1,2]",
    "on",
    "012",
    "1e3",
    "0x1F",
    "1_000",
    '"7"',
    "['x', 'y']",
    "No",
    "+5",
    "[.5, 2.0]",
)
READER = """
import json, rclpy, sys
rclpy.init(args=sys.argv[1:])
options = {"allow_undeclared_parameters": True, "automatically_declare_parameters_from_overrides": True}
params = rclpy.create_node("n", **options).get_parameters_by_prefix("p").values()
values = {one.name: one.value for one in params}
print(json.dumps({name: list(value) if hasattr(value, "tolist") else value for name, value in values.items()}))
"""  # noqa: E501 (a text as its reader has it)


@pytest.mark.ros
def test_a_parameter_of_a_command_line_is_what_a_real_node_takes_it_for(
    tmp_path: Path, domain: Domain
) -> None:
    words = [part for index, word in enumerate(WORDS) for part in ("-p", f"p.w{index}:={word}")]
    command = [sys.executable, "-W", "ignore", "-c", READER, "--ros-args", *words]
    real = processes.run(command, env=dict(domain.environment), check=True).stdout
    line = shlex.join(["ros2", "run", "p", "e", "--ros-args", *words, "-p", "far:=.inf"])
    _, data = import_of(script(tmp_path, line))
    (process,) = data["processes"].values()
    assert process["params"].pop("far") == math.inf
    assert repr(process["params"]) == repr(json.loads(real))
    assert "args" not in process["run"]
