"""What a strict guard passes on: of what the plan's own processes send, which is fenced off, that which is theirs.

A message that is all its sender's goes on as it is, byte for byte. Of others what is not is left out. Each sender of
fixed edges has a latched publisher here, so that late joiners get all of them while their sender is there, also where
it sent one after the other; a guard that follows one that died latches them again.
"""

from __future__ import annotations

from base64 import b64decode, b64encode
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.ros.message import Transform, decode, encode
from tfcompose.ros.tf import TFPublisher
from tfcompose.run.guard.senders import Message
from tfcompose.run.own import say

Edge = tuple[str, str]

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping

    from rclpy.node import Node

    from tfcompose.plan import Plan
    from tfcompose.ros.tf import Received
    from tfcompose.run.guard.neighbours import Graph

    #: Says which edges of a message may pass; None: all.
    Admits = Callable[[Message], Collection[Edge] | None]

#: The parts of a guard's memory that are a sender's fixed edges begin so.
_LATCHED = "latched:"
#: Of so many senders' edges what was held back is counted.
MOST_COUNTED = 1000
NAMED_AT_MOST = 6
#: So many messages with fixed edges wait for their senders' names.
MOST_WAITING = 200


@dataclass(slots=True)
class _Latched:
    """The fixed edges of one sender, by their child."""

    publisher: TFPublisher
    edges: dict[str, Transform] = field(default_factory=dict)
    data: bytes = b""


class Relay:
    """Passes on what is sent on one pair of topics (moving, fixed).

    ``held_back`` counts the transforms that were not passed on, by the sender's node, parent and child; ``changes``
    counts what was latched.
    """

    def __init__(self, node: Node, graph: Graph, plan: Plan) -> None:
        self._node = node
        self._graph = graph
        self._moving = TFPublisher(node, static=False, topic=graph.topics[0])
        self._fixed: dict[bytes, _Latched] = {}
        self._nodes = {name for process in plan.processes if process.kind != "external" for name in process.nodes}
        self._finds_until = 0.0
        self.changes = 0
        self.waiting: list[tuple[Received, Message]] = []
        self.held_back: dict[tuple[str, str, str], int] = {}
        self._reported: dict[tuple[str, str, str], int] = {}

    def pass_on(self, received: Received, message: Message, admitted: Collection[Edge] | None, who: str) -> None:
        """Pass on what is admitted of the message that ``who`` sent; None: all of it."""
        gid = received.gid
        ours = None if gid is None else self._graph.is_ours(gid)
        if gid is None or ours is False:
            self._complain(who)  # it is not fenced off, and has reached everybody, or nobody knows whose it is
            return
        if not who or ours is None:
            if message.static and len(self.waiting) < MOST_WAITING:
                self.waiting.append((received, message))
            return
        if admitted is not None:
            self._count(message, admitted, who)
        if message.static:
            self._latch(gid, received.data, message, admitted)
        elif admitted is None:
            self._moving.publish(received.data)
        elif admitted:
            self._moving.publish(encode(list(_admitted(received.data, message, admitted))))

    def _complain(self, who: str) -> None:
        if who in self._nodes:
            self._nodes.discard(who)
            say(f"{who} is not seen to be a process of this run: what it sends is not passed on")

    def report(self) -> str:
        """Return how much was held back since the last time, and whose it is; empty if nothing was."""
        now = {key: count for key, count in self.held_back.items() if count != self._reported.get(key)}
        self._reported.update(now)
        said = [f"{count} × {parent} → {child} from {who}" for (who, parent, child), count in now.items()]
        more = [f"and {len(said) - NAMED_AT_MOST} more"] if len(said) > NAMED_AT_MOST else []
        return ", ".join([*said[:NAMED_AT_MOST], *more])

    def memory(self) -> dict[str, str | None]:
        """Return what the guard that follows must latch: not every sender latches all that it has sent."""
        return {f"{_LATCHED}{gid.hex()}": b64encode(one.data).decode() for gid, one in self._fixed.items()}

    def recall(self, memory: Mapping[str, str | None], admits: Admits, until: float) -> None:
        """Latch what the guard before this one latched and may still pass, and forget nobody before ``until``.

        Until then the senders are found again.
        """
        self._finds_until = until
        for part, said in memory.items():
            if part.startswith(_LATCHED) and said is not None:
                gid, data = bytes.fromhex(part.removeprefix(_LATCHED)), b64decode(said)
                edges = tuple((t.parent.removeprefix("/"), t.child.removeprefix("/")) for t in decode(data))
                message = Message(edges, static=True, gid=gid, source_ns=0, sequence=0)
                self._latch(gid, data, message, admits(message))

    def forget(self, gids: Collection[bytes], now: float) -> None:
        """Latch the edges of those no more who are not among these any more."""
        if now < self._finds_until:
            return
        for gid in [gid for gid in self._fixed if gid not in gids]:
            self.changes += 1
            self._node.destroy_publisher(self._fixed.pop(gid).publisher.publisher)

    def _latch(self, gid: bytes, data: bytes, message: Message, admitted: Collection[Edge] | None) -> None:
        found = {t.child: t for t in _admitted(data, message, admitted)}
        latched = self._fixed.get(gid)
        if latched is None:
            if not found:
                return
            latched = self._new(gid)
        whole = admitted is None and found.keys() >= latched.edges.keys()
        latched.edges |= found
        latched.data = data if whole else encode(list(latched.edges.values()))
        latched.publisher.publish(latched.data)
        self.changes += 1

    def _new(self, gid: bytes) -> _Latched:
        latched = self._fixed[gid] = _Latched(TFPublisher(self._node, static=True, topic=self._graph.topics[1]))
        self._graph.look_for_own()
        return latched

    def _count(self, message: Message, admitted: Collection[Edge], who: str) -> None:
        for parent, child in message.edges:
            key = (who, parent, child)
            if (parent, child) not in admitted and (key in self.held_back or len(self.held_back) < MOST_COUNTED):
                self.held_back[key] = self.held_back.get(key, 0) + 1


def _admitted(data: bytes, message: Message, admitted: Collection[Edge] | None) -> Iterator[Transform]:
    for transform, edge in zip(decode(data), message.edges, strict=True):
        if admitted is None or edge in admitted:
            yield transform
