"""Who publishes TF, as the graph shows it to the guard."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from tfcompose.ros.graph import UNKNOWN_NODE, own_gid, writers, writers_unmapped
from tfcompose.ros.origin import carries, origin
from tfcompose.run.guard.senders import PARTICIPANT, Writer
from tfcompose.run.place import RUN_ID

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node

    from tfcompose.ros.graph import Writer as Found

#: The names that no namespace moves: (moving, fixed).
GLOBAL = ("/tf", "/tf_static")


class Graph:
    """The publishers on a plan's topics (moving, fixed), and on the global ones; ``own`` are the guard's, left out."""

    def __init__(self, node: Node, topics: tuple[str, str]) -> None:
        self.topics = topics
        self._node = node
        self._where: dict[bytes, str] = {}
        self._ours: dict[bytes, bool | None] = {}
        self._run = f"{RUN_ID}={os.environ[RUN_ID]}" if RUN_ID in os.environ else ""
        self._own = b""
        self.own: set[bytes] = set()

    def writers(self) -> list[Writer]:
        """Return who publishes on the plan's topics now."""
        return self._on(writers, self.topics)

    def is_ours(self, gid: bytes) -> bool | None:
        """Whether the publisher is surely a process of the guard's own run; None: it is not in the graph yet."""
        return bool(self._ours[gid]) if gid in self._ours else None

    def look_for_own(self) -> None:
        """Find out the ids of what the guard's own node publishes on the plan's topics."""
        own = self._own_gid()[:PARTICIPANT]
        for topic in self.topics:
            self.own |= {one.gid for one in writers(self._node, topic) if one.gid[:PARTICIPANT] == own}

    def global_writers(self) -> list[Writer]:
        """Return who publishes on the global topics now."""
        return self._on(writers_unmapped, GLOBAL)

    def _on(self, look: Callable[[Node, str], list[Found]], topics: tuple[str, str]) -> list[Writer]:
        moving, fixed = topics
        pairs = ((True, fixed), (False, moving))
        return [
            self._writer(one, static=static)
            for static, topic in pairs
            for one in look(self._node, topic)
            if one.gid not in self.own
        ]

    def _writer(self, one: Found, *, static: bool) -> Writer:
        where = self._where.get(one.gid)
        if where is None:
            where = self._where[one.gid] = origin(one.gid, self._own_gid())
            self._ours[one.gid] = carries(one.gid, self._own_gid(), self._run) if self._run else None
        node = None if one.node.endswith(UNKNOWN_NODE) else one.node
        volatile, best_effort = one.durability == "volatile", one.reliability == "best_effort"
        return Writer(one.gid, node, static, volatile, best_effort, where, self._ours[one.gid])

    def _own_gid(self) -> bytes:
        """Return an id of this process's: that of its reader."""
        if not self._own:
            self._own = own_gid(self._node, self.topics[0])
        return self._own
