"""Which robot a command means that names none.

The one of this ROS domain, else of the file here, else nobody's.
"""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.robots import ROVER
from tfcompose.cli import main
from tfcompose.cli.commands import monitor
from tfcompose.cli.runs import chosen_run, other_domains, run_of_domain
from tfcompose.foundation.geometry import Pose
from tfcompose.launcher.output import Logs
from tfcompose.launcher.runtime_dir import Lock, RuntimeDir, runtime_dir_of
from tfcompose.model.plan import Plan, PlanEdge, PlanProcess, RosSettings, SourceLine
from tfcompose.model.plan.file import write_plan

PLAN = Plan("rover", "sha256:0", None, RosSettings(), (), ())
Run = Callable[..., RuntimeDir]


@pytest.fixture
def runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Run]:
    """Let a robot run, as far as others see it: its lock is held, and its plan is there."""
    (tmp_path / "runtime").mkdir(mode=0o700)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "runtime"))
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
    monkeypatch.setenv("ROS_DOMAIN_ID", "67")
    with ExitStack() as stack:

        def run(robot: str, domain: int) -> RuntimeDir:
            plan = replace(PLAN, robot=robot, ros=RosSettings(domain_id=domain))
            runtime_dir = runtime_dir_of(plan, os.environ)
            stack.callback(Lock(runtime_dir).close)
            folder = runtime_dir.plan_folder("0")
            folder.mkdir()
            (folder / "plan.json").write_text(write_plan(plan), "utf-8")
            runtime_dir.link_plan(folder)
            return runtime_dir

        yield run


def test_a_robot_of_another_domain_is_refused_with_the_command_for_it(
    runs: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    runs("rover", 71)
    assert main(["down"]) == 1
    assert "tfcompose down --robot rover@71" in capsys.readouterr().err
    assert main(["stop", "base drive"]) == 1
    assert "tfcompose stop 'base drive' --robot rover@71" in capsys.readouterr().err
    assert main(["logs"]) == 1


def test_the_domain_decides_between_robots(runs: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    rover, crawler = runs("rover", 67), runs("crawler", 72)
    assert chosen_run(None, "down").name == rover.name
    monkeypatch.setenv("ROS_DOMAIN_ID", " 72 ")
    assert chosen_run(None, "down").name == crawler.name


def test_two_robots_in_the_domain_need_a_name(
    runs: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    runs("rover", 67)
    runs("crawler", 67)
    assert main(["wait"]) == 2
    errors = capsys.readouterr().err
    assert "rover@67" in errors
    assert "crawler@67" in errors


def test_the_robot_file_of_the_folder_names_a_robot_in_its_own_domain(
    runs: Run, tmp_path: Path
) -> None:
    runs("crawler", 71)
    rover = runs("rover", 72)
    (tmp_path / "robot.yaml").write_text(ROVER, "utf-8")
    assert chosen_run(None, "down").name == rover.name
    (tmp_path / "robot.yaml").write_text("robot: [", "utf-8")
    with pytest.raises(SystemExit):
        chosen_run(None, "down")


def test_logs_are_those_of_the_newest_run_in_the_domain(
    runs: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    elsewhere = runs("crawler", 71)
    for runtime_dir, line in (
        (elsewhere, "far"),
        (replace_name(elsewhere, "rover@67", tmp_path), "near"),
    ):
        runtime_dir.folder.mkdir(exist_ok=True)
        (runtime_dir.folder / "lock").touch()
        runtime_dir.logs.mkdir(parents=True)
        (runtime_dir.logs / "drive.log").write_text(f"2026-01-01T00:00:00.000 {line}\n", "utf-8")
    assert main(["logs"]) == 0
    out = capsys.readouterr().out
    assert "near" in out
    assert "far" not in out


@pytest.mark.parametrize(
    ("words", "printed"),
    [
        ("logs", ["arm/driver_of_the_left_hand | third", "b                           | third"]),
        ("logs b --previous", ["b | second"]),
        ("logs b --since 1h", ["b | first", "b | second", "b | third"]),
    ],
)
def test_logs_begin_at_this_run_and_names_of_any_length_align(
    words: str, printed: list[str], runs: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    runtime_dir = runs("rover", 67)
    for run in ("first", "second", "third"):
        logs = Logs(runtime_dir.logs)
        for name in ("arm/driver_of_the_left_hand", "b"):
            assert logs.write(name, run) is None
        logs.close()
        time.sleep(0.002)
    assert main(words.split()) == 0
    assert capsys.readouterr().out.splitlines() == printed


@pytest.mark.parametrize(
    ("words", "code"), [("logs --previous", 1), ("logs -f --previous", 2), ("logs --since x", 2)]
)
def test_a_run_that_is_not_there_is_refused(
    words: str, code: int, runs: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = Logs(runs("rover", 67).logs)
    assert logs.write("b", "only") is None
    logs.close()
    assert main(words.split()) == code
    assert capsys.readouterr().out == ""


def replace_name(runtime_dir: RuntimeDir, name: str, tmp_path: Path) -> RuntimeDir:
    return RuntimeDir(
        name, runtime_dir.folder.with_name(name), tmp_path / "log" / "tfcompose" / name
    )


def test_the_plan_of_the_domains_robot_is_known(
    runs: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run_of_domain() is None
    rover = runs("rover", 67)
    run = run_of_domain()
    assert run is not None
    assert (run[0].name, run[1].robot) == (rover.name, "rover")
    monkeypatch.setenv("ROS_DOMAIN_ID", "1")
    assert run_of_domain() is None


def test_a_run_of_the_same_robot_in_another_domain_is_named(runs: Run) -> None:
    runs("rover", 71)
    runs("crawler", 71)
    (warning,) = other_domains(runs("rover", 67))
    assert "--robot rover@71" in warning


def test_two_files_with_one_robots_name_do_not_share_a_folder_silently(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a.yaml", "b.yaml"):
        (tmp_path / name).write_text(ROVER, "utf-8")
    assert (
        main(["build", "a.yaml"])
        == main(["build", "a.yaml"])
        == main(["build", "b.yaml", "-o", "b"])
        == 0
    )
    assert capsys.readouterr().err == ""
    assert main(["build", "b.yaml"]) == 0
    assert "a.yaml" in capsys.readouterr().err
    (tmp_path / "b.yaml").unlink()
    assert main(["build", "a.yaml"]) == 0
    assert capsys.readouterr().err == ""


def test_monitor_takes_the_topics_of_the_robot_in_the_domain(
    runs: Run, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert monitor._namespace_here() == ""
    edges = [("odom", "base", "drive"), ("odom2", "base2", "drive2")]
    remaps = {"drive": {"/tf": "/robot1/tf"}, "drive2": {"/tf": "/robot2/tf"}}
    planned = tuple(
        PlanEdge(a, b, "dynamic", owner, f"/{owner}", Pose(), 10.0, SourceLine("r.yaml", 1))
        for a, b, owner in edges
    )
    processes = tuple(PlanProcess(name, "external", remap=remap) for name, remap in remaps.items())
    small = replace(PLAN, edges=planned[:1], processes=processes[:1])
    runtime_dir = runs("rover", 67)
    monkeypatch.setattr("tfcompose.cli.runs.plan_of_run", lambda _: small)
    assert monitor._namespace_here() == "/robot1"
    assert runtime_dir.name in capsys.readouterr().err
    monkeypatch.setattr(
        "tfcompose.cli.runs.plan_of_run",
        lambda _: replace(PLAN, edges=planned, processes=processes),
    )
    with pytest.raises(SystemExit):
        monitor._namespace_here()
    assert "--namespace /robot1 or --namespace /robot2" in capsys.readouterr().err
