"""A graph in DOT, Graphviz's language."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.compiler.draw.style import STYLES, colour_of
from tfcompose.foundation.text import visible

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.draw.graph import Arrow, Graph

_LINES = {"static": "solid", "joint": "dashed", "dynamic": "dashed", "alternative": "dotted"}


def dot(graph: Graph, *, is_down: bool = False) -> str:
    """Return the graph in the DOT language.

    Frames become nodes, groups become clusters, and each owner has a colour.
    """
    return "".join(f"{line}\n" for line in _lines(graph, "TB" if is_down else "LR"))


def _lines(graph: Graph, direction: str) -> Iterator[str]:
    owners = {name: index for index, name in enumerate(graph.all_owners())}
    above = {arrow.child: arrow for arrow in reversed(graph.arrows) if not arrow.alternative}
    yield f"digraph {_quote(graph.title)} {{"
    yield f"  rankdir={direction}; ranksep=0.4; nodesep=0.12;"
    yield (
        '  node [shape=box, style="rounded,filled", fillcolor=white, fontname=Helvetica,'
        " fontsize=11, height=0.3];"
    )
    yield "  edge [fontname=Helvetica, fontsize=9, arrowsize=0.6];"
    for frame in graph.all_frames():
        yield f"  {_quote(frame)}{_node(above.get(frame), frame, owners)};"
    for index, group in enumerate(graph.groups):
        members = " ".join(f"{_quote(frame)};" for frame in group.frames)
        yield (
            f"  subgraph cluster_{index} {{ label={_quote(group.label)}; color=gray70;"
            f" fontsize=10; {members} }}"
        )
    for arrow in graph.arrows:
        yield (f"  {_quote(arrow.parent)} -> {_quote(arrow.child)} {_edge(arrow, owners)};")
    yield "}"


def _node(arrow: Arrow | None, frame: str, owners: dict[str, int]) -> str:
    if arrow is None:
        return f" [label={_quote(frame)}]"
    colour = colour_of(owners[arrow.owner])
    label = _quote(frame, arrow.pose) if arrow.pose else _quote(frame)
    line, fill = STYLES[f"box{colour}"].stroke[0], STYLES[f"box{colour}"].fill[0]
    return f' [label={label}, color="#{line}", fillcolor="#{fill}"]'


def _edge(arrow: Arrow, owners: dict[str, int]) -> str:
    line = STYLES[f"edge{colour_of(owners[arrow.owner])}"].stroke[0]
    kind = "alternative" if arrow.alternative else arrow.kind
    wide = "" if kind == "static" else ", penwidth=1.6"
    free = ", constraint=false" if arrow.alternative else ""
    label = _quote(arrow.owner, arrow.detail) if arrow.detail else _quote(arrow.owner)
    return f'[label={label}, color="#{line}", style={_LINES[kind]}{wide}{free}]'


def _quote(*rows: str) -> str:
    return '"{}"'.format(
        "\\n".join(visible(row).replace("\\", "\\\\").replace('"', '\\"') for row in rows)
    )
