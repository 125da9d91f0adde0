"""A link between two computers of a robot that is cut for longer than DDS's lease of 20 s."""

from __future__ import annotations

import json
import time
from contextlib import contextmanager
from itertools import chain
from typing import TYPE_CHECKING, Any

import pytest

from tests.support import processes
from tests.support.computers import Computers, missing
from tests.support.waiting import until

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from tests.support.processes import Started

pytestmark = [
    pytest.mark.ros,
    pytest.mark.slow,
    pytest.mark.xdist_group("computers of the guard"),
    pytest.mark.skipif(bool(missing()), reason=missing() or "all is there"),
]

ROBOT = """
tfcompose: 1
robot: rover
guard: {mode: MODE}
hosts:
  brain: {ssh: root@10.77.0.2, port: 2222}
  rear: {ssh: root@10.77.0.3, port: 2222}
links: {base_link: {}}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
  rear_mount: {parent: base_link, owner: rear_drive, rate: 20 Hz}
  lidar: {parent: base_link, xyz: [0, 0, 0.3]}
processes:
  static: {host: brain}
  drive: {simulate: {fixed: {xyz: [0, 0, 1]}, rate: 20 Hz}, host: brain}
  rear_drive: {simulate: {fixed: {xyz: [0, 0, 1]}, rate: 20 Hz}, host: rear}
"""
#: What a window of the live view has to say, five times a second: codes of findings.
VIEW = """
import sys
from pathlib import Path
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.foundation.geometry import Offset
from tfcompose.foundation.signals import Stop
from tfcompose.tf.live.feed import follow
from tfcompose.tf.live.ros_feed import RosFeed
from tfcompose.tools.view.live import FOUND_S, LiveTree
from tfcompose.tools.view.live_source import observers_of
robot = compile_robot(Path(sys.argv[1]).read_text(), "robot.yaml", library()).robot
plan = plan_of(robot)
observers = observers_of(plan)
tree = LiveTree(robot, plan, observers, Offset(1e-3, 1e-3))
def show():
    print("view:", *(finding.code for finding in tree.judge(FOUND_S).findings), flush=True)
with Stop() as stop, RosFeed("view", observers) as feed:
    follow(feed, stop, every_s=0.2, show=show)
"""
#: DDS gives a participant up after 20 s without a word.
GAP_S = 25.0
#: The rate of moving edges.
HERTZ = 20.0
#: On a machine that runs other tests; alone it takes about 4 s.
GREEN_WITHIN_S = 30.0
#: How a link is cut and mended: at the socket, where interfaces notice, and farther off.
LINK = {"socket": ("down", "up"), "path": ("nomaster", "master br0")}


@pytest.fixture
def computers(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Computers]:
    """Two computers, each of which runs its share of the robot."""
    with Computers(tmp_path, ("brain", "rear")) as both:
        for name, computer in both.computers.items():
            (computer.home / "robot.yaml").write_text(ROBOT.replace("MODE", request.param))
            started = up(both, name)
            assert started.returncode == 0, started.stderr
        assert until(lambda: not wrong(both))
        yield both
        for name in both.computers:
            tfcompose(both, name, "down")


def tfcompose(computers: Computers, name: str, *words: str) -> subprocess.CompletedProcess[str]:
    return computers.computers[name].run("python3", "-m", "tfcompose", *words)


def up(computers: Computers, name: str) -> subprocess.CompletedProcess[str]:
    folder = computers.computers[name].home
    words = (str(folder / "robot.yaml"), "-o", str(folder / "built"), "--host", name)
    return tfcompose(computers, name, "up", "-d", *words)


@contextmanager
def watched(computers: Computers) -> Iterator[list[tuple[Started, Started]]]:
    """Follow the tree on each computer as the live view and ``monitor`` do."""
    watches = [
        (
            computer.start("python3", "-c", VIEW, str(computer.home / "robot.yaml")),
            computer.start("python3", "-m", "tfcompose", "monitor", "--format", "json"),
        )
        for computer in computers.computers.values()
    ]
    try:
        assert until(lambda: are_green(watches))
        yield watches
    finally:
        for started in chain(*watches):
            processes.end(started.process)
            started.close()


def are_green(watches: Sequence[tuple[Started, Started]]) -> bool:
    return all(is_green(*watch) for watch in watches)


def is_green(view: Started, monitor: Started) -> bool:
    """Return whether the view finds nothing now, and the tree comes at its rates in monitor."""
    if not monitor.lines or not view.lines or view.lines[-1] != "view:\n":
        return False
    edges = [edge for edge in json.loads(monitor.lines[-1])["edges"] if edge["present"]]
    rates = {edge["child"]: edge["rate"] for edge in edges}
    moving = [rates.get(child) or 0.0 for child in ("base_link", "rear_mount")]
    return "lidar" in rates and min(moving) > 0.9 * HERTZ


def wrong(computers: Computers) -> dict[str, Any]:
    """Return what a computer's ``ps`` says is wrong, by its name."""
    status_by_name = {}
    for name in computers.computers:
        robots = json.loads(tfcompose(computers, name, "ps", "--format", "json").stdout or "[]")
        keys = ("missing", "silent", "findings")
        if not robots or not robots[0]["complete"] or any(robots[0][key] for key in keys):
            status_by_name[name] = robots and [robots[0][key] for key in keys]
    return status_by_name


#: A minute each: who starts without a carrier joins ROS anew, and names outlive the lease.
@pytest.mark.parametrize(
    ("computers", "where", "then"),
    [("watch", "socket", "restarted"), ("strict", "path", "same")],
    indirect=["computers"],
)
def test_after_a_gap_each_computer_sees_all_edges_of_the_other_one_again(
    computers: Computers, where: str, then: str
) -> None:
    part, mend = (("ip", "link", "set", "to-rear", *words.split()) for words in LINK[where])
    with watched(computers) as watches:
        computers.office_run(*part)
        begun = time.monotonic()
        assert until(lambda: wrong(computers).keys() == {"brain", "rear"})
        assert not any(is_green(*watch) for watch in watches)
        if then == "restarted":
            assert tfcompose(computers, "rear", "down").returncode == 0
            assert up(computers, "rear").returncode == 0
        time.sleep(max(0.0, begun + GAP_S - time.monotonic()))
        computers.office_run(*mend)
        deadline = time.monotonic() + GREEN_WITHIN_S
        assert until(lambda: not wrong(computers), GREEN_WITHIN_S), wrong(computers)
        left_s = max(0.0, deadline - time.monotonic())
        last_lines = [(view.lines[-1:], monitor.lines[-1:]) for view, monitor in watches]
        assert until(lambda: are_green(watches), left_s), last_lines
    for name in computers.computers:
        doctor = tfcompose(computers, name, "doctor", "--for", "2")
        assert doctor.returncode == 0, doctor
