"""Names of nodes by the ids of their publishers, also where rmw has lost them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from tfcompose.tf.ros import graph
from tfcompose.tf.ros.graph import BARE_DDS, UNKNOWN_NODE

QOS = SimpleNamespace(
    durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE
)


class Graph:
    """A node's graph; ``names_by_gid``: namespace and name of each publisher's node."""

    def __init__(self, **names_by_gid: tuple[str, str]) -> None:
        self.names_by_gid = names_by_gid

    def get_publishers_info_by_topic(self, _topic: str, **_: Any) -> list[SimpleNamespace]:
        return [
            SimpleNamespace(
                endpoint_gid=gid.encode().ljust(16), node_namespace=namespace, node_name=name,
                qos_profile=QOS, topic_type="tf2_msgs/msg/TFMessage",
            )
            for gid, (namespace, name) in self.names_by_gid.items()
        ]  # fmt: skip

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        return []

    def get_name(self) -> str:
        return "guard"

    def get_namespace(self) -> str:
        return "/"


@pytest.fixture(autouse=True)
def _nothing_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(graph, "_names", {})


def names(node: Any) -> list[str]:
    return [writer.node for writer in graph.writers(node, "/tf_static")]


@pytest.mark.parametrize("nameless", [UNKNOWN_NODE, BARE_DDS])
def test_a_publisher_that_returns_without_a_name_has_the_one_that_it_had(nameless: str) -> None:
    node: Any = Graph(a=("/rover", "static"))
    assert names(node) == ["/rover/static"]
    node.names_by_gid = {}
    assert names(node) == []
    node.names_by_gid = {"a": (nameless, nameless), "b": (nameless, nameless)}
    assert sorted(names(node)) == sorted(["/rover/static", nameless])
    assert graph.nodes(node) == ["/rover/static"]
    node.names_by_gid = {"a": ("/", "other")}
    assert names(node) == ["/other"], "an id that is used anew"


def test_the_names_of_those_that_are_there_outlive_any_number_of_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(graph, "MOST_NAMES", 3)
    node: Any = Graph()
    for number in range(10):
        node.names_by_gid = {f"n{number}": ("/", "newcomer"), "a": ("/", "static")}
        names(node)
    node.names_by_gid = {"a": (UNKNOWN_NODE, UNKNOWN_NODE)}
    assert names(node) == ["/static"]
    assert len(graph._names) == 3
