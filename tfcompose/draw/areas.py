"""The rectangles of groups: around their own frames, and around what hangs on them where it is in between."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.draw.letters import shown, width_of
from tfcompose.draw.style import STYLES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.draw.graph import Forest, Graph

LABEL_SIZE = STYLES["label"].size
PAD = 8.0  # between a text and its box, and between a group and its frames


@dataclass(slots=True)
class Place:
    """A frame's box: its left edge, the middle of its height, its width and height, in px from the top left corner."""

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
    """The rectangle of a group, with a strip for the label on top; ``frame`` is where the group begins."""

    frame: str
    x: float
    top: float
    right: float
    bottom: float


def areas_of(
    graph: Graph, forest: Forest, places: dict[str, Place], bands: dict[str, tuple[float, float]]
) -> tuple[tuple[Area, ...], float]:
    """Return the areas, outer ones first, and how wide all is.

    ``bands`` holds the top and bottom of all that hangs on a frame where a group begins.
    """
    order = forest.order
    reach = {frame: place.right for frame, place in places.items()}
    count = dict.fromkeys(order, 1)
    areas = []
    for index in range(len(order) - 1, -1, -1):
        frame = order[index]
        for child in forest.children[frame]:
            reach[frame] = max(reach[frame], reach[child])
            count[frame] += count[child]
        if frame in bands:
            below = order[index : index + count[frame]]
            label = places[frame].x + width_of(shown(graph.groups[forest.group[frame]].label), LABEL_SIZE)
            own = _own(forest, places, frame, below, label)
            right, bottom = own or (max(reach[frame], label) + PAD, bands[frame][1])
            reach[frame] = max(reach[frame], right)
            areas.append(Area(frame, places[frame].x - PAD, bands[frame][0], right, bottom))
    return tuple(reversed(areas)), max(reach.values(), default=0.0)


def _own(
    forest: Forest, places: dict[str, Place], begin: str, below: Sequence[str], label: float
) -> tuple[float, float] | None:
    """Return the right and lower edge around the group's own frames, or None if other frames are in the way.

    ``label`` is where the group's label ends.
    """
    group = forest.group[begin]
    own = [places[frame] for frame in below if forest.group.get(frame) == group]
    right = max(label, *(place.right for place in own)) + PAD
    bottom = max(place.bottom for place in own) + PAD
    if len(own) < len(below):
        for frame in below:
            place = places[frame]
            near = place.x - PAD < right and place.bottom - place.height - PAD < bottom
            if near and forest.group.get(frame) != group:
                return None
    return right, bottom
