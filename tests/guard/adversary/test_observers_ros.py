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

pytestmark = [pytest.mark.ros, pytest.mark.slow, pytest.mark.alone]

#: Of this an interpreter with ROS takes a third, and a listener's queue of long messages another.
MOST_BYTES = 220_000_000


@pytest.fixture(autouse=True)
def sender(domain: Domain) -> Iterator[None]:
    sender = processes.start([sys.executable, "-c", flood(10_000)], env=dict(domain.environment))
    yield
    sender.terminate()
    sender.wait()


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ("monitor --for 6", ["further edges from /flood not kept"]),
        ("doctor --for 6", ["TF853", "/flood"]),
        ("echo a b --timeout 6", ["TF814", "of further frames came"]),
    ],
)
def test_a_flood_is_named_and_takes_bounded_memory(
    tmp_path: Path, command: str, expected: list[str]
) -> None:
    output = tmp_path / "output.txt"
    most = 0
    with output.open("wb") as out:
        running = processes.start(
            [sys.executable, "-m", "tfcompose", *command.split()], stdout=out, stderr=out
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
    assert all(edge in text for edge in expected), text[-2000:]
    assert most < MOST_BYTES
