"""What the guard says of owners that fall silent or slow, and come back."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, Note, finding
from tfcompose.run.events import Found, GuardEvent, Recovered

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.plan import PlanEdge
    from tfcompose.run.liveness import Track

NAMED_AT_MOST = 6


def change_event(change: str, tracks: list[Track], seen: float, now: float) -> GuardEvent:
    """Return the event for tracks that fell silent or slow, or came back: ``change`` says which."""
    verb = "is" if sum(len(track.edges) for track in tracks) == 1 else "are"
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
    every = [edge.name for track in tracks for edge in track.edges]
    names = every[:NAMED_AT_MOST]
    more = len(every) - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "")


def _silent(tracks: list[Track], now: float) -> Diagnostic:
    edge = tracks[0].edge
    quiet = max(now - track.last for track in tracks)
    message = f"{edge.owner} ({edge.node}) fell silent: nothing on {_named(tracks)} for {quiet:.1f} s"
    notes = [Note(f"declared at {edge.rate:g} Hz in {edge.source[0]}:{edge.source[1]}")] if edge.rate else []
    return finding("TF804", message, None, notes=notes, help=f"is {edge.node} still running, and does it get its data?")


def left(edge: PlanEdge, tracks: list[Track]) -> Diagnostic:
    """Return the finding for a static owner that has left."""
    message = f"{edge.owner} ({edge.node}) is gone: nobody latches {_named(tracks)} any more"
    advice = "listeners that are there keep these frames; those that join later do not get them"
    return finding("TF804", message, None, help=advice)


def _slow(tracks: list[Track], seen: float) -> Diagnostic:
    edge = tracks[0].edge
    rate = min(track.rate(seen) or 0.0 for track in tracks)
    verb = "comes" if sum(len(track.edges) for track in tracks) == 1 else "come"
    message = f"{_named(tracks)} {verb} at {rate:.3g} Hz from {edge.owner} ({edge.node})"
    message += f", declared are {edge.rate or 0.0:g} Hz"
    notes = [Note(f"declared in {edge.source[0]}:{edge.source[1]}")]
    return finding("TF805", message, None, severity="warning", notes=notes)
