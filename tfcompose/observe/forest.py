"""The trees that published edges make: several where they do not hang together, and what hangs in a loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from tfcompose.observe.census import EdgeSeen
    from tfcompose.plan import PlanEdge


@dataclass(frozen=True, slots=True)
class Branch:
    """A frame in a tree. ``indent`` draws the lines to it; ``parent`` is None for a root.

    ``seen`` are all who publish where it is, the one that counts first; ``planned`` is what was expected of it.
    """

    frame: str
    parent: str | None
    indent: str
    seen: tuple[EdgeSeen, ...] = ()
    planned: PlanEdge | None = None


@dataclass(frozen=True, slots=True)
class Tree:
    """One root and all below it, as it is drawn; or the frames of a loop, the first one again last."""

    branches: tuple[Branch, ...]
    loop: tuple[str, ...] = ()


def forest(edges: Iterable[EdgeSeen], planned: Mapping[str, PlanEdge] | None = None) -> list[Tree]:
    """Return the trees, the largest first, then the loops. Planned edges (by child) that were not seen are part of it.

    A frame that was seen in several parents hangs where the newest message puts it, as in tf2.
    """
    by_child: dict[str, list[EdgeSeen]] = {}
    for one in edges:
        by_child.setdefault(one.strand.child, []).append(one)
    for some in by_child.values():
        some.sort(key=lambda one: (one.present is False, -one.strand.tally.last_ns))
    parents = {child: edge.parent for child, edge in (planned or {}).items() if child not in by_child}
    parents |= {child: some[0].strand.parent for child, some in by_child.items()}
    children: dict[str, list[str]] = {}
    for child, parent in parents.items():
        children.setdefault(parent, []).append(child)
    for some_children in children.values():
        some_children.sort()

    def branch(frame: str, indent: str) -> Branch:
        seen = tuple(by_child.get(frame, ()))
        return Branch(frame, parents.get(frame), indent, seen, (planned or {}).get(frame))

    roots = sorted(parent for parent in children if parent not in parents)
    trees = []
    for root in roots:
        rows = [branch(root, "")]
        waiting = _below(children.get(root, []), "")
        while waiting:
            indent, frame, is_last = waiting.pop()
            rows.append(branch(frame, f"{indent}{'└── ' if is_last else '├── '}"))
            waiting += _below(children.get(frame, []), indent + ("    " if is_last else "│   "))
        trees.append(Tree(tuple(rows)))
    trees.sort(key=lambda tree: -len(tree.branches))
    drawn = {row.frame for tree in trees for row in tree.branches}
    return [*trees, *_loops({child: parent for child, parent in parents.items() if child not in drawn}, branch)]


def _below(children: Sequence[str], indent: str) -> list[tuple[str, str, bool]]:
    """Return what is to be drawn below a frame, the first one last."""
    return [(indent, child, child == children[-1]) for child in children][::-1]


def _loops(parents: Mapping[str, str], branch: Callable[[str, str], Branch]) -> list[Tree]:
    """Return a tree for each loop, with what hangs on it; ``parents`` holds nothing that hangs on a root."""
    loops: list[list[str]] = []
    at: dict[str, int] = {}
    for start in sorted(parents):
        path = []
        frame = start
        while frame not in at and frame not in path:
            path.append(frame)
            frame = parents[frame]
        if frame in path:
            loop = path[path.index(frame) :]
            first = loop.index(min(loop))
            loops.append(loop[first:] + loop[:first])
            number = len(loops) - 1
        else:
            number = at[frame]
        at |= dict.fromkeys(path, number)
    return [
        Tree(
            tuple(branch(frame, "") for frame in sorted(parents) if at[frame] == number),
            # From parent to child, as edges are written.
            (loop[0], *loop[:0:-1], loop[0]),
        )
        for number, loop in enumerate(loops)
    ]
