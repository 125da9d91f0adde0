"""Observers beside a node that sends 10,000 new frames at 20 Hz.

What they take is bounded, and the node is named.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import psutil
import pytest

from tests.support import processes
from tests.support.adversary import flood

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.support.domains import Domain

pytestmark = pytest.mark.ros

#: Of this an interpreter with ROS takes a third, and a listener's queue of long messages another.
MOST_BYTES = 220_000_000
ROBOT = """
tfcompose: 1
robot: flooded
base: base_link
frames: {odom: {}, base_link: {parent: odom, owner: drive}}
processes: {drive: {external: true, node: /drive}}
"""


@pytest.fixture
def robot(domain: Domain, tmp_path: Path) -> Iterator[Path]:
    file = tmp_path / "robot.yaml"
    file.write_text(ROBOT, encoding="utf-8")
    sender = processes.start([sys.executable, "-c", flood(10_000)], env=dict(domain.environment))
    yield file
    sender.terminate()
    sender.wait()


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ("monitor --for 6", ["further edges from /flood not kept"]),
        ("doctor --for 6", ["TF853", "/flood"]),
        ("verify --for 6 FILE", ["TF853", "/flood"]),
        ("tree --live --for 6", ["further edges from /flood not kept"]),
        ("echo a b --timeout 6", ["TF814", "of further frames came"]),
    ],
)
def test_a_flood_is_named_and_takes_bounded_memory(
    robot: Path, command: str, expected: list[str]
) -> None:
    words = command.replace("FILE", str(robot)).split()
    output = robot.with_name("output.txt")
    most = 0
    with output.open("wb") as out:
        running = processes.start(
            [sys.executable, "-m", "tfcompose", *words], stdout=out, stderr=out
        )
        process = psutil.Process(running.pid)
        while running.poll() is None:
            with process.oneshot():
                most = max(most, process.memory_info().rss)
            try:
                process.wait(0.2)
            except psutil.TimeoutExpired:
                continue
    text = output.read_text(encoding="utf-8")
    assert all(one in text for one in expected), text[-2000:]
    assert most < MOST_BYTES
