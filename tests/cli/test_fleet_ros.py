"""Two rovers from one file, isolated from each other, as they run.

Each on its own topics, one guard for both.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.support import processes

pytestmark = pytest.mark.ros

ROBOT = Path(__file__).parents[2] / "robots" / "two_rovers.yaml"
STRANGER = """
import sys, time
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.ros.node import TFPublisher, open_node
topic, parent, child = sys.argv[1:]
with open_node("stranger", "", args=["-r", f"/tf:={topic}"]) as node:
    publisher = TFPublisher(node, static=False)
    while True:
        publisher.publish(encode([SentTransform(time.time_ns(), parent, child, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))]))
        time.sleep(0.01)
"""  # noqa: E501 (a text as its reader has it)


def test_each_rover_uses_its_own_topics_and_foreign_edges_are_an_offence(
    start: Callable[..., Any], domain: Any, tmp_path: Path
) -> None:
    (tmp_path / "stranger.py").write_text(STRANGER, encoding="utf-8")
    robot = start("up", ROBOT)
    robot.until_says("tree complete: 11 edges")
    assert robot.output.count("tree complete") == 1
    observed = start(
        "echo",
        "rover1/base_link",
        "rover1/laser_link",
        "--once",
        "--namespace",
        "rover1",
    )
    observed.until_says("xyz        [0.1000, 0.0000, 0.2000] m")
    missing = start(
        "echo",
        "rover2/base_link",
        "rover2/laser_link",
        "--once",
        "--namespace",
        "rover1",
        "--timeout",
        2,
    )
    assert missing.process.wait(60) == 1
    program = [sys.executable, str(tmp_path / "stranger.py")]
    stranger = processes.start(
        [*program, "/rover2/tf", "rover1/odom", "rover1/base_link"], env=domain.environment
    )
    try:
        robot.until_says("/stranger")
    finally:
        stranger.kill()
        stranger.wait()
    offence = next(line for line in robot.lines if "/stranger" in line)
    assert "TF803" in offence, robot.lines
    assert "no robot_description" not in robot.output
    code = robot.end()
    assert code == 0  # an edge that nobody declared is a warning
