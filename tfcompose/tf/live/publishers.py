"""Publishers on TF topics by message id, their history, and the contents of messages.

Reading is fast if a publisher sends the same edges repeatedly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from tfcompose.foundation.geometry import Pose
from tfcompose.tf.ros.tf_codec import Decoder, decode

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from tfcompose.tf.ros.node import Received
    from tfcompose.tf.ros.tf_codec import MessageLayout

Key = TypeVar("Key")
#: Maximum number of message layouts to remember.
_MOST = 1024


@dataclass(frozen=True, slots=True)
class Message:
    """A TFMessage with its publisher and arrival."""

    #: Pairs of (parent, child).
    edges: tuple[tuple[str, str], ...]
    #: Whether it arrived on a topic of fixed edges.
    static: bool
    #: The publisher's id, None if the rmw does not provide it.
    gid: bytes | None
    #: Time of sending, in nanoseconds of the sender's system clock.
    source_ns: int
    #: Number among the publisher's messages, counted from 1.
    sequence: int
    #: The transforms' stamps.
    stamps_ns: Sequence[int] = ()
    #: Time of arrival, in nanoseconds of this machine's system clock.
    received_ns: int = 0
    #: Poses of the transforms. They are set only in a publisher's first message with these edges,
    #: and only if frames are compared with presets.
    poses: Sequence[Pose] = ()
    #: False if a name contains a NUL or invalid UTF-8. Listeners in other languages may then read
    #: another name.
    exact: bool = True


class MessageReader:
    """Reads messages. A publisher's first messages that contain ``frames`` include poses."""

    def __init__(self, frames: frozenset[str] = frozenset()) -> None:
        self._frames = frames
        self.decoder = Decoder()
        self._posed: set[tuple[bytes | None, MessageLayout]] = set()

    def read(self, received: Received, *, static: bool) -> Message:
        """Return the message, with frame names as tf2 reads them.

        Raises:
            ValueError: with a sentence, if it is not a TFMessage.
        """
        layout, stamps = self.decoder.stamps(received.data)
        edges = layout.plain_edges
        poses: tuple[Pose, ...] = ()
        if self._frames and (received.gid, layout) not in self._posed:
            poses = self._poses(received, layout)
        return Message(
            edges,
            static,
            received.gid,
            source_ns=received.source_ns,
            sequence=received.sequence,
            stamps_ns=stamps,
            received_ns=received.received_ns,
            poses=poses,
            exact=layout.exact,
        )

    def _poses(self, received: Received, layout: MessageLayout) -> tuple[Pose, ...]:
        if len(self._posed) >= _MOST:
            self._posed.clear()
        if not any(child in self._frames for _, child in layout.plain_edges):
            return ()
        self._posed.add((received.gid, layout))
        return tuple(
            Pose(transform.xyz, transform.quat_xyzw) for transform in decode(received.data)
        )


#: Maximum number of publishers that have left to remember, which limits the memory for short-lived
#: publishers.
MOST_LEFT = 1000
#: Number of bytes of an id that identify the participant (RTPS: prefix of a GUID).
PARTICIPANT = 12
#: Number of gaps between messages that determine with certainty when a publisher began, and the
#: minimum if time is short.
GAPS, FEWEST_GAPS = 5, 2
#: An observed gap may be shorter than usual by up to this factor.
UNSURE = 3.0
#: Time in seconds after which a publisher is judged even if it has no name or is not in the graph.
NAMELESS_S = 0.7
UNCOUNTED = 2**64 - 1


@dataclass(frozen=True, slots=True)
class OtherRun:
    """A run of another robot."""

    #: ROBOT@DOMAIN.
    name: str
    #: The launcher's process id.
    pid: int
    #: Local time of its start, such as 14:03:27.
    since: str


@dataclass(frozen=True, slots=True)
class Publisher:
    """A publisher on a TF topic, as the graph shows it."""

    #: Its id, 16 bytes. Its messages have the same id if the rmw identifies senders.
    gid: bytes
    #: Its node's full name, None while unknown.
    node: str | None
    #: Whether its topic is for fixed edges.
    static: bool
    #: Its topic's full name.
    topic: str = ""
    #: Such as ``tf2_msgs/msg/TFMessage``.
    type: str = ""
    #: Whether its durability is transient_local.
    latched: bool = True
    #: Whether its reliability is reliable.
    reliable: bool = True
    #: Its machine and process; empty if unknown.
    where: str = ""
    #: Whether its process belongs to the guard's run, None if unknown.
    ours: bool | None = None
    #: Whether a strict plan's isolation applies to it, None without isolation.
    fenced: bool | None = None
    #: Other nodes that it may belong to.
    further_nodes: tuple[str, ...] = ()
    #: Its process in the plan; empty if unknown.
    process: str = ""
    #: The run of another robot that it belongs to, None if unknown.
    run: OtherRun | None = None
    #: The profile file with which its process started instead of the plan's; empty if there is
    #: none or it is unknown.
    profile: str = ""
    #: Process id, if it is a descendant of the run's launcher with a cleared environment, so that
    #: its process in the plan is unknown; otherwise 0.
    unmarked: int = 0

    @property
    def nodes(self) -> tuple[str, ...]:
        """The candidates for its node; empty while it has no name."""
        return () if self.node is None else (self.node, *self.further_nodes)


def forget_oldest(entries: dict[Key, Any], present: Collection[Key]) -> None:
    """Forget the publishers that left first, beyond ``MOST_LEFT``."""
    left = (
        [key for key in entries if key not in present]
        if len(entries) > len(present) + MOST_LEFT
        else []
    )
    for key in left[: len(left) - MOST_LEFT]:
        del entries[key]


class Publishers:
    """All publishers that the graph has shown: present publishers, and names of former ones.

    If ``gid_identifies_node`` is False, the rmw does not identify senders. Then message ids only
    distinguish senders, and any node on the topic may be the sender.
    """

    def __init__(self, *, gid_identifies_node: bool = True) -> None:
        self.gid_identifies_node = gid_identifies_node
        #: Whether a graph is known. A recording has none.
        self.queried = False
        #: Present publishers by id.
        self.present: dict[bytes, Publisher] = {}
        #: All publishers by id, with their last known names.
        self.by_gid: dict[bytes, Publisher] = {}

    def update(self, publishers: Sequence[Publisher]) -> None:
        """Take the publishers in the graph now."""
        self.queried = True
        self.present = {publisher.gid: publisher for publisher in publishers}
        self.by_gid |= {
            publisher.gid: publisher
            for publisher in publishers
            if publisher.node is not None or publisher.gid not in self.by_gid
        }
        forget_oldest(self.by_gid, self.present)

    def is_named(self, gid: bytes | None) -> bool:
        """Return whether the publisher's node has a name."""
        return gid is not None and gid in self.by_gid and self.by_gid[gid].node is not None

    def is_sure(self, gid: bytes | None) -> bool:
        """Return whether the id identifies the publisher.

        It does as soon as the graph shows the publisher's name.
        """
        return gid is not None and (self.gid_identifies_node or self.is_named(gid))

    def nodes(self, gid: bytes | None, *, static: bool) -> tuple[str, ...]:
        """Return the publisher's node; empty while unknown.

        If ids do not identify publishers, return all nodes on the topic. Publishers isolated by
        remapping are excluded, because they always have an id.
        """
        if gid is not None and self.is_sure(gid):
            return self.by_gid[gid].nodes if gid in self.by_gid else ()
        present = self.present.values()
        return tuple(
            sorted(
                {
                    publisher.node
                    for publisher in present
                    if publisher.static == static and publisher.node and not publisher.fenced
                }
            )
        )

    def publishers_of(self, nodes: Collection[str], *, static: bool) -> list[bytes]:
        """Return the present publishers of these nodes, on that kind of topic."""
        present = self.present.values()
        return [
            publisher.gid
            for publisher in present
            if publisher.static == static and publisher.node in nodes
        ]

    def where(self, gid: bytes | None) -> str:
        """Return where the publisher runs; empty if unknown."""
        return self.by_gid[gid].where if gid is not None and gid in self.by_gid else ""

    def is_present(self, gid: bytes | None) -> bool:
        """Return whether the publisher is present.

        If its id does not identify it, return whether any publisher is present.
        """
        return gid in self.present if self.is_sure(gid) else bool(self.present)


@dataclass(slots=True)
class MessageCounter:
    """A publisher's first arrival, and the rate of its sequence numbers."""

    first_received: float
    first_ns: int
    first_sequence: int
    last_ns: int
    last_sequence: int
    gaps_ns: tuple[float, ...] = ()

    def heard(self, message: Message) -> None:
        """Record another message."""
        counted = message.sequence - self.last_sequence
        if counted > 0 and len(self.gaps_ns) < GAPS:
            self.gaps_ns += ((message.source_ns - self.last_ns) / counted,)
        self.last_ns, self.last_sequence = message.source_ns, message.sequence

    def began_before(self, time_ns: float, gaps: int = GAPS) -> bool | None:
        """Return whether its first message was sent before this time.

        None if uncertain after ``gaps`` gaps. A publisher that began much later is recognised by
        its second message.
        """
        if self.first_sequence in {1, UNCOUNTED}:
            return self.first_ns < time_ns
        before = self.first_sequence - 1
        if self.gaps_ns and self.first_ns - UNSURE * max(self.gaps_ns) * before > time_ns:
            return False
        return (
            self.first_ns - _median(self.gaps_ns) * before < time_ns
            if len(self.gaps_ns) >= gaps
            else None
        )


def _median(values: Sequence[float]) -> float:
    """Return the median. Importing the standard library's median costs 2 MB per process."""
    ordered, half = sorted(values), len(values) // 2
    return ordered[half] if len(ordered) % 2 else (ordered[half - 1] + ordered[half]) / 2


@dataclass(frozen=True, slots=True)
class SenderMemory:
    """State of a sender, for a new guard."""

    #: The candidates for its node.
    nodes: tuple[str, ...]
    sender: MessageCounter


class Senders(Publishers):
    """All publishers that have sent messages or are in the graph."""

    def __init__(self, *, gid_identifies_node: bool = True) -> None:
        super().__init__(gid_identifies_node=gid_identifies_node)
        self._heard: dict[bytes, MessageCounter] = {}

    def update(self, publishers: Sequence[Publisher]) -> None:
        """Take the publishers in the graph now."""
        super().update(publishers)
        forget_oldest(self._heard, self.present)

    def heard(self, message: Message, now: float) -> None:
        """Count a message. Messages without ids cannot be counted."""
        if message.gid is None:
            return
        sender = self._heard.get(message.gid)
        if sender:
            sender.heard(message)
        else:
            first = (message.source_ns, message.sequence)
            self._heard[message.gid] = MessageCounter(now, *first, *first)

    def sender(self, gid: bytes | None) -> MessageCounter | None:
        """Return the counter of that publisher's messages."""
        return None if gid is None else self._heard.get(gid)

    def process(self, gid: bytes | None) -> str:
        """Return the plan's process that the publisher's environment proves, "" without proof."""
        publisher = (self.present.get(gid) or self.by_gid.get(gid)) if gid is not None else None
        return publisher.process if publisher and publisher.ours else ""

    def is_ours(self, gid: bytes | None) -> bool | None:
        """Return whether the publisher belongs to the guard's run, None if unknown."""
        publisher = (self.present.get(gid) or self.by_gid.get(gid)) if gid is not None else None
        return publisher.ours if publisher else None

    def shows_process(self, process: str, node: str, *, static: bool) -> bool:
        """Return whether a publisher of the node provably belongs to the process."""
        return any(
            publisher.ours
            and publisher.process == process
            and publisher.node == node
            and publisher.static == static
            for publisher in self.present.values()
        )

    def is_held_back(self, gid: bytes | None) -> bool | None:
        """Return whether a strict plan blocks edges that the publisher does not own.

        None: unknown.
        """
        publisher = self.present.get(gid) if gid is not None else None
        return publisher.fenced if publisher else None

    def run(self, gid: bytes | None) -> OtherRun | None:
        """Return the run of another robot that the publisher's environment proves, or None."""
        publisher = self.by_gid.get(gid) if gid is not None else None
        return publisher.run if publisher else None

    def was_held_back(self, gid: bytes | None) -> bool:
        """Return whether a publisher, even if it has left, is known to have been blocked."""
        publisher = self.by_gid.get(gid) if gid is not None else None
        return bool(publisher and publisher.fenced)

    @property
    def mark(self) -> tuple[int, int]:
        """A value that changes when there is more state to store."""
        return len(self._heard), sum(
            publisher.node is not None for publisher in self.by_gid.values()
        )

    def memory(self) -> dict[str, SenderMemory]:
        """Return the state of present publishers for a new guard, by hexadecimal id."""
        present = {gid: sender for gid, sender in self._heard.items() if gid in self.present}
        return {
            gid.hex(): SenderMemory(self.by_gid[gid].nodes, since)
            for gid, since in present.items()
        }

    def recall(self, memory: dict[str, SenderMemory]) -> None:
        """Restore the previous guard's state."""
        for hexed, sender in memory.items():
            gid = bytes.fromhex(hexed)
            self._heard[gid] = sender.sender
            if sender.nodes:
                self.by_gid[gid] = Publisher(
                    gid, sender.nodes[0], static=False, further_nodes=sender.nodes[1:]
                )
