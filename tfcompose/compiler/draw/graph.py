"""Content of a picture: frames, edges, groups and owners, declared or observed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Iterable

Kind = Literal["static", "joint", "dynamic"]


@dataclass(frozen=True, slots=True)
class Arrow:
    """An edge of the picture."""

    parent: str
    child: str
    kind: Kind
    owner: str
    #: Text after the child's name in its box.
    detail: str = ""
    #: Text on the second line of the child's box.
    pose: str = ""
    #: Whether the owner can switch the child to this parent, as a tool changer does. The layout
    #: ignores such edges.
    alternative: bool = False


@dataclass(frozen=True, slots=True)
class Group:
    """Frames that belong together, such as the frames of a sensor."""

    label: str
    frames: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Graph:
    """A TF tree, or any other graph: it may have several roots, second parents or cycles."""

    title: str
    #: Frames in drawing order. Frames that occur only in edges may be missing.
    frames: tuple[str, ...]
    #: Edges in drawing order.
    arrows: tuple[Arrow, ...]
    groups: tuple[Group, ...] = ()
    #: Owners in the order of their colours.
    owners: tuple[str, ...] = ()
    #: Edges to frames that the picture leaves out.
    hidden: tuple[Arrow, ...] = ()

    def all_frames(self) -> list[str]:
        """Return every frame once: ``frames``, then frames that occur only in edges and groups."""
        ends = (end for arrow in self.arrows for end in (arrow.parent, arrow.child))
        return list(
            dict.fromkeys(
                (*self.frames, *ends, *(frame for group in self.groups for frame in group.frames))
            )
        )

    def all_owners(self) -> list[str]:
        """Return every owner once: ``owners``, then owners that occur only in edges."""
        return list(dict.fromkeys((*self.owners, *(arrow.owner for arrow in self.arrows))))


def collapse_groups(graph: Graph) -> Graph:
    """Return the graph with each group reduced.

    Of each group, only the first frame and frames with children outside the group remain.
    """
    up = {arrow.child: arrow for arrow in reversed(graph.arrows) if not arrow.alternative}
    inside = {frame: group for group in graph.groups for frame in group.frames}
    first = {
        frame
        for frame, group in inside.items()
        if frame not in up or inside.get(up[frame].parent) != group
    }
    needed = set(first)
    for arrow in graph.arrows:
        frame = arrow.parent
        while frame in inside and inside.get(arrow.child) != inside[frame] and frame not in needed:
            needed.add(frame)
            frame = up[frame].parent
    gone = inside.keys() - needed
    beneath = {
        frame: sum(inner in gone for inner in inside[frame].frames)
        for frame in first
        if len(inside[frame].frames) > 1
    }
    arrows = []
    for arrow in graph.arrows:
        if arrow.child in gone or arrow.parent in gone:
            continue
        count = beneath.get(arrow.child)
        detail = f"{arrow.detail} +{count}".strip() if count else arrow.detail
        arrows.append(replace(arrow, detail=detail))
    groups = tuple(
        replace(group, frames=tuple(frame for frame in group.frames if frame in needed))
        for group in graph.groups
    )
    return replace(
        graph,
        frames=tuple(frame for frame in graph.frames if frame not in gone),
        arrows=tuple(arrows),
        groups=groups,
        hidden=tuple(
            arrow for arrow in graph.arrows if arrow.child in gone and not arrow.alternative
        ),
    )


@dataclass(frozen=True, slots=True)
class Forest:
    """A graph as trees."""

    #: Frames from top to bottom, parents before descendants.
    order: tuple[str, ...]
    #: The arrow from its parent to each frame, by frame.
    up: dict[str, Arrow]
    #: Children by parent.
    children: dict[str, list[str]]
    #: All arrows that are not in ``up``.
    extra: tuple[Arrow, ...]
    #: The index of each frame's group, by frame.
    group: dict[str, int]

    def enters(self, frame: str) -> bool:
        """Return whether the frame is the first frame of its group."""
        group = self.group.get(frame)
        return group is not None and (
            frame not in self.up or self.group.get(self.up[frame].parent) != group
        )


def forest_of(graph: Graph) -> Forest:
    """Return the graph as trees.

    A frame with several parents is placed below its first parent. Each cycle is broken at one
    edge. Children in their parent's group come first, so that groups stay together.
    """
    group = {frame: index for index, group in enumerate(graph.groups) for frame in group.frames}
    frames = graph.all_frames()
    first: dict[str, Arrow] = {}
    for arrow in graph.arrows:
        if not arrow.alternative and arrow.parent != arrow.child:
            first.setdefault(arrow.child, arrow)
    below: dict[str, list[str]] = {frame: [] for frame in frames}
    for child, arrow in first.items():
        below[arrow.parent].append(child)
    if group:
        for parent, children in below.items():
            mine = group.get(parent, -1)
            children.sort(key=lambda child, mine=mine: group.get(child) != mine)  # type: ignore[misc]
    order, up = _walk(frames, first, below)
    kept = {
        child: [child for child in children if up.get(child) is first[child]]
        for child, children in below.items()
    }
    extra = tuple(arrow for arrow in graph.arrows if up.get(arrow.child) is not arrow)
    return Forest(order, up, kept, extra, group)


def _walk(
    frames: Iterable[str], first: dict[str, Arrow], below: dict[str, list[str]]
) -> tuple[tuple[str, ...], dict[str, Arrow]]:
    """Return the frames in drawing order, and the arrow from its parent to each frame.

    Cycles come last.
    """
    order: dict[str, None] = {}
    up: dict[str, Arrow] = {}
    for root in (*(frame for frame in frames if frame not in first), *frames):
        waiting = [root] if root not in order else []
        while waiting:
            frame = waiting.pop()
            order[frame] = None
            for child in reversed(below[frame]):
                if child not in order:
                    up[child] = first[child]
                    waiting.append(child)
    return tuple(order), up
