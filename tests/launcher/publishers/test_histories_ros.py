"""Publishing processes as histories: a clock that is set by hand, and nodes that are none."""

import math
from collections.abc import Callable, Iterable
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tfcompose.foundation.geometry import Pose
from tfcompose.foundation.signals import Stop
from tfcompose.launcher.publishers import joints, simulate
from tfcompose.model.plan import PlanEdge, PlanJoint, PlanProcess, Simulation, Sweep
from tfcompose.tf.process import read_own
from tfcompose.tf.ros import clock, graph, node, sensor_data
from tfcompose.tf.ros.joint_codec import encode_names, fill
from tfcompose.tf.ros.tf_codec import SentTransform, decode


class History:
    """A process that stands in for an owner; it ends when the history does."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.now = 100.0
        self.sent: list[SentTransform] = []
        self.stop = Stop()
        self.patch = patch
        publisher = SimpleNamespace(publish=lambda data: self.sent.extend(decode(data)))
        patch.setattr(node, "open_node", lambda *_, **__: nullcontext())
        patch.setattr(node, "TFPublisher", lambda _, static: None if static else publisher)

    def run(self, file: Path) -> list[SentTransform]:
        simulate.simulate(read_own([str(file), "wheels"], "simulate"), self.stop)
        return self.sent

    def wakes_late(self, late_s: Iterable[float]) -> None:
        """Let each wait for the system's time last so much longer than it was to."""
        left = iter(late_s)

        def wait(timeout_s: float) -> bool:
            self.now += timeout_s + next(left, math.inf)
            return math.isinf(self.now)

        self.patch.setattr(self.stop, "wait", wait)
        times = SimpleNamespace(monotonic=lambda: self.now, time_ns=lambda: round(self.now * 1e9))
        self.patch.setattr(simulate, "time", times)

    def clock_says(self, seconds: Iterable[float | None]) -> None:
        """Let these times come on /clock, None where it says nothing, a second apart."""
        left = iter(seconds)
        came: list[float | None] = [None]

        def wait(*_: object) -> None:
            self.now += 1.0
            try:
                came[0] = next(left)
            except StopIteration:
                self.stop.request()

        def now_ns() -> int | None:
            return None if came[0] is None else round(came[0] * 1e9)

        made = SimpleNamespace(subscription=None, now_ns=now_ns)
        self.patch.setattr(clock, "SimClock", lambda _: made)
        self.patch.setattr(clock, "publishing_nodes", lambda *_: [])
        self.patch.setattr(node, "wait", wait)
        self.patch.setattr(simulate, "time", SimpleNamespace(monotonic=lambda: self.now))


@pytest.fixture
def history(monkeypatch: pytest.MonkeyPatch) -> History:
    return History(monkeypatch)


@pytest.fixture
def wheels(write: Callable[..., Path], edge: Callable[..., PlanEdge]) -> Callable[..., Path]:
    """Write a plan in which wheels stand in for the owner of odom → base."""

    def make(simulation: Simulation, **more: Any) -> Path:
        process = PlanProcess("wheels", "simulate", simulate=simulation)
        return write([edge("odom base", "wheels")], process, **more)

    return make


def test_late_ticks_delay_no_later_one_and_missed_ones_are_left_out(
    history: History, wheels: Callable[..., Path]
) -> None:
    history.wakes_late((0.0, 0.03, 0.09, 0.0, 0.0, 0.0, 0.001, 0.0))
    pose = Pose((1.0, 2.0, 3.0), (0.0, 0.0, 0.6, 0.8))
    sent = history.run(wheels(Simulation("fixed", 25.0, pose=pose)))
    assert {(t.parent, t.child, t.xyz, t.quat_xyzw) for t in sent} == {
        ("odom", "base", pose.xyz, pose.quat_xyzw)
    }
    assert [t.stamp_ns / 1e9 - 100.0 for t in sent] == pytest.approx(
        [0.0, 0.07, 0.17, 0.17, 0.2, 0.24, 0.281, 0.32]
    )


def test_simulated_time_comes_from_the_clock_topic(
    history: History, wheels: Callable[..., Path]
) -> None:
    """5.03 is within a period, and 1.0 of a simulator that starts anew."""
    history.clock_says((None, 5.0, 5.03, 5.1, 5.3, 1.0, 1.1))
    circle = Simulation("circle", 10.0, radius=1.0, speed=1.0)
    sent = history.run(wheels(circle, clock="sim"))
    angles = [math.atan2(t.xyz[1], t.xyz[0]) for t in sent]
    assert [t.stamp_ns / 1e9 for t in sent] == [5.0, 5.1, 5.3, 1.0, 1.1]
    assert angles == pytest.approx([0.0, 0.1, 0.3, 0.0, 0.1])


def test_a_clock_that_says_nothing_is_named_once_after_5_s(
    history: History, wheels: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    history.clock_says([None] * 20)
    assert history.run(wheels(Simulation("fixed", 10.0), clock="sim")) == []
    assert capsys.readouterr().out.count("no time on /clock after 5 s") == 1


def test_swept_joints_begin_where_they_stand_and_the_others_stay(
    history: History, write: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[tuple[int, list[float]]] = []

    class Publisher:
        topic = "/rover/joint_states"

        def __init__(self, _: object, names: list[str]) -> None:
            assert names == ["lift", "grip"]

        def publish(self, stamp_ns: int, positions: list[float]) -> None:
            sent.append((stamp_ns, positions))

    monkeypatch.setattr(sensor_data, "JointStatePublisher", Publisher)
    history.wakes_late([0.0] * 5)
    sweep = {"lift": Sweep(1.0, 0.1, 0.5)}
    moves = Simulation("joints", 4.0, joints={"lift": 0.3, "grip": 0.5}, sweep=sweep)
    history.run(write([], PlanProcess("wheels", "simulate", simulate=moves)))
    assert [stamp_ns / 1e9 for stamp_ns, _ in sent] == [100.0, 100.25, 100.5, 100.75, 101.0]
    assert [lift for _, (lift, _) in sent] == pytest.approx([0.3, 0.5, 0.3, 0.1, 0.3])
    assert {grip for _, (_, grip) in sent} == {0.5}


@pytest.mark.parametrize("senders", [["/drive"], []])
def test_joints_without_states_are_named_once_after_5_s_with_other_senders(
    edge: Callable[..., PlanEdge],
    write: Callable[..., Path],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    senders: list[str],
) -> None:
    """Edges are published meanwhile, and as soon as a joint state comes."""
    edges = [
        edge(f"base {name}", "joints", None, PlanJoint(name, "revolute", (0.0, 1.0, 0.0)))
        for name in ("left", "right")
    ]
    file = write(edges, PlanProcess("static", "static"), PlanProcess("joints", "joints"))
    data = encode_names(["right"])
    fill(data, 1, [1.0])
    stop, now, sent = Stop(), [0.0], list[bytes]()
    heard = SimpleNamespace(data=bytes(data), received_ns=2)
    states = SimpleNamespace(topic="/rover/joint_states", take=lambda: [heard])

    class Waits:
        def __init__(self, *_: object) -> None:
            pass

        def wait(self, _: float | None) -> list[object]:
            now[0] += 1.0
            if now[0] > 20.0:
                stop.request()
            return [states] if now[0] == 2.0 else []

    for module, name, value in (
        (node, "open_node", lambda *_, **__: nullcontext()),
        (node, "parameter", lambda _node, _name, default: default),
        (node, "TFPublisher", lambda *_, **__: SimpleNamespace(publish=sent.append)),
        (node, "WaitSet", Waits),
        (sensor_data, "JointStateSubscription", lambda _: states),
        (graph, "publishing_nodes", lambda *_: senders),
        (joints, "time", SimpleNamespace(monotonic=lambda: now[0])),
    ):
        monkeypatch.setattr(module, name, value)
    joints.joints(read_own([str(file), "joints"], "joints"), stop)
    assert [[transform.child for transform in decode(message)] for message in sent] == [["right"]]
    (line,) = [text for text in capsys.readouterr().out.splitlines() if "no joint state" in text]
    who = f"comes from {senders[0]}" if senders else "no node publishes /rover/joint_states"
    assert line.startswith("no joint state after 5 s for left: ")
    assert who in line
