"""The way between two frames: up from each to where they meet, as tf2's ``BufferCore::walkToTopParent`` goes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.observe import reasons
from tfcompose.observe.exceptions import ConnectivityException, ExtrapolationException, LookupException

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Mapping

    from tfcompose.observe.history import History

#: The edges from the target up to where the two ways meet, and those from the source.
Ways = tuple[list["History"], list["History"]]


def newest_ways(histories: Mapping[str, History], target: str, source: str) -> Ways:
    """Return the ways by each frame's newest parent.

    Raises:
        LookupException: if the frames above one lead back to it.
        ConnectivityException: if the frames are in two trees.
    """

    def parent_of(history: History) -> str:
        return history.parent

    down, top = _climb(histories, source, {target}, parent_of)
    if top == target:
        return [], down
    on_the_way = [source, *(history.parent for history in down)]
    up, meeting = _climb(histories, target, set(on_the_way), parent_of)
    if meeting not in on_the_way:
        raise ConnectivityException(reasons.two_trees(histories, target, source, meeting, top))
    return up, down[: on_the_way.index(meeting)]


def ways_at(histories: Mapping[str, History], target: str, source: str, stamp_ns: int) -> Ways:
    """Return the ways by each frame's parent at that time.

    Where an edge has no pose at that time and there may be a way behind it, that is what is raised, as in tf2.

    Raises:
        LookupException: if the frames above one lead back to it.
        ConnectivityException: if the frames are in two trees.
        ExtrapolationException: if an edge between them has no pose at that time.
    """

    def parent_at(history: History) -> str:
        return history.parent_at(stamp_ns)

    down, top = _climb(histories, source, {target}, parent_at)
    if top == target:
        return [], down
    on_the_way = [source, *(parent_at(history) for history in down)]
    up, meeting = _climb(histories, target, set(on_the_way), parent_at)
    if meeting in on_the_way:
        return up, down[: on_the_way.index(meeting)]
    for end in (meeting, top):
        if end in histories:
            raise ExtrapolationException(reasons.outside(histories[end], stamp_ns))
    raise ConnectivityException(reasons.two_trees(histories, target, source, meeting, top))


def _climb(
    histories: Mapping[str, History], frame: str, goal: Container[str], parent_of: Callable[[History], str]
) -> tuple[list[History], str]:
    """Return the edges from ``frame`` up to one of the goal, or else as far as there are parents; and that frame."""
    way: list[History] = []
    seen = {frame}
    while frame not in goal:
        history = histories.get(frame)
        parent = parent_of(history) if history else ""
        if not history or not parent:
            break
        way.append(history)
        frame = parent
        if frame in seen and frame not in goal:
            raise LookupException(reasons.loop(frame, [each.child for each in way]))
        seen.add(frame)
    return way, frame
