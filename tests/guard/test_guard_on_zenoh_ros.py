"""The guard's process on Zenoh.

It names who takes an edge, who is silent, and who joins late, from peers' tokens.
"""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from tests.support.domains import Domain
from tests.support.guard_on_zenoh import guard_on_zenoh
from tests.support.waiting import until
from tests.support.zenoh_peers import RosPeer, free_port, session
from tfcompose.tf.ros.tf_codec import SentTransform, encode

pytestmark = pytest.mark.ros

ROBOT = """
tfcompose: 1
robot: rover
frames:
  map: {}
  odom: {parent: map, owner: slam, rate: 20 Hz}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
processes:
  slam: {external: true, node: /robot1/slam}
  drive: {external: true, node: /drive}
"""


class Sending:
    """A peer that sends an edge, 50 times a second, until it is closed."""

    def __init__(self, peer: RosPeer, parent: str, child: str) -> None:
        self._peer = peer
        self._edge = (parent, child)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        peer.advertise("/tf")
        self._thread.start()

    def close(self) -> None:
        """End it, and its publisher."""
        if not self._ended.is_set():
            self._ended.set()
            self._thread.join()
            self._peer.leave("/tf")

    def _run(self) -> None:
        while not self._ended.wait(0.02):
            moving = SentTransform(
                time.time_ns(), *self._edge, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
            )
            self._peer.send("/tf", encode([moving]))


@pytest.fixture
def sending(domain: Domain) -> Iterator[tuple[str, Callable[[str, str, str], Sending]]]:
    with ExitStack() as stack:
        router = f"tcp/127.0.0.1:{free_port()}"
        stack.enter_context(session("router", listen=[router]))

        def started(node: str, parent: str, child: str) -> Sending:
            made = Sending(RosPeer(stack, router, node, domain.id), parent, child)
            stack.callback(made.close)
            return made

        yield router, started


def test_a_live_guard_names_owners_and_strangers_on_zenoh(
    sending: tuple[str, Callable[[str, str, str], Sending]],
    start: Callable[..., Any],
    tmp_path: Path,
) -> None:
    router, peer = sending
    (tmp_path / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    slam = peer("/robot1/slam", "map", "odom")
    peer("/drive", "odom", "base_link")
    robot = start(
        "up",
        tmp_path / "robot.yaml",
        "--no-live",
        "-o",
        tmp_path / "built",
        **guard_on_zenoh(tmp_path, router),
    )
    robot.until_says("all ready")
    assert "tree complete: 2 edges" in robot.output
    assert "slam (/robot1/slam): map → odom" in robot.output
    assert "drive (/drive): odom → base_link" in robot.output
    assert "TF80" not in robot.output, "nobody is blamed who sends what is theirs"
    rogue = peer("/rogue", "map", "odom")
    robot.until_says("TF801")
    line = next(line for line in robot.lines if "TF801" in line)
    assert "/rogue" in line, line
    rogue.close()
    slam.close()
    assert until(lambda: any("TF804" in line and "map → odom" in line for line in robot.lines)), (
        robot.output
    )
    peer("/robot1/slam", "map", "odom")
    robot.until_says("map → odom is back")
    assert robot.end() == 0
    assert "SIGTERM" not in robot.output, "the guard ends with its sessions open"
