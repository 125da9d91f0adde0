"""A link between two computers of a robot that is cut for longer than DDS's lease of 20 s."""

from __future__ import annotations

import json
import time
from typing import TYPE_CHECKING, Any

import pytest

from tests.support.computers import Computers, missing
from tests.support.waiting import until

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Iterator
    from pathlib import Path

pytestmark = [
    pytest.mark.ros,
    pytest.mark.slow,
    pytest.mark.xdist_group("computers"),
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
#: DDS gives a participant up after 20 s without a word.
GAP_S = 25.0
GREEN_WITHIN_S = 10.0
#: How a link is cut and mended: at the socket, where interfaces notice, and farther off.
LINK = {"socket": ("down", "up"), "path": ("nomaster", "master br0")}


@pytest.fixture
def computers(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Computers]:
    """Two computers, each of which runs its share of the robot."""
    with Computers(tmp_path, ("brain", "rear")) as both:
        for name, one in both.computers.items():
            (one.home / "robot.yaml").write_text(ROBOT.replace("MODE", request.param))
            assert up(both, name).returncode == 0
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


def wrong(computers: Computers) -> dict[str, Any]:
    """Return what a computer's ``ps`` says is wrong, by its name."""
    found = {}
    for name in computers.computers:
        robots = json.loads(tfcompose(computers, name, "ps", "--format", "json").stdout or "[]")
        keys = ("missing", "silent", "findings")
        if not robots or not robots[0]["complete"] or any(robots[0][key] for key in keys):
            found[name] = robots and [robots[0][key] for key in keys]
    return found


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
    computers.office_run(*part)
    begun = time.monotonic()
    assert until(lambda: wrong(computers).keys() == {"brain", "rear"})
    if then == "restarted":
        assert tfcompose(computers, "rear", "down").returncode == 0
        assert up(computers, "rear").returncode == 0
    time.sleep(max(0.0, begun + GAP_S - time.monotonic()))
    computers.office_run(*mend)
    assert until(lambda: not wrong(computers), GREEN_WITHIN_S), wrong(computers)
    for name in computers.computers:
        doctor = tfcompose(computers, name, "doctor", "--for", "2")
        assert doctor.returncode == 0, doctor
