"""The head of a picture: what it shows, and what colours, numbers and lines stand for."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from tfcompose.draw.layout import BADGE_WIDTH
from tfcompose.draw.letters import shown, width_of
from tfcompose.draw.shapes import Box, Curve, Text, level
from tfcompose.draw.style import STYLES, colour_of

if TYPE_CHECKING:
    from tfcompose.draw.graph import Graph
    from tfcompose.draw.shapes import Shape

LEAST_WIDTH = 440.0
LINE = 22.0
APART = 20.0
SAMPLE = 34.0
#: What each kind of line says, in the order of the legend.
LINES = {
    "static": "fixed",
    "joint": "moved by joint states",
    "dynamic": "moving",
    "alternative": "another parent, by turns",
}


def legend(graph: Graph, owners: dict[str, int], width: float, margin: float) -> tuple[list[Shape], float, float]:
    """Return the head, how wide all is without margins, and where the tree begins."""
    edges = Counter(arrow.owner for arrow in graph.arrows if not arrow.alternative)
    title = shown(graph.title)
    counted = f"{_count(len(graph.all_frames()), 'frame')} · {_count(edges.total(), 'edge')}"
    title_width = width_of(title, STYLES["title"].size, bold=True)
    counted_width = width_of(counted, STYLES["label"].size)
    base = margin + 14.0
    shapes: list[Shape] = [
        Text(margin, base, title, "title", title_width),
        Text(margin + title_width + 12.0, base, counted, "label", counted_width),
    ]
    width = max(width, LEAST_WIDTH, title_width + 12.0 + counted_width)
    y = base + LINE
    for row in (_owner_items(owners, edges), _line_items(graph)):
        more, y, width = _set(row, margin, y, width)
        shapes += more
    return shapes, width, y + 2.0


def _count(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"


def _owner_items(owners: dict[str, int], edges: Counter[str]) -> list[tuple[str, str, str]]:
    return [
        (f"owner{index}", str(index + 1), f"{shown(name)} ({_count(edges[name], 'edge')})")
        for name, index in owners.items()
        if edges[name]
    ]


def _line_items(graph: Graph) -> list[tuple[str, str, str]]:
    used = {"alternative" if arrow.alternative else arrow.kind for arrow in graph.arrows}
    return [("line", kind, said) for kind, said in LINES.items() if kind in used]


def _set(items: list[tuple[str, str, str]], margin: float, y: float, width: float) -> tuple[list[Shape], float, float]:
    """Return the items in lines no wider than ``width`` unless one alone is, the next line's y, and the width then."""
    shapes: list[Shape] = []
    x = margin
    for what, sign, said in items:
        text_width = width_of(said, STYLES["label"].size)
        whole = (SAMPLE if what == "line" else BADGE_WIDTH) + 6.0 + text_width
        if x > margin and x + whole > margin + width:
            x, y = margin, y + LINE
        width = max(width, whole)
        shapes += _sign(what, sign, x, y)
        shapes.append(Text(x + whole - text_width, y, said, "label", text_width))
        x += whole + APART
    return shapes, y + (LINE if items else 0.0), width


def _sign(what: str, sign: str, x: float, y: float) -> list[Shape]:
    if what == "line":
        return [Curve(level((x, y - 3.8), (x + SAMPLE, y - 3.8)), f"sample {sign}")]
    colour = colour_of(int(what.removeprefix("owner")))
    middle = x + BADGE_WIDTH / 2
    number = Text(middle, y - 0.2, sign, f"number{colour}", width_of(sign, 10.0, bold=True), middle=True)
    return [Box(x, y - 11.8, BADGE_WIDTH, 16.0, 4.0, f"badge{colour}"), number]
