"""Selection of a robot's shared edges, and their sending over Zenoh."""

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

#: The interval of the message with all fixed edges, in seconds. A robot without fixed edges sends
#: it too, because it shows that the robot can be reached.
BEAT_S = 0.5
_SECOND_NS = 1_000_000_000


class SharedEdges:
    """Selects and renames the shared edges of a robot, one message per period of their rate.

    The periods of all robots count from the Unix epoch. Therefore robots send at the same times,
    and lookups between robots use poses of nearly the same time.
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
        """Add a message of the robot; return the message to send now, or None.

        Raises:
            ValueError: if it is not a TFMessage.
        """
        layout, _ = self._decoder.stamps(data)
        due = [
            edge
            for edge in self._names.keys() & set(layout.plain_edges)
            if static or self._is_due(edge, now_ns)
        ]
        if not due:
            return None
        rows = {
            edge: row
            for row in self._rename_rows(self._decoder.rows(data), due)
            for edge in [(row.parent, row.child)]
        }
        if static:
            self._fixed |= rows
            return None
        self._period_of |= {edge: now_ns // self._periods_ns[edge] for edge in due}
        return encode(list(rows.values()))

    def fixed_message(self) -> bytes:
        """Return all fixed edges that have arrived, as a single message."""
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
    """Sends a robot's edges to its router.

    While there is no connection to the router, it drops messages.
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
        """Add a message of the robot; any thread may call this."""
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
        """Connect if there is no session yet, and send the fixed edges."""
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
            with suppress(Exception):  # the session reconnects by itself
                self._session.put(f"{self._key}/{topic}", data)
