"""Publishers that nobody hears, or not wholly, because of how they publish, or that are where they do not belong.

Each is told once, for as long as guards follow each other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.ipc import Found
from tfcompose.ros.misfits import best_effort_writer, leak, replaced_latched, volatile_writer
from tfcompose.run.guard.senders import UNCOUNTED

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from tfcompose.findings import Finding
    from tfcompose.plan import Plan
    from tfcompose.run.guard.senders import Senders, Writer

#: So long after it was first heard, an owner's latched message is surely all that is left of those before, in seconds.
ALL_HEARD_S = 2.0


class Endpoints:
    """What was told of publishers as the graph shows them; ``changes`` counts it."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._nodes = {node for process in plan.processes for node in process.nodes}
        self._told: set[tuple[str, bytes]] = set()

    @property
    def changes(self) -> int:
        """How much was told."""
        return len(self._told)

    def misfits(self, writers: Sequence[Writer]) -> list[Found]:
        """Return the findings for those on the plan's topics whose quality of service no listener accepts."""
        return [
            found
            for writer in writers
            if writer.node
            for code, wrong in self._misfit(writer, writer.node)
            for found in self._once(code, writer, wrong)
        ]

    def _misfit(self, writer: Writer, node: str) -> Iterator[tuple[str, Finding]]:
        topic = "/tf_static" if writer.static else "/tf"
        if writer.static and writer.volatile:
            owned = [edge.name for edge in self._plan.edges if edge.node == node and edge.kind == "static"]
            yield "TF806", volatile_writer(node, topic, owned)
        if writer.best_effort:
            yield "TF826", best_effort_writer(node, topic)

    def leaks(self, writers: Sequence[Writer], topics: tuple[str, str]) -> list[Found]:
        """Return the findings for the plan's nodes on the global topics, while its own (moving, static) are others."""
        inside = f"/{self._plan.ros.namespace.strip('/')}/"
        return [
            found
            for one in writers
            if one.node and (one.node in self._nodes or one.node.startswith(inside))
            for found in self._once(
                "TF827", one, leak(one.node, "/tf_static" if one.static else "/tf", topics[one.static])
            )
        ]

    def replaced(self, senders: Senders, missing: Mapping[str, Sequence[str]], now: float) -> list[Found]:
        """Return the findings for nodes that sent latched messages before they were first heard.

        ``missing`` are names of fixed edges that did not come, by the node, of which others came.
        """
        found = []
        for writer in senders.writers.values() if missing else ():
            edges, sender = missing.get(writer.node or ""), senders.sender(writer.gid)
            if not (writer.node and writer.static and edges and sender):
                continue
            first = sender.first_sequence
            if 1 < first < UNCOUNTED and now - sender.first_seen >= ALL_HEARD_S:
                found += self._once("TF850", writer, replaced_latched(writer.node, first - 1, edges))
        return found

    def memory(self) -> list[list[str]]:
        """Return what was told, as values of JSON."""
        return sorted([code, gid.hex()] for code, gid in self._told)

    def recall(self, memory: list[list[str]]) -> None:
        """Take this as told by the guard before."""
        self._told = {(code, bytes.fromhex(gid)) for code, gid in memory}

    def _once(self, code: str, writer: Writer, found: Finding) -> list[Found]:
        if (code, writer.gid) in self._told:
            return []
        self._told.add((code, writer.gid))
        return [Found(found)]
