"""colcon builds the repository, and ROS's commands find what it installs."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

import pytest

from tests.support.workspace import Workspace

if TYPE_CHECKING:
    from pathlib import Path

pytest.importorskip("ros2cli", reason="the ros2 command comes with a distribution only")
if shutil.which("colcon") is None:
    pytest.skip("there is no colcon", allow_module_level=True)
pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("colcon")]
LINT = "lint $(ros2 pkg prefix --share tfcompose)/robots/picker.yaml"


@pytest.fixture(scope="module", params=[(), ("--symlink-install",)], ids=["copied", "linked"])
def workspace(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Workspace:
    made = Workspace(tmp_path_factory.mktemp("colcon") / "ws")
    made.add_repository()
    done = made.colcon("build", *request.param)
    assert (done.returncode, "1 package finished" in done.stdout) == (0, True), done.stderr
    assert "had stderr output" not in done.stdout, done.stderr
    return made


@pytest.mark.parametrize(
    "program", ["ros2 run tfcompose tfcompose", "ros2 tfcompose", "tfcompose"]
)
def test_each_way_to_start_it_lints_a_robot_of_its_share_folder(
    workspace: Workspace, program: str
) -> None:
    done = workspace.run(f"{program} {LINT}")
    assert (done.returncode, done.stdout) == (0, "no findings in 1 file\n"), done.stderr
    assert workspace.run(f"{program} lint none.yaml").returncode == 2


def test_the_program_on_the_path_is_that_of_the_workspace(workspace: Workspace) -> None:
    program = workspace.folder / "install" / "tfcompose" / "bin" / "tfcompose"
    assert workspace.run("command -v tfcompose").stdout == f"{program}\n"


def test_ros_knows_the_package(workspace: Workspace) -> None:
    prefix = workspace.folder / "install" / "tfcompose"
    assert workspace.run("ros2 pkg prefix tfcompose").stdout == f"{prefix}\n"
    assert workspace.run("ros2 pkg executables tfcompose").stdout == "tfcompose tfcompose\n"
    script = (
        "from ament_index_python.packages import get_package_share_directory as share;"
        "print(share('tfcompose'))"
    )
    share = workspace.run(f'python3 -c "{script}"').stdout.strip()
    assert share == str(prefix / "share" / "tfcompose")
    assert {"package.xml", "robots", "schemas"} <= {
        file.name for file in (prefix / "share" / "tfcompose").iterdir()
    }


def test_colcon_tests_the_installed_robots_alone(workspace: Workspace) -> None:
    robots = workspace.folder / "install" / "tfcompose" / "share" / "tfcompose" / "robots"
    robot = robots / "wrong.yaml"
    robot.write_text("tfcompose: 1\nrobot: wrong\nframes: {a: {parent: b}}\n", "utf-8")
    count = len(list(robots.glob("*.yaml"))) + 1
    try:
        assert workspace.colcon("test").returncode == 0
        result = workspace.colcon("test-result", "--verbose")
    finally:
        robot.unlink()
    assert result.returncode == 1
    assert f"Summary: {count} tests, 0 errors, 2 failures, 0 skipped" in result.stdout
    assert f"{robot}:3:22: error[TF203]" in result.stdout


def test_the_source_folder_stays_as_it_was(workspace: Workspace, tmp_path: Path) -> None:
    built = {file.name for file in (workspace.source / "tfcompose").iterdir()}
    again = Workspace(tmp_path).add_repository()
    assert built == {file.name for file in again.iterdir()}
