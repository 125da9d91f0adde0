"""Whether owners send what they own, often enough: a history of arrivals for each edge, judged at given times.

Times are monotonic seconds. What is measured is the time in which the guard looked: a guard that was kept from looking
knows nothing of the time between, and blames nobody for it.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, Note, finding
from tfcompose.run.events import Complete, Found, GuardEvent, Live, OwnerReady, Recovered

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from tfcompose.plan import Plan, PlanEdge

#: An edge is silent after four periods, and never before this: what a loaded machine can delay.
SILENT_AT_LEAST_S = 0.6
SILENT_PERIODS = 4.0
#: A rate is judged over this time, or so many periods, and is too slow below this part of what is declared.
WINDOW_S = 2.0
WINDOW_PERIODS = 8.0
SLOW_BELOW = 0.8
FAST_AGAIN_ABOVE = 0.9
#: What is kept of the arrivals before the window: a rate needs two gaps, the longer of which may be a hiccup.
FEWEST_ARRIVALS = 4
#: Of the time between two looks only so much counts; the guard looks ten times a second.
LOOK_COUNTS_S = 0.25
#: After so long without a look messages are lost, and come when the writer's next heartbeat does: 3 s in Fast DDS.
STALLED_S = 1.0
CATCH_UP_S = 3.5
NAMED_AT_MOST = 6


@dataclass(slots=True)
class Watched:
    """The seconds in which the guard looked, as a clock that stands while it is kept from looking."""

    _seconds: float = 0.0
    _looked: float | None = None
    _catching_up_until: float = 0.0

    def at(self, now: float) -> float:
        """Return the seconds until ``now``."""
        if self._looked is None or now < self._catching_up_until:
            return self._seconds
        return self._seconds + min(max(now - self._looked, 0.0), LOOK_COUNTS_S)

    def look(self, now: float) -> float:
        """Note that the guard looks now, and return the seconds until then."""
        if self._looked is not None and now - self._looked > STALLED_S:
            self._catching_up_until = now + CATCH_UP_S
        self._seconds, self._looked = self.at(now), now
        return self._seconds


@dataclass(slots=True)
class Track:
    """What is known of one planned edge. ``arrivals`` and ``heard`` are watched seconds, ``last`` is monotonic."""

    edge: PlanEdge
    live: bool = False
    last: float = 0.0
    heard: float = 0.0
    silent: bool = False
    silent_since: float = 0.0
    steady: bool = False
    slow: bool = False
    arrivals: deque[float] = field(default_factory=deque)

    @property
    def silent_after(self) -> float | None:
        """How long this edge may be quiet, or None if it says no rate."""
        if self.edge.kind == "static" or not self.edge.rate:
            return None
        return max(SILENT_AT_LEAST_S, SILENT_PERIODS / self.edge.rate)

    def arrived(self, seen: float, now: float) -> None:
        """Note an arrival. An edge that was silent is steady again with two arrivals close enough to each other."""
        after = self.silent_after
        self.steady = after is not None and self.live and seen - self.heard <= after
        self.last, self.heard = now, seen
        if after is not None:
            self.arrivals.append(seen)
            self._forget(seen)

    def rate(self, seen: float) -> float | None:
        """Return the rate over the window in hertz, without its longest gap; None while there is too little to say."""
        self._forget(seen)
        times = self.arrivals
        if len(times) < 3 or times[-1] - times[0] < self._window / 2:  # noqa: PLR2004 (two gaps need three arrivals)
            return None
        longest = max(b - a for a, b in pairwise(times))
        rest = times[-1] - times[0] - longest
        return (len(times) - 2) / rest if rest > 0 else None

    @property
    def _window(self) -> float:
        return max(WINDOW_S, WINDOW_PERIODS / (self.edge.rate or WINDOW_PERIODS))

    def _forget(self, seen: float) -> None:
        while len(self.arrivals) > FEWEST_ARRIVALS and seen - self.arrivals[0] > self._window:
            self.arrivals.popleft()


class Liveness:
    """The planned edges and their owners."""

    def __init__(self, plan: Plan) -> None:
        self.tracks = {edge.child: Track(edge) for edge in plan.edges}
        self._rated = [track for track in self.tracks.values() if track.silent_after is not None]
        self._waiting = {name: {e.child for e in plan.edges_of(name)} for name in {e.owner for e in plan.edges}}
        self._complete = False
        self._gone: set[str] = set()
        self._watched = Watched()

    def arrived(self, child: str, now: float) -> list[GuardEvent]:
        """Note that the owner sent the edge, and return what that means."""
        track = self.tracks[child]
        track.arrived(self._watched.at(now), now)
        if track.live:
            return []
        track.live = True
        edge = track.edge
        events: list[GuardEvent] = [Live(edge.parent, edge.child, edge.owner, edge.node)]
        waiting = self._waiting[edge.owner]
        waiting.discard(child)
        if not waiting:
            events.append(OwnerReady(edge.owner))
        if not self._complete and not any(self._waiting.values()):
            self._complete = True
            events.append(Complete(len(self.tracks)))
        return events

    def look(self, now: float) -> None:
        """Note that the guard looks, and judge nobody."""
        self._watched.look(now)

    def judge(self, now: float) -> list[GuardEvent]:
        """Return which owners fell silent or slow since the last time, and came back: one event for each owner."""
        seen = self._watched.look(now)
        changed: dict[tuple[str, str], list[Track]] = {}
        for track in self._rated:
            change = _change(track, seen) if track.live else None
            if change:
                changed.setdefault((change, track.edge.owner), []).append(track)
        return [_event(change, tracks, seen, now) for (change, _), tracks in changed.items()]

    def static_writers(self, nodes: Collection[str]) -> list[GuardEvent]:
        """Take the nodes that write /tf_static now; an owner whose edges were live and that is gone is silent."""
        lost: dict[str, list[Track]] = {}
        events: list[GuardEvent] = []
        for track in self.tracks.values():
            if track.edge.kind == "static" and track.live:
                lost.setdefault(track.edge.owner, []).append(track)
        for owner, tracks in lost.items():
            edge = tracks[0].edge
            if edge.node not in nodes and owner not in self._gone:
                self._gone.add(owner)
                events.append(Found(_left(edge, tracks)))
            elif edge.node in nodes and owner in self._gone:
                self._gone.discard(owner)
                events.append(Recovered(f"{owner} ({edge.node}) is back"))
        return events


def _change(track: Track, seen: float) -> str | None:
    """Bring the track up to date and return what changed."""
    after = track.silent_after or 0.0
    quiet = seen - track.heard > after
    if quiet and not track.silent:
        track.silent, track.silent_since, track.steady = True, track.last, False
        track.arrivals.clear()
        return "silent"
    if track.silent and track.steady and not quiet:
        track.silent = track.slow = False
        track.arrivals.clear()
        return "back"
    rate, wanted = track.rate(seen), track.edge.rate or 0.0
    if rate is None:
        return None
    if not track.slow and rate < SLOW_BELOW * wanted:
        track.slow = True
        return "slow"
    if track.slow and not track.silent and rate > FAST_AGAIN_ABOVE * wanted:
        track.slow = False
        return "fast"
    return None


def _event(change: str, tracks: list[Track], seen: float, now: float) -> GuardEvent:
    verb = "is" if len(tracks) == 1 else "are"
    match change:
        case "silent":
            return Found(_silent(tracks, now))
        case "slow":
            return Found(_slow(tracks, seen))
        case "back":
            quiet = now - min(track.silent_since for track in tracks)
            return Recovered(f"{_named(tracks)} {verb} back after {quiet:.1f} s")
        case _:
            rate = min(track.rate(seen) or 0.0 for track in tracks)
            return Recovered(f"{_named(tracks)} {verb} sent at {rate:.3g} Hz again")


def _named(tracks: Sequence[Track]) -> str:
    """Return the edges by name, the first few of them if they are many."""
    names = [track.edge.name for track in tracks[:NAMED_AT_MOST]]
    more = len(tracks) - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "")


def _silent(tracks: list[Track], now: float) -> Diagnostic:
    edge = tracks[0].edge
    quiet = max(now - track.last for track in tracks)
    message = f"{edge.owner} ({edge.node}) fell silent: nothing on {_named(tracks)} for {quiet:.1f} s"
    notes = [Note(f"declared at {edge.rate:g} Hz in {edge.source[0]}:{edge.source[1]}")] if edge.rate else []
    return finding("TF804", message, None, notes=notes, help=f"is {edge.node} still running, and does it get its data?")


def _left(edge: PlanEdge, tracks: list[Track]) -> Diagnostic:
    message = f"{edge.owner} ({edge.node}) is gone: nobody latches {_named(tracks)} any more"
    advice = "listeners that are there keep these frames; those that join later do not get them"
    return finding("TF804", message, None, help=advice)


def _slow(tracks: list[Track], seen: float) -> Diagnostic:
    edge = tracks[0].edge
    rate = min(track.rate(seen) or 0.0 for track in tracks)
    verb = "comes" if len(tracks) == 1 else "come"
    message = f"{_named(tracks)} {verb} at {rate:.3g} Hz from {edge.owner} ({edge.node})"
    message += f", declared are {edge.rate or 0.0:g} Hz"
    notes = [Note(f"declared in {edge.source[0]}:{edge.source[1]}")]
    return finding("TF805", message, None, severity="warning", notes=notes)
