"""A strict guard on the real thing.

Children that send what is not theirs, late joiners, and a guard that is killed.
"""

import json
import re
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.domains import entered_domain
from tests.support.guard_without_ids import guard_without_ids
from tests.support.processes import Started
from tests.support.running_robot import RunningRobot
from tests.support.waiting import TIMEOUT_S, gone, until
from tfcompose.foundation.signals import Stop
from tfcompose.tf.ros.graph import writers
from tfcompose.tf.ros.node import Received, TFPublisher, TFSubscription, open_node, wait
from tfcompose.tf.ros.tf_codec import SentTransform, decode, encode

pytestmark = pytest.mark.ros

#: A node that latches edges, sends others at 20 Hz with stamps that do not change, and says whom
#: it hears on TF.
CHILD = """
import json, signal, sys, time
from tfcompose.tf.ros.tf_codec import SentTransform, decode, encode
from tfcompose.tf.ros.node import TFPublisher, TFSubscription, open_node
name, fixed, moving = sys.argv[1], json.loads(sys.argv[2]), json.loads(sys.argv[3])
signal.signal(signal.SIGINT, lambda *_: sys.exit())
def message(edges):
    return encode([SentTransform(time.time_ns(), *edge.split(), (0.1, 0.2, 0.3), (0.0, 0.0, 0.6, 0.8)) for edge in edges])
def wait_until_passed_on(edge):
    # A latched topic keeps the last message only, and counted subscribers may be its own.
    with open_node(name, "/outside") as node:
        reader, wanted = TFSubscription(node, static=True), edge.split()[1]
        while wanted not in {t.child for one in reader.take() for t in decode(one.data)}:
            time.sleep(0.01)
with open_node(name, "/", args=sys.argv[5:]) as node:
    readers = [TFSubscription(node, static=static) for static in (False, True)]
    latched, sent, heard = TFPublisher(node, static=True), TFPublisher(node, static=False), set()
    for before, edge in zip([None, *fixed], fixed):  # one after the other, as some nodes do
        if before:
            wait_until_passed_on(before)
        latched.publish(message([edge]))
    while True:
        data = message(moving)
        if moving:
            sent.publish(data)
            if name == "drive":
                print("sent", data.hex(), flush=True)
        time.sleep(0.05)
        found = {t.child for reader in readers for one in reader.take() for t in decode(one.data)} - heard
        heard |= found
        if found:
            print("hears", *sorted(heard), flush=True)
"""  # noqa: E501 (a text as its reader has it)
ROBOT = """
tfcompose: 1
robot: fenced
ros: {{discovery: localhost}}
links: {{base_link: {{}}}}
frames:
  map: {{}}
  odom: {{parent: map, owner: slam, rate: 10 Hz}}
  base_link: {{parent: odom, owner: drive, rate: 15 Hz}}
  laser: {{parent: base_link}}
  arm: {{parent: base_link, owner: arm, static: true}}
  tool: {{parent: arm, owner: arm, static: true}}
  hand: {{parent: tool, owner: rogue}}
processes:
  slam: {{simulate: {{fixed: {{}}, rate: 10 Hz}}}}
  drive: {drive}
  arm: {arm}
  rogue: {rogue}
guard: {{mode: strict, fence: {fence}}}
"""
FRAMES = {"odom", "base_link", "laser", "arm", "tool", "hand"}
FIXED = {"laser", "arm", "tool"}


def child(name: str, fixed: list[str], moving: list[str], folder: Path) -> str:
    argv = [sys.executable, str(folder / "child.py"), name, json.dumps(fixed), json.dumps(moving)]
    return json.dumps({"run": argv, "node": f"/{name}"})


class Fenced(RunningRobot):
    """A robot under a strict guard."""

    def __init__(self, folder: Path, fence: str, env: dict[str, str]) -> None:
        (folder / "child.py").write_text(CHILD, encoding="utf-8")
        text = ROBOT.format(
            fence=fence,
            drive=child("drive", [], ["odom base_link"], folder),
            arm=child("arm", ["base_link arm", "arm tool"], [], folder),
            rogue=child(
                "rogue", ["base_link laser"], ["map odom", "tool hand", "tool cup"], folder
            ),
        )
        (folder / "robot.yaml").write_text(text, encoding="utf-8")
        super().__init__(folder, env=env)


FENCES = [
    pytest.param(fence, marks=pytest.mark.xdist_group(f"fence {fence}"))
    for fence in ("partition", "remap", "remap nameless")
]


@pytest.fixture(scope="module", params=FENCES)
def robot(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Fenced]:
    """A robot for its tests in their order; the last one ends it."""
    folder = tmp_path_factory.mktemp("fenced")
    fence, _, nameless = request.param.partition(" ")
    with entered_domain(folder):
        running = Fenced(folder, fence, guard_without_ids(folder) if nameless else {})
        processes.share(running.popen)
        try:
            running.says("tree complete")
            yield running
        finally:
            running.end()


class Listener:
    """A listener like anybody's."""

    def __init__(self, node: object) -> None:
        self.node: object = node
        self.readers = [TFSubscription(node, static=static) for static in (False, True)]  # type: ignore[arg-type]

    def hears(
        self, seconds: float, enough: Callable[[list[Received]], bool] | None = None
    ) -> list[Received]:
        """Return what comes in this time, or until it is enough."""
        received: list[Received] = []
        end = time.monotonic() + seconds
        while time.monotonic() < end and not (enough and enough(received)):
            wait(self.node, self.readers, 0.1, Stop())  # type: ignore[arg-type]
            received += [message for reader in self.readers for message in reader.take()]
        return received


def children(received: list[Received]) -> set[str]:
    return {
        transform.child
        for received_message in received
        for transform in decode(received_message.data)
    }


def of_the_base(received: list[Received]) -> set[str]:
    return {
        received_message.data.hex()
        for received_message in received
        if children([received_message]) == {"base_link"}
    }


def reported(robot: Fenced) -> list[str]:
    return [line for line in robot.lines(" published by /rogue") if "note" not in line]


def test_only_owned_edges_pass_unchanged_and_the_rest_is_named(
    robot: Fenced,
) -> None:
    robot.says("error[TF801]", "/rogue;")
    robot.says("warning[TF803]", "tool → cup", "/rogue")
    with open_node("late", "/test") as node:
        listener = Listener(node)
        received = listener.hears(
            TIMEOUT_S, lambda some: children(some) >= FRAMES and len(of_the_base(some)) > 10
        )
        received += listener.hears(2)
        names: dict[bytes | None, str] = {}

        def named() -> bool:
            names.update(
                (writer.gid, writer.node)
                for topic in ("/tf", "/tf_static")
                for writer in writers(node, topic)
            )
            return all(
                names.get(received_message.gid) == "/tfcompose_guard"
                for received_message in received
                if received_message.gid
            )

        assert until(named), names
    assert children(received) == FRAMES
    poses = {
        t.xyz
        for received_message in received
        for t in decode(received_message.data)
        if t.child in {"odom", "laser"}
    }
    assert (0.1, 0.2, 0.3) not in poses, "the rogue's edge got through"
    fixed = [
        received_message for received_message in received if children([received_message]) <= FIXED
    ]
    assert sorted(map(len, map(decode, (message.data for message in fixed)))) == [
        1,
        2,
    ], "each sender's edges in one message"
    got = of_the_base(received)
    assert len(got) > 10
    # What a child says of a message comes through the launcher, and later than the message.
    assert until(lambda: got <= {line.split()[-1] for line in robot.lines(" sent ")}), (
        "something is not as it was sent"
    )

    def heard_by_the_drive() -> set[str]:
        hears = [line for line in robot.lines(" hears ") if line.startswith("drive")]
        return set(hears[-1].split(" hears ")[1].split()) if hears else set()

    assert until(lambda: heard_by_the_drive() >= FRAMES), "the fence is in a child's ear"
    assert heard_by_the_drive() == FRAMES
    robot.says("note: held back")


@pytest.mark.parametrize("robot", FENCES[:1], indirect=True, scope="module")
def test_a_dead_guard_passes_nothing_and_its_successor_passes_all(
    robot: Fenced,
) -> None:
    with open_node("early", "/test") as node, open_node("meanwhile", "/test") as second_node:
        listener = Listener(node)
        assert children(listener.hears(TIMEOUT_S, lambda some: children(some) >= FRAMES)) == FRAMES
        more = re.compile(r"(?: and (\d+) more edge)? (?:is|are) published by /rogue")
        assert until(
            lambda: sum(1 + int(more.findall(line)[0] or 0) for line in reported(robot)) == 3
        ), robot.text
        before = reported(robot)
        dead = robot.child("guard")
        dead.kill()
        assert until(lambda: gone(dead))
        died_ns = time.time_ns()
        meanwhile: list[Received] = []

        def is_back() -> bool:
            meanwhile.extend(listener.hears(0.05))
            return robot.text.count("started guard") == 2

        assert until(is_back), robot.text  # it waits a second, and then needs some time to listen
        began_ns = robot.child("guard").create_time() * 1e9
        assert [
            received for received in meanwhile if died_ns < received.source_ns < began_ns
        ] == []
        joined = Listener(second_node)
        robot.says("warning[TF808]", "guard", "SIGKILL", "/tf")
        robot.says("over", "guard")
        assert (
            children(listener.hears(TIMEOUT_S, lambda some: children(some) >= FRAMES - FIXED))
            >= FRAMES - FIXED
        )
        assert children(joined.hears(TIMEOUT_S, lambda some: children(some) >= FRAMES)) == FRAMES
    assert robot.text.count("tree complete") == 1
    assert reported(robot) == before


def test_at_its_end_it_prints_what_it_held_back(robot: Fenced) -> None:
    robot.end()
    assert robot.lines("held back: ", " × map → odom from /rogue", " × tool → cup from /rogue")
    assert "tool → hand from" not in robot.text


#: A node that latches an edge, and counts what it hears: a line of JSON, by frame, whenever it has
#: changed.
LISTENER = """
import json, signal, sys, time
from collections import Counter
from tfcompose.tf.ros.tf_codec import SentTransform, decode, encode
from tfcompose.tf.ros.node import open_node
from tfcompose.foundation.signals import Stop
from tfcompose.tf.ros.node import TFPublisher, TFSubscription, wait
signal.signal(signal.SIGINT, lambda *_: sys.exit())
with open_node("ear", "/", args=sys.argv[2:]) as node:
    readers = [TFSubscription(node, static=static) for static in (False, True)]
    latched, heard = TFPublisher(node, static=True), Counter()
    latched.publish(encode([SentTransform(0, "base_link", "ear", (0.1, 0.2, 0.3), (0.0, 0.0, 0.6, 0.8))]))
    while True:
        wait(node, readers, 0.5, Stop())
        heard.update(t.child for reader in readers for one in reader.take() for t in decode(one.data))
        print("heard", json.dumps(heard), flush=True)
"""  # noqa: E501 (a text as its reader has it)
LISTENING = """
tfcompose: 1
robot: listening__robot
ros: {{discovery: localhost}}
links: {{base_link: {{}}}}
frames:
  odom: {{}}
  base_link: {{parent: odom, owner: drive, rate: 20 Hz}}
  laser: {{parent: base_link}}
  ear: {{parent: base_link, owner: ear__, static: true}}
processes:
  drive: {{simulate: {{fixed: {{}}, rate: 20 Hz}}}}
  ear__: {{run: [{python}, {file}], node: /ear}}
guard: {{mode: strict, fence: remap, allow: [{{child: "dock*"}}]}}
"""


def heard_by(up: Started) -> dict[str, int]:
    """Return what the listener has heard since it was started last."""
    since = up.output.rpartition("started ear__")[2]
    lines = [line.partition("heard ")[2] for line in since.splitlines() if "| heard " in line]
    counts: dict[str, int] = json.loads(lines[-1]) if lines else {}
    return counts


def encoded(parent: str, child: str) -> bytes:
    return encode(
        [SentTransform(time.time_ns(), parent, child, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))]
    )


def test_a_late_remapped_listener_hears_the_complete_tree_once(
    start: Callable[..., Started], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ear.py").write_text(LISTENER, encoding="utf-8")
    (tmp_path / "robot.yaml").write_text(
        LISTENING.format(python=sys.executable, file=tmp_path / "ear.py"), encoding="utf-8"
    )
    up = start("up", tmp_path / "robot.yaml")
    with open_node("outside", "/test") as node:
        fixed, moving = TFPublisher(node, static=True), TFPublisher(node, static=False)
        fixed.publish(encoded("odom", "dock"))
        up.until_says("tree complete")
        sent = 0

        def send() -> bool:
            nonlocal sent
            sent += 1
            moving.publish(encoded("odom", "dock_2"))
            return until(lambda: "dock_2" in heard_by(up), 0.05)

        assert until(send), up.output
        full = {"base_link", "laser", "ear", "dock"}
        assert until(lambda: heard_by(up).keys() >= full), up.output
        assert heard_by(up)["dock_2"] <= sent
        assert heard_by(up)["ear"] == 1, "its own came back to it"
        start("restart", "ear__").process.wait(60)
        assert until(lambda: heard_by(up).keys() >= full), up.output
        assert heard_by(up)["ear"] == 1
        expected = {"/tfcompose_guard", "/test/outside"}
        assert until(lambda: {writer.node for writer in writers(node, "/tf_static")} == expected)
