"""``tfcompose echo`` on the real thing."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from tfcompose.plan import PlanProcess, Simulation
from tfcompose.pose import Pose, quat_from_rpy

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path
    from typing import Protocol

    from tfcompose.plan import PlanEdge

    class Started(Protocol):
        """A process under test, as conftest starts it."""

        def until_says(self, text: str) -> None: ...
        def end(self) -> tuple[int, float]: ...


pytestmark = pytest.mark.ros

DOWN_15 = Pose((0.2, 0.0, 0.1), quat_from_rpy(0, math.radians(15), 0))


@pytest.fixture
def rover(write: Callable[..., Path], start: Callable[..., Started], edge: Callable[..., PlanEdge]) -> None:
    """A base that stands at x = 2 in odom, with a camera that looks down 15 degrees, and a tree of its own beside."""
    edges = [edge("odom base_link", "drive"), edge("base_link camera", pose=DOWN_15), edge("world table")]
    drive = PlanProcess("drive", "simulate", simulate=Simulation("fixed", 50.0, pose=Pose((2.0, 0.0, 0.0))))
    plan = write(edges, PlanProcess("static", "static"), drive)
    for module, name in (("static", "static"), ("simulate", "drive")):
        started = start(f"tfcompose.run.{module}", plan, name)
        started.until_says("edge")


def echo(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tfcompose", "echo", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)


@pytest.mark.usefixtures("rover")
def test_once_prints_the_pose_in_metres_quaternion_radians_and_degrees() -> None:
    done = echo("odom", "camera", "--once")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("pose of camera in odom at ")
    assert "xyz        [2.2000, 0.0000, 0.1000] m" in done.stdout
    assert "rpy        [0.0000, 0.2618, 0.0000] rad" in done.stdout
    assert "[0.00, 15.00, 0.00] deg" in done.stdout


@pytest.mark.usefixtures("rover")
def test_json_is_one_object_a_line_until_a_signal_ends_it_with_exit_code_0() -> None:
    command = [sys.executable, "-m", "tfcompose", "echo", "odom", "camera", "--rate", "20", "--format", "json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        rows = [json.loads(process.stdout.readline()) for _ in range(3)]
        process.send_signal(signal.SIGINT)
        assert process.wait(10) == 0
    for row in rows:
        assert (row["parent"], row["child"]) == ("odom", "camera")
        assert row["xyz"] == pytest.approx([2.2, 0, 0.1])
        assert row["quat_xyzw"] == pytest.approx(DOWN_15.quat_xyzw)
        assert row["rpy"] == pytest.approx([0, math.radians(15), 0])
    stamps = [row["stamp_ns"] for row in rows]
    assert stamps == sorted(set(stamps)), "each line has a newer time"


@pytest.mark.usefixtures("rover")
@pytest.mark.parametrize(
    ("a", "b", "why"),
    [
        ("odom", "camra", "no frame camra; did you mean camera?"),
        ("odom", "table", "odom and table are in two trees"),
    ],
)
def test_a_miss_says_why_and_ends_with_exit_code_1(a: str, b: str, why: str) -> None:
    done = echo(a, b, "--timeout", "1.5")
    assert done.returncode == 1
    assert done.stdout == ""
    assert f"no pose of {b} in {a}: " in done.stderr
    assert why in done.stderr


def test_when_the_owner_falls_silent_it_says_so_and_ends(
    write: Callable[..., Path], start: Callable[..., Started], edge: Callable[..., PlanEdge]
) -> None:
    drive = PlanProcess("drive", "simulate", simulate=Simulation("fixed", 50.0))
    owner = start("tfcompose.run.simulate", write([edge("odom base_link", "drive")], drive), "drive")
    command = [sys.executable, "-m", "tfcompose", "echo", "odom", "base_link", "--rate", "20", "--timeout", "1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout
        assert process.stdout.readline().startswith("pose of base_link in odom")
        owner.end()
        _, errors = process.communicate(timeout=20)
    assert process.returncode == 1
    assert "nothing new came on odom → base_link for 1." in errors


@pytest.mark.usefixtures("domain")
def test_where_nothing_is_published_it_says_so() -> None:
    done = echo("odom", "base_link", "--once", "--timeout", "0.5")
    assert done.returncode == 1
    assert "no TF message came" in done.stderr
