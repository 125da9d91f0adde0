"""Where everything in a file stands: a tree beside the data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.findings import Span

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

Path = tuple[str | int, ...]

_NOTHING: Mapping[Any, Any] = {}


class Place:
    """Where a value stands; of a mapping or a list also where its keys, and the values in it, stand.

    Most places are never asked for: the parser's marks become a ``Span`` only then. Places do not change. ``inside``
    holds the places of the values by key or index, ``keys`` those of the keys; an alias has the place of its anchor.
    """

    __slots__ = ("_at", "inside", "keys")

    def __init__(
        self,
        at: Span | tuple[str, Any, Any],
        inside: Mapping[Any, Place] = _NOTHING,
        keys: Mapping[Any, Place] = _NOTHING,
    ) -> None:
        """``at`` is the place, or the file and the parser's marks of beginning and end, which count from 0."""
        self._at = at
        self.inside = inside
        self.keys = keys

    @property
    def span(self) -> Span:
        """The place in the file."""
        at = self._at
        if isinstance(at, Span):
            return at
        file, start, end = at
        self._at = span = Span(file, start.line + 1, start.column + 1, end.line + 1, end.column + 1)
        return span

    def with_inside(self, inside: Mapping[Any, Place], keys: Mapping[Any, Place]) -> Place:
        """Return the same place with other places in it."""
        return Place(self._at, inside, keys)

    def get(self, path: Path) -> Place | None:
        """Return the place of what stands at ``path`` below, or None."""
        place: Place | None = self
        for step in path:
            if place is None:
                break
            place = place.inside.get(step)
        return place

    def nearest(self, path: Path) -> Place:
        """Return the place of what stands at ``path`` below, or of the nearest thing around it that there is."""
        place = self
        for step in path:
            below = place.inside.get(step)
            if below is None:
                break
            place = below
        return place

    def nearest_key(self, path: Path) -> Place | None:
        """Return the place of the last key on the way to ``path`` that there is, or None."""
        place = self
        key: Place | None = None
        for step in path:
            key = place.keys.get(step, key)
            below = place.inside.get(step)
            if below is None:
                break
            place = below
        return key

    def walk(self, path: Path = ()) -> Iterator[tuple[Path, Place]]:
        """Yield every value's path and place, this one's first."""
        yield path, self
        for step, place in self.inside.items():
            yield from place.walk((*path, step))
