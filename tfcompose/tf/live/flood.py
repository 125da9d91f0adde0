"""Limits for publishers that keep inventing edges: number of edges, and time to read."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from tfcompose.tf.ros.node import Received
    from tfcompose.tf.ros.tf_codec import Decoder, Row

#: Maximum number of edges to keep from a publisher, unless its first message has more. No robot's
#: publisher sends more.
MOST_OF_ONE = 10_000
#: Maximum number of edges to keep, counting an edge once for each publisher.
MOST_EDGES = 20_000
#: Time per second for reading messages with ever new edges of all publishers, in seconds.
BUSY_S = 0.1


class ReadingTime:
    """Limits the time for unfamiliar messages from publishers of too many edges.

    After this second's time is used up, their messages are skipped. ``skipped`` counts them.
    """

    def __init__(self, decoder: Decoder) -> None:
        self.skipped = 0
        self._decoder = decoder
        self._spent_s = self._since = 0.0

    def read(
        self,
        received: Received,
        read: Callable[[], object],
        floods: Callable[[bytes | None], bool],
        now: float,
    ) -> None:
        """Read a message unless it must be skipped.

        ``floods`` returns whether its publisher sends too many edges.
        """
        decoder = self._decoder
        if now - self._since >= 1.0:
            self._spent_s, self._since = 0.0, now
        if self._spent_s > BUSY_S and floods(received.gid) and not decoder.knows(received.data):
            self.skipped += 1
            return
        before, begun = decoder.read_anew, time.thread_time()
        read()
        if decoder.read_anew != before and floods(received.gid):
            self._spent_s += time.thread_time() - begun


class EdgeBounds:
    """The edges to keep for each publisher.

    ``beyond`` counts transforms of all other edges, by publisher id.
    """

    def __init__(self) -> None:
        self.beyond: dict[bytes | None, int] = {}
        self._known: dict[bytes | None, set[tuple[str, str]]] = {}
        self._all = 0

    def floods(self, gid: bytes | None) -> bool:
        """Return whether the publisher has sent more edges than are kept."""
        return gid in self.beyond

    def keep_rows(self, rows: Iterable[Row], gid: bytes | None) -> Iterator[Row]:
        """Yield the rows of a message whose edges are kept."""
        gids = self._known.setdefault(gid, set())
        is_full = gid is not None and len(gids) >= MOST_OF_ONE
        for row in rows:
            edge = row[:2]
            if edge not in gids:
                if is_full or self._all >= MOST_EDGES:
                    self.beyond[gid] = self.beyond.get(gid, 0) + 1
                    continue
                gids.add(edge)
                self._all += 1
            yield row
