"""Rules about the tree: parents, cycles, roots, and the order of REP-105's frames."""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING

from tfcompose.check.rule import rule
from tfcompose.findings import Finding, Note, Span, did_you_mean, finding
from tfcompose.tree import below, children_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Edge, Robot


@rule("TF201", of_urdf=True)
def two_parents(robot: Robot) -> Iterator[Finding]:
    """A frame hangs on two parents.

    tf2 keeps one parent for each frame, that of the newest message, and says nothing: the frame jumps between the two.
    Decide which one is meant. A camera whose driver publishes its own chain is mounted by the chain's first frame.
    """
    first: dict[str, Edge] = {}
    for edge in robot.edges:
        other = first.setdefault(edge.child, edge)
        if other.parent != edge.parent:
            message = f"{edge.child} has two parents: {other.parent} and {edge.parent}"
            notes = [Note(f"{other.name}, owned by {other.owner}, stands here", other.at)]
            yield finding("TF201", message, edge.at, notes=notes, help="keep one of the two edges")


@rule("TF202", of_urdf=True)
def cycle(robot: Robot) -> Iterator[Finding]:
    """Frames are each other's ancestors.

    A transform tree has no loops: a lookup through one never ends, and URDF refuses it. One of the edges points the
    wrong way; turn it round, or hang its child elsewhere.
    """
    above = {edge.child: edge for edge in reversed(robot.edges)}
    done: set[str] = set()
    for start in above:
        path: dict[str, None] = {}  # in order, and quick to look up
        frame = start
        while frame in above and frame not in done and frame not in path:
            path[frame] = None
            frame = above[frame].parent
        if frame in path:
            loop = list(path)[list(path).index(frame) :]
            names = " → ".join([*reversed(loop), loop[-1]])
            notes = [Note(above[child].name, above[child].at) for child in loop[1:]]
            yield finding("TF202", f"a cycle: {names}", above[loop[0]].at, notes=notes, help="one edge must go")
        done.update(path)
    for edge in robot.edges:
        for parent in edge.switched:
            path = {}
            frame = parent
            while frame != edge.child and frame in above and frame not in path:
                path[frame] = None
                frame = above[frame].parent
            if frame == edge.child:
                names = " → ".join((frame, *reversed(path), frame))
                message = f"a cycle when {edge.child} hangs on {parent}: {names}"
                yield finding("TF202", message, edge.at, help=f"remove {parent} from its parents")


#: For so many names the nearest one is looked for: among thousands that takes long, and thousands are no slips.
_MOST_SEARCHES = 50


@rule("TF203", of_urdf=True)
def unknown_frame(robot: Robot) -> Iterator[Finding]:
    """An edge names a frame that nothing declares.

    A frame is declared under ``frames`` or ``links``, or by a sensor. A misspelt parent would give a second tree that
    no lookup reaches.
    """
    searches = count(1)
    for edge in robot.edges:
        for parent in (edge.parent, *edge.switched) if edge.given else ():
            if parent not in robot.frames and not robot.excuses(parent):
                near = robot.frames if next(searches) <= _MOST_SEARCHES else ()
                advice = did_you_mean(parent, near, f"declare it: frames: {{{parent}: {{}}}}")
                yield finding("TF203", f"{edge.child} hangs on {parent}, which is no frame", edge.at, help=advice)
        if edge.child not in robot.frames and not robot.excuses(edge.child):
            near = robot.frames if next(searches) <= _MOST_SEARCHES else ()
            advice = did_you_mean(edge.child, near, f"declare it: links: {{{edge.child}: {{}}}}")
            message = f"the joint {edge.joint_name} moves {edge.child}, which is no link"
            yield finding("TF203", message, edge.child_at or edge.at, help=advice)


@rule("TF204", of_urdf=True)
def several_roots(robot: Robot) -> Iterator[Finding]:
    """The robot falls into several trees.

    Between frames of two trees there is no transform, so that nobody can reach the frames of the one from the other.
    Give every root but one a parent; a tree that nobody needs can go.
    """
    grown = _trees(robot)
    main = _main_root(robot, grown)
    for root, frames in grown.items():
        if root != main and len(frames) > 1 and not robot.excuses(root):
            message = f"{root} begins a tree of its own, with {len(frames)} frames: nothing ties it to {main}"
            notes = [Note(f"{main} is the root of the robot's tree", robot.frames[main])]
            yield finding("TF204", message, robot.frames[root], notes=notes, help=f"give {root} a parent")


@rule("TF205", of_urdf=True)
def edge_given_twice(robot: Robot) -> Iterator[Finding]:
    """One edge stands in two places.

    Both would be published, and which value counts depends on who joins when. Keep the one that is measured.
    """
    first: dict[tuple[str, str], Edge] = {}
    for edge in robot.edges:
        other = first.setdefault((edge.parent, edge.child), edge)
        if other is not edge and other.owner == edge.owner:
            notes = [Note("it stands here first", other.at)]
            yield finding("TF205", f"the edge {edge.name} is given twice", edge.at, notes=notes, help="remove one")


@rule("TF206", of_urdf=True)
def no_frames(robot: Robot) -> Iterator[Finding]:
    """The robot has no frames.

    There is nothing to publish and nothing to describe. A robot has at least a ``base_link``, under ``links``.
    """
    if not robot.frames and not robot.broken:
        yield finding(
            "TF206", f"{robot.name or 'the robot'} has no frames", Span(robot.file), help="links: {base_link: {}}"
        )


#: From the world inwards, as REP-105 orders them. base_footprint and base_link are one level: TF208 is about the two.
_LEVELS = {"earth": 0, "map": 1, "odom": 2, "base_footprint": 3, "base_link": 3}

#: No more edges are followed upwards than this.
_MOST_ANCESTORS = 100


@rule("TF207")
def wrong_chain_order(robot: Robot) -> Iterator[Finding]:
    """The frames earth, map, odom and base_link hang on each other in another order than REP-105 gives.

    Localisation publishes map → odom and odometry odom → base_link; navigation, SLAM and recorded data expect it so. A
    node that adds its edge to a chain in another order gives a frame a second parent. A level may be left out. Turn the
    edge round: its pose is then the inverse. Example: ``odom: {parent: map}``, ``base_link: {parent: odom}``.
    """
    above = {edge.child: edge for edge in reversed(robot.edges)}
    for edge in robot.edges:
        prefix, level = _level(edge.child)
        seen, parent = {edge.child}, edge.parent
        while level is not None and parent not in seen and len(seen) < _MOST_ANCESTORS:
            seen.add(parent)
            other_prefix, other = _level(parent)
            if other is not None and other > level and other_prefix in {prefix, ""}:
                message = f"{edge.child} hangs below {parent}; by REP-105 it is the other way round"
                advice = "the order is earth → map → odom → base_link; the pose of a turned edge is the inverse"
                yield finding("TF207", message, edge.at, help=advice)
                break
            parent = above[parent].parent if parent in above else parent


def _level(frame: str) -> tuple[str, int | None]:
    prefix, _, name = frame.rpartition("/")
    return prefix, _LEVELS.get(name)


@rule("TF208")
def base_footprint_below_base_link(robot: Robot) -> Iterator[Finding]:
    """The frame base_footprint hangs on base_link, and should be above it.

    base_footprint is the robot's place on the ground, which stays level while the robot pitches and rolls. Fixed below
    base_link it tilts along, and an odometry that is set to base_footprint would give it a second parent. Write
    ``base_link: {parent: base_footprint, xyz: [0, 0, 0.1]}``, and let odometry move base_footprint. On a robot that
    never tilts nothing is wrong but the name: then allow it.
    """
    for edge in robot.edges:
        prefix, _, name = edge.child.rpartition("/")
        above, _, parent = edge.parent.rpartition("/")
        if (name, parent) == ("base_footprint", "base_link") and prefix == above:
            message = f"{edge.child} hangs on {edge.parent}, and tilts with it"
            advice = f"turn it round: {edge.parent}: {{parent: {edge.child}}}, with the inverse pose"
            yield finding("TF208", message, edge.at, help=advice)


@rule("TF209", of_urdf=True)
def unused_frame(robot: Robot) -> Iterator[Finding]:
    """A link or a frame hangs on nothing, and nothing hangs on it.

    No joint and no mount uses it, nobody can ask where it is, and a URDF with it is refused. Give it a parent, or
    remove it.
    """
    grown = _trees(robot)
    main = _main_root(robot, grown)
    for root, frames in grown.items():
        if root != main and len(frames) == 1 and not robot.excuses(root):
            what = "link" if root in robot.links else "frame"
            message = f"the {what} {root} hangs on nothing, and nothing hangs on it"
            notes = [Note(f"{main} is the root of the robot's tree", robot.frames[main])]
            advice = f"give {root} a parent, or remove it"
            yield finding("TF209", message, robot.frames[root], notes=notes, help=advice)


def _trees(robot: Robot) -> dict[str, set[str]]:
    """Return the frames of each root's tree, the root too, in the order of declaration.

    A frame with parents in two trees is in both; frames that are each other's ancestors are in none.
    """
    children = children_of((edge.parent, edge.child) for edge in robot.edges)
    return {root: below(children, root) for root in robot.roots()}


def _main_root(robot: Robot, grown: dict[str, set[str]]) -> str:
    """Return the root of the tree that holds the robot's base, or of the largest one; empty where there is none."""
    return max(grown, key=lambda root: (robot.base in grown[root], len(grown[root])), default="")
