"""A graph as text that other tools draw: DOT for Graphviz, and Mermaid."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from tfcompose.compiler.draw.style import STYLES, colour_of
from tfcompose.foundation.text import visible

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.draw.graph import Arrow, Graph


_DOT_LINES = {"static": "solid", "joint": "dashed", "dynamic": "dashed", "alternative": "dotted"}


def dot(graph: Graph, *, is_down: bool = False) -> str:
    """Return the graph in the DOT language.

    Frames by their names, groups as clusters, owners as colours.
    """
    return "".join(f"{line}\n" for line in _dot_lines(graph, "TB" if is_down else "LR"))


def _dot_lines(graph: Graph, direction: str) -> Iterator[str]:
    owners = {name: index for index, name in enumerate(graph.all_owners())}
    above = {arrow.child: arrow for arrow in reversed(graph.arrows) if not arrow.alternative}
    yield f"digraph {_dot_quoted(graph.title)} {{"
    yield f"  rankdir={direction}; ranksep=0.4; nodesep=0.12;"
    yield (
        '  node [shape=box, style="rounded,filled", fillcolor=white, fontname=Helvetica,'
        " fontsize=11, height=0.3];"
    )
    yield "  edge [fontname=Helvetica, fontsize=9, arrowsize=0.6];"
    for frame in graph.all_frames():
        yield f"  {_dot_quoted(frame)}{_dot_node(above.get(frame), frame, owners)};"
    for index, group in enumerate(graph.groups):
        members = " ".join(f"{_dot_quoted(frame)};" for frame in group.frames)
        yield (
            f"  subgraph cluster_{index} {{ label={_dot_quoted(group.label)}; color=gray70;"
            f" fontsize=10; {members} }}"
        )
    for arrow in graph.arrows:
        yield (
            f"  {_dot_quoted(arrow.parent)} -> {_dot_quoted(arrow.child)}"
            f" {_dot_edge(arrow, owners)};"
        )
    yield "}"


def _dot_node(arrow: Arrow | None, frame: str, owners: dict[str, int]) -> str:
    if arrow is None:
        return f" [label={_dot_quoted(frame)}]"
    colour = colour_of(owners[arrow.owner])
    label = _dot_quoted(frame, arrow.pose) if arrow.pose else _dot_quoted(frame)
    line, fill = STYLES[f"box{colour}"].stroke[0], STYLES[f"box{colour}"].fill[0]
    return f' [label={label}, color="#{line}", fillcolor="#{fill}"]'


def _dot_edge(arrow: Arrow, owners: dict[str, int]) -> str:
    line = STYLES[f"edge{colour_of(owners[arrow.owner])}"].stroke[0]
    kind = "alternative" if arrow.alternative else arrow.kind
    wide = "" if kind == "static" else ", penwidth=1.6"
    free = ", constraint=false" if arrow.alternative else ""
    label = _dot_quoted(arrow.owner, arrow.detail) if arrow.detail else _dot_quoted(arrow.owner)
    return f'[label={label}, color="#{line}", style={_DOT_LINES[kind]}{wide}{free}]'


def _dot_quoted(*rows: str) -> str:
    return '"{}"'.format(
        "\\n".join(visible(row).replace("\\", "\\\\").replace('"', '\\"') for row in rows)
    )


_MERMAID_MEANT = re.compile(r"[^\w ,.:/+()°·→-]")


def mermaid(graph: Graph, *, is_down: bool = False) -> str:
    """Return the graph as a Mermaid flowchart.

    Moving edges are dotted, groups are subgraphs, owners have colours.
    """
    return "".join(f"{line}\n" for line in _mermaid_lines(graph, "TD" if is_down else "LR"))


def _mermaid_lines(graph: Graph, direction: str) -> Iterator[str]:
    owners = {name: index for index, name in enumerate(graph.all_owners())}
    above = {arrow.child: arrow for arrow in reversed(graph.arrows) if not arrow.alternative}
    numbers = {frame: f"f{index}" for index, frame in enumerate(graph.all_frames())}
    grouped = {frame for group in graph.groups for frame in group.frames}
    yield f"flowchart {direction}"
    for frame, number in numbers.items():
        if frame not in grouped:
            yield f"  {_mermaid_node(frame, number, above.get(frame), owners)}"
    for index, group in enumerate(graph.groups):
        yield f'  subgraph g{index}["{_mermaid_text(group.label)}"]'
        for frame in group.frames:
            yield f"    {_mermaid_node(frame, numbers[frame], above.get(frame), owners)}"
        yield "  end"
    for arrow in graph.arrows:
        line = "-->" if arrow.kind == "static" and not arrow.alternative else "-.->"
        label = f"{_mermaid_text(arrow.owner)} {_mermaid_text(arrow.detail)}".strip()
        yield f'  {numbers[arrow.parent]} {line}|"{label}"| {numbers[arrow.child]}'
    yield from _mermaid_colours(graph, owners)


def _mermaid_node(frame: str, number: str, arrow: Arrow | None, owners: dict[str, int]) -> str:
    below = f"<br/>{_mermaid_text(arrow.pose)}" if arrow and arrow.pose else ""
    colour = f":::owner{owners[arrow.owner]}" if arrow else ""
    return f'{number}["{_mermaid_text(frame)}{below}"]{colour}'


def _mermaid_colours(graph: Graph, owners: dict[str, int]) -> Iterator[str]:
    edges: dict[str, list[str]] = {}
    for index, arrow in enumerate(graph.arrows):
        edges.setdefault(arrow.owner, []).append(str(index))
    for owner, index in owners.items():
        box = STYLES[f"box{colour_of(index)}"]
        yield f"  classDef owner{index} fill:#{box.fill[0]},stroke:#{box.stroke[0]},color:#1b1f24"
        if owner in edges:
            yield f"  linkStyle {','.join(edges[owner])} stroke:#{box.stroke[0]}"


def _mermaid_text(text: str) -> str:
    """Return the text as Mermaid's quotes hold it.

    What could be a sign of the language is an entity.
    """
    return _MERMAID_MEANT.sub(lambda found: f"#{ord(found[0])};", visible(text))
