"""The plug-in for pytest: the same results as ``tfcompose test``, and robots for programs."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree as ET

import psutil
import pytest

from tests.support import processes
from tests.support.bags import UP, Sent, drive, write_bag
from tests.support.cli import tfcompose_in
from tests.support.waiting import TIMEOUT_S, until

PLUGIN = "tfcompose.tools.treetest.pytest_plugin"
ROBOT = """\
tfcompose: 1
robot: cart
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 50 Hz}
  laser: {parent: base_link, xyz: [0.24, 0, 0.3]}
processes:
  drive: {external: true, node: drive}
profiles:
  demo:
    processes: {drive: {simulate: {fixed: {xyz: [1, 2, 0]}, rate: 50 Hz}}}
"""
LASER: Sent = ("/tf_static", 0.0, "base_link", "laser", 0.0, (0.24, 0.0, 0.3), UP)
SUITE = """\
robot: cart.yaml
cases:
  - name: is complete
    bag: bag
    expect: {complete: 3 s}
  - name: is slow
    bag: bag
    expect:
      edges:
        odom → base_link: {rate: [10 Hz, 20 Hz]}
"""

Pytest = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "cart.yaml").write_text(ROBOT, "utf-8")
    (tmp_path / "cart.test.yaml").write_text(SUITE, "utf-8")
    write_bag(tmp_path / "bag", [LASER, *drive()])
    return tmp_path


def run_pytest(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run pytest with the plug-in, whether it is installed as an entry point or not."""
    options = ["-p", "no:tfcompose", "-p", PLUGIN, "-p", "no:cacheprovider", "-p", "no:xdist"]
    env = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    command = [sys.executable, "-m", "pytest", *options, *words]
    return processes.run(command, cwd=folder, env=env, timeout_s=6 * TIMEOUT_S)


def test_cases_have_the_results_of_tfcompose_test_at_the_same_lines(folder: Path) -> None:
    done = run_pytest(folder, "cart.test.yaml", "--junitxml", "out.xml")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "1 failed, 1 passed" in done.stdout
    ended = tfcompose_in(folder, "test")
    finding = ended.stdout[
        ended.stdout.index("cart.test.yaml:10:") : ended.stdout.index("2 cases")
    ]
    assert "error[TF931]" in finding
    assert finding in done.stdout
    assert "Traceback" not in done.stdout
    cases = {
        case.get("name"): case.find("failure")
        for case in ET.parse(folder / "out.xml").iter("testcase")  # noqa: S314
    }
    assert cases["is complete"] is None
    assert "error[TF931]" in (cases["is slow"].text or "")  # type: ignore[union-attr]


def test_the_command_of_ament_cmake_runs_the_cases(folder: Path) -> None:
    """With each warning as an error, as ament_add_pytest_test calls pytest."""
    file = folder / "cart.test.yaml"
    options = ["-We", "--junit-xml=out.xml", "--junit-prefix=cart"]
    done = run_pytest(folder, str(file), *options)
    assert "1 failed, 1 passed" in done.stdout, done.stdout + done.stderr


@pytest.mark.slow
def test_cases_are_selected_by_name_and_line(folder: Path) -> None:
    assert "1 passed, 1 deselected" in run_pytest(folder, "-k", "complete").stdout
    assert "1 passed" in run_pytest(folder, "cart.test.yaml::is complete").stdout
    done = run_pytest(folder, "--collect-only", "-q")
    assert done.stdout.splitlines()[:2] == [
        "cart.test.yaml::is complete",
        "cart.test.yaml::is slow",
    ]


def test_what_is_wrong_with_a_file_is_an_error_of_collection(folder: Path) -> None:
    (folder / "cart.test.yaml").write_text(SUITE.replace("base_link", "base_lnk"), "utf-8")
    done = run_pytest(folder)
    assert done.returncode == 2
    assert "cart.test.yaml:10:9: error[TF930]" in done.stdout
    assert "Traceback" not in done.stdout


def test_a_file_of_another_program_is_collected_only_by_name(folder: Path) -> None:
    (folder / "alerts.test.yaml").write_text("rule_files: [alerts.yaml]\ntests: []\n", "utf-8")
    assert "1 failed, 1 passed" in run_pytest(folder).stdout
    done = run_pytest(folder, "alerts.test.yaml")
    assert done.returncode == 2
    assert "error[TF101]" in done.stdout


def test_pytest_without_test_files_loads_next_to_nothing() -> None:
    code = f"import sys, pytest, {PLUGIN}; print(*sys.modules)"
    modules = set(processes.run([sys.executable, "-c", code], check=True).stdout.split())
    assert PLUGIN in modules
    heavy = {"pydantic", "yaml", "msgspec", "rclpy", "rosbags", "rich", "numpy"}
    assert not modules & heavy
    assert not {name for name in modules if name.startswith(("tfcompose.cli", "tfcompose.spec"))}


def test_the_entry_point_of_pytest_is_the_plug_in() -> None:
    text = (Path(__file__).parents[3] / "pyproject.toml").read_text("utf-8")
    assert f'[project.entry-points.pytest11]\ntfcompose = "{PLUGIN}"\n' in text


PROGRAM = """\
import time

import pytest

from tfcompose.tf.ros.node import TFPublisher, open_node
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tools.treetest.started_robot import RobotError


def test_a_robot_is_asked_and_ended(tfcompose):
    robot = tfcompose.up("cart.yaml", profile="demo").wait_complete()
    assert robot.lookup("odom", "laser").xyz == pytest.approx((1.24, 2.0, 0.3))
    assert robot.findings == []
    with pytest.raises(RobotError, match="camera"):
        robot.lookup("odom", "camera", timeout_s=0.5)
    assert robot.down() == 0
    with pytest.raises(RobotError, match="ended"):
        robot.findings


def test_a_node_of_the_test_is_in_the_robot_s_domain(tfcompose):
    robot = tfcompose.up("cart.yaml", profile="demo").wait_complete()
    with open_node("old_odometry", "") as node:
        publisher = TFPublisher(node, static=False)
        end = time.monotonic() + 60
        while not robot.findings and time.monotonic() < end:
            pose = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
            publisher.publish(encode([SentTransform(time.time_ns(), "odom", "base_link", *pose)]))
            time.sleep(0.05)
    (finding,) = robot.findings
    assert finding.code == "TF801"
    assert "/old_odometry" in finding.message


def test_a_robot_that_does_not_start_says_why(tfcompose):
    with pytest.raises(RobotError, match="TF001"):
        tfcompose.up("none.yaml").wait_complete()
    robot = tfcompose.up("cart.yaml")
    robot.lookup("base_link", "laser", timeout_s=60)
    with pytest.raises(RobotError, match="odom → base_link"):
        robot.wait_complete(timeout_s=0.1)
"""


@pytest.mark.slow
@pytest.mark.ros
def test_a_program_starts_robots_in_a_domain_of_its_own(folder: Path) -> None:
    (folder / "test_cart.py").write_text(PROGRAM, "utf-8")
    done = run_pytest(folder, "test_cart.py")
    assert "3 passed" in done.stdout, done.stdout + done.stderr


@pytest.mark.ros
def test_a_killed_pytest_leaves_no_robot(folder: Path) -> None:
    (folder / "test_cart.py").write_text(
        "import os, signal\n\n\ndef test_it(tfcompose):\n"
        "    tfcompose.up('cart.yaml', profile='demo').wait_complete()\n"
        "    open('up', 'w').close()\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n",
        "utf-8",
    )
    run_pytest(folder, "test_cart.py")
    assert (folder / "up").exists()
    assert until(lambda: not running_in(folder))


def running_in(folder: Path) -> list[int]:
    """Return the launchers of the robot file in the folder."""
    return [
        process.pid
        for process in psutil.process_iter(["cmdline"])
        if str(folder / "cart.yaml") in (process.info["cmdline"] or [])
    ]
