"""Ages end at the last look.

An observer that is kept from looking knows nothing since then, and blames nobody.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import pytest

from tests.support.fake_nodes import FakeNodes
from tests.support.waiting import in_one_of_a_few
from tfcompose.foundation.signals import Stop
from tfcompose.guard.verdict.doctor import examine
from tfcompose.model.plan.topics import GLOBAL
from tfcompose.tf.live import snapshot
from tfcompose.tf.live.edges import SETTLE_S, TreeObserver
from tfcompose.tf.live.feed import follow
from tfcompose.tf.live.ros_feed import RosFeed

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.ros

#: So long the observer does something else after its last look; a publisher at 30 Hz is silent
#: much sooner.
DELAY_S = 3.0


@pytest.fixture(autouse=True)
def publisher(domain: object) -> Iterator[None]:
    assert domain
    nodes = FakeNodes()
    nodes.moving(nodes.node("drive"), "odom base_link")
    yield
    nodes.close()


def test_a_doctor_that_scans_processes_for_long_blames_nobody(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def delayed() -> tuple[()]:
        time.sleep(DELAY_S)
        return ()

    monkeypatch.setattr(snapshot, "ros_processes", delayed)

    def is_fine(_: int) -> bool:
        states = snapshot.observe({GLOBAL: None}, 3.0, Stop())
        return bool(states[0].edges) and examine(states).findings == []

    assert in_one_of_a_few(is_fine)


def test_an_observer_that_is_read_late_blames_nobody() -> None:
    def is_fine(_: int) -> bool:
        observer = TreeObserver(settle_s=SETTLE_S)
        with RosFeed("late", {GLOBAL: observer}) as feed:
            follow(feed, Stop(), duration_s=3.0)
        time.sleep(DELAY_S)
        edges = observer.edges(observer.until_ns)
        return bool(edges) and all(edge.age_s < DELAY_S / 2 for edge in edges)

    assert in_one_of_a_few(is_fine)
