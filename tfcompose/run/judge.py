"""The guard's judgement: who may publish which edge, over what was seen.

It is given messages, the graph and the time, and returns events; it reads no clock and no topic, so that histories can
be replayed. Times are monotonic seconds, but for a message's source time, which is nanoseconds of the system clock.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from tfcompose.run.events import Clear, Found, GuardEvent, Recovered, Taken
from tfcompose.run.liveness import Liveness
from tfcompose.run.offences import NAMELESS, Offence, taken, violation, volatile_writer
from tfcompose.run.senders import FEWEST_GAPS, Message, Senders, Writer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.plan import Plan, PlanEdge

__all__ = ["Judge", "Message", "Writer"]

#: How long a publisher may stay without a name before it is judged all the same; longer if it may be the owner.
NAMELESS_S = 0.7
NAMELESS_OWNER_S = 5.0
#: For how long after the start a publisher can turn out to have been there first, and by how much it must have been.
FIRST_S = 15.0
FIRST_BY_NS = 500_000_000
#: How long messages are waited for that tell from their count when a publisher began.
COUNTING_S = 0.7
#: An offence is over when its publisher has left and nothing came for so long, or for longer from one that stays.
OVER_S = 3.0
QUIET_S = 30.0
#: Further edges of an offender that was just reported are collected for so long.
COLLECTED_S = 0.5
#: The publishers that a plan starts once and never again.
_OWN = ("static", "joints")


@dataclass(slots=True)
class _Case:
    """An offence that was seen; ``last`` is when, ``told`` whether it was reported."""

    offence: Offence
    gid: bytes | None
    last: float
    told: bool = False


@dataclass(frozen=True, slots=True)
class _Sight:
    """An edge that somebody published on a topic."""

    gid: bytes | None
    parent: str
    child: str
    static: bool


@dataclass(slots=True)
class Judge:
    """The state of one watch over one plan. ``settle_s`` is how long it looks before it says that all is clear."""

    plan: Plan
    settle_s: float
    begun: float
    begun_ns: int
    live: Liveness = field(init=False)
    _cleared: float | None = None
    _cleared_ns: int = 0
    _senders: Senders = field(default_factory=Senders)
    _pending: dict[_Sight, float] = field(default_factory=dict)
    _cases: dict[tuple[str, str, str, str], _Case] = field(default_factory=dict)
    _reported: dict[tuple[str, str], float] = field(default_factory=dict)
    _owner_gids: dict[str, tuple[bytes, bytes | None]] = field(default_factory=dict)
    _volatile: set[bytes] = field(default_factory=set)
    _planned: dict[str, PlanEdge] = field(init=False)
    _started: dict[str, bool] = field(init=False)

    def __post_init__(self) -> None:
        self.live = Liveness(self.plan)
        self._started = {process.name: process.kind != "external" for process in self.plan.processes}
        self._planned = {edge.child: edge for edge in self.plan.edges}

    def message(self, message: Message, now: float) -> list[GuardEvent]:
        """Take a message and return which edges it brings to life; ``tick`` tells offences."""
        self._senders.heard(message, now)
        events: list[GuardEvent] = []
        for parent, child in message.edges:
            events += self._see(_Sight(message.gid, parent, child, message.static), now)
        return events

    def graph(self, writers: Sequence[Writer], now: float) -> list[GuardEvent]:
        """Take who publishes on /tf and /tf_static now, and return what that means."""
        self._senders.graph(writers)
        events = self._see_again(now)
        for writer in writers:
            if writer.static and writer.volatile and writer.node is not None and writer.gid not in self._volatile:
                self._volatile.add(writer.gid)
                events.append(Found(volatile_writer(writer.node, self.plan)))
        if self._cleared is not None:
            events += self.live.static_writers({w.node for w in writers if w.static and w.node is not None})
        return events

    def tick(self, now: float) -> list[GuardEvent]:
        """Return what the passing of time means."""
        events = [*self._see_again(now), *self._report(now)]
        if self._cleared is not None:
            return [*events, *self.live.judge(now), *self._over(now)]
        self.live.look(now)
        waiting = self._pending or not all(case.told for case in self._cases.values())
        if now - self.begun >= self.settle_s and not waiting:
            self._cleared = now
            self._cleared_ns = self.begun_ns + int((now - self.begun) * 1e9)
            events.append(Clear())
        return events

    # What is seen.

    def _see(self, sight: _Sight, now: float) -> list[GuardEvent]:
        """Judge what was seen, or put it off until its sender's name is known."""
        nodes = self._senders.nodes(sight.gid, static=sight.static)
        # Without ids, the sender may be one that the graph does not show yet.
        if not nodes or (sight.gid is None and self._offence(sight, nodes)):
            self._pending.setdefault(sight, now)
            return []
        return self._judge(sight, nodes, now)

    def _see_again(self, now: float) -> list[GuardEvent]:
        """Judge what waited for a name."""
        events: list[GuardEvent] = []
        for sight, since in list(self._pending.items()):
            nodes = self._senders.nodes(sight.gid, static=sight.static)
            if (nodes and sight.gid is not None) or now - since >= self._patience_s(sight, nodes):
                del self._pending[sight]
                events += self._judge(sight, nodes, now)
        return events

    def _patience_s(self, sight: _Sight, nodes: tuple[str, ...]) -> float:
        """Return how long to wait for the sender's name. One that may be the owner is not blamed in a hurry."""
        if nodes:
            return NAMELESS_S
        edge = self._planned.get(sight.child)
        if edge is None or not edge.may_hang_on(sight.parent):
            return NAMELESS_S
        owner = self._owner_gids.get(sight.child)
        known = owner is not None and self._senders.is_present(owner[0])
        early = self._cleared is None and self._started.get(edge.owner, False)
        return NAMELESS_S if known or early else NAMELESS_OWNER_S

    def _judge(self, sight: _Sight, nodes: tuple[str, ...], now: float) -> list[GuardEvent]:
        offence = self._offence(sight, nodes)
        if offence is not None:
            case = self._cases.setdefault(_key(offence, sight), _Case(offence, sight.gid, now))
            case.gid, case.last = sight.gid, now
            if nodes:  # what was blamed on nobody has a name now
                self._cases.pop((offence.code, sight.parent, sight.child, NAMELESS), None)
            # Of two that take turns either may be the owner; its edge is not silent.
            if not offence.namesake or sight.child not in self._owner_gids:
                return []
        return self.live.arrived(sight.child, now) if sight.child in self._planned else []

    def _offence(self, sight: _Sight, nodes: tuple[str, ...]) -> Offence | None:
        edge = self._planned.get(sight.child)
        if edge is None:
            declared = self._may_be_undeclared(sight.parent, sight.child)
            return None if declared else Offence("TF803", sight.parent, sight.child, nodes, sight.static, None)
        code, namesake = "", False
        if not edge.may_hang_on(sight.parent):
            code = "TF802"
        elif edge.node not in nodes:
            code = "TF801"
        elif self._is_namesake(edge, sight):
            code, namesake = "TF801", True
        elif sight.static != (edge.kind == "static") and len(nodes) == 1:
            code = "TF809"
        return Offence(code, sight.parent, sight.child, nodes, sight.static, edge, namesake) if code else None

    def _is_namesake(self, edge: PlanEdge, sight: _Sight) -> bool:
        """Whether a publisher has the owner's name and is not the owner.

        It is where the plan starts the owner and this one spoke before; where two take turns: A, B, and A again; and
        where tfcompose's own publisher, which is never restarted, is there twice.
        """
        gid, sender = sight.gid, self._senders.sender(sight.gid)
        if gid is None or sender is None:
            return False
        ours = self._started.get(edge.owner, False)
        if ours and (self._cleared is None or sender.first_ns < self._cleared_ns):
            return True
        current, before = self._owner_gids.get(edge.child, (gid, None))
        if current == gid:
            self._owner_gids[edge.child] = (gid, before)
            return False
        self._owner_gids[edge.child] = (gid, current)
        return (before == gid and not sight.static) or (edge.owner in _OWN and self._senders.is_present(current))

    def _may_be_undeclared(self, parent: str, child: str) -> bool:
        """Whether nobody needs to have declared the edge: by policy, or because it is another robot's."""
        policy, ros = self.plan.guard, self.plan.ros
        if ros.frame_prefix and not child.startswith(ros.frame_prefix) and child not in ros.shared_frames:
            return True
        return policy.unknown_edges == "ignore" or any(
            fnmatchcase(parent, parents) and fnmatchcase(child, children) for parents, children in policy.allow
        )

    # What is told.

    def _report(self, now: float) -> list[GuardEvent]:
        """Tell new cases, those of one kind and node in one finding."""
        grouped: dict[tuple[str, str], list[_Case]] = {}
        for case in self._cases.values():
            if not case.told and not self._may_tell_more(case.gid, now):
                grouped.setdefault((case.offence.code, case.offence.who), []).append(case)
        events: list[GuardEvent] = []
        for group, cases in grouped.items():
            if now - self._reported.get(group, -COLLECTED_S) < COLLECTED_S:
                continue
            self._reported[group] = now
            offences = [case.offence for case in cases]
            first = any(self._was_first(case, now) for case in cases)
            events.append(Taken(taken(offences)) if first else Found(violation(offences, self.plan.guard)))
            for case in cases:
                case.told = True
        return events

    def _may_tell_more(self, gid: bytes | None, now: float) -> bool:
        """Whether more messages of this publisher can tell if it was there before the start."""
        sender = self._senders.sender(gid)
        if sender is None or self._cleared is None or now - self._cleared > FIRST_S:
            return False
        began_before = sender.began_before(self._cleared_ns - FIRST_BY_NS)
        return began_before is None and now - sender.first_seen < COUNTING_S

    def _was_first(self, case: _Case, now: float) -> bool:
        """Whether the offender had the edge before the plan was started."""
        if case.offence.code not in {"TF801", "TF802"}:
            return False
        if self._cleared is None:
            return True
        sender = self._senders.sender(case.gid)
        if sender is None or now - self._cleared >= FIRST_S:
            return False
        return bool(sender.began_before(self._cleared_ns - FIRST_BY_NS, FEWEST_GAPS))

    def _over(self, now: float) -> list[GuardEvent]:
        """Forget offences that have ended, and say so; the next of their kind is a new case."""
        ended = [key for key, case in self._cases.items() if case.told and self._has_ended(case, now)]
        return [Recovered(self._cases.pop(key).offence.over) for key in ended]

    def _has_ended(self, case: _Case, now: float) -> bool:
        if self._senders.is_present(case.gid):
            return not case.offence.static and now - case.last > QUIET_S
        return now - case.last > OVER_S


def _key(offence: Offence, sight: _Sight) -> tuple[str, str, str, str]:
    """Return what makes it the same case; without ids, who may have done it changes from message to message."""
    return (offence.code, offence.parent, offence.child, "" if sight.gid is None else offence.who)
