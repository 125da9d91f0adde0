"""Who sends: the publishers by their ids, their nodes' names, and when each of them began."""

from __future__ import annotations

from dataclasses import dataclass, field
from statistics import median
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.geometry import Pose

#: How many gaps between messages tell surely when a publisher began; so many at least, when time is short.
GAPS, FEWEST_GAPS = 5, 2
#: A gap that was seen may be shorter than usual by this factor.
UNSURE = 3.0
#: How long a publisher may stay without a name, or out of the graph, before it is judged all the same.
NAMELESS_S = 0.7
UNCOUNTED = 2**64 - 1
#: So many bytes of an id are its participant's (RTPS: a GUID's prefix).
PARTICIPANT = 12


@dataclass(frozen=True, slots=True)
class Message:
    """One TFMessage: its (parent, child) pairs, the topic's kind, who sent it, and when.

    ``gid`` is the publisher's id, or None where the rmw gives none; ``sequence`` counts its messages from 1.
    ``stamps_ns`` are the transforms' stamps; ``received_ns`` is when it came, by this machine's system clock.
    ``poses`` are there where frames are compared with presets, in the first message of a publisher with these edges.
    """

    edges: tuple[tuple[str, str], ...]
    static: bool
    gid: bytes | None
    source_ns: int
    sequence: int
    stamps_ns: Sequence[int] = ()
    received_ns: int = 0
    poses: Sequence[Pose] = ()


@dataclass(frozen=True, slots=True)
class Writer:
    """A publisher in the graph; ``node`` is None while its name is not known.

    ``where`` says on which machine and as which process it runs, as far as that is known. ``ours`` says whether that
    process is of the guard's own run; None: not known. ``fenced`` says whether it sends behind the fence of a strict
    plan; None: if it is ours. ``others`` are further nodes of which it may be one. ``process`` is the plan's that it is
    of, where that was seen.
    """

    gid: bytes
    node: str | None
    static: bool
    volatile: bool
    best_effort: bool = False
    where: str = ""
    ours: bool | None = None
    fenced: bool | None = None
    others: tuple[str, ...] = ()
    process: str = ""


@dataclass(slots=True)
class Sender:
    """One publisher: when it was first heard, and how fast it counts."""

    first_seen: float
    first_ns: int
    first_sequence: int
    last_ns: int
    last_sequence: int
    gaps_ns: list[float] = field(default_factory=list)

    def heard(self, message: Message) -> None:
        """Note a further message."""
        counted = message.sequence - self.last_sequence
        if counted > 0 and len(self.gaps_ns) < GAPS:
            self.gaps_ns.append((message.source_ns - self.last_ns) / counted)
        self.last_ns, self.last_sequence = message.source_ns, message.sequence

    def began_before(self, time_ns: float, gaps: int = GAPS) -> bool | None:
        """Return whether its first message was sent before that time; None: not sure by so many gaps.

        A newcomer that is far from it is recognised by its second message.
        """
        if self.first_sequence in {1, UNCOUNTED}:
            return self.first_ns < time_ns
        before = self.first_sequence - 1
        if self.gaps_ns and self.first_ns - UNSURE * max(self.gaps_ns) * before > time_ns:
            return False
        return self.first_ns - median(self.gaps_ns) * before < time_ns if len(self.gaps_ns) >= gaps else None


class Senders:
    """All publishers that were heard, or that the graph shows.

    Where the rmw does not say who sent a message (``says_who``), its id tells senders apart, and any node on the topic
    may be the one.
    """

    def __init__(self, *, says_who: bool = True) -> None:
        self._says_who = says_who
        self.writers: dict[bytes, Writer] = {}
        self._names: dict[bytes, tuple[str, ...]] = {}
        self._where: dict[bytes, str] = {}
        self._heard: dict[bytes, Sender] = {}

    def heard(self, message: Message, now: float) -> None:
        """Count a message. Without ids nobody's messages can be counted."""
        if message.gid is None:
            return
        sender = self._heard.get(message.gid)
        if sender:
            sender.heard(message)
        else:
            first = (message.source_ns, message.sequence)
            self._heard[message.gid] = Sender(now, *first, *first)

    def graph(self, writers: Sequence[Writer]) -> None:
        """Take who is in the graph now; the name of one that has left is kept."""
        self.writers = {writer.gid: writer for writer in writers}
        self._names.update({one.gid: (one.node, *one.others) for one in writers if one.node is not None})
        self._where.update({writer.gid: writer.where for writer in writers if writer.where})

    def where(self, gid: bytes | None) -> str:
        """Return where the publisher runs, empty where that is not known."""
        return "" if gid is None else self._where.get(gid, "")

    def process(self, gid: bytes | None) -> str:
        """Return the plan's process that the publisher was seen to be of, or nothing."""
        writer = self.writers.get(gid) if gid is not None else None
        return writer.process if writer else ""

    def is_of_this_run(self, gid: bytes | None) -> bool:
        """Whether the publisher is surely a process of the guard's own run.

        Where its process cannot be seen, its node's name says so if no other participant has a node of that name.
        """
        writer = self.writers.get(gid) if gid is not None else None
        if writer is None or writer.ours is not None:
            return writer is not None and bool(writer.ours)
        if writer.fenced:
            return True
        return len({one.gid[:PARTICIPANT] for one in self.writers.values() if one.node == writer.node}) == 1

    def is_held_back(self, gid: bytes | None) -> bool:
        """Whether what the publisher may not send reaches nobody in a strict plan."""
        writer = self.writers.get(gid) if gid is not None else None
        return self.is_of_this_run(gid) if writer is None or writer.fenced is None else writer.fenced

    @property
    def mark(self) -> tuple[int, int]:
        """What changes when there is more to remember."""
        return len(self._heard), len(self._names)

    def memory(self) -> dict[str, list[Any]]:
        """Return what the next guard must know of those that are there, as values of JSON."""
        known = {gid: sender for gid, sender in self._heard.items() if gid in self.writers}
        return {gid.hex(): [self._names.get(gid, ()), *_to_json(one)] for gid, one in known.items()}

    def recall(self, memory: dict[str, list[Any]]) -> None:
        """Know what the guard before knew."""
        for hexed, (names, *said) in memory.items():
            gid = bytes.fromhex(hexed)
            self._heard[gid] = Sender(*said)
            if names:
                self._names[gid] = tuple(names)

    def sender(self, gid: bytes | None) -> Sender | None:
        """Return what is known of that publisher's messages."""
        return None if gid is None else self._heard.get(gid)

    def is_sure(self, gid: bytes | None) -> bool:
        """Whether the id says whose it is: by the graph, once it shows the publisher."""
        return gid is not None and (self._says_who or gid in self._names)

    def nodes(self, gid: bytes | None, *, static: bool) -> tuple[str, ...]:
        """Return the publisher's node, nothing while it is not known; all on the topic where ids do not say whose.

        One that sends behind a fence of remappings has an id in any case.
        """
        if gid is not None and self.is_sure(gid):
            return self._names.get(gid, ())
        return tuple(sorted({w.node for w in self.writers.values() if w.static == static and w.node and not w.fenced}))

    def is_present(self, gid: bytes | None) -> bool:
        """Whether the publisher is in the graph; one whose id does not say whose it is, is while anybody is."""
        return gid in self.writers if self.is_sure(gid) else bool(self.writers)


def _to_json(one: Sender) -> list[Any]:
    first = (one.first_seen, one.first_ns, one.first_sequence)
    return [*first, one.last_ns, one.last_sequence, list(one.gaps_ns)]
