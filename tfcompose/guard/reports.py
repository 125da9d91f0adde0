"""Reports about publishers that listeners do not receive, and the frequency of reports."""

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
from tfcompose.model.messages import FilterBypassed, FindingShown
from tfcompose.model.plan.topics import GLOBAL
from tfcompose.tf.live.publishers import UNCOUNTED

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.model.plan import Plan
    from tfcompose.tf.live.publishers import Publisher, Senders

Key = TypeVar("Key")
#: Time in seconds for which reports are collected after a report of the same kind. It grows while
#: more arrive, for example from a tracker that names frames after objects.
COLLECTED_S = 0.5
COLLECTED_AT_MOST_S = 60.0
#: Maximum number of publishers and kinds of reports that are remembered as reported.
MOST_REPORTED = 2000
#: Time in seconds for which messages of a flood are counted before the report.
FLOOD_COUNTED_S = 1.0
#: After this time in seconds, an owner's latched message has certainly replaced its earlier
#: messages.
ALL_HEARD_S = 2.0
#: Time in seconds to wait for messages of a publisher that bypasses the filter, so that they are
#: reported before the publisher is stopped.
UNFENCED_SILENT_S = 0.5
_UNFENCED = "TF852"


class Pace(Generic[Key]):
    """Due times of reports by kind.

    The more often a report is due, the longer the next one waits.
    """

    def __init__(self) -> None:
        self._reported: dict[Key, tuple[float, float]] = {}

    def is_due(self, key: Key, now: float, *, grows: bool) -> bool:
        """Return whether a report is due, and record it as made.

        If the pace ``grows``, later reports wait longer.
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

    #: Time when the publisher exceeded the limit, in monotonic seconds.
    since: float
    #: Time of the last message, in monotonic seconds.
    last: float = 0.0
    messages: int = 0
    #: Number of transforms in the longest message.
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
        """Messages per second, None if unknown."""
        took_s = self.last - self.since
        return (self.messages - 1) / took_s if self.messages > 1 and took_s > 0 else None


class PublisherReports:
    """Publishers whose QoS or topic prevents listeners from receiving all their messages.

    Each publisher is reported once, even if a new guard replaces a guard that died. ``changes``
    counts reports.
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
            finding
            for publisher in publishers
            for wrong in self._wrong_settings(publisher)
            for finding in self._once(publisher, wrong)
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
        """Return publishers of the run that bypass the filter and whose messages were judged.

        A publisher that sends nothing is returned after a while.
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

    def report_unfenced(self, publisher: Publisher, *, remapped: bool) -> list[FilterBypassed]:
        """Return the finding for a publisher that bypasses the filter.

        ``remapped``: remappings isolate the other processes.
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
            FilterBypassed(new.found, process, publisher.unmarked)
            for new in self._once(publisher, finding)
        ]

    def floods(
        self, senders: Senders, flooders: dict[bytes | None, Flood], now: float
    ) -> list[FindingShown]:
        """Return findings for publishers of more undeclared edges than the judge accepts.

        Publishers that have left are removed from ``flooders``.
        """
        findings = []
        for gid, flooder in list(flooders.items()):
            publisher = senders.by_gid.get(gid) if gid is not None else None
            if publisher is None or not publisher.node or now - flooder.since < FLOOD_COUNTED_S:
                continue
            findings += self._once(
                publisher,
                flood(publisher.node, publisher.where, flooder.transforms, flooder.hertz),
            )
            if not senders.is_present(gid):
                del flooders[gid]
        return findings

    def leaks(
        self, publishers: Sequence[Publisher], topics: tuple[str, str]
    ) -> list[FindingShown]:
        """Return findings for nodes of the plan that use the global topics by mistake."""
        inside = f"/{self._plan.ros.namespace.strip('/')}/"
        return [
            finding
            for publisher in publishers
            if publisher.node
            and (publisher.node in self._nodes or publisher.node.startswith(inside))
            for finding in self._once(
                publisher, leak(publisher.node, GLOBAL[publisher.static], topics[publisher.static])
            )
        ]

    def report_replaced(
        self, senders: Senders, missing: Mapping[str, Sequence[str]], now: float
    ) -> list[FindingShown]:
        """Return findings for nodes whose earlier latched messages were replaced before arrival.

        ``missing`` holds, by node, the names of fixed edges that did not arrive although other
        fixed edges of the node did.
        """
        findings = []
        for publisher in senders.present.values() if missing else ():
            edges, sender = missing.get(publisher.node or ""), senders.sender(publisher.gid)
            if not (publisher.node and publisher.static and edges and sender):
                continue
            first = sender.first_sequence
            if 1 < first < UNCOUNTED and now - sender.first_received >= ALL_HEARD_S:
                findings += self._once(
                    publisher, replaced_latched_finding(publisher.node, first - 1, edges)
                )
        return findings

    def memory(self) -> tuple[tuple[str, str], ...]:
        """Return the reports made so far: codes with publisher ids in hexadecimal."""
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
