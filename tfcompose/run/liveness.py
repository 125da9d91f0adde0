"""Whether owners send what they own, often enough: a history of arrivals for each edge, judged at given times.

Times are monotonic seconds.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, Note, finding
from tfcompose.run.events import Complete, Found, GuardEvent, Live, OwnerReady, Recovered

if TYPE_CHECKING:
    from collections.abc import Collection

    from tfcompose.plan import Plan, PlanEdge

#: An edge is silent after four periods, and never before this: what a loaded machine can delay.
SILENT_AT_LEAST_S = 0.6
SILENT_PERIODS = 4.0
#: A rate is judged over this time, and is too slow below this part of what is declared.
WINDOW_S = 2.0
SLOW_BELOW = 0.8
FAST_AGAIN_ABOVE = 0.9
MOST_ARRIVALS = 256
NAMED_AT_MOST = 6


@dataclass(slots=True)
class Track:
    """What is known of one planned edge."""

    edge: PlanEdge
    live: bool = False
    last: float = 0.0
    silent: bool = False
    slow: bool = False
    arrivals: deque[float] = field(default_factory=lambda: deque(maxlen=MOST_ARRIVALS))

    @property
    def silent_after(self) -> float | None:
        """How long this edge may be quiet, or None if it says no rate."""
        if self.edge.kind == "static" or not self.edge.rate:
            return None
        return max(SILENT_AT_LEAST_S, SILENT_PERIODS / self.edge.rate)

    def rate(self, now: float) -> float | None:
        """Return the rate over the window in hertz, or None while there is too little to say."""
        recent = [at for at in self.arrivals if now - at <= WINDOW_S]
        if len(recent) < 2 or recent[-1] - recent[0] < WINDOW_S / 2:  # noqa: PLR2004 (a rate needs two arrivals)
            return None
        return (len(recent) - 1) / (recent[-1] - recent[0])


class Liveness:
    """The planned edges and their owners."""

    def __init__(self, plan: Plan) -> None:
        self.tracks = {edge.child: Track(edge) for edge in plan.edges}
        self._waiting = {name: {e.child for e in plan.edges_of(name)} for name in {e.owner for e in plan.edges}}
        self._complete = False
        self._gone: set[str] = set()

    def arrived(self, child: str, now: float) -> list[GuardEvent]:
        """Note that the owner sent the edge, and return what that means."""
        track = self.tracks[child]
        events: list[GuardEvent] = []
        if track.silent:
            track.silent = False
            track.arrivals.clear()
            events.append(Recovered(f"{track.edge.name} is back after {now - track.last:.1f} s"))
        track.last = now
        track.arrivals.append(now)
        if track.live:
            return events
        track.live = True
        edge = track.edge
        events.append(Live(edge.parent, edge.child, edge.owner, edge.node))
        waiting = self._waiting[edge.owner]
        waiting.discard(child)
        if not waiting:
            events.append(OwnerReady(edge.owner))
        if not self._complete and not any(self._waiting.values()):
            self._complete = True
            events.append(Complete(len(self.tracks)))
        return events

    def judge(self, now: float) -> list[GuardEvent]:
        """Return which owners fell silent or slow since the last time, one finding for each owner."""
        silent: dict[str, list[Track]] = {}
        events: list[GuardEvent] = []
        for track in self.tracks.values():
            after = track.silent_after
            if not track.live or after is None or track.silent:
                continue
            if now - track.last > after:
                track.silent = True
                silent.setdefault(track.edge.owner, []).append(track)
            else:
                events += self._judge_rate(track, now)
        return [*(Found(_silent(owner, tracks, now)) for owner, tracks in silent.items()), *events]

    def _judge_rate(self, track: Track, now: float) -> list[GuardEvent]:
        rate, wanted = track.rate(now), track.edge.rate
        if rate is None or wanted is None:
            return []
        if not track.slow and rate < SLOW_BELOW * wanted:
            track.slow = True
            return [Found(_slow(track.edge, rate, wanted))]
        if track.slow and rate > FAST_AGAIN_ABOVE * wanted:
            track.slow = False
            return [Recovered(f"{track.edge.name} comes at {rate:.3g} Hz again")]
        return []

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


def named(tracks: list[Track]) -> str:
    """Return the edges by name, the first few of them if they are many."""
    names = [track.edge.name for track in tracks[:NAMED_AT_MOST]]
    more = len(tracks) - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "")


def _silent(owner: str, tracks: list[Track], now: float) -> Diagnostic:
    edge = tracks[0].edge
    quiet = max(now - track.last for track in tracks)
    message = f"{owner} ({edge.node}) fell silent: nothing on {named(tracks)} for {quiet:.1f} s"
    notes = [Note(f"declared at {edge.rate:g} Hz in {edge.source[0]}:{edge.source[1]}")] if edge.rate else []
    return finding("TF804", message, None, notes=notes, help=f"is {edge.node} still running, and does it get its data?")


def _left(edge: PlanEdge, tracks: list[Track]) -> Diagnostic:
    message = f"{edge.owner} ({edge.node}) is gone: nobody latches {named(tracks)} any more"
    advice = "listeners that are there keep these frames; those that join later do not get them"
    return finding("TF804", message, None, help=advice)


def _slow(edge: PlanEdge, rate: float, wanted: float) -> Diagnostic:
    message = f"{edge.name} comes at {rate:.3g} Hz from {edge.owner} ({edge.node}), declared are {wanted:g} Hz"
    notes = [Note(f"declared in {edge.source[0]}:{edge.source[1]}")]
    return finding("TF805", message, None, severity="warning", notes=notes)
