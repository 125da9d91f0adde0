"""The sentences that say why there is no pose of one frame in another."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import nearest

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from tfcompose.observe.history import History


class UnknownFrame:
    """That there is no such frame, with the nearest name that there is.

    It is worked out when it is read: among thousands of names that takes longer than all lookups of a second, and who
    waits for a frame asks for it with every message.
    """

    __slots__ = ("_frame", "_known")

    def __init__(self, frame: str, known: Collection[str]) -> None:
        self._frame = frame
        self._known = tuple(known)

    def __str__(self) -> str:
        near = nearest(self._frame, sorted(self._known))
        return f"no frame {self._frame}; did you mean {near}?" if near else self._among()

    def __repr__(self) -> str:
        return repr(str(self))

    def _among(self) -> str:
        return f"no frame {self._frame} among {len(self._known)} frames"


def unusable_name(frame: str) -> str:
    """Return why tf2 takes no such name in a question."""
    if not frame:
        return "a frame's name is empty"
    return f"no frame's name starts with a slash in tf2: {frame} is known as {frame[1:]}"


def two_trees(histories: Mapping[str, History], a: str, b: str, top_a: str, top_b: str) -> str:
    """Return which trees the two frames are in."""
    cleared = [top for top in (top_a, top_b) if top in histories]
    if cleared:
        return f"{a} and {b} are not connected: {cleared[0]} has had no parent since the buffer was cleared"
    return (
        f"{a} and {b} are in two trees: one begins at {top_a}, the other at {top_b}; no edge joins them, "
        f"such as {top_a} → {top_b}"
    )


def loop(frame: str, children: Sequence[str]) -> str:
    """Return the loop that begins and ends at ``frame``; ``children`` are the frames on the way up."""
    around = children[children.index(frame) :]
    return f"the live tree has a loop: {' → '.join([frame, *reversed(around)])}"


def outside(history: History, stamp_ns: int) -> str:
    """Return how far the time is from the edge's samples."""
    if not len(history):
        return f"{history.child} has had no parent since the buffer was cleared"
    edge = f"{history.parent} → {history.child}"
    if len(history) == 1:
        only = history.newest_ns
        away = f"{_ms(abs(only - stamp_ns))} {'later' if only > stamp_ns else 'earlier'}"
        return f"{edge} at {seconds(stamp_ns)} would be extrapolation: its one sample is {away}, of {seconds(only)}"
    if stamp_ns > history.newest_ns:
        late = _ms(stamp_ns - history.newest_ns)
        return (
            f"{edge} at {seconds(stamp_ns)} would be extrapolation into the future: "
            f"its newest sample is {late} earlier, of {seconds(history.newest_ns)}"
        )
    early = _ms(history.oldest_ns - stamp_ns)
    return (
        f"{edge} at {seconds(stamp_ns)} would be extrapolation into the past: "
        f"its oldest sample is {early} later, of {seconds(history.oldest_ns)}"
    )


def no_common_time(moving: Sequence[History]) -> str:
    """Return which edge has nothing at the newest time of the edge that is behind."""
    behind = min(moving, key=lambda history: history.newest_ns)
    ahead = max(moving, key=lambda history: history.oldest_ns)
    gap = _ms(ahead.oldest_ns - behind.newest_ns)
    return (
        f"{ahead.parent} → {ahead.child} begins {gap} after the last of {behind.parent} → {behind.child}: "
        "they have no time in common (extrapolation into the past)"
    )


def seconds(stamp_ns: int) -> str:
    """Return a time in seconds with all nine decimals."""
    sign = "-" if stamp_ns < 0 else ""
    whole, rest = divmod(abs(stamp_ns), 1_000_000_000)
    return f"{sign}{whole}.{rest:09d} s"


def _ms(nanoseconds: int) -> str:
    return f"{nanoseconds / 1e6:.6g} ms" if nanoseconds < 10**9 else f"{nanoseconds / 1e6:.0f} ms"
