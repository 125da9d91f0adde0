"""``tfcompose up`` where it starts nothing: what is missing, wrong use, and a rehearsal."""

import os
import sys
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.cli import tfcompose
from tests.support.robots import ROVER

#: Takes rclpy from all that find modules.
WITHOUT_ROS = """
import sys
class Hider:
    def __init__(self, finder):
        self.finder = finder
    def find_spec(self, name, path=None, target=None):
        return None if name.partition(".")[0] == "rclpy" else self.finder.find_spec(name, path, target)
    def __getattr__(self, name):
        return getattr(self.finder, name)
sys.meta_path[:] = [Hider(finder) for finder in sys.meta_path]
"""  # noqa: E501 (a text as its reader has it)


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in a folder that has a robot, and its own folders of runs and logs."""
    (tmp_path / "runtime").mkdir(mode=0o700)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "runtime"))
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
    (tmp_path / "robot.yaml").write_text(ROVER, encoding="utf-8")


def test_without_ros_one_sentence_names_what_to_install(
    tmp_path: Path,
) -> None:
    stubs = tmp_path / "stubs"
    stubs.mkdir()
    (stubs / "sitecustomize.py").write_text(WITHOUT_ROS)
    before = sorted(tmp_path.rglob("*"))
    path = os.pathsep.join(filter(None, [str(stubs), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, "-B", "-m", "tfcompose", "up"]
    done = processes.run(command, env=os.environ | {"PYTHONPATH": path})
    assert (done.returncode, done.stdout) == (2, "")
    assert [line.split()[0] for line in done.stderr.splitlines()] == ["error[TF901]", "help:"]
    assert sorted(tmp_path.rglob("*")) == before


def test_a_middleware_that_is_missing_is_named_before_ros_is_imported() -> None:
    """ROS ends who imports it then."""
    done = processes.run(
        [sys.executable, "-m", "tfcompose", "up"],
        env=os.environ | {"RMW_IMPLEMENTATION": "rmw_none_cpp"},
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert [line.split()[0] for line in done.stderr.splitlines()] == ["error[TF901]", "help:"]


def test_settle_without_a_guard_is_wrong_use() -> None:
    assert "--settle" in tfcompose("up", "--guard", "off", "--settle", "1", code=2).stderr


def test_missing_packages_are_named_once_with_a_profile_that_needs_none(
    tmp_path: Path,
) -> None:
    simulated = "drive: {simulate: {fixed: {xyz: [0, 0, 0]}, rate: 20 Hz}}"
    missing = "drive: {run: [no_drive], node: drive}\n  more: {run: [no_more]}"
    demo = f"demo: {{processes: {{{simulated}, more: {{run: ['true']}}}}}}"
    needs_more = "sim: {processes: {more: {run: [no_sim]}}}"
    text = f"{ROVER.replace(simulated, missing)}profiles: {{{demo}, {needs_more}, idle: {{}}}}\n"
    (tmp_path / "robot.yaml").write_text(text)
    errors = tfcompose("up", "robot.yaml", "-p", "sim", code=1).stderr
    assert errors.endswith(": tfcompose up robot.yaml --profile demo\n")
    errors = tfcompose("up", "robot.yaml", code=1).stderr
    assert errors.count("error[TF810]") == 1
    assert all(name in errors.splitlines()[0] for name in ("no_drive of drive", "no_more of more"))
    assert errors.endswith(": tfcompose up robot.yaml --profile demo\n")


def test_an_error_of_a_background_launcher_is_kept(
    tmp_path: Path,
) -> None:
    code = """
import sys
from tfcompose.cli import main, starting
def broken(*_, **__): raise ZeroDivisionError("of a launcher")
starting.supervise = broken
sys.exit(main(["up", "-d"]))
"""
    up = processes.run([sys.executable, "-c", code])
    assert up.returncode == 1
    (error_file,) = (tmp_path / "log").rglob("launcher.err")
    assert str(error_file) in up.stderr
    assert "ZeroDivisionError: of a launcher" in error_file.read_text()


def test_a_dry_run_is_equal_everywhere_starts_nothing_and_writes_nothing(
    tmp_path: Path,
) -> None:
    (tmp_path / "robot.yaml").write_text(f"{ROVER}  web: {{run: [serve], cwd: .}}\n")
    dry_run = tfcompose("up", "--dry-run").stdout
    assert "folder   ${build_dir}/../.." in dry_run
    assert not (tmp_path / "build").exists()
    assert str(tmp_path) not in dry_run
    assert [
        word in dry_run for word in ("${tfcompose}", "${plan}", "odom → base_link", "20 Hz")
    ] == [True] * 4
    tfcompose("build")
    assert tfcompose("up", "build/rover/plan.json", "--dry-run").stdout == dry_run
