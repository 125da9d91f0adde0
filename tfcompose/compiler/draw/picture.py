"""A graph as a drawing of boxes, curves, texts and a legend, independent of the file format.

Lengths are in px from the top left corner, with y down.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Union

from tfcompose.compiler.draw.arrange import Direction, arrange
from tfcompose.compiler.draw.graph import forest_of
from tfcompose.compiler.draw.layout import (
    BADGE_WIDTH,
    BETWEEN,
    INDENT,
    LABEL_STRIP,
    PAD,
    POSE_HEIGHT,
)
from tfcompose.compiler.draw.style import STYLES, colour_of, shorten_label, width_of
from tfcompose.foundation.text import plural

if TYPE_CHECKING:
    from tfcompose.compiler.draw.graph import Arrow, Forest, Graph
    from tfcompose.compiler.draw.layout import Area, FrameBox, Layout

Point = tuple[float, float]

MARGIN = 16.0
CORNER = 5.0
BASE = 4.2  # from the vertical middle of a name down to its baseline
MIN_WIDTH = 440.0
LEGEND_LINE = 22.0
ITEM_GAP = 20.0
SAMPLE_WIDTH = 34.0
#: Meaning of each kind of line, in the order of the legend.
LINES = {
    "static": "fixed",
    "joint": "moved by joint states",
    "dynamic": "moving",
    "alternative": "another parent, by turns",
}


@dataclass(slots=True)
class Box:
    """A rectangle with rounded corners."""

    x: float
    y: float
    width: float
    height: float
    radius: float
    style: str


@dataclass(slots=True)
class Curve:
    """Connected cubic Bézier curves."""

    #: Four points for the first curve, and three for each further curve.
    points: tuple[Point, ...]
    style: str
    #: A description, for file formats that can show it.
    about: str = ""

    @property
    def straight(self) -> bool:
        """Whether the curve is a horizontal line."""
        return len({y for _, y in self.points}) == 1


def _level(start: Point, end: Point) -> tuple[Point, Point, Point, Point]:
    """Return the curve that leaves ``start`` and arrives at ``end`` horizontally."""
    bend = (start[0] + end[0]) / 2
    return start, (bend, start[1]), (bend, end[1]), end


def _falling(start: Point, end: Point) -> tuple[Point, Point, Point, Point]:
    """Return the curve that leaves ``start`` downwards and arrives at ``end`` horizontally."""
    corner = (start[0], end[1])
    return start, corner, corner, end


def _along(*corners: Point) -> tuple[Point, ...]:
    """Return a path through the corners, with rounded corners and straight lines between them."""
    points = [corners[0]]
    for before, corner, after in zip(corners, corners[1:], corners[2:], strict=False):
        into, out = _towards(corner, before), _towards(corner, after)
        points += [into, into, into, corner, corner, out]
    return (*points, corners[-1], corners[-1], corners[-1])


def _towards(corner: Point, target: Point) -> Point:
    """Return the point towards ``target`` where the rounding of ``corner`` begins or ends."""
    x, y = target[0] - corner[0], target[1] - corner[1]
    part = min(1.0, CORNER / max(abs(x), abs(y), CORNER))
    return corner[0] + part * x, corner[1] + part * y


def _sagging(start: Point, end: Point) -> tuple[Point, Point, Point, Point]:
    """Return the curve that leaves and arrives from below; it sags more over a longer distance."""
    sag = 26.0 + 0.08 * (abs(end[0] - start[0]) + abs(end[1] - start[1]))
    return start, (start[0], start[1] + sag), (end[0], end[1] + sag), end


@dataclass(slots=True)
class TextLine:
    """A line of text."""

    #: The start of the text, or its middle.
    x: float
    #: The baseline.
    y: float
    text: str
    style: str
    #: The maximum width.
    width: float
    #: Whether ``x`` is the middle.
    middle: bool = False


Shape = Union[Box, Curve, TextLine]  # noqa: UP007 (evaluated when it is loaded, by Python 3.10 too)


@dataclass(frozen=True, slots=True)
class Drawing:
    """The size of the page, and its shapes from back to front."""

    title: str
    width: float
    height: float
    shapes: tuple[Shape, ...]


def draw(graph: Graph, direction: Direction = "auto") -> Drawing:
    """Return the drawing of the graph.

    Groups are at the back, then edges, then frames. The legend is above the tree.
    """
    forest = forest_of(graph)
    places = arrange(graph, forest, direction)
    owners = {name: index for index, name in enumerate(graph.all_owners())}
    head, width, top = _legend(graph, owners, places.width, MARGIN)
    pen = _Pen(graph, forest, places, owners, MARGIN, top)
    extras = pen.extras()
    bottom = max(top + places.height, *(y for curve in extras for _, y in curve.points), 0.0)
    shapes = (*head, *pen.areas(), *extras, *pen.tree())
    return Drawing(graph.title, width + 2 * MARGIN, bottom + MARGIN, shapes)


@dataclass(frozen=True, slots=True)
class _Pen:
    """Shapes of one graph, moved to where the tree begins."""

    graph: Graph
    forest: Forest
    layout: Layout
    owners: dict[str, int]
    left: float
    top: float

    def areas(self) -> list[Shape]:
        """Return the rectangles of the groups, with their labels."""
        return [shape for area in self.layout.areas for shape in self._area(area)]

    def _area(self, area: Area) -> tuple[Shape, ...]:
        label = shorten_label(self.graph.groups[self.forest.group[area.frame]].label)
        x, y = area.x + self.left, area.top + self.top
        return (
            Box(
                x, y, area.right - area.x, height=area.bottom - area.top, radius=7.0, style="group"
            ),
            _text(label, "label", x + PAD, y + LABEL_STRIP - 2.5),
        )

    def extras(self) -> list[Curve]:
        """Return the curves of the edges that are not in ``Forest.up``.

        A curve to the right looks like other edges. A curve back leaves and arrives from below.
        """
        curves = []
        for arrow in self.forest.extra:
            parent, child = self.layout.places[arrow.parent], self.layout.places[arrow.child]
            is_forward = not self.layout.is_down and parent.right < child.x
            curves.append(self._edge(arrow) if is_forward else self._back(arrow))
        return curves

    def tree(self) -> list[Shape]:
        """Return each frame, with the edge from its parent."""
        shapes: list[Shape] = []
        for frame in self.forest.order:
            box, arrow = self.layout.places[frame], self.forest.up.get(frame)
            if arrow:
                shapes.append(self._edge(arrow))
            shapes += self._frame(frame, box, arrow)
        return shapes

    def _edge(self, arrow: Arrow) -> Curve:
        parent, child = self.layout.places[arrow.parent], self.layout.places[arrow.child]
        end = (child.x + self.left, child.y + self.top)
        if self.layout.is_down:
            start = (parent.x + INDENT / 2 + self.left, parent.bottom + self.top)
            return self._curve(arrow, _falling(start, end))
        trunk = self.layout.trunk
        if trunk and arrow.parent == trunk.frame:
            start = (parent.x + INDENT / 2 + self.left, parent.bottom + self.top)
            line, above = trunk.lines[arrow.child] + self.left, trunk.y + self.top
            return self._curve(
                arrow, _along(start, (start[0], above), (line, above), (line, end[1]), end)
            )
        return self._curve(arrow, _level((parent.right + self.left, parent.y + self.top), end))

    def _back(self, arrow: Arrow) -> Curve:
        parent, child = self.layout.places[arrow.parent], self.layout.places[arrow.child]
        start = (parent.x + 0.7 * parent.width + self.left, parent.bottom + self.top)
        return self._curve(
            arrow,
            _sagging(start, (child.x + 0.3 * child.width + self.left, child.bottom + self.top)),
        )

    def _curve(self, arrow: Arrow, points: tuple[Point, ...]) -> Curve:
        kind = "alternative" if arrow.alternative else arrow.kind
        about = f"{arrow.parent} → {arrow.child}: {', '.join(_facts(arrow))}"
        return Curve(points, f"edge{colour_of(self.owners[arrow.owner])} {kind}", about)

    def _frame(self, frame: str, place: FrameBox, arrow: Arrow | None) -> list[Shape]:
        x, y = place.x + self.left, place.y + self.top
        if arrow is None:
            box = Box(
                x,
                y - place.height / 2,
                place.width,
                height=place.height,
                radius=CORNER,
                style="root",
            )
            return [box, _text(shorten_label(frame), "name", x + PAD, y + BASE)]
        owner = self.owners[arrow.owner]
        colour, number = colour_of(owner), str(owner + 1)
        base = y + BASE - (POSE_HEIGHT / 2 - 1.0 if arrow.pose else 0.0)
        left = x + BADGE_WIDTH + PAD
        name = _text(shorten_label(frame), "name", left, base)
        shapes: list[Shape] = [
            Box(
                x,
                y - place.height / 2,
                place.width,
                height=place.height,
                radius=CORNER,
                style=f"box{colour}",
            ),
            Box(
                x,
                y - place.height / 2,
                BADGE_WIDTH,
                height=place.height,
                radius=CORNER,
                style=f"badge{colour}",
            ),
            TextLine(
                x + BADGE_WIDTH / 2,
                y + 3.6,
                number,
                f"number{colour}",
                _width(number, f"number{colour}"),
                middle=True,
            ),
            name,
        ]
        if arrow.detail:
            shapes.append(
                _text(shorten_label(arrow.detail), "more", left + name.width + BETWEEN, base)
            )
        if arrow.pose:
            shapes.append(_text(shorten_label(arrow.pose), "more", left, base + POSE_HEIGHT))
        return shapes


def _text(text: str, style: str, x: float, y: float) -> TextLine:
    return TextLine(x, y, text, style, _width(text, style))


def _width(text: str, style: str) -> float:
    font = STYLES[style]
    return width_of(text, font.size, bold=font.bold)


def _facts(arrow: Arrow) -> list[str]:
    kind = f"{arrow.kind}, by turns" if arrow.alternative else arrow.kind
    return [fact for fact in (kind, f"by {arrow.owner}", arrow.detail, arrow.pose) if fact]


def _legend(
    graph: Graph, owners: dict[str, int], width: float, margin: float
) -> tuple[list[Shape], float, float]:
    """Return the title and legend, the total width without margins, and the y of the tree."""
    edges = Counter(
        arrow.owner for arrow in (*graph.arrows, *graph.hidden) if not arrow.alternative
    )
    title = shorten_label(graph.title)
    frames = len(graph.all_frames())
    totals = f"{plural(frames + len(graph.hidden), 'frame')} · {plural(edges.total(), 'edge')}"
    totals += (
        f" · {plural(len(graph.hidden), 'frame')} inside sensors not shown" if graph.hidden else ""
    )
    title_width = width_of(title, STYLES["title"].size, bold=True)
    totals_width = width_of(totals, STYLES["label"].size)
    base = margin + 14.0
    shapes: list[Shape] = [
        TextLine(margin, base, title, "title", title_width),
        TextLine(margin + title_width + 12.0, base, totals, "label", totals_width),
    ]
    width = max(width, MIN_WIDTH, title_width + 12.0 + totals_width)
    y = base + LEGEND_LINE
    for row in (_owner_items(owners, edges), _line_items(graph)):
        more, y, width = _wrap_items(row, margin, y, width)
        shapes += more
    return shapes, width, y + 2.0


@dataclass(frozen=True, slots=True)
class _Item:
    """Entry of the legend: the meaning of a kind of line, or of an owner's number and colour."""

    text: str
    kind: str = ""
    owner: int = 0


def _owner_items(owners: dict[str, int], edges: Counter[str]) -> list[_Item]:
    return [
        _Item(f"{shorten_label(name)} ({plural(edges[name], 'edge')})", owner=index)
        for name, index in owners.items()
        if edges[name]
    ]


def _line_items(graph: Graph) -> list[_Item]:
    used: set[str] = {arrow.kind for arrow in graph.arrows if not arrow.alternative}
    if any(arrow.alternative for arrow in graph.arrows):
        used.add("alternative")
    return [_Item(text, kind=kind) for kind, text in LINES.items() if kind in used]


def _wrap_items(
    items: list[_Item], margin: float, y: float, width: float
) -> tuple[list[Shape], float, float]:
    """Return the items in lines that fit ``width``, the y of the next line, and the used width.

    The used width exceeds ``width`` if a single item is wider.
    """
    shapes: list[Shape] = []
    x = margin
    for item in items:
        text_width = width_of(item.text, STYLES["label"].size)
        item_width = (SAMPLE_WIDTH if item.kind else BADGE_WIDTH) + 6.0 + text_width
        if x > margin and x + item_width > margin + width:
            x, y = margin, y + LEGEND_LINE
        width = max(width, item_width)
        shapes += _symbol(item, x, y)
        shapes.append(TextLine(x + item_width - text_width, y, item.text, "label", text_width))
        x += item_width + ITEM_GAP
    return shapes, y + (LEGEND_LINE if items else 0.0), width


def _symbol(item: _Item, x: float, y: float) -> list[Shape]:
    if item.kind:
        return [Curve(_level((x, y - 3.8), (x + SAMPLE_WIDTH, y - 3.8)), f"sample {item.kind}")]
    colour, text = colour_of(item.owner), str(item.owner + 1)
    middle = x + BADGE_WIDTH / 2
    number = TextLine(
        middle, y - 0.2, text, f"number{colour}", width_of(text, 10.0, bold=True), middle=True
    )
    return [Box(x, y - 11.8, BADGE_WIDTH, height=16.0, radius=4.0, style=f"badge{colour}"), number]
