"""Rows of the frame tree in the view, with closed and hidden subtrees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.foundation.tree import below, children_of, loop_closed_by, way_up

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.model.robot import Robot

#: The indentation of each level in em, and the deepest level that is indented further.
_INDENT_EM, _DEEPEST = 0.85, 14
#: The maximum number of rows that are open at first. Levels are opened completely, and at least
#: two levels are open.
_OPEN_ROWS = 40


@dataclass(frozen=True, slots=True)
class Row:
    """A row of the tree."""

    frame: str
    #: The depth of the frame; 0 for the root.
    depth: int
    #: Whether the frame's children have rows; None if it has no children.
    is_open: bool | None

    @property
    def style(self) -> str:
        """The indentation of the row as a CSS style."""
        return f"padding-left: {min(self.depth, _DEEPEST) * _INDENT_EM:.2f}em"


class FrameTree:
    """The frames of a robot as a tree.

    A frame with several parents is below its first parent. Loops are cut.
    """

    def __init__(self, robot: Robot) -> None:
        self._parents: dict[str, str] = {}
        for edge in robot.edges:
            is_known = (
                edge.parent in robot.frames
                and edge.child in robot.frames
                and edge.child not in self._parents
            )
            if is_known and not loop_closed_by((edge.parent, edge.child), self._parents.get):
                self._parents[edge.child] = edge.parent
        self._children = children_of((parent, child) for child, parent in self._parents.items())
        self._depths: dict[str, int] = {}
        waiting = [(frame, 0) for frame in reversed(robot.frames) if frame not in self._parents]
        while waiting:
            frame, depth = waiting.pop()
            self._depths[frame] = depth
            waiting += [(child, depth + 1) for child in reversed(self._children.get(frame, ()))]
        self.frames = tuple(self._depths)
        levels = list(self._depths.values())
        self._open_levels = 1
        while (
            levels.count(self._open_levels + 1)
            and sum(level <= self._open_levels + 1 for level in levels) <= _OPEN_ROWS
        ):
            self._open_levels += 1

    def parent(self, frame: str) -> str | None:
        """Return the frame's parent in the tree; None for a root."""
        return self._parents.get(frame)

    def is_open(self, frame: str, chosen: Mapping[str, bool]) -> bool:
        """Return whether the children of a frame have rows.

        The user's choice counts first, then the level of the frame.
        """
        return chosen.get(frame, self._depths[frame] < self._open_levels)

    def open_to(self, frame: str) -> dict[str, bool]:
        """Return the choices that open all frames above a frame, so that it has a row."""
        return dict.fromkeys(way_up(frame, self._parents.get)[1:], True)

    def matches(self, search: str) -> set[str]:
        """Return the frames whose names contain each word of the search, in any case."""
        terms = search.lower().split()
        return {frame for frame in self.frames if all(term in frame.lower() for term in terms)}

    def rows(self, chosen: Mapping[str, bool], search: str = "") -> Iterator[Row]:
        """Yield the rows from top to bottom.

        Without a search, these are the rows below open frames. During a search, these are the
        matches and all frames above them.
        """
        searches = bool(search.strip())
        matches = self.matches(search)
        visible = (
            {above for frame in matches for above in way_up(frame, self._parents.get)}
            if searches
            else matches
        )
        closed_below = -1
        for frame, depth in self._depths.items():
            if frame not in visible or 0 <= closed_below < depth:
                continue
            is_open = searches or self.is_open(frame, chosen)
            closed_below = -1 if is_open else depth
            has_more = any(child in visible for child in self._children.get(frame, ()))
            yield Row(frame, depth, is_open if has_more else None)

    def hidden_frames(self, chosen: Mapping[str, bool]) -> set[str]:
        """Return the hidden frames.

        A frame is hidden if the user hid it. If the user made no choice for a frame, the choice
        for its nearest ancestor counts.
        """
        is_shown: dict[str, bool] = {}
        for frame in self._depths:  # parents come first
            is_shown[frame] = chosen.get(frame, is_shown.get(self._parents.get(frame, ""), True))
        return {frame for frame, is_visible in is_shown.items() if not is_visible}

    def show(self, frame: str, chosen: Mapping[str, bool], *, is_visible: bool) -> dict[str, bool]:
        """Return the choices that show or hide a frame with all frames below it."""
        descendants = below(self._children, frame)
        rest = {name: value for name, value in chosen.items() if name not in descendants}
        is_so_above = (frame in self.hidden_frames(rest)) != is_visible
        return rest if is_so_above else {**rest, frame: is_visible}
