"""A graph as a Mermaid flowchart, for Markdown pages."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from tfcompose.compiler.draw.style import STYLES, colour_of
from tfcompose.foundation.text import visible

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.draw.graph import Arrow, Graph

_ESCAPED = re.compile(r"[^\w ,.:/+()°·→-]")


def mermaid(graph: Graph, *, is_down: bool = False) -> str:
    """Return the graph as a Mermaid flowchart.

    Moving edges are dotted, groups are subgraphs, and each owner has a colour.
    """
    return "".join(f"{line}\n" for line in _lines(graph, "TD" if is_down else "LR"))


def _lines(graph: Graph, direction: str) -> Iterator[str]:
    owners = {name: index for index, name in enumerate(graph.all_owners())}
    above = {arrow.child: arrow for arrow in reversed(graph.arrows) if not arrow.alternative}
    numbers = {frame: f"f{index}" for index, frame in enumerate(graph.all_frames())}
    grouped = {frame for group in graph.groups for frame in group.frames}
    yield f"flowchart {direction}"
    for frame, number in numbers.items():
        if frame not in grouped:
            yield f"  {_node(frame, number, above.get(frame), owners)}"
    for index, group in enumerate(graph.groups):
        yield f'  subgraph g{index}["{_text(group.label)}"]'
        for frame in group.frames:
            yield f"    {_node(frame, numbers[frame], above.get(frame), owners)}"
        yield "  end"
    for arrow in graph.arrows:
        line = "-->" if arrow.kind == "static" and not arrow.alternative else "-.->"
        label = f"{_text(arrow.owner)} {_text(arrow.detail)}".strip()
        yield f'  {numbers[arrow.parent]} {line}|"{label}"| {numbers[arrow.child]}'
    yield from _colours(graph, owners)


def _node(frame: str, number: str, arrow: Arrow | None, owners: dict[str, int]) -> str:
    below = f"<br/>{_text(arrow.pose)}" if arrow and arrow.pose else ""
    colour = f":::owner{owners[arrow.owner]}" if arrow else ""
    return f'{number}["{_text(frame)}{below}"]{colour}'


def _colours(graph: Graph, owners: dict[str, int]) -> Iterator[str]:
    edges: dict[str, list[str]] = {}
    for index, arrow in enumerate(graph.arrows):
        edges.setdefault(arrow.owner, []).append(str(index))
    for owner, index in owners.items():
        box = STYLES[f"box{colour_of(index)}"]
        yield f"  classDef owner{index} fill:#{box.fill[0]},stroke:#{box.stroke[0]},color:#1b1f24"
        if owner in edges:
            yield f"  linkStyle {','.join(edges[owner])} stroke:#{box.stroke[0]}"


def _text(text: str) -> str:
    """Return the text for a quoted Mermaid string.

    Characters with a meaning in Mermaid become entities.
    """
    return _ESCAPED.sub(lambda match: f"#{ord(match[0])};", visible(text))
