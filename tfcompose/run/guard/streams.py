"""Verdicts on messages: which of a message's edges are live, which are cases, and which may pass in a strict plan.

What was judged of a message holds for the next one of the same publisher with the same edges, until an owner, the
tree's shape or a case changes. What has a sender without a name waits for that, for a while.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.run.guard.law import Sight
from tfcompose.run.guard.senders import NAMELESS_S
from tfcompose.run.guard.stamps import Stamps

if TYPE_CHECKING:
    from tfcompose.run.guard.cases import Case, Cases, Start
    from tfcompose.run.guard.law import Law
    from tfcompose.run.guard.senders import Message, Senders
    from tfcompose.verdict.offence import Offence

#: How long a publisher that may be the owner can stay without a name before it is judged all the same.
NAMELESS_OWNER_S = 5.0
#: For so many kinds of messages what was judged of them is remembered.
MOST_STREAMS = 4096
#: What was judged of a message with edges that the plan does not have holds for so long.
STRANGE_S = 1.0


@dataclass(slots=True)
class Stream:
    """A publisher's messages with the same edges; the verdict holds for a time, while nothing changes.

    ``children`` are the planned edges that come with it, ``admitted`` the edges that may pass; None: all.
    """

    stamps: Stamps = field(default_factory=Stamps)
    epoch: int = -1
    until: float = 0.0
    cases: tuple[Case, ...] = ()
    children: tuple[str, ...] = ()
    admitted: frozenset[tuple[str, str]] | None = None


class Streams:
    """What was judged of each publisher's messages, by the law, and what waits for a name."""

    def __init__(self, law: Law, senders: Senders, cases: Cases, start: Start) -> None:
        self._law = law
        self._senders = senders
        self._cases = cases
        self._start = start
        self._streams: dict[tuple[bytes | None, bool, tuple[tuple[str, str], ...]], Stream] = {}
        self._pending: dict[Sight, float] = {}

    @property
    def waits(self) -> bool:
        """Whether something waits for its sender's name."""
        return bool(self._pending)

    def take(self, message: Message, now: float) -> Stream:
        """Return the message's stream, with the verdict on it."""
        key = (message.gid, message.static, message.edges)
        stream = self._streams.get(key)
        if stream is None:
            if len(self._streams) >= MOST_STREAMS:
                self._streams.clear()
            stream = self._streams[key] = Stream()
        if stream.epoch != self._law.changes or now > stream.until:
            self.judge(stream, message, now)
        for case in stream.cases:
            case.last = now
        return stream

    def forget(self) -> None:
        """Judge every message anew."""
        self._streams.clear()

    def forget_stamps(self) -> None:
        """Take the next stamps as first ones: the clock has gone back."""
        for stream in self._streams.values():
            stream.stamps = Stamps()

    def judge(self, stream: Stream, message: Message, now: float) -> None:
        """Judge the edges of a message whose sender has a name; the verdict holds if all is certain."""
        nodes = self._senders.nodes(message.gid, static=message.static)
        sure = self._senders.is_sure(message.gid)
        epoch, certain = self._law.changes, sure
        cases, children, admitted = [], [], []
        for parent, child in dict.fromkeys(message.edges):
            sight = Sight(message.gid, parent, child, message.static)
            offence = self._law.offence(sight, nodes, now) if nodes else None
            # Where ids do not say whose they are, the sender may be one that the graph does not show yet.
            if not nodes or (offence and not sure and not offence.namesake):
                self._pending.setdefault(sight, now)
                certain = False
                continue
            case, arrived = self._note(offence, sight, now)
            if case:
                cases.append(case)
                certain = certain and not case.offence.namesake
            else:
                admitted.append((parent, child))
            if arrived:
                children.append(child)
        stream.admitted = None if {*admitted} == {*message.edges} else frozenset(admitted)
        stream.cases, stream.children = tuple(cases), tuple(children)
        stream.epoch = epoch if certain and epoch == self._law.changes else -1
        strange = any(child not in self._law.planned for _, child in message.edges)
        stream.until = now + STRANGE_S if strange else float("inf")

    def see_again(self, now: float) -> list[tuple[str, ...]]:
        """Judge what waited for a name, and return the planned edges that have come with it, by their senders."""
        arrived: dict[bytes | None, list[str]] = {}
        for sight, since in list(self._pending.items()):
            nodes = self._senders.nodes(sight.gid, static=sight.static)
            if (nodes and self._senders.is_sure(sight.gid)) or now - since >= self._patience_s(sight, nodes):
                del self._pending[sight]
                if self._note(self._law.offence(sight, nodes, now), sight, now)[1]:
                    arrived.setdefault(sight.gid, []).append(sight.child)
        return [tuple(children) for children in arrived.values()]

    def _patience_s(self, sight: Sight, nodes: tuple[str, ...]) -> float:
        """Return how long to wait for the sender's name. One that may be the owner is not blamed in a hurry."""
        if nodes:
            return NAMELESS_S
        edge = self._law.planned.get(sight.child)
        if edge is None or not edge.may_hang_on(sight.parent):
            return NAMELESS_S
        known = self._law.owners.known(sight.child) and self._senders.is_present(self._law.owners.current(sight.child))
        early = self._start.cleared is None and self._law.started.get(edge.owner, False)
        return NAMELESS_S if known or early else NAMELESS_OWNER_S

    def _note(self, offence: Offence | None, sight: Sight, now: float) -> tuple[Case | None, bool]:
        """Return the case that the offence is, if there is one, and whether the owner's edge has come."""
        case = self._cases.note(offence, sight.gid, now) if offence else None
        planned = sight.child in self._law.planned
        # Of two that take turns either may be the owner; its edge is not silent.
        return case, planned and (offence is None or (offence.namesake and self._law.owners.known(sight.child)))
