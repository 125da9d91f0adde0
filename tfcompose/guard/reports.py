"""Reports of publishers that listeners do not receive, and the pace of reports."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

from tfcompose.guard.verdict.publishers import (
    best_effort_publisher,
    flood,
    leak,
    replaced_latched_finding,
    unfenced_finding,
    unmarked_finding,
    volatile_publisher,
)
from tfcompose.model.messages import FindingShown, Unfenced
from tfcompose.model.plan.topics import GLOBAL
from tfcompose.tf.live.publishers import UNCOUNTED

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.model.plan import Plan
    from tfcompose.tf.live.publishers import Publisher, Senders

Key = TypeVar("Key")
#: Time for which further reports of one kind are collected after the first; longer while more
#: arrive: a tracker that names frames after objects has new ones each second.
COLLECTED_S = 0.5
COLLECTED_AT_MOST_S = 60.0
#: The most publishers, and kinds of reports, that are remembered as reported.
MOST_REPORTED = 2000
#: Time for which a flood is counted before it is reported, in seconds.
FLOOD_COUNTED_S = 1.0
#: After this time, an owner's latched message has surely replaced its earlier ones, in seconds.
ALL_HEARD_S = 2.0
#: Time to wait for messages of a publisher that bypasses the fence, so that they are reported
#: before it is stopped.
UNFENCED_SILENT_S = 0.5
_UNFENCED = "TF852"


class Pace(Generic[Key]):
    """Due times of reports by kind: the more often one is due, the longer the next ones wait."""

    def __init__(self) -> None:
        self._reported: dict[Key, tuple[float, float]] = {}

    def is_due(self, key: Key, now: float, *, grows: bool) -> bool:
        """Return whether a report is due, and count it as made.

        If the pace ``grows``, later ones wait longer.
        """
        reported, collected_s = self._reported.pop(key, (-COLLECTED_AT_MOST_S, 0.0))
        if now - reported < collected_s:
            self._reported[key] = (reported, collected_s)
            return False
        goes_on = grows and now - reported < 2 * collected_s
        waits_s = min(2 * collected_s, COLLECTED_AT_MOST_S) if goes_on else COLLECTED_S
        self._reported[key] = (now, waits_s)  # the newest comes last
        if len(self._reported) > MOST_REPORTED:
            del self._reported[next(iter(self._reported))]
        return True


@dataclass(slots=True)
class Flood:
    """Messages of a publisher since it exceeded the limit of undeclared edges."""

    #: When it exceeded the limit, in monotonic seconds.
    since: float
    #: The last message, in monotonic seconds.
    last: float = 0.0
    messages: int = 0
    #: Transforms in the longest message.
    transforms: int = 0

    def count(self, transforms: int, now: float) -> None:
        """Count a message."""
        self.messages, self.last, self.transforms = (
            self.messages + 1,
            now,
            max(self.transforms, transforms),
        )

    @property
    def hertz(self) -> float | None:
        """Messages per second; None if unknown."""
        took_s = self.last - self.since
        return (self.messages - 1) / took_s if self.messages > 1 and took_s > 0 else None


class PublisherReports:
    """Publishers whose QoS or topic keeps listeners from receiving all of their messages.

    Each is reported once, also across guards that replace each other; ``changes`` counts reports.
    """

    def __init__(self, plan: Plan) -> None:
        self._reported: dict[tuple[str, bytes], None] = {}
        self._silent_since: dict[bytes, float] = {}
        self.follow(plan)

    def follow(self, plan: Plan) -> None:
        """Follow a plan from now on."""
        self._plan = plan
        self._nodes = {node for process in plan.processes for node in process.nodes}

    @property
    def changes(self) -> int:
        """The number of reports."""
        return len(self._reported)

    def wrong_settings(self, publishers: Sequence[Publisher]) -> list[FindingShown]:
        """Return findings for publishers with a QoS that no listener accepts."""
        return [
            found
            for publisher in publishers
            for wrong in self._wrong_settings(publisher)
            for found in self._once(publisher, wrong)
        ]

    def _wrong_settings(self, publisher: Publisher) -> Iterator[Finding]:
        if publisher.node is None:
            return
        topic = publisher.topic or GLOBAL[publisher.static]
        if publisher.static and not publisher.latched:
            owned = [
                edge.name
                for edge in self._plan.edges
                if edge.node == publisher.node and edge.kind == "static"
            ]
            yield volatile_publisher(publisher.node, topic, owned)
        if not publisher.reliable:
            yield best_effort_publisher(publisher.node, topic)

    def leaving_the_fence(
        self, publishers: Sequence[Publisher], senders: Senders, now: float
    ) -> list[Publisher]:
        """Return the run's own publishers that bypass the filter, once judged.

        One that sends nothing is returned after a while.
        """
        outside = [
            publisher
            for publisher in publishers
            if publisher.node
            and ((publisher.ours and publisher.process) or publisher.unmarked)
            and publisher.fenced is False
            and not self._is_known(_UNFENCED, publisher)
        ]
        since = {
            publisher.gid: self._silent_since.get(publisher.gid, now) for publisher in outside
        }
        self._silent_since = since
        return [
            publisher
            for publisher in outside
            if senders.sender(publisher.gid) or now - since[publisher.gid] >= UNFENCED_SILENT_S
        ]

    def report_unfenced(self, publisher: Publisher, *, remapped: bool) -> list[Unfenced]:
        """Return the finding for a publisher that bypasses the filter.

        ``remapped``: remappings isolate the others.
        """
        topic = publisher.topic or GLOBAL[publisher.static]
        if publisher.unmarked:
            finding = unmarked_finding(
                publisher.node or "", topic, publisher.where, remapped=remapped
            )
        else:
            finding = unfenced_finding(
                publisher.node or "",
                publisher.process,
                topic,
                publisher.profile,
                remapped=remapped,
            )
        process = "" if publisher.unmarked else publisher.process
        return [
            Unfenced(new.found, process, publisher.unmarked)
            for new in self._once(publisher, finding)
        ]

    def floods(
        self, senders: Senders, flooders: dict[bytes | None, Flood], now: float
    ) -> list[FindingShown]:
        """Return the findings for publishers of more undeclared edges than are judged.

        Drops those that have left.
        """
        found = []
        for gid, flooder in list(flooders.items()):
            publisher = senders.known.get(gid) if gid is not None else None
            if publisher is None or not publisher.node or now - flooder.since < FLOOD_COUNTED_S:
                continue
            found += self._once(
                publisher,
                flood(publisher.node, publisher.where, flooder.transforms, flooder.hertz),
            )
            if not senders.is_present(gid):
                del flooders[gid]
        return found

    def leaks(
        self, publishers: Sequence[Publisher], topics: tuple[str, str]
    ) -> list[FindingShown]:
        """Return findings for nodes of the plan that use the global topics by mistake."""
        inside = f"/{self._plan.ros.namespace.strip('/')}/"
        return [
            found
            for publisher in publishers
            if publisher.node
            and (publisher.node in self._nodes or publisher.node.startswith(inside))
            for found in self._once(
                publisher, leak(publisher.node, GLOBAL[publisher.static], topics[publisher.static])
            )
        ]

    def report_replaced(
        self, senders: Senders, missing: Mapping[str, Sequence[str]], now: float
    ) -> list[FindingShown]:
        """Return the findings for nodes that sent latched messages before they were first heard.

        ``missing`` has, by node, the names of fixed edges that did not come although others of the
        node did.
        """
        found = []
        for publisher in senders.present.values() if missing else ():
            edges, sender = missing.get(publisher.node or ""), senders.sender(publisher.gid)
            if not (publisher.node and publisher.static and edges and sender):
                continue
            first = sender.first_sequence
            if 1 < first < UNCOUNTED and now - sender.first_received >= ALL_HEARD_S:
                found += self._once(
                    publisher, replaced_latched_finding(publisher.node, first - 1, edges)
                )
        return found

    def memory(self) -> tuple[tuple[str, str], ...]:
        """Return the reports made: codes with publisher ids in hexadecimal."""
        return tuple(sorted((code, gid.hex()) for code, gid in self._reported))

    def recall(self, memory: tuple[tuple[str, str], ...]) -> None:
        """Restore the reports that the previous guard made."""
        self._reported = {(code, bytes.fromhex(gid)): None for code, gid in memory}

    def _is_known(self, code: str, publisher: Publisher) -> bool:
        return (code, publisher.gid) in self._reported

    def _once(self, publisher: Publisher, finding: Finding) -> list[FindingShown]:
        if self._is_known(finding.code, publisher):
            return []
        self._reported[finding.code, publisher.gid] = None
        if len(self._reported) > MOST_REPORTED:
            del self._reported[next(iter(self._reported))]
        return [FindingShown(finding)]
