"""``tfcompose init --package``: colcon builds and tests the package, ``ros2 launch`` starts it."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.support.cli import tfcompose_in
from tests.support.ros2_launch import Ros2Launch, needs_ros2_launch
from tests.support.ros2_launch import ros2_launch as _fixture
from tests.support.workspace import Workspace

if TYPE_CHECKING:
    import subprocess

COLCON = shutil.which("colcon")
if COLCON is None:
    pytest.skip("there is no colcon", allow_module_level=True)
pytestmark = [
    pytest.mark.ros,
    pytest.mark.slow,
    pytest.mark.xdist_group("colcon"),
    needs_ros2_launch,
]
ros2_launch = _fixture
ROBOT = "rover_bringup/robots/rover.tfc.yaml"
#: ament_cmake is in a distribution, or beside colcon.
PREFIX = f"-DCMAKE_PREFIX_PATH={Path(COLCON).parents[1]}"


@pytest.fixture(
    scope="module",
    params=[
        ((), ()),
        ((), ("--symlink-install",)),
        (("--cmake",), ("--cmake-args", PREFIX)),
        (("--cmake",), ("--symlink-install", "--cmake-args", PREFIX)),
    ],
    ids=["python", "python linked", "cmake", "cmake linked"],
)
def workspace(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Workspace:
    init, build = request.param
    made = Workspace(tmp_path_factory.mktemp("package") / "ws")
    done = tfcompose_in(made.source, "init", "rover", "--package", "rover_bringup", *init)
    assert done.returncode == 0, done.stderr
    done = made.colcon("build", *build)
    assert (done.returncode, "1 package finished" in done.stdout) == (0, True), done.stderr
    assert "had stderr output" not in done.stdout, done.stderr
    return made


def test_it_is_green_and_red_after_a_mistake_in_the_robot_file(workspace: Workspace) -> None:
    green = run_colcon_test(workspace)
    assert (green.returncode, " 0 tests" in green.stdout) == (0, False), green.stdout
    robot = workspace.source / ROBOT
    text = robot.read_text("utf-8")
    before, _, after = text.partition("generic/imu, parent: base_link")
    assert after
    robot.write_text(f"{before}generic/imu, parent: base_lnk{after}", "utf-8")
    try:
        red = run_colcon_test(workspace)
    finally:
        robot.write_text(text, "utf-8")
    line, column = before.count("\n") + 1, 38
    assert red.returncode == 1
    assert f"{robot}:{line}:{column}: error[TF203]" in red.stdout


def run_colcon_test(workspace: Workspace) -> subprocess.CompletedProcess[str]:
    tested = workspace.colcon("test")
    assert tested.returncode == 0, tested.stdout + tested.stderr
    return workspace.colcon("test-result", "--verbose")


@pytest.mark.parametrize(
    "arguments",
    [("rover.tfc.yaml", "demo:=true"), ("bringup.launch.xml", "profile:=demo")],
    ids=["robot file", "launch file"],
)
def test_ros2_launch_starts_the_robot(
    workspace: Workspace, arguments: tuple[str, ...], ros2_launch: Ros2Launch
) -> None:
    installed = workspace.folder / "install" / "rover_bringup"
    prefixes = f"{installed}{os.pathsep}{os.environ['AMENT_PREFIX_PATH']}"
    launch = ros2_launch("rover_bringup", *arguments, AMENT_PREFIX_PATH=prefixes)
    launch.until_says("tree complete")
    assert launch.end() == 0, launch.output
