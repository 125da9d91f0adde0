"""Relay of a strict guard, which forwards the edges that each process owns.

If the sender owns all edges of a message, the message is forwarded unchanged, byte for byte.
Otherwise, edges that the sender does not own are removed. For each sender of fixed edges, the
relay has a latched publisher. While the sender is present, late joiners receive all its fixed
edges, even if it sent them in separate messages. A new guard that replaces a guard that died
latches the edges again.
"""

from __future__ import annotations

from base64 import b64decode, b64encode
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.tf.live.publishers import Message
from tfcompose.tf.process import say
from tfcompose.tf.ros.node import TFPublisher
from tfcompose.tf.ros.tf_codec import SentTransform, decode, encode

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping

    from rclpy.node import Node

    from tfcompose.tf.live.publishers import Publisher
    from tfcompose.tf.live.topics import TFData, TFGraph

    Edge = tuple[str, str]
    Topics = tuple[str, str]
    #: Returns the edges of a message that may pass, None for all edges.
    Admits = Callable[[Message], Collection[Edge] | None]

#: Prefix of keys in the guard's memory that hold the fixed edges of a sender.
_LATCHED = "latched:"
#: Maximum number of messages kept for listeners. tf2 uses a depth of 100 for a single publisher.
#: Here all publishers of the robot may send at the same moment.
KEPT = 500
#: Maximum number of senders whose blocked edges are counted.
MOST_COUNTED = 1000
NAMED_AT_MOST = 6
#: Maximum number of messages with fixed edges that wait for their senders' names.
MOST_WAITING = 200
#: Maximum number of rejected publishers to report by name.
MOST_REFUSED = 100


@dataclass(slots=True)
class _Latched:
    """The fixed edges of a sender by child, and the process on whose topic they arrived."""

    publisher: TFPublisher
    process: str
    edges: dict[str, SentTransform] = field(default_factory=dict)
    data: bytes = b""


class Relay:
    """Forwards messages of isolated processes on a pair of topics (moving, fixed).

    It adds the ids of its publishers to ``own_gids``. ``feedback`` is set if remappings isolate
    the processes. ``changes`` counts changes of the latched edges.
    """

    def __init__(
        self,
        node: Node,
        graph: TFGraph,
        own_gids: set[bytes | None],
        feedback: Feedback | None = None,
    ) -> None:
        self._node = node
        self._graph = graph
        self._own = own_gids
        self._feedback = feedback
        self._moving = TFPublisher(node, static=False, topic=graph.topics[0], qos=KEPT)
        own_gids.add(self._moving.raw_gid)
        self._fixed: dict[bytes, _Latched] = {}
        self._refused: dict[bytes, None] = {}
        self._finds_until = 0.0
        self.changes = 0
        self.waiting: list[tuple[TFData, Message]] = []
        self.held = HeldBack()

    def pass_on(
        self, sent: TFData, message: Message, admitted: Collection[Edge] | None, who: str
    ) -> None:
        """Forward the admitted edges of a message from ``who``; None: forward all edges."""
        if self._feedback and not sent.fenced:
            self._feed(self._feedback, sent, message)  # all listeners have received it
            return
        gid = sent.received.gid
        if gid is None or not sent.fenced:
            return  # all listeners have it, or its sender is unknown
        match self._graph.may_pass(gid):
            case True if who:
                self._pass_admitted(gid, sent, message, admitted, who)
            case False:
                self._refuse(gid)
            case _ if message.static and len(self.waiting) < MOST_WAITING:
                self.waiting.append((sent, message))

    def _pass_admitted(
        self,
        gid: bytes,
        sent: TFData,
        message: Message,
        admitted: Collection[Edge] | None,
        who: str,
    ) -> None:
        if admitted is not None:
            self.held.count(message, admitted, who)
        elif not message.exact:
            admitted = message.edges  # encode it again, with the judged names
        data = sent.received.data
        if message.static:
            self._latch(gid, data, message, admitted, sent.process)
        elif admitted is None:
            self._send(data, sent.process)
        elif admitted:
            self._send(encode(list(_admit(data, message, admitted))), sent.process)

    def memory(self) -> dict[str, Any]:
        """Return the latched edges for a new guard.

        A new guard cannot get them from the senders, because not every sender latches all its
        edges.
        """
        return {
            f"{_LATCHED}{gid.hex()}": [sender.process, b64encode(sender.data).decode()]
            for gid, sender in self._fixed.items()
        }

    def recall(self, memory: Mapping[str, Any], admits: Admits, until: float) -> None:
        """Latch the previous guard's edges that may still pass.

        Their senders count as present ``until`` this time, because they must be discovered again.
        """
        self._finds_until = until
        for part, entry in memory.items():
            if part.startswith(_LATCHED) and entry is not None:
                gid, data = bytes.fromhex(part.removeprefix(_LATCHED)), b64decode(entry[1])
                edges = tuple(
                    (t.parent.removeprefix("/"), t.child.removeprefix("/")) for t in decode(data)
                )
                message = Message(edges, static=True, gid=gid, source_ns=0, sequence=0)
                self._latch(gid, data, message, admits(message), entry[0])

    def update(self, writers: Collection[Publisher], now: float) -> None:
        """Latch the edges of senders that are still in the graph, and send them to listeners."""
        if now >= self._finds_until:
            present = {writer.gid for writer in writers}
            for gid in [gid for gid in self._fixed if gid not in present]:
                self.changes += 1
                self._node.destroy_publisher(self._fixed.pop(gid).publisher.publisher)
                if self._feedback:
                    self._feedback.forget([gid])
            self._forget_others(writers, present)
        if self._feedback:
            self._feedback.update()

    def _forget_others(self, writers: Collection[Publisher], present: Collection[bytes]) -> None:
        """Stop forwarding edges of publishers that have left and are not processes of the plan.

        If ids do not identify publishers, stop when all such publishers have left.
        """
        if self._feedback is None:
            return
        sources = self._feedback.sources("")
        if not self._graph.gid_identifies_node and any(
            writer.static and not writer.fenced for writer in writers
        ):
            return
        self._feedback.forget([source for source in sources if source not in present])

    def _refuse(self, gid: bytes) -> None:
        """Report once that the relay drops a publisher's messages.

        The name of its node may be the name of an owner.
        """
        if gid in self._refused or len(self._refused) >= MOST_REFUSED:
            return
        self._refused[gid] = None
        where = self._graph.where(gid)
        who = f"a publisher that runs {where}" if where else "a publisher of an unknown process"
        say(f"nothing from {who} is forwarded: it is not known to be a process of this run")

    def _send(self, data: bytes, process: str) -> None:
        self._moving.publish(data)
        if self._feedback:
            self._feedback.moving(data, process)

    @staticmethod
    def _feed(feedback: Feedback, sent: TFData, message: Message) -> None:
        if message.static:
            transforms = {t.child: t for t in decode(sent.received.data)}
            feedback.latch_fixed(sent.received.raw_gid or b"", transforms, "")
        else:
            feedback.moving(sent.received.data, "")

    def _latch(
        self,
        gid: bytes,
        data: bytes,
        message: Message,
        admitted: Collection[Edge] | None,
        process: str,
    ) -> None:
        transforms = {t.child: t for t in _admit(data, message, admitted)}
        latched = self._fixed.get(gid)
        if latched is None:
            if not transforms:
                return
            latched = self._new(gid, process)
        is_all = admitted is None and transforms.keys() >= latched.edges.keys()
        latched.edges |= transforms
        latched.data = data if is_all else encode(list(latched.edges.values()))
        latched.publisher.publish(latched.data)
        if self._feedback:
            self._feedback.latch_fixed(gid, latched.edges, process)
        self.changes += 1

    def _new(self, gid: bytes, process: str) -> _Latched:
        publisher = TFPublisher(self._node, static=True, topic=self._graph.topics[1])
        self._own.add(publisher.raw_gid)
        latched = self._fixed[gid] = _Latched(publisher, process)
        return latched


def _admit(
    data: bytes, message: Message, admitted: Collection[Edge] | None
) -> Iterator[SentTransform]:
    for transform, edge in zip(decode(data), message.edges, strict=True):
        if admitted is None or edge in admitted:
            yield transform


class HeldBack:
    """Blocked transforms; ``counts`` is by sender's node, parent and child."""

    def __init__(self) -> None:
        self.counts: dict[tuple[str, str, str], int] = {}
        self._reported: dict[tuple[str, str, str], int] = {}

    def count(self, message: Message, admitted: Collection[tuple[str, str]], who: str) -> None:
        """Count the blocked transforms of a message."""
        for parent, child in message.edges:
            key = (who, parent, child)
            if (parent, child) not in admitted and (
                key in self.counts or len(self.counts) < MOST_COUNTED
            ):
                self.counts[key] = self.counts.get(key, 0) + 1

    def report(self) -> str:
        """Return a sentence with newly blocked transforms and their senders; "" without any."""
        now = {
            key: count for key, count in self.counts.items() if count != self._reported.get(key)
        }
        self._reported.update(now)
        parts = [
            f"{count} × {parent} → {child} from {who}"
            for (who, parent, child), count in now.items()
        ]
        more = [f"and {len(parts) - NAMED_AT_MOST} more"] if len(parts) > NAMED_AT_MOST else []
        return ", ".join([*parts[:NAMED_AT_MOST], *more])


@dataclass(slots=True)
class _Listener:
    """A process's topics and the publishers on them, which are None without a subscriber."""

    topics: Topics
    moving: TFPublisher | None = None
    fixed: TFPublisher | None = None
    is_sent: bool = False


class Feedback:
    """Sends TF of other publishers to processes that remappings isolate.

    While a process has subscribers, moving edges are forwarded at once, and all fixed edges are
    latched in a single message. Ids of its publishers are added to ``own_gids``, because the node
    also subscribes to these topics.
    """

    def __init__(
        self, node: Node, private: Mapping[str, Topics], own_gids: set[bytes | None]
    ) -> None:
        self._node = node
        self._own = own_gids
        self._listeners = {process: _Listener(topics) for process, topics in private.items()}
        self._fixed: dict[bytes, tuple[str, dict[str, SentTransform]]] = {}

    def update(self) -> None:
        """Find the current listeners, and latch changed edges for them."""
        for process, listener in self._listeners.items():
            if listener.moving is None and self._is_heard(listener.topics[0]):
                listener.moving = self._publisher(listener.topics[0], static=False)
            if listener.fixed is None and self._is_heard(listener.topics[1]):
                listener.fixed = self._publisher(listener.topics[1], static=True)
            if listener.fixed and not listener.is_sent:
                listener.is_sent = True
                listener.fixed.publish(encode(self._rest(process)))

    def moving(self, data: bytes, sender: str) -> None:
        """Send a message to all processes except ``sender``; to all if ``sender`` is empty."""
        for process, listener in self._listeners.items():
            if listener.moving and process != sender:
                listener.moving.publish(data)

    def latch_fixed(self, source: bytes, edges: Mapping[str, SentTransform], sender: str) -> None:
        """Latch the fixed edges of a source, by child, at the next update."""
        latched = self._fixed.pop(source, (sender, {}))[1]  # the newest comes last
        self._fixed[source] = (sender, {**latched, **edges})
        self._outdate_all_but(sender)

    def forget(self, sources: Collection[bytes]) -> None:
        """Stop latching the edges of these sources."""
        for source in [source for source in sources if source in self._fixed]:
            self._outdate_all_but(self._fixed.pop(source)[0])

    def sources(self, sender: str) -> list[bytes]:
        """Return the sources of fixed edges from the process.

        If ``sender`` is empty, return sources outside the plan's processes.
        """
        return [source for source, (process, _) in self._fixed.items() if process == sender]

    def _rest(self, process: str) -> list[SentTransform]:
        rest: dict[str, SentTransform] = {}
        for sender, edges in self._fixed.values():
            if sender != process:
                rest |= edges
        return list(rest.values())

    def _outdate_all_but(self, sender: str) -> None:
        for process, listener in self._listeners.items():
            listener.is_sent = listener.is_sent and process == sender

    def _is_heard(self, topic: str) -> bool:
        return self._node.count_subscribers(topic) > 1  # the first is the node's own

    def _publisher(self, topic: str, *, static: bool) -> TFPublisher:
        kept = None if static else KEPT
        publisher = TFPublisher(self._node, static=static, topic=topic, qos=kept)
        self._own.add(publisher.raw_gid)
        return publisher
