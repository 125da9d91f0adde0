"""Who publishes TF, as the graph shows it to the guard."""

from __future__ import annotations

import os
from hashlib import blake2b
from typing import TYPE_CHECKING

from tfcompose.ipc import PROCESS, RUN_ID
from tfcompose.plan.topics import GLOBAL
from tfcompose.ros.graph import UNKNOWN_NODE, ids_say_who, own_gid, writers, writers_unmapped
from tfcompose.ros.processes import has_variable, origin, variable_of
from tfcompose.run.guard.senders import PARTICIPANT, Writer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from rclpy.node import Node

    from tfcompose.ros.graph import Writer as Found

    Topics = tuple[str, str]

_ID_BYTES = 16


def id_of_topic(topic: str) -> bytes:
    """Return what stands for the id of whoever sends on a process's own topic, where the rmw does not say who sent."""
    return blake2b(topic.encode(), digest_size=_ID_BYTES).digest()


class Graph:
    """The publishers on a plan's topics (moving, fixed), and on the global ones; the guard's own are left out.

    ``private`` are the pairs of topics that processes are remapped to, where they are.
    """

    def __init__(self, node: Node, topics: Topics, private: Sequence[Topics] | None = None) -> None:
        self.topics = topics
        self._private = private
        self.says_who = ids_say_who(node)
        self._node = node
        self._where: dict[bytes, str] = {}
        self._ours: dict[bytes, bool | None] = {}
        self._process: dict[bytes, str] = {}
        self._run = f"{RUN_ID}={os.environ[RUN_ID]}" if RUN_ID in os.environ else ""
        self._own = b""

    def writers(self) -> list[Writer]:
        """Return who publishes now: on the plan's topics, and on those that processes are remapped to."""
        if self._private is None:
            return self._on(writers, self.topics)
        found = self._on(writers, self.topics, fenced=False)
        for topics in self._private:
            there = self._on(writers, topics, fenced=True)
            found += there if self.says_who else [*there, *self._by_topic(topics, there)]
        return found

    def may_pass(self, gid: bytes) -> bool | None:
        """Whether what the publisher sends behind the fence is of the guard's own run; None: it is not known yet.

        In the common partition that must be seen; on a topic of a process's own, nobody else is expected.
        """
        if gid not in self._ours:
            return None
        ours = self._ours[gid]
        return bool(ours) if self._private is None else ours is not False

    def sends_clock(self) -> bool:
        """Return whether somebody is there who publishes /clock."""
        return bool(writers(self._node, "/clock"))

    def global_writers(self) -> list[Writer]:
        """Return who publishes on the global topics now."""
        return self._on(writers_unmapped, GLOBAL)

    def _on(
        self, look: Callable[[Node, str], list[Found]], topics: Topics, *, fenced: bool | None = None
    ) -> list[Writer]:
        moving, fixed = topics
        own = self._own_gid()[:PARTICIPANT]
        return [
            self._writer(one, static=static, fenced=fenced)
            for static, topic in ((True, fixed), (False, moving))
            for one in look(self._node, topic)
            if one.gid[:PARTICIPANT] != own
        ]

    def _by_topic(self, topics: Topics, there: list[Writer]) -> Iterator[Writer]:
        """Yield what stands for all that send on a topic, as a message does not say which of them did."""
        for static, topic in zip((False, True), topics, strict=True):
            gid = id_of_topic(topic)
            nodes = sorted({one.node for one in there if one.static == static and one.node})
            if nodes:
                self._ours[gid] = None
                yield Writer(gid, nodes[0], static, volatile=False, fenced=True, others=tuple(nodes[1:]))

    def _writer(self, one: Found, *, static: bool, fenced: bool | None) -> Writer:
        where = self._where.get(one.gid)
        if where is None:
            where = self._where[one.gid] = origin(one.gid, self._own_gid())
            self._ours[one.gid] = has_variable(one.gid, self._own_gid(), self._run) if self._run else None
            self._process[one.gid] = variable_of(one.gid, self._own_gid(), PROCESS) if self._ours[one.gid] else ""
        node = None if one.node.endswith(UNKNOWN_NODE) else one.node
        process = self._process[one.gid]
        volatile, best_effort = one.durability == "volatile", one.reliability == "best_effort"
        return Writer(one.gid, node, static, volatile, best_effort, where, self._ours[one.gid], fenced, process=process)

    def _own_gid(self) -> bytes:
        """Return an id of this process's: that of its reader."""
        if not self._own:
            self._own = own_gid(self._node, self.topics[0])
        return self._own
