"""Liveness of owners: arrivals of their edges, judged at given times.

Edges that have always arrived together share a history. At first these are all edges of an owner.
A message with only some of them splits the history. Therefore the cost of a message does not
depend on the number of its edges.

Times are monotonic seconds. Silence is measured only while the guard runs. A guard that was
suspended or got no CPU time knows nothing about that time, and blames no owner for it.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

from tfcompose.foundation.text import list_names
from tfcompose.guard.verdict.rates import owner_left, silent, slow
from tfcompose.model.messages import (
    FindingShown,
    GuardEvent,
    Live,
    OwnerReady,
    RecoveredShown,
    TreeComplete,
)
from tfcompose.tf.live.arrivals import Arrivals

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.model.plan import Plan, PlanEdge

#: A rate is judged over this time in seconds or this number of periods, or at least half of that.
#: Arrivals are counted in intervals that are this fraction of the window. The last two intervals
#: count.
WINDOW_S = 2.0
WINDOW_PERIODS = 8.0
STRETCH = 0.6
#: Maximum number of combinations of edges whose tracks are cached.
MOST_MESSAGES = 1000
#: Maximum number of edges in an event, so that the event's line does not exceed the reader's
#: limit.
MOST_NAMED = 1000
#: Maximum time in seconds that a tick counts. The guard ticks ten times a second.
MAX_TICK_S = 0.25
#: After this time in seconds without a tick, messages are lost. They arrive again with the
#: writer's next heartbeat, which comes after 3 s in Fast DDS.
STALLED_S = 1.0
CATCH_UP_S = 3.5


@dataclass(frozen=True, slots=True)
class EdgeHealth:
    """The state of a planned edge."""

    edge: PlanEdge
    #: Full name of the publishing node; empty without one.
    publisher: str = ""
    #: Rate in Hz, None if unknown.
    rate: float | None = None
    #: Time since the last arrival in seconds, None if unknown.
    age_s: float | None = None
    #: Age of the last stamp at its arrival in seconds, None if unknown.
    delay_s: float | None = None
    #: Whether it is overdue at the plan's rate.
    silent: bool = False
    #: Whether its rate is below the plan's rate.
    slow: bool = False

    @property
    def text(self) -> str:
        """The state as text."""
        if self.age_s is None:
            return "not seen yet"
        numbers = [f"age {self.age_s:.3f} s"] if self.edge.kind != "static" else ["latched"]
        numbers += [f"{self.rate:.3g} Hz"] if self.rate is not None else []
        numbers += [f"delay {self.delay_s:.3f} s"] if self.delay_s is not None else []
        return ", ".join([*numbers, f"from {self.publisher}"])


@dataclass(slots=True)
class WatchedTime:
    """The time in which the guard ran: a clock that stops while the guard does not run."""

    _seconds: float = 0.0
    _ticked: float | None = None
    _catching_up_until: float = 0.0

    def time_at(self, now: float) -> float:
        """Return the watched seconds until ``now``."""
        if self._ticked is None or now < self._catching_up_until:
            return self._seconds
        return self._seconds + min(max(now - self._ticked, 0.0), MAX_TICK_S)

    def begins_late(self, until: float) -> None:
        """Treat owners that are missing until this time as not discovered yet."""
        self._catching_up_until = max(self._catching_up_until, until)

    def is_behind(self, now: float) -> bool:
        """Return whether messages that arrive now may be delayed.

        That is so if the guard did not run for a while, lost messages, or is still catching up.
        """
        stalled = self._ticked is not None and now - self._ticked > STALLED_S
        return stalled or now < self._catching_up_until

    def tick(self, now: float) -> float:
        """Record that the guard runs now, and return the watched seconds."""
        if self._ticked is not None and now - self._ticked > STALLED_S:
            self._catching_up_until = now + CATCH_UP_S
        self._seconds, self._ticked = self.time_at(now), now
        return self._seconds


@dataclass(slots=True)
class Track:
    """State of planned edges that arrive together and have the same owner, kind and rate."""

    edges: tuple[PlanEdge, ...]
    #: Longest gap in seconds after which the edges count as silent, None for edges without a rate.
    silent_after: float | None = field(init=False)
    #: Age of the last stamp at its arrival, in seconds.
    delay_s: float | None = None
    live: bool = False
    #: Time of the last arrival, in monotonic seconds.
    last: float = 0.0
    #: Time of the last arrival, in watched seconds.
    heard: float = 0.0
    silent: bool = False
    silent_since: float = 0.0
    steady: bool = False
    slow: bool = False
    #: Arrivals in watched time.
    arrivals: Arrivals = field(default_factory=Arrivals)
    _window_ns: int = field(init=False)

    @property
    def edge(self) -> PlanEdge:
        """Any of the edges."""
        return self.edges[0]

    def __post_init__(self) -> None:
        rate = self.edge.rate
        self._window_ns = int(max(WINDOW_S, WINDOW_PERIODS / (rate or WINDOW_PERIODS)) * 1e9)
        self.silent_after = self.edge.silent_after_s
        if not self.arrivals.count:
            self.forget()

    def note_arrival(self, watched: float, now: float, *, late: bool = False) -> None:
        """Record an arrival. Two arrivals in quick succession end a silence.

        ``late``: the message may have waited, so it does not count for the rate.
        """
        after = self.silent_after
        self.steady = after is not None and self.live and watched - self.heard <= after
        self.last, self.heard = now, watched
        if after is not None:
            at_ns = int(watched * 1e9)
            self.arrivals.note_resumption(at_ns) if late else self.arrivals.note_arrival(
                at_ns, None
            )

    def forget(self) -> None:
        """Treat the next arrival as the first."""
        self.arrivals = Arrivals(int(STRETCH * self._window_ns))

    def rate(self) -> float | None:
        """Return the rate over the window in Hz, without the longest gap.

        None if there are too few arrivals.
        """
        return self.arrivals.steady_rate(self._window_ns // 2)


@dataclass(frozen=True, slots=True)
class SilentMemory:
    """Edges that have been silent since a time in monotonic seconds, by child frame."""

    since: float
    children: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class LivenessMemory:
    """State for a new guard: edges by child frame, and owners that left."""

    live: tuple[str, ...]
    slow: tuple[str, ...]
    silent: tuple[SilentMemory, ...]
    gone: tuple[str, ...]


@dataclass(slots=True, eq=False)
class WrongEdges:
    """Edges in an open finding, with their current lines in the robot file."""

    edges: list[PlanEdge]
    finding_of: Callable[[Sequence[PlanEdge]], Finding]

    @property
    def finding(self) -> Finding:
        """The finding about the edges."""
        return self.finding_of(self.edges)


class Liveness:
    """The planned edges and their owners.

    ``changes`` counts reports, and owners that stopped, started or left.
    """

    def __init__(self, plan: Plan) -> None:
        self.changes = 0
        self._order = {edge.child: index for index, edge in enumerate(plan.edges)}
        together: dict[tuple[str, str, float | None], list[PlanEdge]] = {}
        for edge in plan.edges:
            together.setdefault((edge.owner, edge.kind, edge.rate), []).append(edge)
        self.tracks = [Track(tuple(edges)) for edges in together.values()]
        self._track_of = {edge.child: track for track in self.tracks for edge in track.edges}
        self._of_message: dict[tuple[str, ...], list[Track]] = {}
        self._waiting = {
            name: {e.child for e in plan.edges_of(name)} for name in {e.owner for e in plan.edges}
        }
        self._complete = False
        self._gone: set[str] = set()
        self._absent: set[str] = set()
        #: Reported silence or low rate that has not ended, by the edge's child.
        self._wrong: dict[str, WrongEdges] = {}
        self._watched = WatchedTime()

    @property
    def is_complete(self) -> bool:
        """Whether all planned edges have been live since an owner was last stopped on purpose."""
        return self._complete

    def follow(self, plan: Plan) -> None:
        """Follow a plan that differs only in lines of edges and in poses of fixed edges."""
        planned = {edge.child: edge for edge in plan.edges}
        for track in self.tracks:
            track.edges = tuple(planned[edge.child] for edge in track.edges)
        for reported in self._wrong.values():
            reported.edges = [planned[edge.child] for edge in reported.edges]

    def absent(self, owner: str) -> None:
        """Record that the owner was stopped on purpose.

        The owner's edges then count neither as live nor as missing.
        """
        self._absent.add(owner)
        self.changes += 1
        self._gone.discard(owner)
        self._complete = False
        tracks = [track for track in self.tracks if track.edge.owner == owner]
        self._waiting[owner] = {edge.child for track in tracks for edge in track.edges}
        for track in tracks:
            track.live = track.silent = track.slow = track.steady = False
            track.forget()
        self._note_over(_children(tracks))

    def present(self, owner: str) -> None:
        """Record that the owner was started. Its edges must arrive again."""
        self._absent.discard(owner)

    def memory(self) -> LivenessMemory:
        """Return the state for a new guard."""
        silent = tuple(
            SilentMemory(track.silent_since, _children([track]))
            for track in self.tracks
            if track.silent
        )
        live, slow = ([t for t in self.tracks if t.live], [t for t in self.tracks if t.slow])
        return LivenessMemory(_children(live), _children(slow), silent, tuple(sorted(self._gone)))

    def recall(self, memory: LivenessMemory, now: float, until: float) -> None:
        """Restore the previous guard's state. Report no silence before ``until``.

        The new guard has to discover all publishers again.
        """
        self._watched.begins_late(until)
        self._gone = set(memory.gone)
        for track in self._part_tracks(self._planned_children(memory.live)):
            track.live, track.last = True, now
            self._waiting[track.edge.owner].difference_update(edge.child for edge in track.edges)
        for track in self._part_tracks(self._planned_children(memory.slow)):
            track.slow = True
        for name in memory.silent:
            for track in self._part_tracks(self._planned_children(name.children)):
                track.silent, track.silent_since, track.last = True, name.since, name.since
                self._note_wrong(
                    WrongEdges(list(track.edges), partial(silent, silence_s=now - name.since))
                )
        self._complete = not any(self._waiting.values())

    def _planned_children(self, children: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(child for child in children if child in self._track_of)

    def note_arrivals(
        self, children: tuple[str, ...], now: float, delay_s: float | None = None
    ) -> list[GuardEvent]:
        """Record edges that owners sent in a message, and return the resulting events."""
        watched, late, events = self._watched.time_at(now), self._watched.is_behind(now), []
        for track in self._of_message.get(children) or self._part_tracks(children):
            if track.edge.owner in self._absent:
                continue
            track.note_arrival(watched, now, late=late)
            track.delay_s = delay_s
            if not track.live:
                track.live = True
                events += self._began(track)
        return events

    def _part_tracks(self, children: tuple[str, ...]) -> list[Track]:
        """Return the tracks of exactly these edges. Split tracks that contain other edges, too."""
        names = set(children)
        touched = {id(track): track for child in children for track in (self._track_of[child],)}
        tracks = []
        for track in touched.values():
            rest = tuple(edge for edge in track.edges if edge.child not in names)
            if rest:
                part = replace(track, edges=rest, arrivals=deepcopy(track.arrivals))
                self.tracks.append(part)
                self._track_of.update((edge.child, part) for edge in rest)
                track.edges = tuple(edge for edge in track.edges if edge.child in names)
                self._of_message.clear()
            tracks.append(track)
        if len(self._of_message) > MOST_MESSAGES:
            self._of_message.clear()
        self._of_message[children] = tracks
        return tracks

    def _began(self, track: Track) -> list[GuardEvent]:
        """Return the events that the edges of the track are live."""
        owner = track.edge.owner
        self.changes += 1
        children = tuple(edge.child for edge in track.edges)
        events: list[GuardEvent] = [
            Live(owner, children[start : start + MOST_NAMED])
            for start in range(0, len(children), MOST_NAMED)
        ]
        waiting = self._waiting[owner]
        waiting.difference_update(children)
        if not waiting:
            events.append(OwnerReady(owner))
        if not self._complete and not any(self._waiting.values()):
            self._complete = True
            events.append(TreeComplete(len(self._order)))
        return events

    def seconds_since(self, track: Track, now: float) -> tuple[float, float | None]:
        """Return the age of the last arrival in seconds, and the rate in Hz or None."""
        return now - track.last, track.rate() if track.silent_after is not None else None

    def silent(self) -> tuple[str, ...]:
        """Return the child frames of edges that were live and no longer arrive."""
        return _children(
            [
                track
                for track in self.tracks
                if track.live and (track.silent or self._is_gone(track))
            ]
        )

    def _is_gone(self, track: Track) -> bool:
        return track.edge.kind == "static" and track.edge.owner in self._gone

    def is_behind(self, now: float) -> bool:
        """Return whether messages that arrive now may be delayed."""
        return self._watched.is_behind(now)

    def note_lost_messages(self, now: float) -> None:
        """Record lost messages. Until they are sent again, no owner counts as silent."""
        self._watched.begins_late(now + CATCH_UP_S)

    def tick(self, now: float) -> None:
        """Record that the guard runs, without judging owners."""
        self._watched.tick(now)

    def judge(self, now: float, speed: float = 1.0, *, paused: bool = False) -> list[GuardEvent]:
        """Return an event for each owner that fell silent or slow, or recovered.

        Changes since the previous call count. ``speed`` is the real-time factor, because rates are
        lower in a slow simulation. In a ``paused`` simulation no owner falls silent.
        """
        watched = self._watched.tick(now)
        if paused:
            for track in self.tracks:
                track.heard = track.heard if track.silent else watched
        changed: dict[tuple[str, str], list[Track]] = {}
        for track in self.tracks:
            change = (
                _change(track, watched, speed)
                if track.live and track.silent_after is not None
                else None
            )
            if change:
                changed.setdefault((change, track.edge.owner), []).append(track)
        self.changes += len(changed)
        events: list[GuardEvent] = []
        for (change, _), tracks in changed.items():
            wrong = _wrong(change, self._in_order(tracks), now)
            if wrong is None:
                self._note_over(_children(tracks))
                events.append(_recovery_event(change, self._in_order(tracks), now))
            else:
                self._note_wrong(wrong)
                events.append(FindingShown(wrong.finding))
        return events

    def wrong(self) -> list[Finding]:
        """Return the open findings about silent and slow edges."""
        return [reported.finding for reported in dict.fromkeys(self._wrong.values())]

    def _note_wrong(self, reported: WrongEdges) -> None:
        self._wrong.update({edge.child: reported for edge in reported.edges})

    def _note_over(self, children: Iterable[str]) -> None:
        for child in children:
            self._wrong.pop(child, None)

    def _in_order(self, tracks: list[Track]) -> list[Track]:
        """Return the tracks in the order of their first edges in the plan."""
        return sorted(tracks, key=lambda track: self._order[track.edge.child])

    def partly_missing(self) -> dict[str, list[str]]:
        """Return names of missing fixed edges by node, if other fixed edges of the node came."""
        if not any(self._waiting.values()):
            return {}
        fixed = [
            t
            for t in self._in_order(self.tracks)
            if t.edge.kind == "static" and t.edge.owner not in self._absent
        ]
        heard = {track.edge.node for track in fixed if track.live}
        missing: dict[str, list[str]] = {}
        for track in fixed:
            if not track.live and track.edge.node in heard:
                missing.setdefault(track.edge.node, []).extend(edge.name for edge in track.edges)
        return missing

    def static_writers(self, nodes: Collection[str]) -> list[GuardEvent]:
        """Process the nodes that currently publish on /tf_static.

        An owner of live edges that has left counts as silent.
        """
        lost: dict[str, list[Track]] = {}
        events: list[GuardEvent] = []
        for track in self._in_order(self.tracks):
            if track.edge.kind == "static" and track.live:
                lost.setdefault(track.edge.owner, []).append(track)
        for owner, tracks in lost.items():
            edge = tracks[0].edge
            if edge.node not in nodes and owner not in self._gone:
                self._gone.add(owner)
                wrong = WrongEdges([edge for track in tracks for edge in track.edges], owner_left)
                self._note_wrong(wrong)
                events.append(FindingShown(wrong.finding))
            elif edge.node in nodes and owner in self._gone:
                self._gone.discard(owner)
                self._note_over(_children(tracks))
                events.append(RecoveredShown(f"{owner} ({edge.node}) is back"))
        self.changes += len(events)
        return events


def _wrong(change: str, tracks: list[Track], now: float) -> WrongEdges | None:
    """Return the finding for tracks that fell silent or slow, None if they recovered."""
    edges = [edge for track in tracks for edge in track.edges]
    match change:
        case "silent":
            silence_s = max(now - track.last for track in tracks)
            return WrongEdges(edges, partial(silent, silence_s=silence_s))
        case "slow":
            return WrongEdges(edges, partial(slow, rate=_rate(tracks)))
        case _:
            return None


def _recovery_event(change: str, tracks: list[Track], now: float) -> RecoveredShown:
    """Return the event for tracks that arrive again, or arrive at their rate again."""
    edges = [edge for track in tracks for edge in track.edges]
    named, are = list_names([edge.name for edge in edges]), "is" if len(edges) == 1 else "are"
    if change == "back":
        silence_s = now - min(track.silent_since for track in tracks)
        return RecoveredShown(f"{named} {are} back after {silence_s:.1f} s")
    return RecoveredShown(f"{named} {are} sent at {_rate(tracks):.3g} Hz again")


def _rate(tracks: list[Track]) -> float:
    return min(track.rate() or 0.0 for track in tracks)


def _children(tracks: list[Track]) -> tuple[str, ...]:
    return tuple(edge.child for track in tracks for edge in track.edges)


def _change(track: Track, watched: float, speed: float) -> str | None:
    """Update the track and return its change."""
    after = track.silent_after or 0.0
    is_silent = watched - track.heard > after
    if is_silent and not track.silent:
        track.silent, track.silent_since, track.steady = True, track.last, False
        track.forget()
        return "silent"
    if track.silent and track.steady and not is_silent:
        track.silent = track.slow = False
        track.forget()
        return "back"
    rate = track.rate()
    if rate is None:
        return None
    is_slow = track.edge.is_slow(rate, speed, was_slow=track.slow)
    if is_slow == track.slow or (track.slow and track.silent):
        return None
    track.slow = is_slow
    return "slow" if is_slow else "fast"
