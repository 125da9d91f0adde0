"""Robots in the background: started, listed, steered, changed and ended by other commands."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import psutil
import pytest

from tests.support import processes
from tests.support.cli import tfcompose_in
from tests.support.domains import entered_domain
from tests.support.edge_listener import EdgeListener
from tests.support.robots import EXTERNAL, ROVER
from tests.support.waiting import gone, until
from tfcompose.launcher.control import ANSWER_S

pytestmark = pytest.mark.ros
#: What is true of publishers on a machine that does much else.
LATE = {"TF804", "TF805"}


def run(*words: str) -> subprocess.CompletedProcess[str]:
    """Run a command to its end.

    A launcher is the child of a process of its own; commands that talk to one run in this process.
    """
    if words[0] != "up":
        return tfcompose_in(Path.cwd(), *words)
    return processes.run([sys.executable, "-m", "tfcompose", *words])


def enter(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in a folder that has its own runtime folder."""
    (folder / "runtime").mkdir(mode=0o700)
    monkeypatch.chdir(folder)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(folder / "runtime"))
    monkeypatch.setenv("ROS_LOG_DIR", str(folder / "log"))


def kill_all() -> None:
    """Kill the robots of this runtime folder."""
    left: list[psutil.Process] = []
    for robot in json.loads(run("ps", "--format", "json").stdout or "[]"):
        with contextlib.suppress(psutil.NoSuchProcess):  # it has ended meanwhile
            launcher = psutil.Process(robot["launcher"])
            left += [launcher, *launcher.children(recursive=True)]
            launcher.kill()
    assert until(lambda: all(map(gone, left)))


@pytest.fixture
def tfc(
    domain: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[..., Any]]:
    """Run commands in a folder of the test's own."""
    assert domain
    enter(tmp_path, monkeypatch)
    (tmp_path / "robot.yaml").write_text(ROVER, encoding="utf-8")
    yield run
    kill_all()


#: Waits for another process.
LATE_PROCESS = "  late: {run: [sleep, '1000'], after: {drive: ready}}\n"


@pytest.fixture(scope="module")
def background(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The folder of a robot that runs in the background; the last of its tests ends it."""
    folder = tmp_path_factory.mktemp("background")
    with entered_domain(folder), pytest.MonkeyPatch.context() as patch:
        enter(folder, patch)
        (folder / "robot.yaml").write_text(ROVER + LATE_PROCESS, encoding="utf-8")
        up = run("up", "--wait")
        assert up.returncode == 0, up.stdout + up.stderr
        assert "tree complete: 2 edges" in up.stdout
        assert "all ready after" in up.stdout
        yield folder
        kill_all()


def launcher_of(folder: Path) -> int:
    (lock,) = (folder / "runtime").glob("tfcompose/*/lock")
    return int(json.loads(lock.read_text())["pid"])


def ps(tfc: Callable[..., Any]) -> dict[str, dict[str, Any]]:
    (robot,) = json.loads(tfc("ps", "--format", "json").stdout)
    return {process["name"]: process for process in robot["processes"]}


def test_a_timeout_reports_missing_edges_with_1_and_the_robot_goes_on(
    tfc: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "robot.yaml").write_text(EXTERNAL)
    up = tfc("up", "--wait", "--timeout", "12")
    assert up.returncode == 1
    assert [name in up.stderr for name in ("drive", "static", "odom → base_link")] == [
        True,
        False,
        True,
    ]
    assert ps(tfc)["static"]["state"] == "running"


def test_one_process_restarts_stops_and_starts_and_the_guard_blames_none(
    tfc: Callable[..., Any], tmp_path: Path
) -> None:
    """The edge may be silent for 4 s, so that a machine that stalls blames nobody.

    That a longer silence would be told is seen by an edge of the same rate, whose owner hangs.
    """
    text = ROVER.replace("rate: 20 Hz}", "rate: 1 Hz}", 1).replace(
        "frames:", "frames:\n  hung: {parent: odom, owner: hangs, rate: 1 Hz}"
    )
    text += "  hangs: {simulate: {fixed: {xyz: [0, 0, 0]}, rate: 20 Hz}}\n"
    (tmp_path / "robot.yaml").write_text(text, encoding="utf-8")
    assert tfc("up", "--wait").returncode == 0
    before = ps(tfc)
    assert tfc("restart", "drive").returncode == 0
    assert until(lambda: ps(tfc)["drive"]["restarts"] == 1)
    assert tfc("wait", "--ready", "--timeout", "60").returncode == 0
    assert tfc("stop", "drive", "static").returncode == 0
    assert until(lambda: {ps(tfc)[name]["state"] for name in ("drive", "static")} == {"stopped"})
    assert tfc("stop", "drive").returncode == 1
    os.kill(before["hangs"]["pid"], signal.SIGSTOP)
    assert until(lambda: "TF804" in tfc("logs").stdout)
    os.kill(before["hangs"]["pid"], signal.SIGCONT)
    assert tfc("start", "drive", "static").returncode == 0
    assert tfc("wait", "--ready", "--timeout", "60").returncode == 0
    after = ps(tfc)
    assert after["guard"]["pid"] == before["guard"]["pid"]
    assert after["static"]["pid"] != before["static"]["pid"]
    assert {
        line.split("] ")[1].split()[0]
        for line in tfc("logs").stdout.splitlines()
        if "[TF8" in line
    } == {"hangs"}
    assert " drive?" in tfc("restart", "driv").stderr


def test_up_restarts_what_changed_and_reports_what_listeners_keep(
    tfc: Callable[..., Any], tmp_path: Path
) -> None:
    nothing = tfc("up", "--update")
    assert (nothing.returncode, "is not running" in nothing.stderr) == (1, True), nothing
    assert tfc("up", "--wait").returncode == 0
    assert tfc("up", "--update").returncode == 0
    before = ps(tfc)
    with EdgeListener("base_link") as drive:
        _change(tfc, tmp_path)
        after = ps(tfc)
        assert after["drive"]["pid"] == before["drive"]["pid"]
        assert after["static"]["pid"] != before["static"]["pid"]
        blamed = set(re.findall(r"\[(TF\d+)\]", tfc("logs").stdout))
    assert not blamed - (LATE if drive.longest_gap_s() > 0.1 else set())


def _change(tfc: Callable[..., Any], tmp_path: Path) -> None:
    same = tfc("up")
    assert same.returncode == 1
    assert re.search(rf"rover@.* pid {launcher_of(tmp_path)}, .*tfcompose down", same.stderr)
    assert tfc("up", "-d").returncode == 0
    (tmp_path / "robot.yaml").write_text(ROVER.replace("lidar:", "laser:"))
    changed = tfc("up", "--wait")
    assert changed.returncode == 0, changed.stderr
    assert "restarted: static, guard" in changed.stdout
    assert "base_link → lidar" in changed.stdout, "what running listeners keep"


def test_events_are_reported_from_the_start_and_wait_returns_the_exit_code(
    tfc: Callable[..., Any], tmp_path: Path
) -> None:
    assert tfc("up", "--wait").returncode == 0
    launcher = psutil.Process(launcher_of(tmp_path))
    alone = len(launcher.net_connections("unix"))
    start = partial(processes.start, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    command = [sys.executable, "-m", "tfcompose"]
    waiting, listening = start([*command, "wait"]), start([*command, "events", "--format", "json"])
    assert until(lambda: len(launcher.net_connections("unix")) >= alone + 2), "both are heard"
    os.kill(ps(tfc)["static"]["pid"], signal.SIGKILL)
    events = [json.loads(line) for line in listening.communicate(timeout=60)[0].splitlines()]
    assert waiting.communicate(timeout=60) == ("", "")
    assert waiting.returncode == 1
    kinds = [event["event"] for event in events]
    assert kinds[0] == "ProcessState"
    assert kinds[-1] == "Ended"
    reported = [event["found"] for event in events if event["event"] == "FindingShown"]
    (finding,) = [entry for entry in reported if entry["code"] not in LATE]
    assert (finding["code"], finding["message"].split()[0], finding["message"].split()[-1]) == (
        "TF808",
        "static",
        "SIGKILL",
    )


def test_a_killed_launcher_ends_events_with_1_and_leaves_no_process(
    tfc: Callable[..., Any], tmp_path: Path
) -> None:
    assert tfc("up", "--wait").returncode == 0
    command = [sys.executable, "-m", "tfcompose", "events"]
    with processes.start(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as follower:
        assert follower.stdout
        assert "started guard" in follower.stdout.readline()
        launcher = launcher_of(tmp_path)
        below = psutil.Process(launcher).children(recursive=True)
        os.kill(launcher, signal.SIGKILL)
        _, error_file = follower.communicate(timeout=20)
    assert follower.returncode == 1
    assert error_file.startswith("tfcompose: rover@")
    assert error_file.endswith(" was killed\n")
    assert until(lambda: all(map(gone, below)))
    assert tfc("ps", "--fail-on", "absent").returncode == 1
    assert "was killed" in tfc("logs").stdout or "tree complete" in tfc("logs").stdout
    assert tfc("up", "--wait").returncode == 0


def test_a_suspended_launcher_is_named_at_once_and_hides_no_other_robot(
    tfc: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "other.yaml").write_text(
        ROVER.replace("rover", "other").replace("base_link", "body").replace("lidar", "lamp")
    )
    tfc("up", "-d")
    launcher = launcher_of(tmp_path)
    tfc("up", "other.yaml", "-d")
    began = time.monotonic()
    tfc("ps")
    once_s = time.monotonic() - began
    os.kill(launcher, signal.SIGSTOP)
    try:
        assert until(lambda: psutil.Process(launcher).status() == psutil.STATUS_STOPPED)
        began = time.monotonic()
        listed = tfc("ps")
        assert f"rover@{os.environ['ROS_DOMAIN_ID']} " in listed.stderr
        assert f"kill -CONT {launcher}" in listed.stderr
        assert (listed.returncode, listed.stdout.split("@")[0]) == (1, "other")
        down = tfc("down", "--robot", "rover")
        assert (down.returncode, down.stdout) == (1, "")
        assert time.monotonic() - began < 2 * once_s + ANSWER_S, "nobody waits for an answer"
    finally:
        os.kill(launcher, signal.SIGCONT)
    assert until(lambda: tfc("ps", "--robot", "rover", "--fail-on", "absent").returncode == 0)


#: In this order, with one robot.
of_one_robot = pytest.mark.xdist_group("one robot in the background")


@of_one_robot
@pytest.mark.usefixtures("background")
def test_a_robot_in_the_background_is_listed_with_states_memory_and_edges() -> None:
    listed = ps(run)
    for process in listed.values():
        assert (process["state"], process["ready"], process["restarts"]) == ("running", True, 0)
        assert psutil.pid_exists(process["pid"])
        assert process["memory"] > 1e5
    edges = [(1, 1), (1, 1), (0, 0), (0, 0)]
    assert until(lambda: [(row["live"], row["edges"]) for row in ps(run).values()] == edges)


@of_one_robot
def test_a_run_with_another_runtime_folder_is_found_and_is_no_leftover(
    background: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as elsewhere:
        tmp_path.chmod(0o700)
        elsewhere.setenv("XDG_RUNTIME_DIR", str(tmp_path))
        second = run("up", "--for", "3")
        assert (second.returncode, second.stdout) == (1, "")
        assert (
            f" pid {launcher_of(background)}, with XDG_RUNTIME_DIR={background}/runtime"
            in second.stderr
        )
        down = run("down", "--leftovers")
        assert (down.returncode, down.stdout.split()[0]) == (0, "0")
    assert {process["state"] for process in ps(run).values()} == {"running"}


@of_one_robot
@pytest.mark.usefixtures("background")
def test_who_follows_ends_when_nobody_reads_it_any_more() -> None:
    """``tfcompose logs -f | grep -m1 complete``: nothing more may ever be written."""
    with processes.start(
        [sys.executable, "-m", "tfcompose", "logs", "-f"], stdout=subprocess.PIPE
    ) as follower:
        assert follower.stdout
        while "all ready after" not in follower.stdout.readline():
            pass
        follower.stdout.close()
        assert follower.wait(20) == 141


@of_one_robot
@pytest.mark.usefixtures("background")
def test_ps_and_start_report_what_waits_for_a_stopped_process() -> None:
    assert run("restart", "late").stdout == "late: restarting\n"
    assert run("stop", "drive").returncode == 0
    assert until(lambda: ps(run)["drive"]["state"] == "stopped")
    waits = "waits for drive"
    assert waits in run("restart", "late").stdout
    assert until(lambda: re.search(f"  late +{waits}", run("ps").stdout)), run("ps").stdout
    assert f"late ({waits}" in run("wait", "--ready", "--timeout", "0.1").stderr
    assert run("start", "drive").returncode == 0
    assert run("wait", "--ready", "--timeout", "60").returncode == 0


@of_one_robot
@pytest.mark.usefixtures("background")
def test_verify_and_doctor_take_the_plan_of_the_robot_that_runs_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # without a robot file
    verified = run("verify", "--for", "2")
    assert (verified.returncode, verified.stdout.count("2 of 2")) == (0, 1), (
        verified.stdout + verified.stderr
    )
    assert "rover@" in verified.stderr
    assert run("stop", "drive").returncode == 0
    examined = run("doctor", "--for", "3")
    assert "rover@" in examined.stderr
    assert (examined.returncode, "drive" in examined.stdout) == (1, True), examined.stdout


@of_one_robot
@pytest.mark.usefixtures("background")
def test_down_ends_every_process_also_one_that_waits() -> None:
    assert run("stop", "drive").returncode in (0, 1)
    assert run("restart", "late").returncode in (0, 1)
    pids = [process["pid"] for process in ps(run).values() if process["pid"]]
    down = run("down")
    assert (down.returncode, down.stdout.split("@")[0]) == (0, "rover")
    assert until(lambda: all(map(gone, pids)))
    assert run("ps", "--fail-on", "absent").returncode == 1
    assert "\ntfcompose | ended\n" in run("logs").stdout
