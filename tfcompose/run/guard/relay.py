"""What a strict guard passes on: of what the plan's own processes send, which is fenced off, that which is theirs.

A message that is all its sender's goes on as it is, byte for byte. Of others what is not is left out. Each sender of
fixed edges has a latched publisher here, so that late joiners get all of them while their sender is there, also where
it sent one after the other; a guard that follows one that died latches them again.
"""

from __future__ import annotations

from base64 import b64decode, b64encode
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.ros.node import TFPublisher
from tfcompose.ros.tf_codec import Transform, decode, encode
from tfcompose.run.guard.held import Held
from tfcompose.run.guard.senders import Message
from tfcompose.run.own import say

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping

    from rclpy.node import Node

    from tfcompose.plan import Plan
    from tfcompose.run.guard.ear import Heard
    from tfcompose.run.guard.feedback import Feedback
    from tfcompose.run.guard.neighbours import Graph
    from tfcompose.run.guard.senders import Writer

    Edge = tuple[str, str]
    #: Says which edges of a message may pass; None: all.
    Admits = Callable[[Message], Collection[Edge] | None]

#: The parts of a guard's memory that are a sender's fixed edges begin so.
_LATCHED = "latched:"
#: So many messages with fixed edges wait for their senders' names.
MOST_WAITING = 200


@dataclass(slots=True)
class _Latched:
    """The fixed edges of one sender, by their child, and the process whose own topic they came on, if any."""

    publisher: TFPublisher
    process: str
    edges: dict[str, Transform] = field(default_factory=dict)
    data: bytes = b""


class Relay:
    """Passes on what is sent behind the fence on one pair of topics (moving, fixed).

    ``own`` takes the ids of its publishers. With ``feedback`` the fence is one of remappings. ``changes`` counts what
    was latched.
    """

    def __init__(
        self, node: Node, graph: Graph, plan: Plan, own: set[bytes | None], feedback: Feedback | None = None
    ) -> None:
        self._node = node
        self._graph = graph
        self._own = own
        self._feedback = feedback
        self._moving = TFPublisher(node, static=False, topic=graph.topics[0])
        own.add(self._moving.raw_gid)
        self._fixed: dict[bytes, _Latched] = {}
        self._nodes = {name for process in plan.processes if process.kind != "external" for name in process.nodes}
        self._finds_until = 0.0
        self.changes = 0
        self.waiting: list[tuple[Heard, Message]] = []
        self.held = Held()

    def pass_on(self, heard: Heard, message: Message, admitted: Collection[Edge] | None, who: str) -> None:
        """Pass on what is admitted of the message that ``who`` sent; None: all of it."""
        if self._feedback and not heard.process:
            self._feed(heard, message)  # everybody has it
            return
        gid = heard.received.gid
        may_pass = False if gid is None else self._graph.may_pass(gid)
        if gid is None or may_pass is False:
            self._complain(who)  # it is not fenced off, and has reached everybody, or nobody knows whose it is
            return
        if not who or may_pass is None:
            if message.static and len(self.waiting) < MOST_WAITING:
                self.waiting.append((heard, message))
            return
        if admitted is not None:
            self.held.count(message, admitted, who)
        data = heard.received.data
        if message.static:
            self._latch(gid, data, message, admitted, heard.process)
        elif admitted is None:
            self._send(data, heard.process)
        elif admitted:
            self._send(encode(list(_admitted(data, message, admitted))), heard.process)

    def memory(self) -> dict[str, Any]:
        """Return what the guard that follows must latch: not every sender latches all that it has sent."""
        return {
            f"{_LATCHED}{gid.hex()}": [one.process, b64encode(one.data).decode()] for gid, one in self._fixed.items()
        }

    def recall(self, memory: Mapping[str, Any], admits: Admits, until: float) -> None:
        """Latch what the guard before this one latched and may still pass, and forget nobody before ``until``.

        Until then the senders are found again.
        """
        self._finds_until = until
        for part, said in memory.items():
            if part.startswith(_LATCHED) and said is not None:
                gid, data = bytes.fromhex(part.removeprefix(_LATCHED)), b64decode(said[1])
                edges = tuple((t.parent.removeprefix("/"), t.child.removeprefix("/")) for t in decode(data))
                message = Message(edges, static=True, gid=gid, source_ns=0, sequence=0)
                self._latch(gid, data, message, admits(message), said[0])

    def look(self, writers: Collection[Writer], now: float) -> None:
        """Latch the edges of those no more who are not in the graph any more, and feed listeners."""
        if now >= self._finds_until:
            present = {writer.gid for writer in writers}
            for gid in [gid for gid in self._fixed if gid not in present]:
                self.changes += 1
                self._node.destroy_publisher(self._fixed.pop(gid).publisher.publisher)
                if self._feedback:
                    self._feedback.forget([gid])
            self._forget_others(writers, present)
        if self._feedback:
            self._feedback.look()

    def _forget_others(self, writers: Collection[Writer], present: Collection[bytes]) -> None:
        """Feed no more what everybody had from one that has left; where ids do not tell who, from all when all have."""
        if self._feedback is None:
            return
        others = self._feedback.sources("")
        if not self._graph.says_who and any(one.static and not one.fenced for one in writers):
            return
        self._feedback.forget([source for source in others if source not in present])

    def _complain(self, who: str) -> None:
        if who in self._nodes:
            self._nodes.discard(who)
            say(f"{who} is not seen to be a process of this run: what it sends is not passed on")

    def _send(self, data: bytes, process: str) -> None:
        self._moving.publish(data)
        if self._feedback:
            self._feedback.moving(data, process)

    def _feed(self, heard: Heard, message: Message) -> None:
        if self._feedback is None:
            return
        if message.static:
            found = {t.child: t for t in decode(heard.received.data)}
            self._feedback.fixed(heard.received.raw_gid or b"", found, "")
        else:
            self._feedback.moving(heard.received.data, "")

    def _latch(
        self, gid: bytes, data: bytes, message: Message, admitted: Collection[Edge] | None, process: str
    ) -> None:
        found = {t.child: t for t in _admitted(data, message, admitted)}
        latched = self._fixed.get(gid)
        if latched is None:
            if not found:
                return
            latched = self._new(gid, process)
        whole = admitted is None and found.keys() >= latched.edges.keys()
        latched.edges |= found
        latched.data = data if whole else encode(list(latched.edges.values()))
        latched.publisher.publish(latched.data)
        if self._feedback:
            self._feedback.fixed(gid, latched.edges, process)
        self.changes += 1

    def _new(self, gid: bytes, process: str) -> _Latched:
        publisher = TFPublisher(self._node, static=True, topic=self._graph.topics[1])
        self._own.add(publisher.raw_gid)
        latched = self._fixed[gid] = _Latched(publisher, process)
        return latched


def _admitted(data: bytes, message: Message, admitted: Collection[Edge] | None) -> Iterator[Transform]:
    for transform, edge in zip(decode(data), message.edges, strict=True):
        if admitted is None or edge in admitted:
            yield transform
