"""Deployment to three hosts: from nothing, with nothing to change, and with a process changed.

The hosts are namespaces with an sshd each and a stand-in for systemd; they share the processors.
"""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

from tests.benchmarks.benchmark import TFCOMPOSE, Benchmark, Contender, Row
from tests.support import processes
from tests.support.computers import Computers, missing

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tests.benchmarks.benchmark import Sampler, Workspace

NAMES = ("brain", "rear", "arm")
ROBOT = """
tfcompose: 1
robot: rover
hosts:
  brain: {ssh: root@10.77.0.2, port: 2222}
  rear: {ssh: root@10.77.0.3, port: 2222}
  arm: {ssh: root@10.77.0.4, port: 2222}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 50 Hz}
  lidar: {parent: base_link, xyz: [0, 0, 0.3]}
  rear_mount: {parent: base_link, owner: rear_drive, rate: 20 Hz}
  tool: {parent: base_link, owner: arm_drive, rate: 20 Hz}
processes:
  static: {host: brain}
  drive: {simulate: {fixed: {xyz: [0, 0, 0]}, rate: 50 Hz}}
  rear_drive: {simulate: {fixed: {xyz: [0, 0, 1]}, rate: 20 Hz}, host: rear}
  arm_drive: {simulate: {fixed: {xyz: [0, 0, 1]}, rate: 20 Hz}, host: arm}
"""
#: The edit before the third deployment: where a process says that its frame is.
CHANGE = ("[0, 0, 1]}, rate: 20 Hz}, host: arm", "[0, 0, 2]}, rate: 20 Hz}, host: arm")


@contextmanager
def deployed(workspace: Workspace) -> Iterator[Sampler]:
    """Boot the hosts anew in each round."""
    rounds = workspace.folder / "rounds"
    rounds.mkdir()

    def sample() -> Mapping[str, float]:
        folder = rounds / str(len(list(rounds.iterdir())))
        folder.mkdir()
        with Computers(folder, NAMES) as computers:
            (folder / "robot.yaml").write_text(ROBOT, encoding="utf-8")
            first, again = _deploy_s(computers), _deploy_s(computers)
            (folder / "robot.yaml").write_text(ROBOT.replace(*CHANGE), encoding="utf-8")
            return {"first": first, "again": again, "changed": _deploy_s(computers)}

    yield sample


def _deploy_s(computers: Computers) -> float:
    command = computers.in_office(sys.executable, "-m", "tfcompose", "deploy")
    began = time.monotonic()
    processes.run(command, env=computers.environment(), cwd=computers.folder, check=True)
    return time.monotonic() - began


BENCHMARK = Benchmark(
    name="deploy",
    about="three hosts, namespaces of one machine, with ten processes",
    rows={
        "first": Row("`deploy` from nothing until every edge of every host is live", "s"),
        "again": Row("… again, with nothing to change", "s"),
        "changed": Row("… with one process changed, on one host", "s"),
    },
    contenders={Contender(TFCOMPOSE.name, missing): deployed},
    runs=3,
    quick_runs=1,
)
