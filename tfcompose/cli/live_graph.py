"""``tfcompose graph --live`` and ``graph --bag``: the tree as it is published, as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.edge_table import printable
from tfcompose.cli.expected import where_to_look
from tfcompose.cli.looking import from_bag, from_live
from tfcompose.draw import Arrow, Graph
from tfcompose.geometry import Pose, norm, normalised
from tfcompose.observe.census import SETTLE_S, Census
from tfcompose.render.tree import short_pose

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Sequence

    from tfcompose.draw.graph import Kind
    from tfcompose.observe.census import EdgeSeen
    from tfcompose.plan import Plan

_SOMEBODY = "somebody"


def seen(arguments: Namespace) -> Graph | int:
    """Return the published tree as a graph, or the exit code: 1 if nothing is published, 2 for what cannot be read."""
    known = where_to_look(arguments)
    if isinstance(known, int):
        return known
    plan, pairs = known
    censuses = {pair: Census(settle_s=0.0 if arguments.bag else SETTLE_S) for pair in pairs}
    if arguments.bag:
        code = from_bag(arguments.bag, censuses)
    else:
        code = from_live("tfcompose_graph", censuses, ros=plan.ros if plan else None, duration_s=arguments.duration)
    if code is not None:
        return code
    title = arguments.bag or (plan.robot if plan else pairs[0][0])
    return graph_of_censuses(list(censuses.values()), title, plan, poses=arguments.poses)


def graph_of_censuses(
    censuses: Sequence[Census], title: str, plan: Plan | None = None, *, poses: bool = False
) -> Graph:
    """Return what was seen as a graph: second parents and loops as they are, publishers as owners.

    What the plan expects and nobody publishes is said to be missing.
    """
    edges = [one for census in censuses for one in census.edges(census.end_ns or census.last_ns)]
    children = {one.strand.child for one in edges}
    missing = [edge for edge in plan.edges if edge.child not in children] if plan else []
    arrows = [_arrow(one, poses=poses) for one in edges]
    arrows += [Arrow(edge.parent, edge.child, edge.kind, edge.node, "missing", "") for edge in missing]
    return Graph(printable(title), (), tuple(arrows))


def _arrow(one: EdgeSeen, *, poses: bool) -> Arrow:
    strand = one.strand
    rate = "" if strand.static or one.timing.rate is None else f"{one.timing.rate:.1f} Hz"
    kind: Kind = "static" if strand.static else "dynamic"
    owner = printable(one.publisher) or _SOMEBODY
    below = _pose(strand.pose) if poses else ""
    return Arrow(printable(strand.parent), printable(strand.child), kind, owner, rate, below)


def _pose(pose: Pose) -> str:
    length = norm(pose.quat_xyzw)
    sound = length > 0 and length < float("inf")
    return short_pose(Pose(pose.xyz, normalised(pose.quat_xyzw))) if sound else "no rotation"
