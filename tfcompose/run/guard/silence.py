"""What the guard says of owners that fall silent or slow, and come back."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.ipc import Found, GuardEvent, Recovered
from tfcompose.verdict.timing import named, silent, slow

if TYPE_CHECKING:
    from tfcompose.run.guard.track import Track


def change_event(change: str, tracks: list[Track], seen: float, now: float) -> GuardEvent:
    """Return the event for tracks that fell silent or slow, or came back: ``change`` says which."""
    edges = [edge for track in tracks for edge in track.edges]
    verb = "is" if len(edges) == 1 else "are"
    match change:
        case "silent":
            return Found(silent(edges, max(now - track.last for track in tracks)))
        case "slow":
            return Found(slow(edges, min(track.rate(seen) or 0.0 for track in tracks)))
        case "back":
            quiet = now - min(track.silent_since for track in tracks)
            return Recovered(f"{named(edges)} {verb} back after {quiet:.1f} s")
        case _:
            rate = min(track.rate(seen) or 0.0 for track in tracks)
            return Recovered(f"{named(edges)} {verb} sent at {rate:.3g} Hz again")
