"""Publishers on TF topics by message ids, since when, and what messages say.

What messages say is read fast where a publisher sends the same edges again and again.
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
#: So many layouts of publishers are remembered whose poses were read.
_MOST = 1024


@dataclass(frozen=True, slots=True)
class Message:
    """One TFMessage: its (parent, child) pairs, the topic's kind, who sent it, and when.

    ``gid`` is the publisher's id, or None where the rmw gives none; ``sequence`` counts its
    messages from 1. ``stamps_ns`` are the transforms' stamps; ``received_ns`` is when it came, by
    this machine's system clock. ``exact`` says that its names are all that was sent: listeners of
    other languages take more of one with a NUL. ``poses`` are there where frames are compared with
    presets, in the first message of a publisher with these edges.
    """

    edges: tuple[tuple[str, str], ...]
    static: bool
    gid: bytes | None
    source_ns: int
    sequence: int
    stamps_ns: Sequence[int] = ()
    received_ns: int = 0
    poses: Sequence[Pose] = ()
    exact: bool = True


class MessageReader:
    """Reads messages, with poses in a publisher's first ones that hold one of ``frames``."""

    def __init__(self, frames: frozenset[str] = frozenset()) -> None:
        self._frames = frames
        self.decoder = Decoder()
        self._posed: set[tuple[bytes | None, MessageLayout]] = set()

    def read(self, received: Received, *, static: bool) -> Message:
        """Return the message, with frames named as tf2 takes them.

        Raises:
            ValueError: with one sentence, if it is no TFMessage.
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


#: Of publishers that have left so many are remembered: those that come and go take a bounded
#: memory.
MOST_LEFT = 1000
#: So many bytes of an id are its participant's (RTPS: a GUID's prefix).
PARTICIPANT = 12
#: How many gaps between messages tell surely when a publisher began; so many at least, when time
#: is short.
GAPS, FEWEST_GAPS = 5, 2
#: A gap that was seen may be shorter than usual by this factor.
UNSURE = 3.0
#: How long a publisher may stay without a name, or out of the graph, before it is judged all the
#: same.
NAMELESS_S = 0.7
UNCOUNTED = 2**64 - 1


@dataclass(frozen=True, slots=True)
class OtherRun:
    """A run of another robot: its name, ROBOT@DOMAIN, its launcher's process, and since when.

    14:03:27, local time.
    """

    name: str
    pid: int
    since: str


@dataclass(frozen=True, slots=True)
class Publisher:
    """A publisher on a TF topic, as the graph shows it.

    Attributes:
        gid: its id, 16 bytes, which comes with its messages where the rmw says who sent them.
        node: its node's full name, None while that is not known.
        static: whether its topic is one of fixed edges.
        topic: its topic's full name.
        type: its type, such as ``tf2_msgs/msg/TFMessage``.
        latched: whether its durability is transient_local.
        reliable: whether its reliability is reliable.
        where: on which machine and as which process it runs; empty if that is not known.
        ours: whether that process is of the guard's own run; None: not known.
        fenced: whether it sends behind the fence of a strict plan; None: there is no fence.
        others: further nodes of which it may be one.
        process: the plan's process that it is of, where that was seen.
        run: the run of another robot that it is of, where that was seen.
        profile: the profile file that its process was started with instead of the fence's; empty:
            none, or not known.
        unmarked: the number of its process, where that descends from the run's launcher, and its
            environment was cleared, so that nothing says which of the plan's processes it is of.
    """

    gid: bytes
    node: str | None
    static: bool
    topic: str = ""
    type: str = ""
    latched: bool = True
    reliable: bool = True
    where: str = ""
    ours: bool | None = None
    fenced: bool | None = None
    others: tuple[str, ...] = ()
    process: str = ""
    run: OtherRun | None = None
    profile: str = ""
    unmarked: int = 0

    @property
    def nodes(self) -> tuple[str, ...]:
        """The nodes of which one is the publisher's; none while it has no name."""
        return () if self.node is None else (self.node, *self.others)


def forget_oldest(known: dict[Key, Any], present: Collection[Key]) -> None:
    """Forget the oldest of absent publishers beyond ``MOST_LEFT``."""
    left = (
        [key for key in known if key not in present]
        if len(known) > len(present) + MOST_LEFT
        else []
    )
    for key in left[: len(left) - MOST_LEFT]:
        del known[key]


class Publishers:
    """All publishers that the graph has shown.

    Those that are there, and the names of those that have left.

    Where the rmw does not say who sent a message (``says_who``), ids of messages tell senders
    apart, and any node on the topic may be the one.
    """

    def __init__(self, *, says_who: bool = True) -> None:
        self.says_who = says_who
        #: Whether the graph was asked: of a recording nobody can.
        self.queried = False
        #: Those that are there, by id.
        self.present: dict[bytes, Publisher] = {}
        #: All by id, as they were when they had a name last.
        self.known: dict[bytes, Publisher] = {}

    def update(self, publishers: Sequence[Publisher]) -> None:
        """Take who is in the graph now."""
        self.queried = True
        self.present = {publisher.gid: publisher for publisher in publishers}
        self.known |= {
            publisher.gid: publisher
            for publisher in publishers
            if publisher.node is not None or publisher.gid not in self.known
        }
        forget_oldest(self.known, self.present)

    def is_named(self, gid: bytes | None) -> bool:
        """Return whether the publisher's node has a name."""
        return gid is not None and gid in self.known and self.known[gid].node is not None

    def is_sure(self, gid: bytes | None) -> bool:
        """Return whether the id says whose it is.

        By the graph, once it shows the publisher's name.
        """
        return gid is not None and (self.says_who or self.is_named(gid))

    def nodes(self, gid: bytes | None, *, static: bool) -> tuple[str, ...]:
        """Return the publisher's node, nothing while it is not known.

        All on the topic where ids do not say whose.

        One that sends behind a fence of remappings has an id in any case.
        """
        if gid is not None and self.is_sure(gid):
            return self.known[gid].nodes if gid in self.known else ()
        there = self.present.values()
        return tuple(
            sorted(
                {
                    publisher.node
                    for publisher in there
                    if publisher.static == static and publisher.node and not publisher.fenced
                }
            )
        )

    def publishers_of(self, nodes: Collection[str], *, static: bool) -> list[bytes]:
        """Return the publishers that are there of these nodes, on that kind of topic."""
        there = self.present.values()
        return [
            publisher.gid
            for publisher in there
            if publisher.static == static and publisher.node in nodes
        ]

    def where(self, gid: bytes | None) -> str:
        """Return where the publisher runs, empty where that is not known."""
        return self.known[gid].where if gid is not None and gid in self.known else ""

    def is_present(self, gid: bytes | None) -> bool:
        """Return whether the publisher is there.

        One whose id does not say whose it is, is while anybody is.
        """
        return gid in self.present if self.is_sure(gid) else bool(self.present)


@dataclass(slots=True)
class MessageCounter:
    """One publisher: when it was first heard, and how fast it counts."""

    first_received: float
    first_ns: int
    first_sequence: int
    last_ns: int
    last_sequence: int
    gaps_ns: tuple[float, ...] = ()

    def heard(self, message: Message) -> None:
        """Note a further message."""
        counted = message.sequence - self.last_sequence
        if counted > 0 and len(self.gaps_ns) < GAPS:
            self.gaps_ns += ((message.source_ns - self.last_ns) / counted,)
        self.last_ns, self.last_sequence = message.source_ns, message.sequence

    def began_before(self, time_ns: float, gaps: int = GAPS) -> bool | None:
        """Return whether its first message was sent before that time.

        None: not sure by so many gaps.

        A newcomer that is far from it is recognised by its second message.
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
    """Return the median; the library's costs two megabytes in a process."""
    ordered, half = sorted(values), len(values) // 2
    return ordered[half] if len(ordered) % 2 else (ordered[half - 1] + ordered[half]) / 2


@dataclass(frozen=True, slots=True)
class SenderMemory:
    """What the next guard must know of a sender; ``nodes`` are those that it can be of."""

    nodes: tuple[str, ...]
    sender: MessageCounter


class Senders(Publishers):
    """All publishers that were heard, or that the graph shows."""

    def __init__(self, *, says_who: bool = True) -> None:
        super().__init__(says_who=says_who)
        self._heard: dict[bytes, MessageCounter] = {}

    def update(self, publishers: Sequence[Publisher]) -> None:
        """Take who is in the graph now."""
        super().update(publishers)
        forget_oldest(self._heard, self.present)

    def heard(self, message: Message, now: float) -> None:
        """Count a message. Without ids messages cannot be counted."""
        if message.gid is None:
            return
        sender = self._heard.get(message.gid)
        if sender:
            sender.heard(message)
        else:
            first = (message.source_ns, message.sequence)
            self._heard[message.gid] = MessageCounter(now, *first, *first)

    def sender(self, gid: bytes | None) -> MessageCounter | None:
        """Return what is known of that publisher's messages."""
        return None if gid is None else self._heard.get(gid)

    def process(self, gid: bytes | None) -> str:
        """Return the plan's process that the publisher is proven to be of, by its environment.

        Empty: none is.
        """
        publisher = (self.present.get(gid) or self.known.get(gid)) if gid is not None else None
        return publisher.process if publisher and publisher.ours else ""

    def is_ours(self, gid: bytes | None) -> bool | None:
        """Return whether the publisher is of the guard's own run; None: that is not known."""
        publisher = (self.present.get(gid) or self.known.get(gid)) if gid is not None else None
        return publisher.ours if publisher else None

    def shows_process(self, process: str, node: str, *, static: bool) -> bool:
        """Return whether a publisher of that node exists and provably is the process's."""
        return any(
            publisher.ours
            and publisher.process == process
            and publisher.node == node
            and publisher.static == static
            for publisher in self.present.values()
        )

    def is_held_back(self, gid: bytes | None) -> bool | None:
        """Whether what the publisher may not send reaches nobody in a strict plan.

        None: that is not known.
        """
        publisher = self.present.get(gid) if gid is not None else None
        return publisher.fenced if publisher else None

    def run(self, gid: bytes | None) -> OtherRun | None:
        """Return the run of another robot that the publisher is of, by its environment.

        None: no such is known.
        """
        publisher = self.known.get(gid) if gid is not None else None
        return publisher.run if publisher else None

    def was_held_back(self, gid: bytes | None) -> bool:
        """Return whether messages of one that may have left reached nobody, as far as known."""
        publisher = self.known.get(gid) if gid is not None else None
        return bool(publisher and publisher.fenced)

    @property
    def mark(self) -> tuple[int, int]:
        """What changes when there is more to remember."""
        return len(self._heard), sum(
            publisher.node is not None for publisher in self.known.values()
        )

    def memory(self) -> dict[str, SenderMemory]:
        """Return what the next guard must know of present publishers, by hexadecimal ids."""
        there = {gid: sender for gid, sender in self._heard.items() if gid in self.present}
        return {
            gid.hex(): SenderMemory(self.known[gid].nodes, since) for gid, since in there.items()
        }

    def recall(self, memory: dict[str, SenderMemory]) -> None:
        """Know what the guard before knew."""
        for hexed, sender in memory.items():
            gid = bytes.fromhex(hexed)
            self._heard[gid] = sender.sender
            if sender.nodes:
                self.known[gid] = Publisher(
                    gid, sender.nodes[0], static=False, others=sender.nodes[1:]
                )
