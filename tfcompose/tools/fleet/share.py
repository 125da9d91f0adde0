"""Sharing of a robot's edges: from its TF topics to Zenoh, as the fleet file says."""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from tfcompose.tf.ros.tf_codec import Decoder, SentTransform, encode
from tfcompose.tools.fleet.session import connect_router

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from tfcompose.tf.ros.tf_codec import Row
    from tfcompose.tools.fleet.spec import FleetSpec

#: All fixed edges are sent so often, in seconds, also where there is none: that says that the
#: robot is reached.
BEAT_S = 0.5
_SECOND_NS = 1_000_000_000


class SharedEdges:
    """Selects and renames the edges that leave a robot, one per period of their rate.

    Periods are counted from the epoch, so that robots send at the same times, and what is looked
    up between them is of about one time.
    """

    def __init__(self, fleet: FleetSpec, robot: str) -> None:
        self._decoder = Decoder()
        self._names: dict[tuple[str, str], tuple[str, str]] = {}
        self._periods_ns: dict[tuple[str, str], int] = {}
        for shared in fleet.edges_of(robot):
            parent, child = shared.ends
            self._names[parent, child] = (fleet.final(robot, parent), fleet.final(robot, child))
            self._periods_ns[parent, child] = int(_SECOND_NS / shared.rate)
        self._period_of: dict[tuple[str, str], int] = {}
        self._fixed: dict[tuple[str, str], SentTransform] = {}

    def take(self, data: bytes, *, static: bool, now_ns: int) -> bytes | None:
        """Take a message of the robot; return what of it is to be sent now, or None.

        Raises:
            ValueError: if it is no TFMessage.
        """
        layout, _ = self._decoder.stamps(data)
        due = [
            edge
            for edge in self._names.keys() & set(layout.plain_edges)
            if static or self._is_due(edge, now_ns)
        ]
        if not due:
            return None
        found = {
            edge: row
            for row in self._rename_rows(self._decoder.rows(data), due)
            for edge in [(row.parent, row.child)]
        }
        if static:
            self._fixed |= found
            return None
        self._period_of |= {edge: now_ns // self._periods_ns[edge] for edge in due}
        return encode(list(found.values()))

    def fixed_message(self) -> bytes:
        """Return all fixed edges that came until now, as one message."""
        return encode(list(self._fixed.values()))

    def _is_due(self, edge: tuple[str, str], now_ns: int) -> bool:
        return self._period_of.get(edge) != now_ns // self._periods_ns[edge]

    def _rename_rows(
        self, rows: Iterable[Row], due: list[tuple[str, str]]
    ) -> Iterable[SentTransform]:
        for parent, child, sec, nsec, *numbers in rows:
            edge = (parent.removeprefix("/"), child.removeprefix("/"))
            if edge in due:
                x, y, z, *quat = numbers
                stamp_ns = sec * _SECOND_NS + nsec
                yield SentTransform(
                    stamp_ns, *self._names[edge], (x, y, z), (quat[0], quat[1], quat[2], quat[3])
                )


class EdgeSender:
    """Sends a robot's edges to its router, whenever that is reached.

    What comes meanwhile is dropped.
    """

    def __init__(self, fleet: FleetSpec, robot: str, say: Callable[[str], None]) -> None:
        self.edges = SharedEdges(fleet, robot)
        self._key = fleet.key_of(robot)
        self._router = fleet.robots[robot].router
        self._say = say
        self._lock = threading.Lock()
        self._session: Any = None
        self._refused = False
        self._malformed = False

    def on_message(self, data: bytes, static: bool) -> None:  # noqa: FBT001 (as the listener calls)
        """Take a message of the robot's, from any thread."""
        with self._lock:
            try:
                sent = self.edges.take(data, static=static, now_ns=time.time_ns())
            except ValueError as error:
                if not self._malformed:
                    self._malformed = True
                    self._say(f"dropped a TF message: {error} (reported once)")
                return
        if sent is not None:
            self._put("tf", sent)

    def beat(self) -> None:
        """Connect where there is no session yet, and send the fixed edges."""
        if self._session is None:
            try:
                self._session = connect_router(self._router)
            except ConnectionError as error:
                if not self._refused:
                    self._refused = True
                    self._say(f"{error}; trying again every second")
                return
            self._refused = False
            self._say(f"sharing on {self._key} at {self._router}")
        with self._lock:
            fixed = self.edges.fixed_message()
        self._put("tf_static", fixed)

    def close(self) -> None:
        """End the session."""
        if self._session is not None:
            self._session.close()

    def _put(self, topic: str, data: bytes) -> None:
        if self._session is not None:
            with suppress(Exception):  # the session connects again by itself
                self._session.put(f"{self._key}/{topic}", data)
