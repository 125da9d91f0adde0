"""Where each frame stands: a tree from left to right, a row for each leaf, a parent in the middle of its children.

The rows of two subtrees that do not hold one another are apart, and a child begins where its parent has ended: so no
two boxes can overlap. The cost grows with the number of frames.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.draw.areas import PAD, Area, Place, areas_of
from tfcompose.draw.letters import shown, width_of
from tfcompose.draw.style import STYLES

if TYPE_CHECKING:
    from tfcompose.draw.graph import Forest, Graph

NAME_SIZE, MORE_SIZE = STYLES["name"].size, STYLES["more"].size
BOX_HEIGHT, POSE_HEIGHT = 24.0, 14.0
ROW_GAP = 8.0
BADGE_WIDTH = 18.0
BETWEEN = 8.0  # between a name and what stands beside it
LABEL_STRIP = 16.0
TREE_GAP = 10.0
NEAREST, FARTHEST, STEEPNESS = 28.0, 100.0, 0.08  # from a parent to its children: the wider the fan, the farther


@dataclass(frozen=True, slots=True)
class Layout:
    """All places, the groups' areas (outer ones first), and the size of it all."""

    places: dict[str, Place]
    areas: tuple[Area, ...]
    width: float
    height: float


def layout(graph: Graph, forest: Forest) -> Layout:
    """Return where everything stands, from (0, 0)."""
    places = {frame: _box(forest, frame) for frame in forest.order}
    bands, height = _rows(forest, places)
    _columns(forest, places)
    areas, width = areas_of(graph, forest, places, bands)
    return Layout(places, areas, width, height)


def _box(forest: Forest, frame: str) -> Place:
    arrow = forest.up.get(frame)
    width = width_of(shown(frame), NAME_SIZE) + 2 * PAD
    if arrow is None:
        return Place(0.0, 0.0, width, BOX_HEIGHT)
    if arrow.beside:
        width += BETWEEN + width_of(shown(arrow.beside), MORE_SIZE)
    if not arrow.below:
        return Place(0.0, 0.0, width + BADGE_WIDTH, BOX_HEIGHT)
    width = max(width, width_of(shown(arrow.below), MORE_SIZE) + 2 * PAD)
    return Place(0.0, 0.0, width + BADGE_WIDTH, BOX_HEIGHT + POSE_HEIGHT)


def _rows(forest: Forest, places: dict[str, Place]) -> tuple[dict[str, tuple[float, float]], float]:
    """Give each frame its y; return the top and bottom of each group, by the frame where it begins, and the height."""
    bands: dict[str, tuple[float, float]] = {}
    row = max((place.height for place in places.values()), default=0.0)
    y = 0.0
    waiting = [(frame, False) for frame in reversed(forest.order) if frame not in forest.up]
    while waiting:
        frame, done = waiting.pop()
        if done:
            place, children = places[frame], forest.children[frame]
            place.y = round((places[children[0]].y + places[children[-1]].y) / 2) if children else y + row / 2
            y += 0.0 if children else row + ROW_GAP
            if frame in bands:
                bands[frame] = (bands[frame][0], y - ROW_GAP + PAD)
                y += PAD
            continue
        if frame not in forest.up and y:
            y += TREE_GAP
        if forest.enters(frame):
            bands[frame] = (y, y)
            y += LABEL_STRIP + PAD / 2
        waiting.append((frame, True))
        waiting += [(child, False) for child in reversed(forest.children[frame])]
    return bands, max(0.0, y - ROW_GAP)


def _columns(forest: Forest, places: dict[str, Place]) -> None:
    for frame in forest.order:
        place, children = places[frame], forest.children[frame]
        if frame not in forest.up and forest.enters(frame):
            place.x = PAD
        if not children:
            continue
        span = places[children[-1]].y - places[children[0]].y
        gap: float = round(min(FARTHEST, NEAREST + STEEPNESS * span))
        gap += PAD if any(forest.enters(child) for child in children) else 0.0
        for child in children:
            places[child].x = round(place.right) + gap
