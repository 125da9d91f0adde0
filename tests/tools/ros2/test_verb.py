"""``ros2 tfcompose`` is ``tfcompose``: output, exit codes, help and completion."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from pathlib import Path

import pytest

from tests.support import processes

pytest.importorskip("ros2cli", reason="the ros2 command comes with a distribution only")
ROS2, TFCOMPOSE = shutil.which("ros2") or "ros2", shutil.which("tfcompose") or "tfcompose"
ROBOTS = Path(__file__).parents[3] / "robots"


def outcome(command: list[str], folder: Path) -> tuple[int, str, str]:
    done = processes.run(command, cwd=folder)
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize(
    "line",
    [
        "",
        "--help",
        "-V",
        "lint --help",
        "lint rover.yaml -- no.yaml",
        "linnt rover.yaml",
        "lint --formt json rover.yaml",
        "pose rover.yaml base_link laser",
        "lint --select TF4 rover.yaml",
    ],
)
def test_it_prints_and_ends_as_tfcompose_does(line: str) -> None:
    argv = line.split()
    ours = outcome([TFCOMPOSE, *argv], ROBOTS)
    assert outcome([ROS2, "tfcompose", *argv], ROBOTS) == ours
    assert ours[1] + ours[2]


def test_ros2_lists_it() -> None:
    lines = processes.run([ROS2, "--help"], check=True).stdout.splitlines()
    assert [line.split()[0] for line in lines if "TF tree" in line] == ["tfcompose"]


@pytest.mark.parametrize(
    ("before", "line", "expected"),
    [
        ("ros2", "tfcompose li", {"lint"}),
        ("ros2", "tfcompose lint --sel", {"--select"}),
        ("ros2 --use-python-default-buffering", "tfcompose lint two", {"two_rovers.yaml"}),
        ("/opt/tfcompose/ros2", "tfcompose up my_robot.yaml -p ", {"demo"}),
        ("ros2", "tfc", {"tfcompose"}),
    ],
)
def test_a_shell_completes_it(before: str, line: str, expected: set[str], tmp_path: Path) -> None:
    answer = tmp_path / "completions"
    typed = f"{before} {line}"
    variables = {
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_IFS": "\n",
        "_ARGCOMPLETE_STDOUT_FILENAME": str(answer),
        "_ARGCOMPLETE_SUPPRESS_SPACE": "1",
        "COMP_LINE": typed,
        "COMP_POINT": str(len(typed.encode())),
    }
    processes.run([ROS2], cwd=ROBOTS, env=os.environ | variables)
    assert {text.strip() for text in answer.read_text("utf-8").split("\n")} == expected


def test_it_is_one_process_whose_signals_are_its_own(tmp_path: Path) -> None:
    command = [ROS2, "tfcompose", "up", str(ROBOTS / "my_robot.yaml"), "-p", "demo"]
    process = processes.start(command, cwd=tmp_path, stdout=subprocess.PIPE)
    assert process.stdout
    argv = Path(f"/proc/{process.pid}/cmdline")
    for line in process.stdout:
        if "tree complete" in line:
            break
    assert "ros2" not in argv.read_bytes().split(b"\0")[1].decode()
    process.send_signal(signal.SIGINT)
    assert process.wait(20) == 0
