"""What the guard itself loses is said as that, and no owner is called silent for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.support.guard_history import edge
from tfcompose.guard import losses
from tfcompose.guard.judge import Judge
from tfcompose.guard.losses import OVER_S, LossWatch, datagrams_lost
from tfcompose.model.messages import FindingShown, RecoveredShown
from tfcompose.model.plan import Plan, PlanProcess, RosSettings
from tfcompose.tf.ros.sockets import WANTED

if TYPE_CHECKING:
    from tfcompose.model.messages import GuardEvent

HERTZ = 10


class Watch:
    """Two owners at 10 Hz, and a guard that looks every tenth of a second."""

    def __init__(self) -> None:
        edges = (edge("odom base", "drive", rate=HERTZ), edge("base tool", "arm", rate=HERTZ))
        processes = (PlanProcess("drive", "external"), PlanProcess("arm", "external"))
        plan = Plan("rover", "0", "odom", RosSettings(), edges, processes)
        self.judge = Judge(plan, 0.0, 500.0, 500_000_000_000)
        self.now = 500.0
        self.judge.tick(self.now)
        self.events: list[GuardEvent] = []
        self.watch = LossWatch([self.judge], self.events.append)

    def run(self, seconds: float, *children: str, lost: int = 0) -> Watch:
        """Let these come, while so many datagrams are lost at each look."""
        for _ in range(round(seconds * HERTZ)):
            self.now += 1 / HERTZ
            self.watch.take(lost, self.now)
            for child in children:
                self.events += self.judge.live.note_arrivals((child,), self.now)
            self.events += self.judge.tick(self.now)
        return self

    def codes(self) -> list[str]:
        return [event.found.code for event in self.events if isinstance(event, FindingShown)]


@pytest.fixture
def watch() -> Watch:
    return Watch().run(5, "base", "tool")


def test_nobody_is_silent_or_slow_while_the_guard_loses_messages(watch: Watch) -> None:
    for _ in range(3):  # the last of a burst come with their writer's next heartbeat
        watch.run(0.1, "base", lost=2).run(3, "base")
        watch.run(0.1, *["tool"] * 31, "base").run(1, "base", "tool")
    assert watch.codes() == ["TF862"]
    rates = [health.rate for health in watch.judge.health(watch.now)]
    assert rates == [pytest.approx(HERTZ, rel=0.1)] * 2


def test_an_owner_still_silent_is_named_within_2_s_of_the_resending(
    watch: Watch,
) -> None:
    watch.run(0.1, "base", lost=2).run(3.5 + 2, "base")
    assert watch.codes() == ["TF862", "TF804"]


def test_a_loss_is_reported_once_and_when_it_is_over(watch: Watch) -> None:
    watch.run(3, "base", "tool", lost=7)
    assert [finding.code for finding in watch.watch.wrong()] == ["TF862"]
    watch.run(OVER_S + 1, "base", "tool")
    assert watch.watch.wrong() == []
    assert sum(isinstance(event, RecoveredShown) for event in watch.events) == 1
    assert watch.codes() == ["TF862"]


@pytest.mark.parametrize(("limit", "named"), [(212_992, 1), (None, 1), (WANTED, 0)], ids=str)
def test_the_sysctl_is_named_where_it_helps(limit: int | None, named: int) -> None:
    finding = datagrams_lost(7, limit)
    assert str(finding.help).count("net.core.rmem_max=") == named
    assert "7" in finding.message


def test_the_buffers_are_widened_where_the_limit_was_raised(
    watch: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    widened: list[bool] = []
    monkeypatch.setattr(losses, "widen_buffers", lambda: widened.append(True))
    watch.run(0.1, lost=1)
    assert widened
