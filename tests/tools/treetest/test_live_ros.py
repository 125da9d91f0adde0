"""``tfcompose test`` on robots that it starts: real processes in ROS domains of their own."""

import os
import shutil
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from tests.support import processes
from tests.support.cli import tfcompose_in
from tests.support.waiting import TIMEOUT_S, until
from tfcompose.launcher.program import HERE
from tfcompose.tf.bags import Recording

pytestmark = [pytest.mark.ros, pytest.mark.slow]

#: It sets a domain, which a case replaces.
ROBOT = """\
tfcompose: 1
robot: cart
ros: {domain_id: 7, discovery: subnet}
links: {base_link: {}}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 50 Hz}
  laser: {parent: base_link, xyz: [0.24, 0, 0.3]}
processes:
  drive: {simulate: {circle: {radius: 1 m, speed: 0.5 rad/s}, rate: 50 Hz}}
profiles:
  broken: {processes: {wheels: {run: [sh, -c, "echo no wheels; exit 3"], required: true}}}
  strict: {guard: {mode: strict, fence: remap}}
"""
MET = """\
  - name: drives
    for: 1 s
    expect:
      complete: 10 s
      edges: {odom → base_link: {owner: drive, rate: [30 Hz, 60 Hz]}}
      pose: {base_link → laser: {xyz: [0.24, 0, 0.3]}}
      lookups: [{from: odom, to: laser, at: 0.5 s, timeout: 5 s}]
      findings: []
  - name: a second odometry is named
    for: 1 s
    inject: {publish: {edge: odom → base_link, as: /old_odometry}}
    expect: {findings: [{code: TF801, names: /old_odometry, within: 5 s}]}
"""
HANGING = """\
  - name: a hanging owner is named
    for: 1 s
    inject: {stop: drive}
    expect: {findings: [{code: TF804, names: drive, within: 10 s}]}
"""
#: Faults in messages, which relays inject.
RELAYED = """\
  - name: another clock and a moving fixed edge
    for: 1 s
    inject: [{clock: odom → base_link}, {dynamic: {edge: base_link → laser}}]
    expect:
      edges: {odom → base_link: {owner: drive}, base_link → laser: {owner: static}}
      findings:
        - {code: TF825, names: [/drive, odom → base_link]}
        - {code: TF809, names: [/tfcompose_static, base_link → laser]}
  - name: a jump behind a strict guard
    profile: strict
    for: 1 s
    inject: {jump: {edge: base_link → laser, xyz: [0, 0, 2 mm]}, at: 300 ms}
    expect: {findings: [{code: TF846, names: laser}]}
  - name: no messages
    for: 1 s
    inject: {drop: {edge: odom → base_link}}
    expect: {findings: [{code: TF804, names: [/drive, odom → base_link], within: 10 s}]}
"""
UNMET = """\
  - name: a second odometry
    for: 1 s
    inject: {publish: {edge: odom → base_link, as: /old_odometry, xyz: [5, 0, 0]}}
    expect:
      edges: {odom → base_link: {owner: drive}}
      pose: {base_link → laser: {xyz: [0.24, 0, 0.31]}}
      findings: []
"""


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Keep temporary files in a folder of the test; none are left, and no process that has one."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    yield folder
    assert until(lambda: not running(folder)), running(folder)
    assert not list(folder.iterdir())


def running(folder: Path) -> list[psutil.Process]:
    """Return the processes whose runtime directory is in the folder."""
    started = []
    for process in psutil.process_iter():
        try:
            if process.environ().get("XDG_RUNTIME_DIR", "").startswith(str(folder)):
                started.append(process)
        except psutil.Error:
            continue
    return started


def write(folder: Path, cases: str) -> None:
    (folder / "robot.yaml").write_text(ROBOT, "utf-8")
    (folder / "cart.test.yaml").write_text(f"robot: robot.yaml\ncases:\n{cases}", "utf-8")


def test_met_expectations_pass_in_parallel_and_leave_nothing(tmp_path: Path) -> None:
    write(tmp_path, MET + HANGING)
    done = tfcompose_in(tmp_path, "test", "-j", "2", "--keep", "kept")
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == "3 cases, 0 failed"
    assert not list((tmp_path / "kept").iterdir())
    assert not (tmp_path / "build").exists()


def test_faults_in_messages_of_a_started_robot_are_named(tmp_path: Path) -> None:
    write(tmp_path, RELAYED)
    done = tfcompose_in(tmp_path, "test", "-j", "3")
    assert done.returncode == 0, done.stdout + done.stderr


def test_unmet_expectations_fail_at_their_lines_and_leave_evidence(
    tmp_path: Path,
) -> None:
    write(tmp_path, UNMET)
    done = tfcompose_in(tmp_path, "test", "--keep", "kept")
    assert done.returncode == 1, done.stdout + done.stderr
    places = [line.split(" ")[0] for line in done.stdout.splitlines() if "error[TF931]" in line]
    assert places == [
        "cart.test.yaml:8:14:",
        "cart.test.yaml:7:41:",
        "cart.test.yaml:9:7:",
    ], done.stdout
    (folder,) = (tmp_path / "kept").iterdir()
    assert {"tf", "tree.svg", "up.log", "log"} <= {path.name for path in folder.iterdir()}
    assert "/old_odometry" in (folder / "tree.svg").read_text("utf-8")
    assert "TF801" in (folder / "up.log").read_text("utf-8")
    sent = {
        (row[0], row[1], message.static)
        for message in Recording(str(folder / "tf")).messages(("/tf", "/tf_static"))
        for row in message.rows or ()
    }
    assert sent == {("odom", "base_link", False), ("base_link", "laser", True)}


def test_a_robot_that_ends_fails_its_case_with_its_last_lines(tmp_path: Path) -> None:
    write(tmp_path, "  - {name: breaks, profile: broken, expect: {findings: []}}\n")
    done = tfcompose_in(tmp_path, "test")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "cart.test.yaml:3:12: error[TF932]" in done.stdout
    assert "no wheels" in done.stdout


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_signal_ends_every_process_of_a_case(
    number: signal.Signals, tmp_path: Path, temporary: Path
) -> None:
    write(tmp_path, MET.replace("for: 1 s", "for: 10 min"))
    command = [*HERE, "test", "-k", "odometry"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = processes.start(command, cwd=tmp_path, env=dict(os.environ), **pipes)
    # The case, up, the guard, static, drive, and the publisher.
    assert until(lambda: len(running(temporary)) >= 6)
    process.send_signal(number)
    output = process.communicate(timeout=TIMEOUT_S)
    assert "Traceback" not in "".join(output)
    assert until(lambda: not running(temporary))
    if number == signal.SIGKILL:
        assert process.returncode == -number
        for path in temporary.iterdir():  # a killed program removes nothing
            shutil.rmtree(path)
    else:
        assert process.returncode == 130
