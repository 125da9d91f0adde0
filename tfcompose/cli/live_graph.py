"""``tfcompose graph --live`` and ``graph --bag``: the tree as it is published, as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.edge_table import printable
from tfcompose.cli.looking import from_bag, from_live
from tfcompose.draw import Arrow, Graph
from tfcompose.emit.tree import pose_words
from tfcompose.observe.census import SETTLE_S, Census, topics_below
from tfcompose.pose import Pose, norm, normalised

if TYPE_CHECKING:
    from argparse import Namespace

    from tfcompose.draw.graph import Kind
    from tfcompose.observe.census import EdgeSeen

_SOMEBODY = "somebody"


def seen(arguments: Namespace) -> Graph | int:
    """Return the published tree as a graph, or the exit code: 1 if nothing is published, 2 for a bag that is none."""
    topics = topics_below(arguments.namespace)
    census = Census(settle_s=0.0 if arguments.bag else SETTLE_S)
    if arguments.bag:
        code = from_bag(arguments.bag, {topics: census})
    else:
        code = from_live("tfcompose_graph", {topics: census}, duration_s=arguments.duration)
    if code is not None:
        return code
    return graph_of_census(census, arguments.bag or topics[0], poses=arguments.poses)


def graph_of_census(census: Census, title: str, *, poses: bool = False) -> Graph:
    """Return what was seen as a graph: second parents and loops as they are, publishers as owners."""
    edges = census.edges(census.last_ns)
    return Graph(printable(title), (), tuple(_arrow(one, poses=poses) for one in edges))


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
    return pose_words(Pose(pose.xyz, normalised(pose.quat_xyzw))) if sound else "no rotation"
