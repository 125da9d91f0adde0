"""What is wrong with the tree's shape."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding, slip_of
from tfcompose.observe.refused import refused_transform
from tfcompose.observe.seen import counted, listed, who
from tfcompose.tree import loops, trees

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.observe.census import EdgeSeen
    from tfcompose.observe.seen import Seen


#: So many publishers are named of one frame.
MOST_NOTES = 8


def self_transform(seen: Seen) -> Iterator[Finding]:
    """A frame is published in itself."""
    for edge in seen.edges:
        if edge.strand.parent == edge.strand.child:
            message = f"{who(edge)} publishes {edge.name}, a frame in itself, which tf2 drops"
            advice = "give the node's child frame another name, or switch its TF off"
            yield finding("TF821", message, None, severity="warning", help=advice)


def drops(seen: Seen) -> Iterator[Finding]:
    """Transforms come that no listener takes: a quaternion that is none, a NaN, an empty name."""
    for edge in seen.edges:
        yield from refused_transform(edge)


def slash_in_front(seen: Seen) -> Iterator[Finding]:
    """Names come with a slash in front, which tf2 drops, and does not take in lookups."""
    found: dict[str, list[EdgeSeen]] = {}
    for edge in seen.taken:
        if edge.strand.slashed:
            found.setdefault(who(edge), []).append(edge)
    for publisher, edges in found.items():
        more = f" and {counted(len(edges) - 1, 'more edge')}" if len(edges) > 1 else ""
        message = (
            f"{publisher} publishes {edges[0].name}{more} with a slash in front of a frame's name, which tf2 drops"
        )
        advice = "write the node's frame names without it: lookups of a name that begins with / fail"
        yield finding("TF501", message, None, severity="warning", help=advice)


def loop(seen: Seen) -> Iterator[Finding]:
    """Frames are each other's ancestors, so that tf2 finds no way through them."""
    for frames in loops(_pairs(seen)):
        on_it = [edge for edge in seen.taken if _is_on(edge, frames)]
        way = " → ".join((*frames, frames[0]))
        message = f"the frames {way} are a loop: tf2 finds no way through them"
        notes = [Note(f"{edge.name} is published by {who(edge)}") for edge in on_it]
        elsewhere = [edge for edge in seen.taken if edge.strand.child in frames and edge.strand.parent not in frames]
        notes += [Note(f"{edge.name}, which leads out of the loop, is published by {who(edge)}") for edge in elsewhere]
        nodes = {who(edge) for edge in on_it}
        advice = "end one of these nodes, or turn its edge round"
        if len(nodes) == 1 and not elsewhere:
            advice = f"let {nodes.pop()} leave one of these edges out"
        yield finding("TF820", message, None, notes=notes, help=advice)


def second_parent(seen: Seen) -> Iterator[Finding]:
    """A frame hangs on two parents; tf2 takes whichever came last."""
    above, planned = _above(seen), seen.planned
    in_loops = {frame for frames in loops(_pairs(seen)) for frame in frames}
    for child, edges in above.items():
        parents = sorted({edge.strand.parent for edge in edges})
        if len(parents) < 2 or child in in_loops or child in planned:  # noqa: PLR2004 (two parents)
            continue
        if _hands_over(edges):
            continue  # one node hands it over, which is what a gripper does
        message = f"{child} has {len(parents)} parents: {_both(parents)}; tf2 takes whichever came last"
        notes = [Note(_said(seen, edge)) for edge in edges[:MOST_NOTES]]
        nodes = {who(edge) for edge in edges}
        advice = f"let one node publish {child}: end the other, or switch its TF off"
        if len(nodes) == 1:
            advice = f"let {nodes.pop()} send one of them, or end it if it runs twice"
        yield finding("TF802", message, None, notes=notes, help=advice)


def two_trees(seen: Seen) -> Iterator[Finding]:
    """Frames are in trees that nothing connects."""
    found = trees_of(seen)
    expected = {edge.parent for edge in seen.plan.edges} - seen.planned if seen.plan else frozenset()
    if len(found) < 2 or set(found) <= expected:  # noqa: PLR2004 (one tree is right)
        return
    first, *others = found
    for root in others:
        if found[root] & found[first]:
            continue  # a frame with two parents connects them, and is a finding of its own
        message = f"nothing connects {_tree(root, found[root])} with {_tree(first, found[first])}"
        publishers = {who(edge): None for edge in seen.taken if edge.strand.child in found[root]}
        notes = [Note(f"{root} and what is below it is published by {listed(list(publishers))}")]
        yield finding("TF830", message, None, notes=notes, help=_bridge(seen, root, found[first], found[root]))


def trees_of(seen: Seen) -> dict[str, set[str]]:
    """Return the frames of each tree by its root, the largest tree first; frames on loops have no root."""
    return trees(_pairs(seen))


def _bridge(seen: Seen, root: str, main: set[str], own: set[str]) -> str:
    """Return what would connect the tree below ``root`` with the main one."""
    for edge in seen.plan.edges if seen.plan else ():
        if (edge.parent in main) != (edge.child in main) and (edge.parent in own) != (edge.child in own):
            return f"{edge.name} is missing: {edge.owner} ({edge.node}) should publish it"
    for joint in seen.movable:
        if {joint.parent, joint.child} & own and {joint.parent, joint.child} & main:
            return f"{joint.parent} → {joint.child} is missing: the joint {joint.name} of robot_description moves it"
    slip = slip_of(root, main)
    if slip:
        return f"is {root} meant to be {slip}? One of the two names is misspelt"
    for name in sorted(main):
        if root.rpartition("/")[2] == name.rpartition("/")[2]:
            return f"is {root} meant to be {name}? One of the two has a frame_prefix too much or too little"
    return f"publish the edge that leads to {root}; is the node that should do it running?"


def _tree(root: str, frames: set[str]) -> str:
    some = sorted(frames - {root})
    return f"the tree below {root} ({listed(some)})"


def _said(seen: Seen, edge: EdgeSeen) -> str:
    where = seen.where(edge)
    rate = f" at {edge.timing.rate:.3g} Hz" if edge.timing.rate and not edge.strand.static else ""
    return f"{edge.name} is published by {who(edge)}{rate}{', ' if where else ''}{where}"


def _both(names: list[str]) -> str:
    return " and ".join(names) if len(names) < MOST_NOTES else listed(names)


def _hands_over(edges: list[EdgeSeen]) -> bool:
    """Whether they are all of one publisher, who puts the frame now in this parent, now in that."""
    turns = edges[0].strand.turns
    return turns is not None and turns.are_taken and len(turns.strands) == len(edges)


def _above(seen: Seen) -> dict[str, list[EdgeSeen]]:
    above: dict[str, list[EdgeSeen]] = {}
    for edge in seen.taken:
        if edge.strand.parent != edge.strand.child:
            above.setdefault(edge.strand.child, []).append(edge)
    return above


def _is_on(edge: EdgeSeen, frames: tuple[str, ...]) -> bool:
    pairs = zip(frames, (*frames[1:], frames[0]), strict=True)
    return (edge.strand.parent, edge.strand.child) in set(pairs)


def _pairs(seen: Seen) -> list[tuple[str, str]]:
    return [(edge.strand.parent, edge.strand.child) for edge in seen.taken]
