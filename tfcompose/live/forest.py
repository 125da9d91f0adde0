"""The trees that published edges make: several where they do not hang together, and what hangs in a loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.tree import below, children_of, drawn, loops, trees

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from tfcompose.live.edges import EdgeState
    from tfcompose.plan import PlanEdge


@dataclass(frozen=True, slots=True)
class Branch:
    """A frame in a tree. ``indent`` draws the lines to it; ``parent`` is None for a root.

    ``observed`` are all who publish where it is, the one that counts first; ``planned`` is what was expected of it.
    """

    frame: str
    parent: str | None
    indent: str
    observed: tuple[EdgeState, ...] = ()
    planned: PlanEdge | None = None


@dataclass(frozen=True, slots=True)
class Tree:
    """One root and all below it, as it is drawn; or the frames of a loop, the first one again last."""

    branches: tuple[Branch, ...]
    loop: tuple[str, ...] = ()


def forest(edges: Iterable[EdgeState], planned: Mapping[str, PlanEdge] | None = None) -> list[Tree]:
    """Return the trees, the largest first, then the loops. Planned edges (by child) that were not seen are part of it.

    A frame that was seen in several parents hangs where the newest message puts it, as in tf2.
    """
    by_child: dict[str, list[EdgeState]] = {}
    for one in edges:
        by_child.setdefault(one.child, []).append(one)
    for some in by_child.values():
        some.sort(key=lambda one: (one.present is False, -one.stream.arrivals.last_ns))
    parents = {child: edge.parent for child, edge in (planned or {}).items() if child not in by_child}
    parents |= {child: some[0].parent for child, some in by_child.items()}
    children = children_of(sorted((parent, child) for child, parent in parents.items()))

    def branch(frame: str, indent: str = "") -> Branch:
        observed = tuple(by_child.get(frame, ()))
        return Branch(frame, parents.get(frame), indent, observed, (planned or {}).get(frame))

    grown = [
        Tree((branch(root), *(branch(frame, lines) for lines, frame in drawn(children, root, str))))
        for root in trees(zip(parents.values(), parents, strict=True))
    ]
    left = parents.keys() - {row.frame for tree in grown for row in tree.branches}
    for loop in loops((parents[frame], frame) for frame in left):
        rows = tuple(branch(frame) for frame in sorted(below(children, loop[0])))
        grown.append(Tree(rows, (*loop, loop[0])))
    return grown
