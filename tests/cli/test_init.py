"""``tfcompose init``: what it writes lints without a finding, builds, and starts at once."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.support import processes
from tests.support.cli import tfcompose_in
from tfcompose.cli.templates import FOLDER, TEMPLATES
from tfcompose.model.plan.file import read_plan


@pytest.mark.parametrize("template", TEMPLATES)
def test_a_template_lints_in_every_profile_and_builds_under_its_new_name(
    template: str, tmp_path: Path
) -> None:
    assert tfcompose_in(tmp_path, "init", template, "--name", "my_robot").returncode == 0
    linted = tfcompose_in(tmp_path, "lint", ".", "--fail-on", "warning")
    assert linted.returncode == 0, linted.stdout
    assert tfcompose_in(tmp_path, "build").returncode == 0
    assert (tmp_path / "build" / "my_robot" / "plan.json").is_file()


@pytest.mark.parametrize(
    ("template", "process", "program"),
    [
        ("diffbot", "base_drive", "${executable:ros_gz_bridge/parameter_bridge}"),
        ("rover", "base_drive", "${executable:ros_gz_bridge/parameter_bridge}"),
        ("arm", "simulator", "${executable:mujoco_ros2_control/ros2_control_node}"),
    ],
)
def test_profile_sim_starts_what_takes_the_simulators_place_with_its_clock(
    template: str, process: str, program: str, tmp_path: Path
) -> None:
    assert tfcompose_in(tmp_path, "init", template).returncode == 0
    assert tfcompose_in(tmp_path, "build", "-p", "sim", "-o", "out").returncode == 0
    plan = read_plan((tmp_path / "out" / "plan.json").read_text("utf-8"), "plan.json")
    started = plan.process(process)
    assert started.argv[0] == program
    assert started.argv[-1] == "use_sim_time:=true"


def test_every_template_is_listed_and_no_file_is_left_out() -> None:
    further_files = {
        file_name.removesuffix(".yaml") for _, more in TEMPLATES.values() for file_name in more
    }
    assert {file.stem for file in FOLDER.glob("*.yaml")} == TEMPLATES.keys() | further_files


@pytest.mark.ros
@pytest.mark.parametrize("template", TEMPLATES)
def test_the_command_that_it_names_starts_the_robot(
    template: str, tmp_path: Path, domain: object
) -> None:
    assert domain
    printed = tfcompose_in(tmp_path, "init", template).stdout
    (up,) = (
        line.partition("#")[0].split()
        for line in printed.splitlines()
        if line.startswith("  tfcompose up")
    )
    robot = processes.Started(
        processes.start(
            [sys.executable, "-m", *up],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
    )
    try:
        robot.until_says("tree complete")
        assert robot.end() == 0, robot.output
    finally:
        robot.close()


@pytest.mark.parametrize("existing", ["robot.yaml", "cart.yaml", "robot.schema.json"])
def test_nothing_is_replaced_and_all_or_nothing_is_made(existing: str, tmp_path: Path) -> None:
    (tmp_path / existing).write_text("mine", "utf-8")
    done = tfcompose_in(tmp_path, "init", "fleet", "--schema")
    assert (done.returncode, existing in done.stderr) == (2, True)
    assert [file.name for file in tmp_path.iterdir()] == [existing]
    assert (tmp_path / existing).read_text("utf-8") == "mine"


@pytest.mark.parametrize("name", ["3x", "a b", "", "ä", "a/b"])
def test_a_name_that_no_robot_can_have_is_refused(name: str, tmp_path: Path) -> None:
    assert tfcompose_in(tmp_path, "init", "--name", name).returncode == 2
    assert not list(tmp_path.iterdir())


def test_the_schema_is_in_the_folder_of_the_file_that_names_it(tmp_path: Path) -> None:
    assert tfcompose_in(tmp_path, "init", "-o", "a/b/arm.yaml", "--schema").returncode == 0
    (named,) = (
        line.partition("$schema=")[2]
        for line in (tmp_path / "a/b/arm.yaml").read_text("utf-8").splitlines()[:1]
    )
    assert (tmp_path / "a/b" / named).is_file()


def test_a_folder_that_refuses_files_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    done = tfcompose_in(tmp_path, "init", "-o", "file/robot.yaml")
    assert (done.returncode, "file/robot.yaml" in done.stderr) == (2, True)


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError(28, "No space left on device")])
def test_an_interrupted_init_leaves_no_file(
    error: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_file = Path.open

    def open_first(path: Path, *arguments: Any, **options: Any) -> Any:
        if path.name == "cart.yaml" and arguments == ("x",):
            raise error
        return open_file(path, *arguments, **options)

    monkeypatch.setattr(Path, "open", open_first)
    done = tfcompose_in(tmp_path, "init", "fleet")
    assert done.returncode == (130 if error is KeyboardInterrupt else 2)
    assert not list(tmp_path.iterdir())
