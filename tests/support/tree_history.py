"""Histories of what publishers sent, as the doctor and verify judge them at the end."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.foundation.geometry import Pose
from tfcompose.model.plan import Plan, PlanEdge, PlanProcess, RosSettings, SourceLine
from tfcompose.tf.live.edges import TreeObserver
from tfcompose.tf.live.publishers import Publisher
from tfcompose.tf.live.state import TreeState

if TYPE_CHECKING:
    from collections.abc import Callable

SECOND_NS = 1_000_000_000
BEGUN_NS = 1_800_000_000 * SECOND_NS
SECONDS = 5.0
END_NS = BEGUN_NS + int(SECONDS * SECOND_NS)
SENDERS = {b"d": "/drive", b"e": "/drive", b"s": "/static", b"t": "/static", b"x": "/ekf"}


class TreeHistory:
    """What came in five seconds, from publishers that are named after their ids."""

    def __init__(self) -> None:
        self.observer = TreeObserver()
        self.knows(b"d", b"e", b"s", b"x")

    def knows(self, *gids: bytes) -> TreeHistory:
        """Let the graph show these publishers, and no others."""
        self.observer.take_graph(
            [Publisher(gid, SENDERS[gid], static=gid in b"st") for gid in gids]
        )
        return self

    def fixed(self, edge: str, gid: bytes = b"s", x: float = 0.0) -> TreeHistory:
        return self.takes(row(edge, 0, x), gid, BEGUN_NS, static=True)

    def moving(  # noqa: PLR0913 (all but two are named)
        self,
        edge: str,
        gid: bytes = b"d",
        *,
        hz: float = 50.0,
        until_s: float = SECONDS,
        stamp: Callable[[int], int] = lambda now: now,
        parents: Callable[[int], str] | None = None,
    ) -> TreeHistory:
        """Send an edge again and again.

        ``parents`` says for each message of which parent it is.
        """
        for tick in range(int(until_s * hz)):
            now = BEGUN_NS + int(tick * SECOND_NS / hz)
            names = f"{parents(tick)} {edge.split()[1]}" if parents else edge
            self.takes(row(names, stamp(now)), gid, now)
        return self

    def takes(
        self, transform: Any, gid: bytes = b"d", at_ns: int = END_NS, *, static: bool = False
    ) -> TreeHistory:
        """Let one transform arrive."""
        self.observer.take([transform], static=static, gid=gid, received_ns=at_ns)
        return self

    def observed(self, **more: Any) -> TreeState:
        publishers = more.pop("publishers", tuple(self.observer.publishers.by_gid.values()))
        return TreeState(
            SECONDS,
            edges=tuple(self.observer.edges(END_NS)),
            publishers=publishers,
            sent=dict(self.observer.sent),
            **more,
        )


def row(edge: str, stamp_ns: int, x: float = 0.0, w: float = 1.0) -> Any:
    """Return a transform: parent, child, stamp, place and quaternion."""
    parent, child = edge.split()
    return (parent, child, *divmod(stamp_ns, SECOND_NS), x, 0.0, 0.0, 0.0, 0.0, 0.0, w)


def late(seconds: float) -> Callable[[int], int]:
    """Return how a publisher stamps that is late by so many seconds.

    Ahead, where they are negative.
    """
    return lambda now: now - int(seconds * SECOND_NS)


def since_start(now: int) -> int:
    """Stamp as a simulation does that began with the history."""
    return now - BEGUN_NS


def sound_tree() -> TreeHistory:
    return TreeHistory().moving("odom base_link").fixed("base_link laser")


def sound_plan(*edges: PlanEdge, **more: Any) -> Plan:
    processes = (
        PlanProcess("drive", "external", nodes=("/drive",)),
        PlanProcess("static", "static", nodes=("/static",)),
    )
    planned = (
        PlanEdge(
            "odom",
            "base_link",
            "dynamic",
            "drive",
            "/drive",
            Pose(),
            50.0,
            SourceLine("rover.yaml", 7),
        ),
        PlanEdge(
            "base_link",
            "laser",
            "static",
            "static",
            "/static",
            Pose(),
            None,
            SourceLine("rover.yaml", 9),
        ),
    )
    return Plan(
        "rover",
        "0",
        "base_link",
        more.pop("ros", RosSettings()),
        edges or planned,
        processes,
        **more,
    )
