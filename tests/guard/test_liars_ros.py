"""Children and strangers that bear an owner's name, or leave the fence.

Whom the guard names, and who is heard.
"""

from __future__ import annotations

import json
import re
import signal
import sys
from typing import TYPE_CHECKING

import psutil
import pytest

from tests.support import processes
from tests.support.waiting import TIMEOUT_S, complete_lines, gone, until
from tfcompose.foundation.signals import Stop
from tfcompose.tf.ros.node import TFSubscription, open_node, wait
from tfcompose.tf.ros.tf_codec import decode

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

pytestmark = pytest.mark.ros

#: A node that sends edges at 20 Hz; x says who it is.
NODE = """
import signal, sys, time
from tfcompose.tf.ros.tf_codec import Transform, encode
from tfcompose.tf.ros.node import TFPublisher, open_node
words, _, ros = " ".join(sys.argv[1:]).partition(" --ros-args ")
name, x, *edges = words.split(" ", 2)
edges, ros = edges[0].split(", "), ["--ros-args", *ros.split()] if ros else []
signal.signal(signal.SIGTERM, lambda *_: sys.exit())
signal.signal(signal.SIGINT, lambda *_: sys.exit())
with open_node(name, "/", args=ros) as node:
    publisher = TFPublisher(node, static=False)
    print("ready", flush=True)
    while True:
        now = time.time_ns()
        publisher.publish(encode([Transform(now, *edge.split(), (float(x), 0, 0), (0, 0, 0, 1)) for edge in edges]))
        time.sleep(0.05)
"""  # noqa: E501 (a text as its reader has it)
ROBOT = """
tfcompose: 1
robot: liars
ros: {{discovery: localhost}}
links: {{base_link: {{}}}}
frames:
  map: {{}}
  odom: {{parent: map, owner: slam}}
  base_link: {{parent: odom, owner: drive}}
  hand: {{parent: base_link, owner: rogue}}
processes:
  slam: {{run: {slam}, node: /slam}}
  drive: {{simulate: {{fixed: {{}}, rate: 20 Hz}}}}
  rogue: {{run: {rogue}, node: /rogue, required: false}}
guard: {{{guard}}}
"""
#: What the true owner, another and a child of the run send as x.
OWNER_X, OTHER_X, CHILD_X = 1.0, 2.0, 3.0


class Liars:
    """A robot whose owner /slam has a namesake, or whose child is outside of the fence."""

    def __init__(self, folder: Path, guard: str, rogue: object = None) -> None:
        (folder / "node.py").write_text(NODE, encoding="utf-8")
        self.folder, self.output = folder, folder / "output.txt"
        slam = self.command("slam", OWNER_X, "map odom")
        rogue = self.command("rogue", CHILD_X, "base_link hand") if rogue is None else rogue
        text = ROBOT.format(guard=guard, slam=json.dumps(slam), rogue=json.dumps(rogue))
        (folder / "robot.yaml").write_text(text, encoding="utf-8")
        with self.output.open("wb") as out:
            command = [sys.executable, "-m", "tfcompose", "up"]
            self.popen = processes.start(command, cwd=folder, stdout=out, stderr=out)

    @staticmethod
    def command(name: str, x: float, *edges: str) -> list[str]:
        return [sys.executable, "node.py", name, str(x), *edges]

    def says(self, *words: str) -> str:
        """Wait for a line with all these words, and return it."""

        def found() -> list[str]:
            return [
                line for line in complete_lines(self.output) if all(word in line for word in words)
            ]

        assert until(found, 60), (words, self.text)
        return found()[0]

    @property
    def text(self) -> str:
        return self.output.read_text(encoding="utf-8")

    def pid_of(self, process: str) -> int:
        match = re.search(rf"started {process} \(pid (\d+)\)", self.text)
        assert match
        return int(match[1])


@pytest.fixture
def run(domain: object, tmp_path: Path) -> Iterator[Callable[..., Liars]]:
    assert domain
    running: list[Liars] = []

    def start(guard: str, rogue: object = None) -> Liars:
        running.append(Liars(tmp_path, guard, rogue))
        return running[-1]

    yield start
    for one in running:
        one.popen.send_signal(signal.SIGINT)
        try:
            one.popen.wait(TIMEOUT_S)
        finally:
            one.popen.kill()


def heard_until(child: str, x: float, times: int = 20) -> list[float]:
    """Return the x of each transform that a new listener receives of a frame.

    It ends when this one came this often.
    """
    with open_node("late", "/test") as node:
        reader = TFSubscription(node, static=False)
        found: list[float] = []

        def enough() -> bool:
            wait(node, [reader], 0.1, Stop())
            found.extend(
                t.xyz[0] for one in reader.take() for t in decode(one.data) if t.child == child
            )
            return found.count(x) >= times

        assert until(enough), found
        return found


@pytest.mark.parametrize(
    "guard",
    [
        "mode: strict",
        pytest.param("mode: watch", marks=pytest.mark.slow),
        pytest.param("mode: strict, fence: remap", marks=pytest.mark.slow),
    ],
)
def test_of_two_with_the_owners_name_the_stranger_is_accused_and_the_owner_is_heard(
    run: Callable[..., Liars], guard: str
) -> None:
    robot = run(guard)
    robot.says("tree complete")
    stranger = processes.start(robot.command("slam", OTHER_X, "map odom"), cwd=robot.folder)
    try:
        robot.says("error[TF801]", "map → odom", "another /slam")
        robot.says("note: ", f"pid {stranger.pid}")
        heard_until("odom", OWNER_X)
    finally:
        processes.end(stranger)
    assert f"pid {robot.pid_of('slam')}:" not in robot.text, "the owner is not accused"
    robot.says("over", "map → odom")


@pytest.mark.parametrize("guard", ["mode: strict", "mode: strict, fence: remap"])
def test_a_child_with_an_owners_name_gets_nothing_of_that_owners_through(
    run: Callable[..., Liars], guard: str
) -> None:
    liar = [sys.executable, "node.py", "slam", str(CHILD_X), "map odom, base_link hand"]
    robot = run(guard, liar)
    robot.says("error[TF801]", "map → odom", "another /slam")
    assert CHILD_X not in heard_until("odom", OWNER_X)


@pytest.mark.parametrize(
    "slip",
    ["export FASTRTPS_DEFAULT_PROFILES_FILE=own.xml\n", "unset FASTRTPS_DEFAULT_PROFILES_FILE\n"],
)
def test_a_child_that_leaves_the_fence_is_named_and_stopped(
    run: Callable[..., Liars], tmp_path: Path, slip: str
) -> None:
    (tmp_path / "own.xml").write_text("<?xml version='1.0'?><dds/>\n", encoding="utf-8")
    (tmp_path / "setup.sh").write_text(slip, encoding="utf-8")
    words = " ".join(f"'{word}'" for word in Liars.command("rogue", CHILD_X, "base_link hand"))
    robot = run("mode: strict", ["/bin/sh", "-c", f". ./setup.sh; exec {words}"])
    robot.says("error[TF852]", "/rogue", "rogue")
    robot.says("note: ", "rogue is stopped")
    assert until(lambda: gone(robot.pid_of("rogue")))
    assert robot.popen.poll() is None
    assert robot.text.count("error[TF852]") == 1


#: A node that sends new frames in each message: so many transforms, ten times a second.
FLOOD = """
import signal, sys, time
from tfcompose.tf.ros.tf_codec import Transform, encode
from tfcompose.tf.ros.node import TFPublisher, open_node
signal.signal(signal.SIGTERM, lambda *_: sys.exit())
with open_node("flood", "/") as node:
    publisher, n = TFPublisher(node, static=False), 0
    print("ready", flush=True)
    while True:
        n, now = n + 1, time.time_ns()
        rest = ((0, 0, 0), (0, 0, 0, 1))
        publisher.publish(encode([Transform(now, f"f{n}_{i}", f"f{n}_{i + 1}", *rest) for i in range(3000)]))
        time.sleep(0.1)
"""  # noqa: E501 (a text as its reader has it)
#: What a guard may grow by, however much is sent.
MOST_GROWTH = 60_000_000


@pytest.mark.parametrize("guard", ["mode: watch", "mode: strict"])
def test_a_flood_of_ever_new_frames_is_named_and_takes_neither_the_tree_nor_the_memory(
    run: Callable[..., Liars], guard: str
) -> None:
    robot = run(guard)
    robot.says("tree complete")
    process = psutil.Process(robot.pid_of("guard"))
    before = process.memory_info().rss
    (robot.folder / "flood.py").write_text(FLOOD, encoding="utf-8")
    flood = processes.start([sys.executable, "flood.py"], cwd=robot.folder)
    try:
        robot.says("error[TF853]", "/flood")
        heard_until("odom", OWNER_X, 60)
        assert process.memory_info().rss - before < MOST_GROWTH
    finally:
        processes.end(flood)
    assert robot.pid_of("guard") == process.pid, "it was not killed as one that hangs"
    assert process.is_running()
