"""Judges of robots on topics of their own.

What each of them is given, and what is said of all together.
"""

import time
from collections.abc import Callable
from typing import Any

import pytest
from rclpy.duration import Duration

from tests.support.waiting import TIMEOUT_S, until
from tfcompose.guard.judge import Judge
from tfcompose.guard.process import (
    CHECK_EVERY_S,
    GATHER_BELOW,
    TopicWatch,
    gather_s,
    plans_by_topics,
    together,
)
from tfcompose.model.messages import Clear, GuardEvent, OwnerReady, TreeComplete
from tfcompose.model.plan import Plan, PlanEdge, PlanProcess, RosSettings
from tfcompose.model.plan.topics import GLOBAL
from tfcompose.tf.ros.node import DEEP, TFPublisher, open_node
from tfcompose.tf.ros.tf_codec import Template

OWN = {"/tf": "/one/tf", "/tf_static": "/one/tf_static"}


def plan(*edges: PlanEdge) -> Plan:
    processes = (
        PlanProcess("static", "static"),
        PlanProcess("one/static", "static", remap=OWN),
        PlanProcess("guard", "guard"),
    )
    return Plan("fleet", "0", None, RosSettings(), edges, processes)


def test_each_judge_gets_the_edges_of_the_owners_on_its_topics(
    edge: Callable[..., PlanEdge],
) -> None:
    mine, theirs = edge("map dock"), edge("map one/base", "one/static")
    full = plan(mine, theirs)
    plans = plans_by_topics(full, full.process("guard"))
    assert {topics: some.edges for topics, some in plans.items()} == {
        ("/tf", "/tf_static"): (mine,),
        ("/one/tf", "/one/tf_static"): (theirs,),
    }


def test_the_guard_watches_its_own_topics_where_nothing_is_planned(
    edge: Callable[..., PlanEdge],
) -> None:
    full = plan(edge("map one/base", "one/static"))
    assert plans_by_topics(full, full.process("guard"))["/tf", "/tf_static"].edges == ()


def test_all_is_clear_and_complete_once_the_last_judge_says_so(
    edge: Callable[..., PlanEdge],
) -> None:
    reports: list[GuardEvent] = []
    first, two, none = plan(edge("a b")), plan(edge("c d"), edge("c e")), plan()
    tell = together(reports.append, [first, two, none])
    for event in (Clear(), Clear(), OwnerReady("static"), TreeComplete(0), TreeComplete(1)):
        tell(event)
    assert reports == [OwnerReady("static")]
    tell(Clear())
    tell(TreeComplete(2))
    assert reports == [OwnerReady("static"), Clear(), TreeComplete(3)]


@pytest.mark.parametrize(
    ("taken", "is_prompt", "gathers"),
    [
        pytest.param(0, False, True, id="idle"),
        pytest.param(GATHER_BELOW - 1, False, True, id="some came"),
        pytest.param(GATHER_BELOW, False, False, id="a burst: readers keep a thousand"),
        pytest.param(0, True, False, id="passed on, or before the start"),
    ],
)
def test_a_watching_guard_lets_messages_gather_unless_many_come(
    taken: int, *, is_prompt: bool, gathers: bool
) -> None:
    pause_s = gather_s(taken, is_prompt=is_prompt)
    assert 0 < pause_s <= CHECK_EVERY_S if gathers else pause_s == 0


@pytest.mark.ros
@pytest.mark.parametrize("too_many", [False, True])
def test_owners_are_not_called_silent_where_the_guards_reader_overflowed(
    node: Any, edge: Callable[..., PlanEdge], *, too_many: bool
) -> None:
    judge = Judge(plan(edge("odom base_link", "drive")), 0.0, time.monotonic(), 0)
    watch = TopicWatch(node, GLOBAL, judge, lambda _: None)
    message = Template([("odom", "base_link")]).data
    with open_node("drive", "/rover") as drive:
        publisher = TFPublisher(drive, static=False, qos=2 * DEEP)
        assert until(lambda: publisher.publisher.get_subscription_count() == 1)
        for _ in range(DEEP + 100 if too_many else DEEP - 100):
            publisher.publish(message)
        assert publisher.publisher.wait_for_all_acked(Duration(seconds=TIMEOUT_S))
        watch.step()
    assert judge.live.is_behind(time.monotonic()) == too_many
    watch.close()
