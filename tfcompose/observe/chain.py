"""The edges between two frames as one chain, in which neighbouring fixed edges are multiplied in advance."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.observe.rotation import IDENTITY, Seven, inverse, inverse_product, product, unit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.observe.history import History

#: A link: a fixed pose; or the samples of a moving edge, and whether it is passed from the parent to the child.
Link = tuple[None, Seven, bool] | tuple["History", None, bool]


class Chain:
    """The pose of the source in the target as a product of links, from the source on.

    ``moving`` are the edges with samples over time. Where there are none, ``fixed`` is the pose, else None.
    """

    __slots__ = ("fixed", "links", "moving")

    def __init__(self, up: Sequence[History], down: Sequence[History]) -> None:
        self.moving = [history for history in (*down, *up) if not history.static]
        self.links = _links([*((each, False) for each in down), *((each, True) for each in reversed(up))])
        self.fixed = None if self.moving else unit(self.links[0][1] or IDENTITY) if self.links else IDENTITY

    def at(self, stamp_ns: int) -> Seven | None:
        """Return the pose of the source in the target at that time, or None if an edge has none then."""
        if self.fixed is not None:
            return self.fixed
        pose = None
        for history, fixed, backwards in self.links:
            link = fixed if history is None else history.at(stamp_ns)
            if link is None:
                return None
            if pose is None:
                pose = inverse(link) if backwards else link
            else:
                pose = inverse_product(link, pose) if backwards else product(link, pose)
        return unit(pose or IDENTITY)

    def common_ns(self) -> int:
        """Return the newest time that all moving edges have reached, in nanoseconds; 0 where none moves, as in tf2."""
        return min((history.stamps[-1] for history in self.moving if history.stamps[-1]), default=0)


def _links(passed: Sequence[tuple[History, bool]]) -> list[Link]:
    links: list[Link] = []
    for history, backwards in passed:
        if not history.static:
            links.append((history, None, backwards))
            continue
        pose = inverse(history.pose(-1)) if backwards else history.pose(-1)
        before = links[-1][1] if links else None
        if before is not None:
            links[-1] = (None, product(pose, before), False)
        else:
            links.append((None, pose, False))
    return links
