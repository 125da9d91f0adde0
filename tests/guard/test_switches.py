"""Switches that were read back from nodes, against what the plan wrote."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pytest

from tests.support.findings import expect
from tfcompose.guard import gates
from tfcompose.guard.channel import SwitchMemory, recall_memory
from tfcompose.guard.gates import Switches
from tfcompose.guard.verdict.drivers import not_taken
from tfcompose.model.messages import FindingShown, GuardEvent, Remember
from tfcompose.model.plan import Driven, Plan, PlanProcess, RosSettings
from tfcompose.model.variables import MEMORY_FD

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tfcompose.tf.ros.parameters import Value

DRIVEN = (Driven("front", "realsense/d455", publishes=False, switch={"publish_tf": False}),)


@pytest.mark.parametrize(
    ("expected", "actual", "reported"),
    [
        (False, False, False),
        (False, True, True),
        (True, True, False),
        (0.0, 0.0, False),
        (0.0, 0, False),
        (0.0, 0.05, True),
        (1, True, True),
        (False, 0, True),
        ("link", "link", False),
        ("link", "frame", True),
        (False, None, True),
    ],
)
def test_a_parameter_is_reported_exactly_where_it_is_another_value(
    expected: Value, actual: Value | None, *, reported: bool
) -> None:
    wrong = not_taken("/front/front", {"switch": expected}, {"switch": actual}, DRIVEN)
    assert [finding.code for finding in wrong] == ["TF829"] * reported


def test_the_finding_names_the_node_the_parameter_and_both_values() -> None:
    (first,) = not_taken("/front/front", {"publish_tf": False}, {"publish_tf": True}, DRIVEN)
    expect(
        first,
        "TF829",
        "/front/front",
        "publish_tf: true",
        "publish_tf: false",
        "front (realsense/d455)",
    )
    (first,) = not_taken("/drive", {"enable_odom_tf": False}, {"enable_odom_tf": None})
    expect(first, "TF829", "/drive", "no parameter enable_odom_tf", "enable_odom_tf: false")


# Guards that follow each other.


@dataclass
class Reader:
    """Stands in for a node's parameters."""

    is_there: bool = True
    requested: int = 0

    def close(self) -> None:
        pass

    def ask(self, _: float) -> None:
        self.requested += 1

    def take(self) -> dict[str, Any] | None:
        return {"publish_tf": True} if self.requested else None


@dataclass
class Watch:
    """A guard's part that reads switches back, and a clock."""

    reader: Reader
    now: float = 0.0

    def __post_init__(self) -> None:
        self.reported: list[GuardEvent] = []

    def follow(self, left: dict[str, Any]) -> None:
        """Let a guard run that knows what is ``left`` of the one before."""
        drive = PlanProcess("front", "external", switches={"/front": {"publish_tf": False}})
        plan = Plan("rover", "", None, RosSettings(), (), (drive,))
        self.switches = Switches(None, plan, self.reported.append)  # type: ignore[arg-type]
        self.memory = SwitchMemory(self.switches, self.reported.append, left)

    def run_for(self, seconds: float) -> None:
        end = self.now + seconds
        while self.now < end:
            self.now += 0.5
            self.switches.check()
            self.memory.hand_on()

    def all(self, kind: type[Any]) -> list[Any]:
        return [finding for finding in self.reported if isinstance(finding, kind)]


@pytest.fixture
def watch(monkeypatch: pytest.MonkeyPatch) -> Watch:
    started = Watch(Reader())
    monkeypatch.setattr(gates, "_reader", lambda *_: started.reader)
    monkeypatch.setattr("time.monotonic", lambda: started.now)
    started.follow({})
    return started


@pytest.fixture
def left(watch: Watch, tmp_path: Path) -> Callable[[], dict[str, Any]]:
    """Return what the guard that died has left, as the next one reads it."""

    def read() -> dict[str, Any]:
        memory: dict[str, Any] = {}
        for event in watch.all(Remember):
            memory |= event.changed
        (tmp_path / "memory").write_text(json.dumps(memory))
        return recall_memory({MEMORY_FD: str(os.open(tmp_path / "memory", os.O_RDONLY))})

    return read


def test_a_guard_that_follows_one_that_died_tells_no_switch_twice(
    watch: Watch, left: Callable[[], dict[str, Any]]
) -> None:
    watch.run_for(10)
    assert len(watch.all(FindingShown)) == 1
    watch.follow(left())
    watch.reader.is_there = False  # it is found after a while
    watch.run_for(2)
    watch.reader.is_there = True
    watch.run_for(10)
    assert (len(watch.all(FindingShown)), watch.reader.requested) == (1, 1)


def test_a_node_that_comes_back_after_the_guard_has_is_queried_anew(
    watch: Watch, left: Callable[[], dict[str, Any]]
) -> None:
    watch.run_for(10)
    watch.follow(left())
    watch.run_for(10)
    watch.reader.is_there = False
    watch.run_for(2)
    watch.reader.is_there = True
    watch.run_for(10)
    assert len(watch.all(FindingShown)) == 2


def test_the_switches_of_another_plan_are_read_and_the_same_ones_not_again(watch: Watch) -> None:
    watch.run_for(10)
    front = PlanProcess("front", "external", switches={"/front": {"publish_tf": False}})
    rear = PlanProcess("rear", "external", switches={"/rear": {"publish_tf": False}})
    for processes, count in (((front, rear), 2), ((front,), 2), ((rear,), 3)):
        watch.switches.follow(Plan("rover", "", None, RosSettings(), (), processes))
        watch.run_for(10)
        assert len(watch.all(FindingShown)) == count
