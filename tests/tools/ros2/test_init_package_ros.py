"""``tfcompose init --package``: colcon builds and tests the package, ``ros2 launch`` starts it."""

from __future__ import annotations

import os
import shutil
import sysconfig
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from xml.etree import ElementTree as ET

import pytest

from tests.support.bags import UP, Sent, write_bag
from tests.support.cli import tfcompose_in
from tests.support.house import ROOT
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
    pytest.mark.xdist_group("colcon package"),
    needs_ros2_launch,
]
ros2_launch = _fixture
ROBOT = "robots/rover.tfc.yaml"
#: ament_cmake is in a distribution, or beside colcon.
PREFIX = f"-DCMAKE_PREFIX_PATH={Path(COLCON).parents[1]}"


#: The folders with the installed plug-in for pytest, and with the code that it imports.
PLUGIN = os.pathsep.join((sysconfig.get_path("purelib"), str(ROOT)))
CASES = """\
robot: ../robots/rover.tfc.yaml
cases:
  - name: an IMU as declared
    bag: ../run_17
    expect: {pose: {base_link → imu_link: {xyz: [0, 0, 0.1]}}}
"""
ROBOT_FILE = ("rover.tfc.yaml", "demo:=true")
LAUNCH_FILE = ("bringup.launch.xml", "profile:=demo")
IMU: Sent = ("/tf_static", 0.0, "base_link", "imu_link", 0.0, (0.0, 0.0, 0.1), UP)


class Package(NamedTuple):
    """A workspace with a package, and where colcon leaves the results of its tests."""

    workspace: Workspace
    results: Path
    #: Whether the Python that runs pytest has tfcompose, and with it the plug-in.
    has_plugin: bool
    #: The file that ``ros2 launch`` starts, and its argument.
    launch: tuple[str, str]

    @property
    def folder(self) -> Path:
        return self.workspace.source / "rover_bringup"

    def test(self) -> subprocess.CompletedProcess[str]:
        """Run ``colcon test``; return what ``colcon test-result`` says."""
        path = os.environ["PYTHONPATH"] + (self.has_plugin * f"{os.pathsep}{PLUGIN}")
        tested = self.workspace.run(f"PYTHONPATH={path} colcon test", sourced=False)
        assert tested.returncode == 0, tested.stdout + tested.stderr
        return self.workspace.colcon("test-result", "--verbose")

    def tests(self) -> set[str]:
        """Return the names of the tests that ran."""
        cases = ET.parse(self.results).iter("testcase")  # noqa: S314 (colcon's file)
        return {case.get("name", "") for case in cases}


@pytest.fixture(
    scope="module",
    params=[
        ((), (), True, ROBOT_FILE),
        ((), ("--symlink-install",), False, LAUNCH_FILE),
        (("--cmake",), ("--cmake-args", PREFIX), False, LAUNCH_FILE),
        (("--cmake",), ("--symlink-install", "--cmake-args", PREFIX), True, LAUNCH_FILE),
    ],
    ids=["python", "python linked", "cmake", "cmake linked"],
)
def package(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Package:
    init, build, has_plugin, launch = request.param
    workspace = Workspace(tmp_path_factory.mktemp("package") / "ws")
    results = workspace.folder / "build" / "rover_bringup" / "pytest.xml"
    if init:
        results = results.parent / "test_results" / "rover_bringup" / "robots.xunit.xml"
    made = Package(workspace, results, has_plugin, launch)
    done = tfcompose_in(workspace.source, "init", "rover", "--package", "rover_bringup", *init)
    assert done.returncode == 0, done.stderr
    write_bag(made.folder / "run_17", [IMU])
    (made.folder / "test" / "rover.test.yaml").write_text(CASES, "utf-8")
    done = workspace.colcon("build", *build)
    assert (done.returncode, "1 package finished" in done.stdout) == (0, True), done.stderr
    assert "had stderr output" not in done.stdout, done.stderr
    return made


def test_it_is_green_and_red_after_mistakes(package: Package) -> None:
    green = package.test()
    assert green.returncode == 0, green.stdout
    assert ("an IMU as declared" in package.tests()) == package.has_plugin
    text = (package.folder / ROBOT).read_text("utf-8")
    before, _, after = text.partition("generic/imu, parent: base_link")
    assert after
    wrong = package.folder / "robots" / "wrong.tfc.yaml"
    wrong.write_text(f"{before}generic/imu, parent: base_lnk{after}", "utf-8")
    cases = package.folder / "test" / "rover.test.yaml"
    cases.write_text(CASES.replace("0, 0, 0.1", "0, 0, 0.2"), "utf-8")
    try:
        red = package.test()
    finally:
        wrong.unlink()
        cases.write_text(CASES, "utf-8")
    assert red.returncode == 1
    assert f"{wrong}:{before.count(chr(10)) + 1}:38: error[TF203]" in red.stdout
    assert "test/rover.test.yaml:5:21: error[TF931]" in red.stdout


def test_ros2_launch_starts_the_robot(package: Package, ros2_launch: Ros2Launch) -> None:
    """By the robot file in one layout, and in the others by the launch file that includes it."""
    installed = package.workspace.folder / "install" / "rover_bringup"
    assert (installed / "share" / "rover_bringup" / "launch" / "bringup.launch.xml").is_file()
    prefixes = f"{installed}{os.pathsep}{os.environ['AMENT_PREFIX_PATH']}"
    launch = ros2_launch("rover_bringup", *package.launch, AMENT_PREFIX_PATH=prefixes)
    launch.until_says("tree complete")
    assert launch.end() == 0, launch.output
