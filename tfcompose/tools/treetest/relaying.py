"""Relay of a process's TF messages through ROS, which publishes them as the owner's nodes."""

from __future__ import annotations

import time
from contextlib import ExitStack
from typing import TYPE_CHECKING

from tfcompose.tf.ros.clock import SimClock
from tfcompose.tf.ros.node import TFPublisher, TFSubscription, WaitSet, open_node
from tfcompose.tf.ros.tf_codec import Decoder, SentTransform, encode
from tfcompose.tools.treetest.relayed_messages import RelayedMessages
from tfcompose.tools.treetest.relayed_plan import relayed_processes
from tfcompose.tools.treetest.setup import LiveSetup

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rclpy.node import Node

    from tfcompose.foundation.signals import Stop
    from tfcompose.model.plan import Plan
    from tfcompose.tf.bags import RecordedMessage
    from tfcompose.tf.ros.tf_codec import Row
    from tfcompose.tools.treetest.relay_request import RelayRequest, Topics

#: How often delayed messages are sent, and the begin of a fault is checked, in seconds.
CHECK_EVERY_S = 0.005
_SECOND_NS = 1_000_000_000


def relay(request: RelayRequest, published: Topics, stop: Stop) -> None:
    """Relay the messages of a process to the published topics until ``stop`` is requested.

    Raises:
        RosError: if ROS cannot start a node, or take messages.
    """
    setup = LiveSetup.read(request.setup)
    case = setup.case
    faults = {
        number: injection
        for number, injection in enumerate(case.spec.inject)
        if request.process in relayed_processes(injection, case.plan)
    }
    messages = RelayedMessages(faults, case.plan)
    waiting = list(faults)
    with ExitStack() as stack:
        publishers = OwnerPublishers(case.plan, request.process, published, stack)
        node = publishers.node
        readers = {
            static: TFSubscription(node, static=static, topic=request.topics[static], deep=True)
            for static in (True, False)
        }
        clock = SimClock(node) if case.plan.ros.clock == "sim" else None
        wait_set = WaitSet(node, list(readers.values()), stop)
        decoder = Decoder()
        while not stop.requested:
            wait_set.wait(CHECK_EVERY_S)
            now_ns, clock_ns = time.time_ns(), clock.now_ns() if clock else None
            for static, reader in readers.items():
                for received in reader.take():
                    rows = tuple(decoder.rows(received.data))
                    sent = messages.take(rows, static=static, now_ns=now_ns, clock_ns=clock_ns)
                    publishers.send(sent)
            due = [number for number in waiting if setup.begin_file(number).exists()]
            for number in due if messages.has_any else ():
                publishers.send(messages.begin(number, now_ns, clock_ns))
                setup.begun_file(number, request.process).touch()
                waiting.remove(number)
            publishers.send(messages.pass_time(now_ns, clock_ns))


class OwnerPublishers:
    """Publishers with the names of the nodes that own the edges of a process."""

    def __init__(self, plan: Plan, process: str, topics: Topics, stack: ExitStack) -> None:
        edges = plan.edges_of(process)
        self._topics = topics
        self._node_of = {edge.child: edge.node for edge in edges}
        self._default = edges[0].node
        self._nodes: dict[str, Node] = {}
        self._publishers: dict[tuple[str, bool], TFPublisher] = {}
        for name in dict.fromkeys(self._node_of.values()):
            namespace, _, base = name.rpartition("/")
            self._nodes[name] = stack.enter_context(open_node(base, namespace))
        for edge in edges:
            self._publisher(edge.node, static=edge.kind == "static")

    @property
    def node(self) -> Node:
        """The first of the nodes."""
        return self._nodes[self._default]

    def send(self, messages: Iterable[RecordedMessage]) -> None:
        """Publish the messages, each edge by its node."""
        for message in messages:
            rows: dict[str, list[Row]] = {
                name: [] for name, static in self._publishers if static and message.static
            }  # a message about fixed edges replaces the one before
            for row in message.rows or ():
                name = self._node_of.get(row[1].removeprefix("/"), self._default)
                rows.setdefault(name, []).append(row)
            for name, part in rows.items():
                transforms = [
                    SentTransform(row[2] * _SECOND_NS + row[3], row[0], row[1], row[4:7], row[7:])
                    for row in part
                ]
                self._publisher(name, static=message.static).publish(encode(transforms))

    def _publisher(self, name: str, *, static: bool) -> TFPublisher:
        publisher = self._publishers.get((name, static))
        if publisher is None:
            node, topic = self._nodes[name], self._topics[static]
            publisher = TFPublisher(node, static=static, topic=topic)
            self._publishers[name, static] = publisher
        return publisher
