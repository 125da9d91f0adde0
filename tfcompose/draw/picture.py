"""A graph as a drawing: boxes, curves and texts, of which any format can be written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.draw.areas import PAD
from tfcompose.draw.graph import forest_of
from tfcompose.draw.layout import BADGE_WIDTH, BETWEEN, LABEL_STRIP, POSE_HEIGHT, layout
from tfcompose.draw.legend import legend
from tfcompose.draw.letters import shown, width_of
from tfcompose.draw.shapes import Box, Curve, Drawing, Text, hanging, level
from tfcompose.draw.style import STYLES, colour_of

if TYPE_CHECKING:
    from tfcompose.draw.areas import Area, Place
    from tfcompose.draw.graph import Arrow, Forest, Graph
    from tfcompose.draw.layout import Layout
    from tfcompose.draw.shapes import Point, Shape

MARGIN = 16.0
CORNER = 5.0
BASE = 4.2  # from the middle of a name down to its base line


def draw(graph: Graph) -> Drawing:
    """Return the drawing of the graph: groups at the back, then edges, then frames, and the legend on top."""
    forest = forest_of(graph)
    places = layout(graph, forest)
    owners = {name: index for index, name in enumerate(graph.all_owners())}
    head, width, top = legend(graph, owners, places.width, MARGIN)
    pen = _Pen(graph, forest, places, owners, MARGIN, top)
    extras = pen.extras()
    bottom = max(top + places.height, *(y for curve in extras for _, y in curve.points), 0.0)
    shapes = (*head, *pen.areas(), *extras, *pen.tree())
    return Drawing(graph.title, width + 2 * MARGIN, bottom + MARGIN, shapes)


@dataclass(frozen=True, slots=True)
class _Pen:
    """What is drawn of one graph, moved to where the tree begins."""

    graph: Graph
    forest: Forest
    layout: Layout
    owners: dict[str, int]
    left: float
    top: float

    def areas(self) -> list[Shape]:
        """Return the groups, with their labels."""
        return [shape for area in self.layout.areas for shape in self._area(area)]

    def _area(self, area: Area) -> tuple[Shape, ...]:
        label = shown(self.graph.groups[self.forest.group[area.frame]].label)
        x, y = area.x + self.left, area.top + self.top
        return (
            Box(x, y, area.right - area.x, area.bottom - area.top, 7.0, "group"),
            _text(label, "label", x + PAD, y + LABEL_STRIP - 2.5),
        )

    def extras(self) -> list[Curve]:
        """Return the edges that are not of the trees: forward as all others, and back from below to below."""
        curves = []
        for arrow in self.forest.extra:
            parent, child = self.layout.places[arrow.parent], self.layout.places[arrow.child]
            curves.append(self._edge(arrow) if parent.right < child.x else self._back(arrow))
        return curves

    def tree(self) -> list[Shape]:
        """Return each frame with the edge that it hangs on."""
        shapes: list[Shape] = []
        for frame in self.forest.order:
            place, arrow = self.layout.places[frame], self.forest.up.get(frame)
            if arrow:
                shapes.append(self._edge(arrow))
            shapes += self._frame(frame, place, arrow)
        return shapes

    def _edge(self, arrow: Arrow) -> Curve:
        parent, child = self.layout.places[arrow.parent], self.layout.places[arrow.child]
        start = (parent.right + self.left, parent.y + self.top)
        return self._curve(arrow, level(start, (child.x + self.left, child.y + self.top)))

    def _back(self, arrow: Arrow) -> Curve:
        parent, child = self.layout.places[arrow.parent], self.layout.places[arrow.child]
        start = (parent.x + 0.7 * parent.width + self.left, parent.bottom + self.top)
        return self._curve(arrow, hanging(start, (child.x + 0.3 * child.width + self.left, child.bottom + self.top)))

    def _curve(self, arrow: Arrow, points: tuple[Point, Point, Point, Point]) -> Curve:
        kind = "alternative" if arrow.alternative else arrow.kind
        about = f"{arrow.parent} → {arrow.child}: {', '.join(_facts(arrow))}"
        return Curve(points, f"edge{colour_of(self.owners[arrow.owner])} {kind}", about)

    def _frame(self, frame: str, place: Place, arrow: Arrow | None) -> list[Shape]:
        x, y = place.x + self.left, place.y + self.top
        if arrow is None:
            box = Box(x, y - place.height / 2, place.width, place.height, CORNER, "root")
            return [box, _text(shown(frame), "name", x + PAD, y + BASE)]
        owner = self.owners[arrow.owner]
        colour, number = colour_of(owner), str(owner + 1)
        base = y + BASE - (POSE_HEIGHT / 2 - 1.0 if arrow.below else 0.0)
        left = x + BADGE_WIDTH + PAD
        name = _text(shown(frame), "name", left, base)
        shapes: list[Shape] = [
            Box(x, y - place.height / 2, place.width, place.height, CORNER, f"box{colour}"),
            Box(x, y - place.height / 2, BADGE_WIDTH, place.height, CORNER, f"badge{colour}"),
            Text(
                x + BADGE_WIDTH / 2, y + 3.6, number, f"number{colour}", _wide(number, f"number{colour}"), middle=True
            ),
            name,
        ]
        if arrow.beside:
            shapes.append(_text(shown(arrow.beside), "more", left + name.width + BETWEEN, base))
        if arrow.below:
            shapes.append(_text(shown(arrow.below), "more", left, base + POSE_HEIGHT))
        return shapes


def _text(text: str, look: str, x: float, y: float) -> Text:
    return Text(x, y, text, look, _wide(text, look))


def _wide(text: str, look: str) -> float:
    style = STYLES[look]
    return width_of(text, style.size, bold=style.bold)


def _facts(arrow: Arrow) -> list[str]:
    kind = f"{arrow.kind}, by turns" if arrow.alternative else arrow.kind
    return [fact for fact in (kind, f"by {arrow.owner}", arrow.beside, arrow.below) if fact]
