"""Rules about the tree: parents, cycles, roots, and the order of REP-105's frames."""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING

from tfcompose.compiler.check.names import valid_name
from tfcompose.compiler.check.rule import rule
from tfcompose.foundation.findings import Finding, Note, Span, did_you_mean, finding
from tfcompose.foundation.tree import below, children_of
from tfcompose.model.robot import advise_left_out

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model.robot import Edge, Robot


@rule("TF201", of_urdf=True)
def two_parents(robot: Robot) -> Iterator[Finding]:
    first: dict[str, Edge] = {}
    for edge in robot.edges:
        first_edge = first.setdefault(edge.child, edge)
        if first_edge.parent != edge.parent:
            message = f"{edge.child} has two parents: {first_edge.parent} and {edge.parent}"
            notes = [
                Note(
                    f"{first_edge.name} is defined here, owned by {first_edge.owner}",
                    first_edge.span,
                )
            ]
            advice = "remove one of the two edges, or swap parent and child of one"
            yield finding("TF201", message, edge.span, notes=notes, help=advice)


@rule("TF202", of_urdf=True)
def cycle(robot: Robot) -> Iterator[Finding]:
    above = {edge.child: edge for edge in reversed(robot.edges)}
    done: set[str] = set()
    for start in above:
        path: dict[str, None] = {}  # keys only: keeps the order, and lookup is fast
        frame = start
        while frame in above and frame not in done and frame not in path:
            path[frame] = None
            frame = above[frame].parent
        if frame in path:
            loop = list(path)[list(path).index(frame) :]
            names = " → ".join([*reversed(loop), loop[-1]])
            notes = [
                Note(f"{above[child].name} is defined here", above[child].span)
                for child in loop[1:]
            ]
            advice = (
                "parent and child of one of these edges are probably swapped: swap them, or remove"
                " that edge"
            )
            if len(loop) == 1:
                advice = f"remove the parent of {frame}"
                if frame in robot.mounted.values():
                    advice += (
                        f", and let the part share the frame: ros: {{shared_frames: [{frame}]}}"
                    )
            yield finding(
                "TF202", f"cycle: {names}", above[loop[0]].span, notes=notes, help=advice
            )
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
                message = f"cycle while {parent} is the parent of {edge.child}: {names}"
                yield finding(
                    "TF202",
                    message,
                    edge.span,
                    help=f"remove {parent} from the parents of {edge.child}",
                )


#: Maximum number of unknown names for which the rule searches the nearest frame. A search among
#: thousands of frames is slow, and thousands of unknown names are not typing errors.
_MOST_SEARCHES = 50


@rule("TF203", of_urdf=True)
def unknown_frame(robot: Robot) -> Iterator[Finding]:
    searches = count(1)
    moved = {edge.child for edge in robot.edges if edge.joint_name}
    invalid = {valid_name(name) for name in robot.frames} - robot.frames.keys()  # TF501

    def advice(name: str, span: Span, section: str, child: str = "") -> str:
        if conditional := advise_left_out(robot.conditions, name):
            return conditional
        near = robot.frames if next(searches) <= _MOST_SEARCHES else ()
        declare = (
            f'add <link name="{name}"/>'
            if robot.is_foreign(span)
            else f"declare it: {section}: {{{name}: {{}}}}"
        )
        return did_you_mean(name, [candidate for candidate in near if candidate != child], declare)

    for edge in robot.edges:
        for parent in (edge.parent, *edge.switched) if edge.declared else ():
            if (
                parent not in robot.frames
                and parent not in invalid
                and not robot.tolerates(parent)
            ):
                message = f"{edge.child}: unknown parent frame {parent}"
                section = "links" if parent in moved else "frames"
                yield finding(
                    "TF203",
                    message,
                    edge.span,
                    help=advice(parent, edge.span, section, edge.child),
                )
        if edge.child not in robot.frames and not robot.tolerates(edge.child):
            span = edge.child_at or edge.span
            message = f"joint {edge.joint_name}: unknown child link {edge.child}"
            yield finding("TF203", message, span, help=advice(edge.child, span, "links"))


@rule("TF204", of_urdf=True)
def several_roots(robot: Robot) -> Iterator[Finding]:
    grown = _trees(robot)
    main = _main_root(robot, grown)
    for root, frames in grown.items():
        if root != main and len(frames) > 1 and not robot.tolerates(root):
            span = robot.frames[root]
            message = (
                f"{root} is not connected to {main}: it is the root of a separate tree with"
                f" {len(frames)} frames"
            )
            notes = [
                Note(f"{main}, the root of the robot's tree, is declared here", robot.frames[main])
            ]
            advice = f"give {root} a parent"
            if robot.is_foreign(span):
                advice = "connect the trees with a fixed joint"
            elif "/" in root and root in robot.mounted.values():
                advice += (
                    f", or share the frame: ros: {{shared_frames: [{root.rpartition('/')[2]}]}}"
                )
            yield finding("TF204", message, span, notes=notes, help=advice)


@rule("TF205", of_urdf=True)
def edge_given_twice(robot: Robot) -> Iterator[Finding]:
    first: dict[tuple[str, str], Edge] = {}
    for edge in robot.edges:
        first_edge = first.setdefault((edge.parent, edge.child), edge)
        has_owners = not robot.is_foreign(edge.span)
        if first_edge is not edge and not (has_owners and first_edge.owner != edge.owner):
            notes = [Note("first defined here", first_edge.span)]
            yield finding(
                "TF205",
                f"edge {edge.name} is defined twice",
                edge.span,
                notes=notes,
                help="remove one",
            )


@rule("TF206", of_urdf=True)
def no_frames(robot: Robot) -> Iterator[Finding]:
    if not robot.frames and not robot.broken:
        span = Span(robot.file)
        advice = '<link name="base_link"/>' if robot.is_foreign(span) else "links: {base_link: {}}"
        yield finding(
            "TF206", f"{robot.name or 'the robot'} has no frames", span, help=f"add {advice}"
        )


#: Levels of REP-105's frames, from the world to the robot. base_footprint and base_link share a
#: level; TF208 checks their order.
_LEVELS = {"earth": 0, "map": 1, "odom": 2, "base_footprint": 3, "base_link": 3}

#: Maximum number of edges to follow upwards.
_MOST_ANCESTORS = 100


@rule("TF207")
def wrong_chain_order(robot: Robot) -> Iterator[Finding]:
    yield from _base_not_below_odom(robot)
    above = {edge.child: edge for edge in reversed(robot.edges)}
    for edge in robot.edges:
        prefix, level = _level(edge.child)
        passed, parent = {edge.child}, edge.parent
        while level is not None and parent not in passed and len(passed) < _MOST_ANCESTORS:
            passed.add(parent)
            parent_prefix, parent_level = _level(parent)
            if parent_level is not None and parent_level > level and parent_prefix in {prefix, ""}:
                message = (
                    f"{edge.child} is below {parent}; REP-105 has {parent} below {edge.child}"
                )
                advice = (
                    "the order is earth → map → odom → base_link: swap parent and child, and"
                    " invert the pose"
                )
                yield finding("TF207", message, edge.span, help=advice)
                break
            parent = above[parent].parent if parent in above else parent


def _base_not_below_odom(robot: Robot) -> Iterator[Finding]:
    """Yield a finding if odom and the base are on two branches below the same frame."""
    for odom in robot.frames:
        prefix, _, name = odom.rpartition("/")
        around = robot.parent_edge(odom)
        if name != "odom" or around is None:
            continue
        bases = (f"{prefix}/{base}".lstrip("/") for base in ("base_footprint", "base_link"))
        for base in bases:
            edge = robot.parent_edge(base)
            if edge is None or odom in edge.switched:
                continue
            outside = robot.below(around.parent) - robot.below(odom)
            if base in outside and odom not in robot.below(base):
                message = f"{base} is beside {odom}, not below it: both are below {around.parent}"
                notes = [Note(f"{odom} is defined here", around.span)]
                advice = f"write {base}: {{parent: {odom}}}, which odometry publishes"
                yield finding("TF207", message, edge.span, help=advice, notes=notes)
            break


def _level(frame: str) -> tuple[str, int | None]:
    prefix, _, name = frame.rpartition("/")
    return prefix, _LEVELS.get(name)


@rule("TF208")
def base_footprint_below_base_link(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        prefix, _, name = edge.child.rpartition("/")
        above, _, parent = edge.parent.rpartition("/")
        if (name, parent) == ("base_footprint", "base_link") and prefix == above:
            message = f"{edge.child} is a child of {edge.parent}, so it tilts with the robot"
            advice = (
                f"swap the two: {edge.parent}: {{parent: {edge.child}}}, with the inverse pose"
            )
            yield finding("TF208", message, edge.span, help=advice)


@rule("TF209", of_urdf=True)
def unused_frame(robot: Robot) -> Iterator[Finding]:
    grown = _trees(robot)
    main = _main_root(robot, grown)
    for root, frames in grown.items():
        if root != main and len(frames) == 1 and not robot.tolerates(root):
            span = robot.frames[root]
            message = (
                f"{'link' if root in robot.links else 'frame'} {root} has neither a parent nor a"
                " child"
            )
            notes = [
                Note(f"{main}, the root of the robot's tree, is declared here", robot.frames[main])
            ]
            joint = robot.is_foreign(span)
            advice = (
                "remove it, or connect it with a joint"
                if joint
                else f"give {root} a parent, or remove it"
            )
            yield finding("TF209", message, span, notes=notes, help=advice)


def _trees(robot: Robot) -> dict[str, set[str]]:
    """Return the frames of each root's tree, including the root, in order of declaration.

    A frame with parents in two trees is in both trees. Frames of a cycle are in no tree.
    """
    children = children_of((edge.parent, edge.child) for edge in robot.edges)
    return {root: below(children, root) for root in robot.roots()}


def _main_root(robot: Robot, grown: dict[str, set[str]]) -> str:
    """Return the root of the tree that holds the robot's base, otherwise of the largest tree.

    Empty if there is no tree.
    """
    return max(grown, key=lambda root: (robot.base in grown[root], len(grown[root])), default="")
