"""An observed tree as a graph, and graphs as pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.terminal import printable
from tfcompose.foundation.geometry import Pose, norm, normalise

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.compiler.draw import Arrow, Graph
    from tfcompose.compiler.draw.arrange import Direction
    from tfcompose.compiler.draw.graph import Kind
    from tfcompose.model.plan import Plan
    from tfcompose.tf.live.edges import EdgeState, TreeObserver


def picture(graph: Graph, ending: str, direction: Direction = "auto") -> bytes:
    """Return the graph as a file of this format; import only the modules for it."""
    if ending == ".mmd":
        from tfcompose.compiler.draw.mermaid import mermaid

        return mermaid(graph, is_down=direction == "down").encode()
    if ending in {".dot", ".gv"}:
        from tfcompose.compiler.draw.dot import dot

        return dot(graph, is_down=direction == "down").encode()
    from tfcompose.compiler.draw.picture import draw

    drawing = draw(graph, direction)
    if ending == ".png":
        from tfcompose.compiler.draw.png import png

        return png(drawing)
    from tfcompose.compiler.draw.svg import svg

    return svg(drawing).encode()


def graph_of_observers(
    observers: Sequence[TreeObserver], title: str, plan: Plan | None = None, *, poses: bool = False
) -> Graph:
    """Return the observed tree as a graph, with second parents, loops and publishers.

    Planned edges that no node publishes are marked as missing.
    """
    from tfcompose.compiler.draw import Arrow, Graph

    edges = [edge for observer in observers for edge in observer.edges(observer.until_ns)]
    children = {edge.stream.child for edge in edges}
    missing = [edge for edge in plan.edges if edge.child not in children] if plan else []
    arrows = [_arrow(edge, poses=poses) for edge in edges]
    arrows += [
        Arrow(edge.parent, edge.child, edge.kind, owner=edge.node, detail="missing", pose="")
        for edge in missing
    ]
    return Graph(printable(title), (), tuple(arrows))


def _arrow(edge: EdgeState, *, poses: bool) -> Arrow:
    from tfcompose.compiler.draw import Arrow

    stream = edge.stream
    rate = "" if stream.static or edge.timing.rate is None else f"{edge.timing.rate:.1f} Hz"
    owner = printable(edge.publisher) or "unknown"
    below = _pose(stream.pose) if poses else ""
    kind: Kind = "static" if stream.static else "dynamic"
    return Arrow(
        printable(stream.parent),
        printable(stream.child),
        kind,
        owner=owner,
        detail=rate,
        pose=below,
    )


def _pose(pose: Pose) -> str:
    from tfcompose.compiler.render.tree import short_pose

    length = norm(pose.quat_xyzw)
    sound = length > 0 and length < float("inf")
    return short_pose(Pose(pose.xyz, normalise(pose.quat_xyzw))) if sound else "no rotation"
