"""Trees of frames: descendants, ancestors, roots, loops, and drawing as text.

Edges are (parent, child) pairs of names. Declared or observed edges need not form a tree. A frame
may have several parents, and frames may be ancestors of each other. Every function in this module
terminates for such edges, except ``draw_tree``, and its docstring states the result.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    Edge = tuple[str, str]

_Item = TypeVar("_Item")

#: Maximum number of indented levels in a drawing, because the depth of a branch widens all lines.
DEEPEST_DRAWN = 50


def children_of(edges: Iterable[Edge]) -> dict[str, list[str]]:
    """Return the children of each parent without duplicates, in the order of the edges."""
    children: dict[str, dict[str, None]] = {}
    for parent, child in edges:
        children.setdefault(parent, {})[child] = None
    return {parent: list(children) for parent, children in children.items()}


def parents_of(edges: Iterable[Edge]) -> dict[str, list[str]]:
    """Return the parents of each child without duplicates, in the order of the edges."""
    return children_of((child, parent) for parent, child in edges)


def below(children: Mapping[str, Sequence[str]], frame: str) -> set[str]:
    """Return the frame and every frame below it."""
    reached, waiting = {frame}, [frame]
    while waiting:
        new = [child for child in children.get(waiting.pop(), ()) if child not in reached]
        reached.update(new)
        waiting += new
    return reached


def trees(edges: Iterable[Edge]) -> dict[str, set[str]]:
    """Return the frames of each tree by its root, the largest tree first, then by name.

    A frame with parents in two trees is in both. Frames of a loop without a root above it are in
    no tree.
    """
    children = children_of(edges)
    has_parent = {child for some in children.values() for child in some}
    frames_by_root = {root: below(children, root) for root in sorted(children.keys() - has_parent)}
    return dict(sorted(frames_by_root.items(), key=lambda item: -len(item[1])))


def way_up(frame: str, parent_of: Callable[[str], str | None]) -> list[str]:
    """Return the frame and its ancestors, up to a root or before a repeated frame."""
    way = {frame: None}
    parent = parent_of(frame)
    while parent is not None and parent not in way:
        way[parent] = None
        parent = parent_of(parent)
    return list(way)


def loop_closed_by(edge: Edge, parent_of: Callable[[str], str | None]) -> tuple[str, ...]:
    """Return the loop that an additional edge closes, from its child down to its child.

    Empty if it closes none. ``parent_of`` returns the parent of a frame. Its result for the edge's
    child is ignored.
    """
    parent, child = edge
    way = way_up(parent, lambda frame: None if frame == child else parent_of(frame))
    return (*reversed(way), child) if way[-1] == child else ()


def loops(edges: Iterable[Edge]) -> list[tuple[str, ...]]:
    """Return each loop once, from its alphabetically first frame downwards.

    Each frame in loops contributes at most one loop. A frame that is its own parent is a loop of
    length 1.
    """
    parents = _around_loops(parents_of(edges))
    cycles: dict[frozenset[str], tuple[str, ...]] = {}
    done: set[str] = set()  # frames whose only way up is a known loop
    for start in sorted(parents):
        loop = () if start in done else _shortest_loop(parents, start)
        if all(len(parents[frame]) == 1 for frame in loop):
            done.update(loop)
        if loop and frozenset(loop) not in cycles:
            first = loop.index(min(loop))
            cycles[frozenset(loop)] = (*loop[first:], *loop[:first])
    return list(cycles.values())


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
        for ahead, back in ((above, below), (below, above)):
            for neighbour in ahead.get(frame, ()):
                back[neighbour].discard(frame)
                if not back[neighbour] and neighbour not in outside:
                    ends.append(neighbour)
    return {
        frame: [parent for parent in some if parent not in outside]
        for frame, some in parents.items()
        if frame not in outside
    }


def _shortest_loop(parents: Mapping[str, Sequence[str]], start: str) -> tuple[str, ...]:
    """Return the shortest path from ``start`` down to ``start``; empty without one."""
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
    """Yield all descendants of the root in drawing order, each with its tree lines.

    ``children`` are frames or edges; ``name_of`` returns the frame of an item. The frames must
    form a tree, because the function does not end below a loop. Levels deeper than
    ``DEEPEST_DRAWN`` are not indented further, and show the number of further levels.
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
