"""A robot among hostile publishers, and children that try to evade its guard.

Each edge's x says who sent it.
"""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shlex
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tests.support import processes
from tests.support.domains import entered_domain
from tests.support.running_robot import RunningRobot
from tests.support.waiting import TIMEOUT_S, until
from tfcompose.foundation.signals import Stop
from tfcompose.tf.ros.node import TFSubscription, open_node, wait
from tfcompose.tf.ros.tf_codec import decode

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

#: The ways in which a guard can watch.
GUARDS = {"watch": "mode: watch", "strict": "mode: strict", "remap": "mode: strict, fence: remap"}
#: A node that sends edges at 20 Hz, or what is given as ``hex:`` and the bytes of a message in
#: hexadecimal.
NODE = """
import os, signal, sys, time
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.ros.node import TFPublisher, open_node
words, _, ros = "\\n".join(sys.argv[1:]).partition("\\n--ros-args\\n")
name, namespace, x, *edges = words.split("\\n")
signal.signal(signal.SIGTERM, lambda *_: sys.exit())
signal.signal(signal.SIGINT, lambda *_: sys.exit())
def message():
    if edges[0].startswith("hex:"):
        return bytes.fromhex(edges[0][4:])
    now, rest = time.time_ns(), ((float(x), 0, 0), (0, 0, 0, 1))
    return encode([SentTransform(now, *edge.split(), *rest) for edge in edges])
with open_node(name, namespace, args=ros.split("\\n") if ros else []) as node:
    publisher = TFPublisher(node, static=False, topic=os.environ.get("TOPIC", "/tf"))
    print("ready", flush=True)
    while True:
        publisher.publish(message())
        time.sleep(0.05)
"""
_FLOOD = """
import signal, sys, time
from tfcompose.tf.ros.tf_codec import Template
from tfcompose.tf.ros.node import TFPublisher, open_node
signal.signal(signal.SIGTERM, lambda *_: sys.exit())
template = Template([(f"f00000000_{{i:05}}", f"f00000000_{{i + 1:05}}") for i in range({count})])
with open_node("flood", "/") as node:
    publisher, n, due = TFPublisher(node, static=False), 0, time.monotonic()
    while True:
        n, due = n + 1, due + 0.05
        template.set_stamp(time.time_ns())
        publisher.publish(template.data.replace(b"f00000000_", b"f%08d_" % n))
        time.sleep(max(0.0, due - time.monotonic()))
"""
#: What the true owner sends, and those that are started beside the robot.
OWNER_X, OTHER_X = 1.0, 2.0


def node(name: str, x: float, *edges: str, namespace: str = "/") -> list[str]:
    """Return the command of a node, in the robot's folder."""
    return [sys.executable, "node.py", name, namespace, str(x), *edges]


def foreign(x: float, *edges: str) -> list[str]:
    """Return the command of a program of another vendor's DDS, which is no ROS node."""
    return [sys.executable, "-m", "tests.support.foreign_dds", str(x), *edges]


def flood(count: int) -> str:
    """Return a program of a node /flood that sends chains of new frames at 20 Hz."""
    return _FLOOD.format(count=count)


def in_shell(first: str, command: Sequence[str]) -> list[str]:
    """Return the command of a shell that does something first."""
    return ["/bin/sh", "-c", f"{first} {shlex.join(command)}"]


@dataclass
class Child:
    """A process of the robot's: its command, and the frames below base_link that it owns.

    Its node is /NAME.
    """

    command: Sequence[str]
    frames: Sequence[str] = ()


class Robot(RunningRobot):
    """A running robot with owners of map → odom and odom → base_link, and more children."""

    def __init__(
        self, folder: Path, guard: str, children: Mapping[str, Child], env: Mapping[str, str]
    ) -> None:
        (folder / "node.py").write_text(NODE, encoding="utf-8")
        self.env, self.guard = dict(env), guard
        lines = [
            *(
                "tfcompose: 1",
                "robot: liars",
                "ros: {discovery: localhost}",
                "links: {base_link: {}}",
            ),
            f"guard: {{{GUARDS[guard]}}}",
            *(
                "frames:",
                "  map: {}",
                "  odom: {parent: map, owner: slam}",
                "  base_link: {parent: odom, owner: drive}",
            ),
            *(
                f"  {frame}: {{parent: base_link, owner: {name}}}"
                for name in children
                for frame in children[name].frames
            ),
            *("processes:", "  drive: {simulate: {fixed: {}, rate: 20 Hz}}"),
            f"  slam: {{run: {json.dumps(node('slam', OWNER_X, 'map odom'))}, node: /slam}}",
        ]
        for name, child in children.items():
            more = {"run": child.command, "node": f"/{name}", "required": False, "restart": "no"}
            lines.append(f"  {name}: {json.dumps(more)}")
        (folder / "robot.yaml").write_text("\n".join(lines), encoding="utf-8")
        super().__init__(folder, env=self.env)

    def output_after(self, lines: int) -> str:
        """Return what it has said behind so many lines."""
        return "\n".join(self.lines(after=lines))

    def pid_of(self, process: str) -> int:
        """Return the process number of one of its own."""
        match = re.search(rf"started {process} \(pid (\d+)\)", self.text)
        assert match, process
        return int(match[1])

    def start(self, command: Sequence[str], **env: str) -> subprocess.Popen[str]:
        """Start a program beside the robot."""
        out = (self.folder / "rogue.txt").open("wb")
        with out:
            return processes.start(
                command, cwd=self.folder, env=self.env | env, stdout=out, stderr=out
            )

    @staticmethod
    def stop(started: subprocess.Popen[str]) -> None:
        """Let a program leave: one that is killed is in the graph for a while."""
        started.terminate()
        try:
            started.wait(TIMEOUT_S)
        finally:
            processes.end(started)


@contextmanager
def running(folder: Path, guard: str, children: Mapping[str, Child]) -> Iterator[Robot]:
    """Run a robot in a domain of its own, which is this process's as well.

    What it keeps is in the folder.
    """
    with entered_domain(folder) as domain:
        path = os.pathsep.join(filter(None, sys.path))
        robot = Robot(folder, guard, children, {**domain.environment, "PYTHONPATH": path})
        try:
            yield robot
        finally:
            robot.end()


class PlainListener:
    """A listener like anybody's, which notes the x of each child frame."""

    def __init__(self) -> None:
        self.heard: dict[str, list[float]] = {}

    def until(self, child: str, x: float, times: int = 20) -> list[float]:
        """Listen until this x came so often for the frame, and return all that came for it."""
        with open_node("late", "/test") as node:
            reader = TFSubscription(node, static=False)

            def enough() -> bool:
                wait(node, [reader], 0.1, Stop())
                for received in reader.take():
                    for transform in decode(received.data):
                        self.heard.setdefault(transform.child, []).append(transform.xyz[0])
                return self.heard.get(child, []).count(x) >= times

            assert until(enough), self.heard
        return self.heard[child]


def holds_back(robot: Robot, inside: Mapping[str, str], **foreign_inside: str) -> None:
    """Let a node, and a program of another DDS, join what only the robot's processes are in."""
    after = len(robot.lines())
    started = [robot.start(node("inside", OTHER_X, "map odom"), **inside)]
    try:
        robot.says("error[TF801]", "map → odom", "/inside", after=after)
        robot.says("note: ", f"pid {started[0].pid}", after=after)
        if importlib.util.find_spec("cyclonedds"):  # there is none for every Python
            program = foreign(OTHER_X, "map odom", "odom extra")
            started.append(robot.start(program, **foreign_inside))
            robot.says("a DDS program that is not a ROS node", after=after)
        listener = PlainListener()
        assert OTHER_X not in listener.until("odom", OWNER_X, 40)
        assert "extra" not in listener.heard
        assert "listeners receive it" not in robot.output_after(after)
    finally:
        for rogue in started:
            robot.stop(rogue)
