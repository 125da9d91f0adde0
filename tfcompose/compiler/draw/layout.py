"""Positions of frames.

Drawn to the right, each leaf has its own row, and each parent is level with the middle of its
children. Drawn down, each frame has its own row, below its parent and a little to the right, so
that a long chain such as an arm fits on a page. Separate subtrees share no rows. A child begins to
the right of its parent, or below it. Therefore no two boxes overlap. The cost grows linearly with
the number of frames. A group's rectangle surrounds the group's frames and any descendants between
them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.compiler.draw.style import STYLES, shorten_label, width_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.compiler.draw.graph import Forest, Graph

NAME_SIZE, MORE_SIZE, LABEL_SIZE = STYLES["name"].size, STYLES["more"].size, STYLES["label"].size
BOX_HEIGHT, POSE_HEIGHT = 24.0, 14.0
ROW_GAP = 8.0
BADGE_WIDTH = 18.0
BETWEEN = 8.0  # between a name and its detail
LABEL_STRIP = 16.0
TREE_GAP = 10.0
NEAREST, FARTHEST, STEEPNESS = (
    28.0,
    100.0,
    0.08,
)  # from a parent to its children; larger if they spread far
INDENT = 28.0  # drawn down: from a parent's left edge to its children's left edge
PAD = 8.0  # between a text and its box, and between a group and its frames


@dataclass(slots=True)
class FrameBox:
    """A frame's box: left edge, vertical middle, width and height.

    In px from the picture's top left corner.
    """

    x: float
    y: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """The box's right edge."""
        return self.x + self.width

    @property
    def bottom(self) -> float:
        """The box's lower edge."""
        return self.y + self.height / 2


@dataclass(frozen=True, slots=True)
class Area:
    """The rectangle of a group, with a strip for the label at the top."""

    #: The first frame of the group.
    frame: str
    x: float
    top: float
    right: float
    bottom: float


@dataclass(frozen=True, slots=True)
class Trunk:
    """The line from a frame to its children in columns."""

    frame: str
    #: The y of the horizontal line above the children.
    y: float
    #: The x of the vertical line to each child, by child.
    lines: dict[str, float]


@dataclass(frozen=True, slots=True)
class Layout:
    """All positions, the groups' areas (outer groups first), the total size, and the direction."""

    places: dict[str, FrameBox]
    areas: tuple[Area, ...]
    width: float
    height: float
    is_down: bool = False
    trunk: Trunk | None = None


def layout(graph: Graph, forest: Forest, *, is_down: bool) -> Layout:
    """Return all positions, drawn down or to the right, with the top left corner at (0, 0)."""
    places = {frame: _box(forest, frame) for frame in forest.order}
    bands, height = _rows(forest, places, is_down=is_down)
    (_indent if is_down else _columns)(forest, places)
    areas, width = _areas(graph, forest, places, bands)
    return Layout(places, areas, width, height, is_down)


def _box(forest: Forest, frame: str) -> FrameBox:
    arrow = forest.up.get(frame)
    width = width_of(shorten_label(frame), NAME_SIZE) + 2 * PAD
    if arrow is None:
        return FrameBox(0.0, 0.0, width, BOX_HEIGHT)
    if arrow.detail:
        width += BETWEEN + width_of(shorten_label(arrow.detail), MORE_SIZE)
    if not arrow.pose:
        return FrameBox(0.0, 0.0, width + BADGE_WIDTH, BOX_HEIGHT)
    width = max(width, width_of(shorten_label(arrow.pose), MORE_SIZE) + 2 * PAD)
    return FrameBox(0.0, 0.0, width + BADGE_WIDTH, BOX_HEIGHT + POSE_HEIGHT)


def _rows(
    forest: Forest, places: dict[str, FrameBox], *, is_down: bool
) -> tuple[dict[str, tuple[float, float]], float]:
    """Set the y of each frame. Return each group's top and bottom, and the total height.

    Groups are keyed by their first frame.
    """
    bands: dict[str, tuple[float, float]] = {}
    row = max((box.height for box in places.values()), default=0.0)
    y = 0.0
    waiting = [(frame, False) for frame in reversed(forest.order) if frame not in forest.up]
    while waiting:
        frame, done = waiting.pop()
        if done:
            box, children = places[frame], forest.children[frame]
            if not is_down:
                box.y = (
                    round((places[children[0]].y + places[children[-1]].y) / 2)
                    if children
                    else y + row / 2
                )
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
        if is_down:
            places[frame].y = y + places[frame].height / 2
            y += places[frame].height + ROW_GAP
        waiting.append((frame, True))
        waiting += [(child, False) for child in reversed(forest.children[frame])]
    return bands, max(0.0, y - ROW_GAP)


def _columns(forest: Forest, places: dict[str, FrameBox]) -> None:
    for frame in forest.order:
        box, children = places[frame], forest.children[frame]
        if frame not in forest.up and forest.enters(frame):
            box.x = PAD
        if not children:
            continue
        span = places[children[-1]].y - places[children[0]].y
        gap: float = round(min(FARTHEST, NEAREST + STEEPNESS * span))
        gap += PAD if any(forest.enters(child) for child in children) else 0.0
        for child in children:
            places[child].x = round(box.right) + gap


def _indent(forest: Forest, places: dict[str, FrameBox]) -> None:
    for frame in forest.order:
        box = places[frame]
        if frame not in forest.up and forest.enters(frame):
            box.x = PAD
        for child in forest.children[frame]:
            places[child].x = box.x + INDENT + (PAD if forest.enters(child) else 0.0)


def _areas(
    graph: Graph,
    forest: Forest,
    places: dict[str, FrameBox],
    bands: dict[str, tuple[float, float]],
) -> tuple[tuple[Area, ...], float]:
    """Return the groups' areas, outer groups first, and the total width.

    ``bands`` holds, for the first frame of each group, the top and bottom of its subtree.
    """
    order = forest.order
    reach = {frame: box.right for frame, box in places.items()}
    count = dict.fromkeys(order, 1)
    areas = []
    for index in range(len(order) - 1, -1, -1):
        frame = order[index]
        for child in forest.children[frame]:
            reach[frame] = max(reach[frame], reach[child])
            count[frame] += count[child]
        if frame in bands:
            below = order[index : index + count[frame]]
            label = places[frame].x + width_of(
                shorten_label(graph.groups[forest.group[frame]].label), LABEL_SIZE
            )
            area = _group_area(forest, places, frame, below, label)
            right, bottom = area or (max(reach[frame], label) + PAD, bands[frame][1])
            reach[frame] = max(reach[frame], right)
            areas.append(Area(frame, places[frame].x - PAD, bands[frame][0], right, bottom))
    return tuple(reversed(areas)), max(reach.values(), default=0.0)


def _group_area(
    forest: Forest, places: dict[str, FrameBox], begin: str, below: Sequence[str], label: float
) -> tuple[float, float] | None:
    """Return the right and lower edge around a group's frames, None if another frame is between.

    ``label`` is the x where the group's label ends.
    """
    group = forest.group[begin]
    areas = [places[frame] for frame in below if forest.group.get(frame) == group]
    right = max(label, *(box.right for box in areas)) + PAD
    bottom = max(box.bottom for box in areas) + PAD
    if len(areas) < len(below):
        for frame in below:
            box = places[frame]
            near = box.x - PAD < right and box.bottom - box.height - PAD < bottom
            if near and forest.group.get(frame) != group:
                return None
    return right, bottom
