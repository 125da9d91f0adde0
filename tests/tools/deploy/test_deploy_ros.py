"""deploy, on three computers with an sshd of their own: what comes to all of them, or to none."""

import json
import os
import re
import signal
import subprocess
import sys
import sysconfig
import venv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support import processes
from tests.support.computers import SHIFTED, Computers, missing
from tests.support.waiting import TIMEOUT_S, until

pytestmark = [
    pytest.mark.ros,
    pytest.mark.slow,
    pytest.mark.skipif(bool(missing()), reason=missing() or "all is there"),
]

NAMES = ("brain", "rear", "arm")
ROBOT = """
tfcompose: 1
robot: rover
hosts:
  brain: {ssh: root@10.77.0.2, port: 2222}
  rear: {ssh: root@10.77.0.3, port: 2222}
  arm: {ssh: root@10.77.0.4, port: 2222}
links: {base_link: {visual: {mesh: meshes/wheel.stl}}}
frames:
  odom: {}
  rear_mount: {parent: base_link, owner: rear_drive, rate: 20 Hz}
  tool: {parent: base_link, owner: arm_drive, rate: 20 Hz}
  lidar: {parent: base_link, xyz: [0, 0, 0.3]}
joints: {base_joint: {type: fixed, parent: odom, child: base_link}}
processes:
  static: {host: brain}
  rear_drive: {simulate: {fixed: {xyz: [0, 0, 1]}, rate: 20 Hz}, host: rear}
  arm_drive: {simulate: {fixed: {xyz: [0, 0, 1]}, rate: 20 Hz}, host: arm}
"""
MOVED = ROBOT.replace("[0, 0, 0.3]", "[0, 0, 0.4]")
#: Its owner runs, and publishes nothing.
SIMULATED = "simulate: {fixed: {xyz: [0, 0, 1]}, rate: 20 Hz}, host: rear"
SILENT = ROBOT.replace(SIMULATED, 'run: [sh, -c, "sleep 1000"], host: rear')
#: The same, and a frame vanishes: nothing goes on.
SILENT_ANEW = SILENT.replace("  lidar: {parent: base_link, xyz: [0, 0, 0.3]}\n", "")
#: Two workers at once, each with computers of its own.
first_computers, second_computers = (
    pytest.mark.xdist_group(f"computers {number}") for number in (1, 2)
)
each_way = pytest.mark.parametrize(
    "silent", [SILENT, SILENT_ANEW], ids=["followed", "started_anew"]
)


@pytest.fixture(scope="module")
def computers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Computers]:
    folder = tmp_path_factory.mktemp("computers")
    (folder / "robot/meshes").mkdir(parents=True)
    (folder / "robot/meshes/wheel.stl").write_bytes(b"\0" * 84)
    with Computers(folder, NAMES) as all_of_them:
        yield all_of_them


def deploy(computers: Computers, text: str, *words: str) -> subprocess.CompletedProcess[str]:
    process = deploying(computers, text, *words)
    output, errors = process.communicate(timeout=2 * TIMEOUT_S)
    return subprocess.CompletedProcess(process.args, process.returncode, output, errors)


def deploying(computers: Computers, text: str, *words: str) -> subprocess.Popen[str]:
    folder = computers.folder / "robot"
    (folder / "robot.yaml").write_text(text)
    command = computers.in_office(sys.executable, "-m", "tfcompose", "deploy", *words)
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return processes.start(command, env=computers.environment(), cwd=folder, **pipes)


def current(computers: Computers) -> dict[str, str]:
    links = {
        name: computer.base / f"rover.{name}" / "current"
        for name, computer in computers.computers.items()
    }
    return {name: link.readlink().name for name, link in links.items() if link.is_symlink()}


def runs(computers: Computers, name: str) -> dict[str, object]:
    done = computers.computers[name].run("python3", "-m", "tfcompose", "ps", "--format", "json")
    robots = json.loads(done.stdout or "[]")
    return {} if not robots else {"ready": robots[0]["ready"], "launcher": robots[0]["launcher"]}


def is_complete(computers: Computers) -> bool:
    return all(runs(computers, name).get("ready") for name in NAMES)


def is_on_trial(computers: Computers, name: str) -> bool:
    """Whether a computer runs another plan than that of its current release."""
    done = computers.computers[name].run("python3", "-m", "tfcompose", "ps", "--format", "json")
    plan = json.loads(
        (computers.computers[name].base / f"rover.{name}/current/plan.json").read_text()
    )
    return any(robot["plan"] != plan["spec_digest"] for robot in json.loads(done.stdout or "[]"))


def journals(computers: Computers) -> str:
    """Return what the units printed, for a test that fails."""
    return "".join(
        computer.run("sh", "-c", "tail -n 20 $XDG_RUNTIME_DIR/*.journal").stdout
        for computer in computers.computers.values()
    )


@first_computers
def test_from_nothing_all_hosts_go_live_and_a_second_run_changes_nothing(
    computers: Computers,
) -> None:
    checked = deploy(computers, ROBOT, "--check")
    assert (checked.returncode, current(computers)) == (1, {}), checked
    first = deploy(computers, ROBOT)
    assert first.returncode == 0, first
    assert re.search(r"4 edges live on brain, rear, arm", first.stdout), first
    assert is_complete(computers)
    before = {name: (runs(computers, name), current(computers)) for name in NAMES}
    for words in ((), ("--check",), ("--diff",)):
        again = deploy(computers, ROBOT, *words)
        assert (again.returncode, "nothing to change" in again.stdout) == (0, True), again
    assert {name: (runs(computers, name), current(computers)) for name in NAMES} == before
    mesh = (computers.computers["rear"].base / "rover.rear/current/files").glob("**/wheel.stl")
    assert next(mesh).stat().st_size == 84


@first_computers
def test_what_would_change_is_listed_and_shown_and_changes_nothing(computers: Computers) -> None:
    assert deploy(computers, ROBOT).returncode == 0
    before = current(computers)
    done = deploy(computers, MOVED, "--check", "--diff")
    assert done.returncode == 1, done
    assert {f"{name}: plan.json: changed" for name in NAMES} <= set(done.stdout.splitlines())
    assert any(line.startswith("+") and "0.4" in line for line in done.stdout.splitlines())
    assert {f"+++ {name}/plan.json (here)" for name in NAMES} <= set(done.stdout.splitlines())
    assert current(computers) == before
    (computers.computers["arm"].base / "rover.arm/current/plan.json").write_text("{}")
    drifted = deploy(computers, ROBOT, "--check")
    assert [line for line in drifted.stdout.splitlines() if "changed" in line] == [
        "arm: plan.json: changed"
    ]
    assert deploy(computers, ROBOT).returncode == 0
    assert deploy(computers, ROBOT, "--check").returncode == 0


@first_computers
@each_way
def test_a_release_that_does_not_come_up_is_taken_back_everywhere(
    computers: Computers, silent: str
) -> None:
    assert deploy(computers, ROBOT).returncode == 0
    before = current(computers)
    done = deploy(computers, silent, "--timeout", "8")
    assert (done.returncode, "TF917" in done.stderr, "base_link → rear_mount" in done.stderr) == (
        1,
        True,
        True,
    ), done
    for name in NAMES:
        assert f"{name} returned to release {before[name]}" in done.stderr
    assert current(computers) == before
    assert until(lambda: is_complete(computers)), journals(computers)
    assert deploy(computers, ROBOT, "--check").returncode == 0


def children(computers: Computers, name: str) -> dict[str, int]:
    """Return the processes that run on a computer, by name, with their numbers there."""
    done = computers.computers[name].run(
        sys.executable, "-m", "tfcompose", "ps", "--format", "json"
    )
    (robot,) = json.loads(done.stdout)
    return {process["name"]: process["pid"] for process in robot["processes"] if process["pid"]}


@first_computers
def test_only_what_is_different_starts_again(computers: Computers) -> None:
    assert deploy(computers, ROBOT).returncode == 0
    launchers = {name: runs(computers, name) for name in NAMES}
    before = {name: children(computers, name) for name in NAMES}
    changed = ROBOT.replace(
        "rear_drive: {simulate: {fixed: {xyz: [0, 0, 1]}",
        "rear_drive: {simulate: {fixed: {xyz: [0, 0, 2]}",
    )
    done = deploy(computers, changed)
    assert done.returncode == 0, done
    assert {
        "rear: restarted: rear_drive",
        "brain: the plan changed, and nothing had to restart",
        "arm: the plan changed, and nothing had to restart",
    } <= set(done.stdout.splitlines()), done
    after = {name: children(computers, name) for name in NAMES}
    assert [
        (name, process)
        for name in NAMES
        for process in before[name]
        if before[name][process] != after[name][process]
    ] == [("rear", "rear_drive")]
    moved = deploy(computers, changed.replace("[0, 0, 0.3]", "[0, 0, 0.4]"))
    assert (moved.returncode, "arm: restarted: guard" in moved.stdout) == (0, True), moved
    assert children(computers, "rear")["rear_drive"] == after["rear"]["rear_drive"]
    assert {name: runs(computers, name) for name in NAMES} == launchers
    assert is_complete(computers)
    assert (
        deploy(computers, changed.replace("[0, 0, 0.3]", "[0, 0, 0.4]"), "--check").returncode == 0
    )
    named = computers.folder / "robot/meshes/wheel.stl"
    named.write_bytes(b"\1" * 84)
    try:
        assert deploy(computers, changed).returncode == 0
    finally:
        named.write_bytes(b"\0" * 84)
    anew = {name for name in NAMES if runs(computers, name) != launchers[name]}
    assert anew == {*NAMES}, "who reads a file is not known"


@first_computers
def test_a_host_that_is_down_is_named_before_anything_changes(computers: Computers) -> None:
    assert deploy(computers, ROBOT).returncode == 0
    before, launcher = current(computers), runs(computers, "brain")
    computers.computers["rear"].lose_power()
    try:
        done = deploy(computers, MOVED)
        assert (
            done.returncode,
            "TF913" in done.stderr,
            "rear cannot be reached" in done.stderr,
        ) == (1, True, True)
    finally:
        computers.boot("rear")
    assert (current(computers), runs(computers, "brain")) == (before, launcher)
    again = deploy(computers, ROBOT)
    assert (again.returncode, "nothing to change" in again.stdout) == (0, True), (
        "it waits for a host that has just booted",
        again,
        journals(computers),
    )


@first_computers
@each_way
def test_a_host_that_loses_power_in_the_middle_takes_all_back(
    computers: Computers, silent: str
) -> None:
    assert deploy(computers, ROBOT).returncode == 0
    before = current(computers)
    process = deploying(computers, silent)
    assert until(lambda: is_on_trial(computers, "rear"))
    computers.computers["rear"].lose_power()
    try:
        _, errors = process.communicate(timeout=2 * TIMEOUT_S)
    finally:
        computers.boot("rear")
    assert (process.returncode, "rear lost its connection" in errors) == (1, True), errors
    for name in ("brain", "arm"):
        assert f"{name} returned to release {before[name]}" in errors
    assert current(computers) == before
    assert until(lambda: is_complete(computers)), journals(computers)


@first_computers
@each_way
def test_whoever_deploys_may_be_killed(computers: Computers, silent: str) -> None:
    assert deploy(computers, ROBOT).returncode == 0
    before = current(computers)
    process = deploying(computers, silent)
    assert until(lambda: is_on_trial(computers, "rear"))
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert until(lambda: not is_on_trial(computers, "rear"))
    assert until(lambda: is_complete(computers)), journals(computers)
    assert current(computers) == before


@second_computers
def test_clocks_that_are_apart_are_found_before_the_start(computers: Computers) -> None:
    assert deploy(computers, ROBOT).returncode == 0
    before = current(computers)
    shifted = computers.folder / "shifted"
    venv.create(shifted, symlinks=True)
    (packages,) = shifted.glob("lib/python*/site-packages")
    # Debian's Python has a sitecustomize of its own.
    (packages / "shifted_clock.py").write_text(SHIFTED)
    here = [sysconfig.get_path("purelib"), str(Path(__file__).parents[3])]
    lines = [f"import site; site.addsitedir({folder!r})\n" for folder in here]
    (packages / "here.pth").write_text("".join(["import shifted_clock\n", *lines]))
    python = shifted / "python"
    python.write_text(f'#!/bin/sh\necho welcome\nexec {shifted}/bin/python "$@"\n')
    python.chmod(0o755)
    ahead = MOVED.replace("10.77.0.4, port: 2222", f"10.77.0.4, port: 2222, python: {python}")
    done = deploy(computers, ahead)
    assert (done.returncode, "TF834" in done.stderr) == (1, True), done
    assert re.search(r"the clock of arm is (2|1\.9\d|2\.0\d) s ahead", done.stderr), done
    assert current(computers) == before
    assert deploy(computers, ahead, "--check", "--clock-limit", "3").returncode == 1


@pytest.fixture
def own_domains(computers: Computers) -> Iterator[None]:
    """Give each computer a ROS domain of its own while the test runs."""

    def boot_in(domains: dict[str, dict[str, str]]) -> None:
        for name, computer in computers.computers.items():
            computer.variables = domains[name]
            computer.lose_power()
            computers.boot(name)

    boot_in({name: {"ROS_DOMAIN_ID": str(number)} for number, name in enumerate(NAMES, 11)})
    yield
    boot_in({name: {} for name in NAMES})


@second_computers
@pytest.mark.usefixtures("own_domains")
def test_hosts_with_domains_of_their_own_need_one_of_the_robots(computers: Computers) -> None:
    before = current(computers)
    refused = deploy(computers, ROBOT)
    assert (refused.returncode, "TF916" in refused.stderr) == (1, True), refused
    assert "ROS_DOMAIN_ID is 11 on brain, 12 on rear, 13 on arm" in refused.stderr, refused
    assert current(computers) == before
    done = deploy(computers, ROBOT.replace("robot: rover", "robot: rover\nros: {domain_id: 21}"))
    assert (done.returncode, "4 edges live on brain, rear, arm" in done.stdout) == (0, True), done
    listed = computers.computers["arm"].run("python3", "-m", "tfcompose", "ps").stdout
    assert "rover.arm@21" in listed, listed
    again = deploy(computers, ROBOT.replace("robot: rover", "robot: rover\nros: {domain_id: 21}"))
    assert "nothing to change" in again.stdout, again


@second_computers
def test_rollback_returns_to_the_release_before(computers: Computers) -> None:
    assert deploy(computers, ROBOT).returncode == 0
    before = current(computers)
    assert deploy(computers, MOVED).returncode == 0
    after = current(computers)
    assert not set(before.items()) & set(after.items())
    done = deploy(computers, MOVED, "--rollback")
    assert done.returncode == 0, done
    assert current(computers) == before
    assert is_complete(computers)
    assert deploy(computers, ROBOT, "--check").returncode == 0


@second_computers
def test_of_two_at_once_the_second_says_who_holds_the_hosts(computers: Computers) -> None:
    assert deploy(computers, ROBOT).returncode == 0
    before = current(computers)
    first = deploying(computers, SILENT, "--timeout", "20")
    assert until(lambda: is_on_trial(computers, "rear"))
    second = deploy(computers, MOVED)
    assert (second.returncode, "TF915" in second.stderr, f"pid {first.pid}" in second.stderr) == (
        1,
        True,
        True,
    ), second
    first.communicate(timeout=2 * TIMEOUT_S)
    assert (first.returncode, current(computers)) == (1, before)


def events_in(file: Path) -> list[dict[str, Any]]:
    """Return the events in the file so far, without a line that is still being written."""
    lines = file.read_text("utf-8").splitlines(keepends=True)
    return [json.loads(line) for line in lines if line.endswith("\n")]


@second_computers
def test_commands_on_all_hosts_answer_as_one(computers: Computers) -> None:
    assert deploy(computers, ROBOT).returncode == 0

    def on_all(*words: str) -> subprocess.CompletedProcess[str]:
        command = computers.in_office(sys.executable, "-m", "tfcompose", *words, "--all-hosts")
        return processes.run(
            command, env=computers.environment(), cwd=computers.folder / "robot", check=False
        )

    listed = on_all("ps", "--format", "json")
    robots = json.loads(listed.stdout)
    assert [(robot["host"], robot["ready"]) for robot in robots] == [
        (name, True) for name in NAMES
    ], listed
    tables = re.findall(r"^rover\.(\w+)@0: tree complete", on_all("ps").stdout, re.MULTILINE)
    assert tuple(tables) == NAMES
    logs = on_all("logs", "rear_drive", "guard").stdout.splitlines()
    assert {line.partition("|")[0].strip() for line in logs if "rear_drive" in line} == {"rear"}
    assert {line.partition("|")[0].strip() for line in logs if "guard" in line} == set(NAMES)
    unknown = on_all("logs", "nobody")
    assert (unknown.returncode, unknown.stderr.count("no log of nobody")) == (1, 3), unknown
    heard = computers.folder / "events.jsonl"
    with heard.open("w") as stream:
        following = processes.start(
            computers.in_office(
                sys.executable, "-m", "tfcompose", "events", "--all-hosts", "--format", "json"
            ),
            env=computers.environment(),
            cwd=computers.folder / "robot",
            stdout=stream,
        )
    assert until(lambda: {event["host"] for event in events_in(heard)} == set(NAMES))
    down = on_all("down")
    assert (
        down.returncode,
        sorted(line.partition(" |")[0].strip() for line in down.stdout.splitlines()),
    ) == (
        0,
        sorted(NAMES),
    ), down
    following.wait(TIMEOUT_S)
    ended = {event["host"] for event in events_in(heard) if event["event"] == "Ended"}
    assert (following.returncode, ended) == (0, set(NAMES))
    assert on_all("ps", "--fail-on", "absent").returncode == 1
    assert deploy(computers, ROBOT).returncode == 0, "what is down is started again"


@second_computers
def test_a_robot_of_a_fleet_shares_its_edges_from_the_host_of_static(computers: Computers) -> None:
    fleet = "fleet: 1\nshare: [base_link → lidar]\nrobots: {rover: {router: tcp/10.77.0.1:7447}}\n"
    (computers.folder / "robot/fleet.yaml").write_text(fleet)
    done = deploy(computers, ROBOT.replace("robot: rover", "robot: rover\nfleet: fleet.yaml"))
    assert done.returncode == 0, done
    assert ["fleet_share" in children(computers, name) for name in NAMES] == [True, False, False]
    logs = (
        computers.computers["brain"]
        .run("python3", "-m", "tfcompose", "logs", "fleet_share")
        .stdout
    )
    assert "no router at tcp/10.77.0.1:7447" in logs, logs
    assert deploy(computers, ROBOT).returncode == 0
    assert "fleet_share" not in children(computers, "brain")


@second_computers
def test_a_release_has_the_overlay_of_the_computer_that_runs_static(
    computers: Computers,
) -> None:
    """All computers of the test have this one's hostname."""
    folder = computers.folder / "robot/units"
    folder.mkdir()
    own_overlay = folder / f"{os.uname().nodename}.yaml"
    own_overlay.write_text("frames: {lidar: {xyz: [0, 0, 0.302]}}\n")
    (folder / "ant.yaml").write_text("frames: {lidar: {xyz: [0, 0, 1]}}\n")
    text = f"{ROBOT}overlays: {{by: hostname, folder: units}}\n"
    done = deploy(computers, text)
    assert done.returncode == 0, done
    assert os.uname().nodename in done.stdout
    for options, overlay in (((), own_overlay.name), (("--robot", "ant"), "ant.yaml")):
        done = deploy(computers, text, *options)
        assert done.returncode == 0, done
        plan = computers.computers["brain"].base / "rover.brain/current/plan.json"
        assert json.loads(plan.read_text())["overlays"] == [f"units/{overlay}"]


@second_computers
def test_one_host_alone_is_deployed_to_and_waited_for(computers: Computers) -> None:
    assert deploy(computers, ROBOT).returncode == 0
    before = current(computers)
    done = deploy(computers, MOVED, "--host", "rear")
    assert (done.returncode, "1 edge live on rear" in done.stdout) == (0, True), done
    after = current(computers)
    assert [name for name in NAMES if before[name] != after[name]] == ["rear"]
    wrong = deploy(computers, MOVED, "--host", "raer")
    assert (wrong.returncode, "TF819" in wrong.stderr) == (1, True), wrong
