"""``tfcompose export``: from a robot or a built plan to files for other launchers."""

from pathlib import Path

import pytest
import yaml

from tests.support.findings import words_of
from tests.support.robots import DRIVEN, ON_TWO_HOSTS
from tfcompose.cli import main


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robot.yaml").write_text(DRIVEN, "utf-8")
    (tmp_path / "two.yaml").write_text(ON_TWO_HOSTS, "utf-8")
    return tmp_path


@pytest.mark.parametrize("kind", ["systemd", "compose", "launch"])
def test_a_robot_and_its_plan_export_alike_and_the_build_stays_complete(
    robot: Path, kind: str
) -> None:
    assert main(["build"]) == 0
    build = robot / "build" / "rover"
    before = {
        file.relative_to(build): file.read_bytes() for file in build.rglob("*") if file.is_file()
    }
    exports = []
    for words in (["build/rover/plan.json"], ["build/rover"], []):
        assert main(["export", kind, *words]) == 0
        exports.append({file.name: file.read_bytes() for file in (build / kind).iterdir()})
    assert exports[0] == exports[1] == exports[2]
    assert {name: (build / name).read_bytes() for name in before} == before
    assert Path("params/drive.yaml") in before


def test_a_built_folder_is_started_as_its_plan_is(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["build"]) == 0
    printed = []
    for file in ("build/rover/plan.json", "build/rover"):
        capsys.readouterr()
        assert main(["up", file, "--dry-run"]) == 0
        printed.append(capsys.readouterr().out)
    assert printed[0] == printed[1]
    (robot / "empty").mkdir()
    assert main(["up", "empty", "--dry-run"]) == 2


def test_a_hosts_share_is_exported_without_the_others(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def services(*words: str) -> set[str]:
        assert main(["export", "compose", "two.yaml", *words]) == 0
        text = (robot / "build" / "rover" / "compose" / "compose.yaml").read_text("utf-8")
        return set(yaml.safe_load(text)["services"])

    assert services("--host", "jetson") == {"arm_drive", "guard"}
    assert services("--host", "") == {"static", "drive", "guard"}
    assert "jetson" not in capsys.readouterr().out
    assert services() == {"static", "drive", "arm_drive", "guard"}
    assert words_of(capsys.readouterr().out) >= {"arm_drive", "jetson", "--host"}
    assert main(["export", "compose", "two.yaml", "--host", "jetsn"]) == 1
    assert " jetson?" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("kind", "options", "file"),
    [
        ("compose", [], "compose.yaml"),
        ("launch", [], "rover.launch.py"),
        ("launch", ["--format", "xml"], "rover.launch.xml"),
        ("launch", ["--format", "yaml"], "rover.launch.yaml"),
    ],
)
def test_the_plans_folder_on_the_robot_is_that_of_at(
    kind: str, options: list[str], file: str, robot: Path
) -> None:
    (robot / "robot.yaml").write_text(DRIVEN.replace("    lifecycle: active\n", ""), "utf-8")

    def export(*at_options: str) -> str:
        assert main(["export", kind, *options, *at_options]) == 0
        return (robot / "build" / "rover" / kind / file).read_text("utf-8")

    assert "/opt/rover" not in export()
    text = export("--at", "/opt/rover")
    assert "/opt/rover" in text
    assert not any(folder in text for folder in ("dirname", "'..'", ": .."))


def test_units_name_where_things_are_on_the_robot(robot: Path) -> None:
    words = [
        "--at",
        "/opt/rover",
        "--python",
        "/usr/bin/python3",
        "--setup",
        "/opt/ros/jazzy/setup.bash",
    ]
    assert main(["export", "systemd", *words]) == 0
    unit = (robot / "build" / "rover" / "systemd" / "rover-static.service").read_text("utf-8")
    assert '/opt/ros/jazzy/setup.bash -- /usr/bin/python3 -c "import os, sys; ' in unit
    assert unit.count(" exec /opt/rover/plan.json static\n") == 1
    assert str(robot) not in unit
    assert "PATH" not in unit, "the setup file says it"


STRICT = ["--set", "guard.mode=strict"]


def test_units_use_the_python_and_setup_of_their_host_unless_overridden(
    robot: Path,
) -> None:
    declared = "hosts: {jetson: {python: /opt/py, setup: [/opt/a.bash, /opt/b.bash]}, main: {}}\n"
    (robot / "two.yaml").write_text(
        ON_TWO_HOSTS.replace("processes:", f"{declared}processes:\n  static: {{host: main}}")
    )
    unit = robot / "build" / "rover" / "systemd" / "rover-arm_drive.service"
    assert main(["export", "systemd", "two.yaml", "--host", "jetson"]) == 0
    assert "/opt/a.bash /opt/b.bash" in unit.read_text("utf-8")
    assert "/opt/py -c " in unit.read_text("utf-8")
    assert (
        main(["export", "systemd", "two.yaml", "--host", "jetson", "--python", "/usr/bin/py"]) == 0
    )
    assert "/usr/bin/py -c " in unit.read_text("utf-8")


def test_a_strict_plan_has_no_launch_file_because_there_is_no_guard_in_it(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "launch", *STRICT]) == 1
    assert "--set guard.mode=watch" in capsys.readouterr().err
    assert not (robot / "build" / "rover" / "launch").exists()


def test_a_strict_plan_exports_if_a_guard_runs_and_can_fence_each_owner(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "compose", *STRICT]) == 0
    assert "fence" in words_of(capsys.readouterr().out)
    file = robot / "robot.yaml"
    text = file.read_text("utf-8").replace(
        "run: [slam, --now]", "run: slam | tee log, shell: true"
    )
    file.write_text(text, "utf-8")
    assert main(["export", "systemd", *STRICT]) == 1
    assert "slam" in words_of(capsys.readouterr().err)
    assert not (robot / "build" / "rover" / "systemd").exists()


@pytest.mark.parametrize(
    ("words", "code"),
    [(["nothere.yaml"], 2), (["nothere.json"], 2), (["plan.json", "--profile", "demo"], 2)],
)
def test_what_cannot_be_exported_writes_nothing(robot: Path, words: list[str], code: int) -> None:
    assert main(["export", "launch", *words]) == code
    assert not (robot / "build").exists()
