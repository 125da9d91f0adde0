"""The shape of the tree: loops, second parents, several trees, and transforms that tf2 drops."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, finding, slip_of
from tfcompose.foundation.geometry import norm
from tfcompose.foundation.text import list_names, with_more
from tfcompose.foundation.tree import loops, trees
from tfcompose.tf.live.edges import LEAST_LENGTH
from tfcompose.tf.live.state import who

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from tfcompose.tf.live.edges import EdgeState
    from tfcompose.tf.live.state import TreeState


#: Maximum number of publishers of a frame that get a note each.
MOST_NOTES = 8
#: The effect of two publishers of a frame.
LAST_WINS = "tf2 keeps the last transform it received"
_FIX = "fix what the node computes it from; until then the frame does not exist"
_FIX_SOME = "fix what the node computes it from; tf2 uses the messages before and after"
_NORMALISE = (
    "normalise it in the node: RViz shows the frame anyway, because tf2 on Jazzy normalises it,"
    " but stricter readers drop it"
)


# Findings.


def way(frames: Sequence[str]) -> str:
    """Return the frames as a path down the tree."""
    return " → ".join(frames)


def loop_message(frames: Sequence[str], closed_by: str = "") -> str:
    """Return the message for a loop of frames, with the publisher that closed it if known."""
    return f"the frames {way(frames)} form a loop" + (
        f", closed by {closed_by}" if closed_by else ""
    )


def loop_help(end: str) -> str:
    """Return the help for a loop; ``end`` is the advice to stop a node."""
    return f"{end}, or swap parent and child of that edge: tf2 finds no way through a loop"


def self_message(edges: str, publisher: str) -> str:
    """Return the message for a frame that is its own parent."""
    return f"{publisher} publishes {edges}, a frame as its own parent, which tf2 drops"


SELF_HELP = "give the node's child frame another name, or disable its TF output"


def two_parents_message(child: str, parents: Sequence[tuple[str, str]]) -> str:
    """Return the message for a frame with several parents and their publishers."""
    by_parent: dict[str, list[str]] = {}
    for parent, publisher in parents:
        by_parent.setdefault(parent, []).append(publisher)
    each = [
        f"{parent} (from {' and '.join(dict.fromkeys(who))})" for parent, who in by_parent.items()
    ]
    if len(each) == 2:  # noqa: PLR2004 (two)
        return f"{child} has two parents: {' and '.join(each)}"
    return f"{child} has {len(each)} parents: {list_names(each)}"


# At the end.


def self_transform(state: TreeState) -> Iterator[Finding]:
    """A frame is published as its own parent."""
    for edge in state.edges:
        if edge.parent == edge.child:
            yield finding(
                "TF821",
                self_message(edge.name, who(edge)),
                None,
                severity="warning",
                help=SELF_HELP,
            )


def drops(state: TreeState) -> Iterator[Finding]:
    """Transforms arrive that every listener drops: no unit quaternion, NaN, or an empty name."""
    for edge in state.edges:
        yield from rejected_transforms(edge)


def rejected_transforms(edge: EdgeState) -> Iterator[Finding]:
    """Yield the finding for an edge whose transforms tf2 drops, unless it is a self-loop."""
    stream = edge.stream
    if stream.rejected is None or edge.parent == edge.child:
        return
    what, why, advice = "which tf2 drops", stream.rejected.text, _FIX
    if stream.rejections < stream.arrivals.count:
        advice = _FIX_SOME
    length = norm((stream.rejected_row or stream.row)[7:11])
    if stream.rejected.name == "DENORMALISED":
        why = f"its quaternion has length {length:.3f}"
        if length > LEAST_LENGTH:
            what, advice = "which is not a rotation", _NORMALISE
    name = f"{stream.parent or '(no frame)'} → {stream.child or '(no frame)'}"
    often = "" if stream.static else f" ({stream.rejections} of {stream.arrivals.count})"
    message = f"{who(edge)} publishes {name}, {what}: {why}{often}"
    yield finding("TF831", message, None, help=advice)


def slash_in_front(state: TreeState) -> Iterator[Finding]:
    """Names begin with a slash, which tf2 strips from messages but rejects in lookups."""
    states: dict[str, list[EdgeState]] = {}
    for edge in state.taken:
        if edge.stream.slashed:
            states.setdefault(who(edge), []).append(edge)
    for publisher, edges in states.items():
        named = with_more(edges[0].name, len(edges) - 1)
        message = (
            f"{publisher} publishes {named} with a slash in front of a frame's name, which tf2"
            " drops"
        )
        advice = (
            "write the node's frame names without it: lookups of a name that begins with / fail"
        )
        yield finding("TF501", message, None, severity="warning", help=advice)


def loop(state: TreeState) -> Iterator[Finding]:
    """Frames are ancestors of each other, so tf2 finds no path between them."""
    for frames in loops(_pairs(state)):
        on_it = [edge for edge in state.taken if _is_on(edge, frames)]
        message = loop_message((*frames, frames[0]))
        notes = [Note(f"{edge.name} is published by {who(edge)}") for edge in on_it]
        elsewhere = [
            edge for edge in state.taken if edge.child in frames and edge.parent not in frames
        ]
        notes += [
            Note(f"{edge.name}, which leads out of the loop, is published by {who(edge)}")
            for edge in elsewhere
        ]
        nodes = {who(edge) for edge in on_it}
        advice = loop_help("end one of these nodes")
        if len(nodes) == 1 and not elsewhere:
            advice = f"let {nodes.pop()} leave one of these edges out"
        yield finding("TF820", message, None, notes=notes, help=advice)


def second_parent(state: TreeState) -> Iterator[Finding]:
    """A frame has two parents, and tf2 uses the parent received last."""
    above, planned = _above(state), state.planned
    in_loops = {frame for frames in loops(_pairs(state)) for frame in frames}
    for child, edges in above.items():
        parents = sorted({edge.parent for edge in edges})
        if len(parents) < 2 or child in in_loops or child in planned:  # noqa: PLR2004 (two parents)
            continue
        if _hands_over(edges):
            continue  # a single node switches its parent, as a gripper does
        message = two_parents_message(child, [(edge.parent, who(edge)) for edge in edges])
        notes = [Note(_describe_edge(state, edge)) for edge in edges[:MOST_NOTES]]
        nodes = {who(edge) for edge in edges}
        advice = f"let one node publish {child}: stop the other, or disable its TF output"
        if len(nodes) == 1:
            advice = f"let {nodes.pop()} send one of them, or stop it if it runs twice"
        advice += f"; {LAST_WINS}"
        yield finding("TF802", message, None, notes=notes, help=advice)


def two_trees(state: TreeState) -> Iterator[Finding]:
    """The frames form several unconnected trees."""
    trees = trees_of(state)
    expected = (
        {edge.parent for edge in state.plan.edges} - state.planned if state.plan else frozenset()
    )
    if len(trees) < 2 or set(trees) <= expected:  # noqa: PLR2004 (one tree is right)
        return
    first, *further_roots = trees
    for root in further_roots:
        if trees[root] & trees[first]:
            continue  # a frame with two parents connects them, which another finding reports
        message = f"nothing connects {_tree(root, trees[root])} with {_tree(first, trees[first])}"
        publishers = {who(edge): None for edge in state.taken if edge.child in trees[root]}
        notes = [
            Note(f"{root} and what is below it is published by {list_names(list(publishers))}")
        ]
        yield finding(
            "TF830",
            message,
            None,
            notes=notes,
            help=_bridge(state, root, trees[first], trees[root]),
        )


def trees_of(state: TreeState) -> dict[str, set[str]]:
    """Return the frames of each tree by its root, the largest tree first.

    Frames on loops belong to no tree.
    """
    return trees(_pairs(state))


def _bridge(state: TreeState, root: str, main: set[str], frames: set[str]) -> str:
    """Return the help to connect the tree below ``root`` with the main one."""
    for edge in state.plan.edges if state.plan else ():
        if (edge.parent in main) != (edge.child in main) and (edge.parent in frames) != (
            edge.child in frames
        ):
            return f"{edge.name} is missing: {edge.owner} ({edge.node}) should publish it"
    for joint in state.moving_joints:
        if {joint.parent, joint.child} & frames and {joint.parent, joint.child} & main:
            return (
                f"{joint.parent} → {joint.child} is missing: the joint {joint.name} of"
                " robot_description moves it"
            )
    slip = slip_of(root, main)
    if slip:
        return f"is {root} meant to be {slip}? One of the two names is misspelt"
    for name in sorted(main):
        if root.rpartition("/")[2] == name.rpartition("/")[2]:
            return (
                f"is {root} meant to be {name}? One of the two has a frame_prefix too many or"
                " too few"
            )
    return f"publish the edge that leads to {root}; is the node that should do it running?"


def _tree(root: str, frames: set[str]) -> str:
    some = sorted(frames - {root})
    return f"the tree below {root} ({list_names(some)})"


def _describe_edge(state: TreeState, edge: EdgeState) -> str:
    where = state.where(edge)
    rate = f" at {edge.timing.rate:.3g} Hz" if edge.timing.rate and not edge.stream.static else ""
    return f"{edge.name} is published by {who(edge)}{rate}{', ' if where else ''}{where}"


def _hands_over(edges: list[EdgeState]) -> bool:
    """Return whether all edges come from a single publisher that alternates between parents."""
    handover = edges[0].stream.handover
    return handover is not None and handover.is_one and len(handover.streams) == len(edges)


def _above(state: TreeState) -> dict[str, list[EdgeState]]:
    above: dict[str, list[EdgeState]] = {}
    for edge in state.taken:
        if edge.parent != edge.child:
            above.setdefault(edge.child, []).append(edge)
    return above


def _is_on(edge: EdgeState, frames: tuple[str, ...]) -> bool:
    pairs = zip(frames, (*frames[1:], frames[0]), strict=True)
    return (edge.parent, edge.child) in set(pairs)


def _pairs(state: TreeState) -> list[tuple[str, str]]:
    return [(edge.parent, edge.child) for edge in state.taken]
