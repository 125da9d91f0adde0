"""Inquiries of the graph: rmw is asked again only after its graph has changed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from tests.support.waiting import until
from tfcompose.model.plan.topics import GLOBAL
from tfcompose.tf.live import topics
from tfcompose.tf.live.topics import Identity, TFGraph
from tfcompose.tf.ros.graph import GraphPublisher, graph_changes
from tfcompose.tf.ros.node import TFPublisher, open_node

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.tf.live.publishers import Publisher

pytestmark = pytest.mark.ros

GID = b"drive".ljust(16)


@pytest.mark.parametrize("ask", [TFGraph.publishers, TFGraph.global_publishers])
def test_rmw_is_queried_again_only_after_its_graph_has_changed(
    node: Any, monkeypatch: pytest.MonkeyPatch, ask: Callable[[TFGraph], list[Publisher]]
) -> None:
    inquiries: list[str] = []
    inquire = node.get_publishers_info_by_topic

    def counted(topic: str, **options: Any) -> Any:
        inquiries.append(topic)
        return inquire(topic, **options)

    monkeypatch.setattr(node, "get_publishers_info_by_topic", counted)
    graph, second_graph = TFGraph(node, GLOBAL), TFGraph(node, ("/a/tf", "/a/tf_static"))
    assert ask(graph) == []
    assert len(inquiries) == len(GLOBAL)

    def names() -> list[str | None]:
        assert (
            second_graph.publishers() is not None
        )  # one context's graphs take no change from others
        return [publisher.node for publisher in ask(graph)]

    with open_node("drive", "/rover") as drive:
        publisher = TFPublisher(drive, static=False)
        assert publisher.raw_gid
        assert until(lambda: names() == ["/rover/drive"])

        def is_at_rest() -> bool:
            before = len(inquiries)
            return all(names() for _ in range(20)) and len(inquiries) == before

        assert until(is_at_rest)
    assert until(lambda: names() == [])


def test_graphs_of_one_context_share_their_changes(node: Any) -> None:
    assert graph_changes(node) is graph_changes(node)


def test_a_sender_heard_outside_the_fence_is_unfenced_in_a_constant_graph(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    writer = GraphPublisher(GID, "/drive", "volatile", "reliable", "tf2_msgs/msg/TFMessage")

    class Unchanged:
        def count(self) -> int:
            return 1

    monkeypatch.setattr(topics, "graph_changes", lambda _: Unchanged())
    monkeypatch.setattr(topics, "gid_identifies_node", lambda _: True)
    monkeypatch.setattr(topics, "own_gid", lambda *_: b"guard".ljust(16))
    writers_by_topic = {GLOBAL[0]: [writer], GLOBAL[1]: []}
    monkeypatch.setattr(topics, "writers", lambda _, topic: writers_by_topic[topic])
    node: Any = None
    graph = TFGraph(node, GLOBAL)
    graph._where[GID], graph._ours[GID] = "here", Identity(ours=True, process="drive", fenced=True)
    assert [publisher.fenced for publisher in graph.publishers()] == [True]
    graph.hear_public([GID])
    assert [publisher.fenced for publisher in graph.publishers()] == [False]
