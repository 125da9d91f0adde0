"""How long a deployment to three hosts takes.

From nothing, with nothing to change, and with one process changed.

``python -m tests.benchmarks.bench_deploy``: three computers made of namespaces, each with an sshd
of its own, and a stand-in for systemd. It needs the right to make them. The three share the
processors of this machine.
"""

import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

from tests.benchmarks.results import record
from tests.support import processes
from tests.support.computers import Computers, missing

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
#: What is different in the third deployment: where one process says that its frame is.
CHANGE = ("[0, 0, 1]}, rate: 20 Hz}, host: arm", "[0, 0, 2]}, rate: 20 Hz}, host: arm")
RUNS = 5


def main() -> None:
    """Measure, and print the medians."""
    if lacking := missing():
        sys.exit(lacking)
    load = os.getloadavg()[0]
    first, again, changed = [], [], []
    for _ in range(RUNS):
        with tempfile.TemporaryDirectory() as folder, Computers(Path(folder), NAMES) as computers:
            Path(folder, "robot.yaml").write_text(ROBOT)
            first.append(_seconds(computers))
            again.append(_seconds(computers))
            Path(folder, "robot.yaml").write_text(ROBOT.replace(*CHANGE))
            changed.append(_seconds(computers))
    rows = {
        "from nothing until every edge of every host is live": first,
        "again, with nothing to change": again,
        "one process changed, on one host": changed,
    }
    record(
        "deploy",
        {row: [f"{statistics.median(seconds):.1f} s"] for row, seconds in rows.items()},
        load,
    )


def _seconds(computers: Computers) -> float:
    command = computers.in_office(sys.executable, "-m", "tfcompose", "deploy")
    begun = time.monotonic()
    processes.run(command, env=computers.environment(), cwd=computers.folder, check=True)
    return time.monotonic() - begun


if __name__ == "__main__":
    main()
