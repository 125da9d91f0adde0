"""Trees of frames: descendants, ancestors, roots, loops, and drawing as text.

Edges are (parent, child) pairs of names. What was declared or seen need be no tree: a frame may
have several parents, and frames may be each other's ancestors. Every function here ends all the
same, and says what it makes of that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    Edge = tuple[str, str]

_Item = TypeVar("_Item")

#: So many levels are indented in a drawing: the width of all lines grows with the depth of one.
DEEPEST_DRAWN = 50


def children_of(edges: Iterable[Edge]) -> dict[str, list[str]]:
    """Return the children of each parent, in the order of the edges; a child comes once."""
    found: dict[str, dict[str, None]] = {}
    for parent, child in edges:
        found.setdefault(parent, {})[child] = None
    return {parent: list(children) for parent, children in found.items()}


def parents_of(edges: Iterable[Edge]) -> dict[str, list[str]]:
    """Return the parents of each child, in the order of the edges; a parent comes once."""
    return children_of((child, parent) for parent, child in edges)


def below(children: Mapping[str, Sequence[str]], frame: str) -> set[str]:
    """Return the frame and every frame below it."""
    found, waiting = {frame}, [frame]
    while waiting:
        new = [child for child in children.get(waiting.pop(), ()) if child not in found]
        found.update(new)
        waiting += new
    return found


def trees(edges: Iterable[Edge]) -> dict[str, set[str]]:
    """Return the frames of each tree by its root, the largest tree first, then by name.

    A frame with parents in two trees is in both; frames in a loop that hangs on no root are in
    none.
    """
    children = children_of(edges)
    has_parent = {child for some in children.values() for child in some}
    found = {root: below(children, root) for root in sorted(children.keys() - has_parent)}
    return dict(sorted(found.items(), key=lambda item: -len(item[1])))


def way_up(frame: str, parent_of: Callable[[str], str | None]) -> list[str]:
    """Return the frame and its ancestors, up to a root or before a repeated frame."""
    way = {frame: None}
    parent = parent_of(frame)
    while parent is not None and parent not in way:
        way[parent] = None
        parent = parent_of(parent)
    return list(way)


def loop_closed_by(edge: Edge, parent_of: Callable[[str], str | None]) -> tuple[str, ...]:
    """Return the loop that a further edge closes, from its child down to that again.

    () if it closes none.

    ``parent_of`` says which parent a frame has; what it says of the edge's child does not matter.
    """
    parent, child = edge
    way = way_up(parent, lambda frame: None if frame == child else parent_of(frame))
    return (*reversed(way), child) if way[-1] == child else ()


def loops(edges: Iterable[Edge]) -> list[tuple[str, ...]]:
    """Return each loop once, from its first frame by name downwards.

    At most one for each frame that is in loops.

    A frame that is its own parent is a loop of one.
    """
    parents = _around_loops(parents_of(edges))
    found: dict[frozenset[str], tuple[str, ...]] = {}
    done: set[str] = set()  # frames whose only way up is a loop that was found
    for start in sorted(parents):
        loop = () if start in done else _shortest_loop(parents, start)
        if all(len(parents[frame]) == 1 for frame in loop):
            done.update(loop)
        if loop and frozenset(loop) not in found:
            first = loop.index(min(loop))
            found[frozenset(loop)] = (*loop[first:], *loop[:first])
    return list(found.values())


def _around_loops(parents: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Return the parents of frames that are on loops or between two loops."""
    above = {frame: set(some) for frame, some in parents.items()}
    below: dict[str, set[str]] = {}
    for frame, some in parents.items():
        for parent in some:
            below.setdefault(parent, set()).add(frame)
    ends = [frame for frame in {**above, **below} if not above.get(frame) or not below.get(frame)]
    outside: set[str] = set()
    while ends:
        frame = ends.pop()
        outside.add(frame)
        for there, back in ((above, below), (below, above)):
            for other in there.get(frame, ()):
                back[other].discard(frame)
                if not back[other] and other not in outside:
                    ends.append(other)
    return {
        frame: [parent for parent in some if parent not in outside]
        for frame, some in parents.items()
        if frame not in outside
    }


def _shortest_loop(parents: Mapping[str, Sequence[str]], start: str) -> tuple[str, ...]:
    """Return the frames from ``start`` down to it again, by the shortest way, or nothing."""
    came_from: dict[str, str] = {}
    waiting = [start]
    for frame in waiting:
        for parent in parents.get(frame, ()):
            if parent == start:
                way = [frame]
                while way[-1] != start:
                    way.append(came_from[way[-1]])
                return (start, *way[:-1])
            if parent not in came_from:
                came_from[parent] = frame
                waiting.append(parent)
    return ()


def draw_tree(
    children: Mapping[str, Sequence[_Item]], root: str, name_of: Callable[[_Item], str]
) -> Iterator[tuple[str, _Item]]:
    """Yield what is below the root in the order of a drawing, each with the lines that lead to it.

    ``children`` are frames, or edges to them; ``name_of`` returns the frame of one. It has to be a
    tree: below a loop this does not end. What is deeper than ``DEEPEST_DRAWN`` stays in its
    column, with the number of further levels.
    """

    def level(frame: str, indent: str, depth: int) -> list[tuple[str, int, _Item, bool]]:
        some = children.get(frame, ())
        return [(indent, depth, item, index == len(some) - 1) for index, item in enumerate(some)][
            ::-1
        ]

    waiting = level(root, "", 1)
    while waiting:
        indent, depth, item, is_last = waiting.pop()
        deeper = f"+{depth - DEEPEST_DRAWN} " if depth > DEEPEST_DRAWN else ""
        yield f"{indent}{deeper}{'└── ' if is_last else '├── '}", item
        inner = indent if depth >= DEEPEST_DRAWN else indent + ("    " if is_last else "│   ")
        waiting += level(name_of(item), inner, depth + 1)
