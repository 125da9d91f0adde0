"""Histories replayed to the guard's judge, with a clock that is set by hand."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import msgspec

from tfcompose.foundation.geometry import Pose
from tfcompose.guard.judge import Judge, JudgeMemory
from tfcompose.model.messages import (
    Clear,
    EdgeTaken,
    FilterBypassed,
    FindingShown,
    GuardEvent,
    RecoveredShown,
)
from tfcompose.model.plan import (
    GuardPolicy,
    Plan,
    PlanClaim,
    PlanEdge,
    PlanProcess,
    RosSettings,
    SourceLine,
)
from tfcompose.tf.live.publishers import Message, OtherRun
from tfcompose.tf.live.publishers import Publisher as TFPublisher

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.model.plan import Clock, EdgeKind


TICK_S = 0.1


SETTLE_S = 1.0


def edge(
    names: str, owner: str, kind: EdgeKind = "dynamic", rate: float | None = None
) -> PlanEdge:
    parent, child = names.split()
    return PlanEdge(
        parent, child, kind, owner, f"/{owner}", Pose(), rate, SourceLine("rover.yaml", 7)
    )


EDGES = (
    edge("map odom", "slam"),
    edge("odom base", "drive"),
    edge("base left", "joints", "joint"),
    edge("base lidar", "static", "static"),
    edge("base camera", "static", "static"),
)


TOOL = replace(edge("arm tool", "changer"), switched=("rack_1", "rack_2"))


PROCESSES = (
    PlanProcess("static", "static"),
    PlanProcess("joints", "joints"),
    PlanProcess("slam", "run"),
    PlanProcess("drive", "external"),
    PlanProcess("guard", "guard"),
)


FIXED = "base lidar, base camera"


@dataclass
class Publisher:
    """A publisher of the history; ``sent`` counts its messages."""

    node: str | None
    static: bool = False
    volatile: bool = False
    gid: bytes = b""
    sent: int = 0
    ours: bool | None = None
    process: str = ""
    fenced: bool | None = None
    run: OtherRun | None = None
    profile: str = ""
    pid: int | None = None


@dataclass
class History:
    """A judge that looks every tenth of a second, and the publishers that it sees."""

    guard: GuardPolicy = field(default_factory=GuardPolicy)
    processes: tuple[PlanProcess, ...] = PROCESSES
    clock: Clock = "wall"
    settle_s: float = SETTLE_S
    gids: bool = True
    gid_identifies_node: bool = True
    edges: tuple[PlanEdge, ...] = EDGES
    claims: tuple[PlanClaim, ...] = ()
    now: float = 1000.0
    events: list[GuardEvent] = field(default_factory=list)
    graph: list[Publisher] = field(default_factory=list)
    made: int = 0
    judge: Judge = field(init=False)
    #: The edges of the last message that may pass in a strict plan; None: all.
    admitted: frozenset[tuple[str, str]] | None = field(init=False)
    ticked: float = field(init=False)

    def __post_init__(self) -> None:
        settings = RosSettings(clock=self.clock)
        plan = Plan(
            "rover",
            "0",
            "base",
            settings,
            self.edges,
            self.processes,
            self.guard,
            claims=self.claims,
        )
        self.judge = Judge(
            plan,
            self.settle_s,
            self.now,
            self.wall_ns(),
            gid_identifies_node=self.gid_identifies_node,
        )
        self.ticked = self.now

    def wall_ns(self) -> int:
        return 1_700_000_000_000_000_000 + round(self.now * 1e9)

    def joins(  # noqa: PLR0913 (what a publisher can be, each with a default)
        self,
        node: str | None,
        *,
        static: bool = False,
        volatile: bool = False,
        hidden: bool = False,
        process: str | None = None,
        pid: int | None = None,
    ) -> Publisher:
        """Let a publisher come; one that is hidden is not in the graph yet.

        ``pid`` is its process's number, where that can be seen. ``process`` is the plan's process
        that it is seen to be of, empty: one that is not of this run; None: its process cannot be
        seen.
        """
        self.made += 1
        ours = None if process is None else bool(process)
        gid = bytes([self.made]) * 16
        publisher = Publisher(
            node, static, volatile, gid, ours=ours, process=process or "", pid=pid
        )
        if not hidden:
            self.graph.append(publisher)
        return publisher

    def leaves(self, publisher: Publisher) -> None:
        self.graph.remove(publisher)

    def send(
        self,
        publisher: Publisher,
        edges: str,
        *,
        static: bool | None = None,
        ago: float = 0.0,
        stamp_s: float | None = None,
    ) -> History:
        """Let a message arrive that was sent ``ago`` seconds before, stamped so."""
        publisher.sent += 1
        pairs = tuple((names.split()[0], names.split()[1]) for names in edges.split(", "))
        kind = publisher.static if static is None else static
        gid = (
            (publisher.gid if self.gid_identifies_node else publisher.gid[:8] + bytes(8))
            if self.gids
            else None
        )
        sent_ns = self.wall_ns() - round(ago * 1e9)
        stamps = () if stamp_s is None else (round(stamp_s * 1e9),) * len(pairs)
        message = Message(pairs, kind, gid, sent_ns, publisher.sent, stamps, self.wall_ns())
        judged = self.judge.take(message, self.now)
        self.admitted = judged.admitted
        self.events += self.judge.judge_arrival(judged, message, self.now)
        return self

    def check(self) -> History:
        writers = [
            TFPublisher(
                p.gid,
                p.node,
                p.static,
                latched=not p.volatile,
                where="" if p.pid is None else f"on this machine as pid {p.pid}: node.py",
                ours=p.ours,
                process=p.process,
                fenced=p.fenced,
                run=p.run,
                profile=p.profile,
            )
            for p in self.graph
        ]
        self.events += self.judge.graph(writers, self.now)
        self.events += self.judge.tick(self.now)
        return self

    def wait(self, seconds: float) -> History:
        """Let time pass, in looks."""
        end = self.now + seconds
        while self.now < end - 1e-9:
            self.now = min(end, self.now + TICK_S)
            self.check()
        return self

    def repeat(self, publisher: Publisher, edges: str, times: int, every: float = 0.1) -> History:
        """Let a publisher send, and the guard look, so many times."""
        for _ in range(times):
            self.send(publisher, edges).wait(every)
        return self

    def clear(self) -> History:
        """Look until all is clear."""
        self.wait(self.settle_s + TICK_S)
        assert Clear() in self.events
        return self

    def dies(self, down_s: float = 1.5) -> History:
        """Let another judge continue with this one's memory after a gap, and forget events."""
        memory = msgspec.json.decode(msgspec.json.encode(self.judge.memory()), type=JudgeMemory)
        self.now += down_s
        self.judge = Judge(self.judge.plan, 0.0, self.now, 0)
        self.events = self.judge.recall(memory, self.now)
        return self

    def findings(self) -> list[Finding]:
        return self.findings_in(self.events)

    @staticmethod
    def findings_in(events: Sequence[GuardEvent]) -> list[Finding]:
        return [
            event.found
            for event in events
            if isinstance(event, (FindingShown, EdgeTaken, FilterBypassed))
        ]

    def reports(self) -> list[str]:
        return [f"{finding.code} {finding.message}" for finding in self.findings()]

    def over(self) -> list[str]:
        """Return what is said to have ended."""
        return [event.text for event in self.events if isinstance(event, RecoveredShown)]

    def only(self) -> Finding:
        """Return what was found, which is one thing."""
        (finding,) = self.findings()
        return finding

    def all(self, kind: type[GuardEvent]) -> list[GuardEvent]:
        return [event for event in self.events if isinstance(event, kind)]


def wall(running: History) -> float:
    return running.wall_ns() / 1e9
