"""Observation of a fleet from any computer.

An observer receives the shared edges of robots. It returns the state of each robot, the age of its
edges, and poses between robots.
"""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

from tfcompose.foundation.findings import Finding, finding
from tfcompose.tf.ros.tf_codec import Decoder
from tfcompose.tf.tf2.pose_buffer import PoseBuffer
from tfcompose.tools.fleet.session import connect_router

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.foundation.geometry import Pose
    from tfcompose.tools.fleet.spec import FleetSpec

#: The age in seconds of a robot's last message at which its link is stale. A robot sends twice a
#: second.
STALE_S = 2.0
#: The number of periods after which an edge is stale, but not before ``STALE_S``.
_PERIODS = 4.0
#: The largest accepted difference between the clocks of two computers, in seconds.
CLOCK_S = 0.5
_RETRY_S = 1.0
_LATE = (
    "its link is slow, or its clock is behind (synchronise it with chrony or systemd-timesyncd)"
)
_SECOND_NS = 1_000_000_000

LinkState = Literal["live", "stale", "silent", "unreachable"]


class StaleError(Exception):
    """Raised if a pose needs a link or an edge that is stale or was never received.

    The message names the first such link or edge.
    """


@dataclass(frozen=True, slots=True)
class EdgeStatus:
    """The status of a shared edge. Frames have their names in the fleet."""

    parent: str
    child: str
    #: The time since it was sent, in seconds; None if it never arrived.
    age_s: float | None
    #: The time of its last arrival, by this computer's clock, minus its stamp, by the robot's
    #: clock, in seconds; None for a fixed edge.
    delay_s: float | None
    stale: bool


@dataclass(frozen=True, slots=True)
class FleetRobotStatus:
    """The status of a robot and of the edges that it shares.

    live: its last message was sent within ``STALE_S``. stale: its last message is older. silent:
    its router is connected, but the robot has sent nothing yet. unreachable: its router is not
    connected.
    """

    robot: str
    router: str
    state: LinkState
    #: The time since its last message was sent, in seconds; None if there was none.
    age_s: float | None
    edges: tuple[EdgeStatus, ...]
    #: The transmission time of its last message, by the two computers' clocks, in seconds.
    delay_s: float = 0.0


@dataclass(slots=True)
class _Link:
    """The received transforms of a robot, with times of sending by this computer's clock."""

    last: float | None = None
    delay_s: float = 0.0
    edges: dict[tuple[str, str], tuple[float, float | None]] = field(default_factory=dict)
    decoder: Decoder = field(default_factory=Decoder)


class FleetObserver:
    """Listens to robots of a fleet until it is closed.

    If ``frames`` contains a target and a source, the observer listens only to robots with edges
    between these frames, else to all robots. ``buffer`` answers lookups.
    """

    def __init__(self, fleet: FleetSpec, frames: tuple[str, str] | None = None) -> None:
        self.fleet = fleet
        self.buffer = PoseBuffer()
        self._lock = threading.Lock()
        self._links = {robot: _Link() for robot in fleet.robots}
        ends = {
            robot: {
                fleet.final(robot, edge.ends[1]): fleet.final(robot, edge.ends[0])
                for edge in fleet.edges_of(robot)
            }
            for robot in fleet.robots
        }
        self._parents = {
            child: parent for edges in ends.values() for child, parent in edges.items()
        }
        self._heard = list(fleet.robots)
        if frames is not None:
            needed = self._between(*frames)
            self._heard = [robot for robot in fleet.robots if needed & ends[robot].keys()]
        self._sessions: dict[str, Any] = {}
        self._subscribers: list[Any] = []
        self._ended = threading.Event()
        # Zenoh calls back in daemon threads if the subscribing thread is a daemon. If a daemon
        # thread returns from Zenoh while Python exits, the process aborts. Therefore these threads
        # are not daemons.
        self._threads = [
            threading.Thread(
                target=self._connect, args=(router,), name=f"router {router}", daemon=False
            )
            for router in dict.fromkeys(fleet.robots[robot].router for robot in self._heard)
        ]
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Close the subscribers, then the sessions.

        Python waits for the subscribers' threads when it exits.
        """
        self._ended.set()
        for thread in self._threads:
            thread.join()
        for subscriber in self._subscribers:
            subscriber.undeclare()
        for session in self._sessions.values():
            session.close()

    def wait(self, seconds: float) -> bool:
        """Wait until every edge of every robot has arrived; return False after a timeout."""
        end = time.monotonic() + seconds
        while not (complete := self.is_complete()) and (left := end - time.monotonic()) > 0:
            self._ended.wait(min(0.05, left))
        return complete

    def is_complete(self) -> bool:
        """Return whether every edge of every robot has arrived."""
        return all(edge.age_s is not None for robot in self.status() for edge in robot.edges)

    def status(self) -> list[FleetRobotStatus]:
        """Return the current status of each robot, in the order of the file."""
        now = time.monotonic()
        with self._lock:
            return [self._status(robot, now) for robot in self.fleet.robots]

    def pose(self, target: str, source: str) -> tuple[Pose, int | None]:
        """Return the newest pose of ``source`` in ``target`` and its stamp.

        Raises:
            StaleError: if a link or an edge between the two frames is stale, or a robot has sent
            nothing. The buffer may still contain an old pose. TransformException: if there is no
            transform between the frames.
        """
        needed = self._between(target, source)
        is_shared = {target, source} <= self._parents.keys() | set(self._parents.values())
        for robot in self.status():
            edges = [edge for edge in robot.edges if edge.child in needed]
            if edges and robot.age_s is None and is_shared:
                raise StaleError(
                    f"{robot.robot} is {robot.state}: no message arrived from it"
                    " (see tfcompose fleet doctor)"
                )
            if edges and robot.age_s is not None and robot.age_s > STALE_S:
                raise StaleError(f"the link to {robot.robot} is stale")
            for edge in edges:
                if edge.stale:
                    raise StaleError(f"{edge.parent} → {edge.child} of {robot.robot} is stale")
        return self.buffer.latest(target, source)

    def findings(self) -> Iterator[Finding]:
        """Yield findings about the current status of all robots."""
        for robot in self.status():
            yield from problems_of(robot)

    def _between(self, target: str, source: str) -> set[str]:
        """Return the child frames of the shared edges between two frames."""
        chains = []
        for frame in (target, source):
            chain = [frame]
            while (parent := self._parents.get(chain[-1])) is not None and parent not in chain:
                chain.append(parent)
            chains.append(set(chain))
        return chains[0] ^ chains[1]

    def _status(self, robot: str, now: float) -> FleetRobotStatus:
        link, router = self._links[robot], self.fleet.robots[robot].router
        edges = []
        for shared in self.fleet.edges_of(robot):
            parent, child = (self.fleet.final(robot, frame) for frame in shared.ends)
            came, delay_s = link.edges.get((parent, child), (None, None))
            age_s = None if came is None else now - came
            stale = age_s is not None and age_s > max(STALE_S, _PERIODS / shared.rate)
            edges.append(EdgeStatus(parent, child, age_s, delay_s, stale))
        age_s = None if link.last is None else now - link.last
        return FleetRobotStatus(
            robot,
            router,
            self._state(router, age_s),
            age_s=age_s,
            edges=tuple(edges),
            delay_s=link.delay_s,
        )

    def _state(self, router: str, age_s: float | None) -> LinkState:
        if age_s is not None and age_s <= STALE_S:
            return "live"
        session = self._sessions.get(router)
        if session is None or not session.info.routers_zid():
            return "unreachable"
        return "silent" if age_s is None else "stale"

    def _connect(self, router: str) -> None:
        """Connect to a router as soon as it is available, and listen to its robots."""
        while not self._ended.is_set():
            try:
                session = connect_router(router)
            except ConnectionError:
                self._ended.wait(_RETRY_S)
                continue
            with self._lock:
                self._sessions[router] = session
            robots = [robot for robot in self._heard if self.fleet.robots[robot].router == router]
            for robot in robots:
                for static in (False, True):
                    key = f"{self.fleet.key_of(robot)}/{'tf_static' if static else 'tf'}"
                    subscriber = session.declare_subscriber(
                        key, partial(self._take, robot, static)
                    )
                    self._subscribers.append(subscriber)
            return

    def _take(self, robot: str, static: bool, sample: Any) -> None:  # noqa: FBT001 (given by partial)
        now, now_ns = time.monotonic(), time.time_ns()
        time_s = now_ns / _SECOND_NS
        with self._lock:
            link = self._links[robot]
            try:
                rows = tuple(link.decoder.rows(bytes(sample.payload)))
            except ValueError:
                return
            link.delay_s = (
                0.0
                if sample.timestamp is None
                else time_s - sample.timestamp.get_time().timestamp()
            )
            sent = now - max(link.delay_s, 0.0)  # delayed messages keep their times of sending
            link.last = max(sent, link.last or sent)
            for row in rows:
                stamp_ns = row[2] * _SECOND_NS + row[3]
                link.edges[row[0], row[1]] = (
                    sent,
                    None if static else (now_ns - stamp_ns) / _SECOND_NS,
                )
        self.buffer.insert(rows, static=static, authority=robot)


def problems_of(robot: FleetRobotStatus) -> Iterator[Finding]:
    """Yield findings about the status of a robot."""
    if robot.state == "unreachable":
        ago = f"; its last message is {robot.age_s:.1f} s old" if robot.age_s is not None else ""
        advice = (
            "is the robot on, and in this network? Its router is the process zenoh_router, or"
            " zenohd"
        )
        yield finding(
            "TF882",
            f"the router of {robot.robot} at {robot.router} cannot be reached{ago}",
            None,
            help=advice,
        )
        return
    if robot.state == "stale":
        message = (
            f"the link to {robot.robot} is stale: its last message was sent"
            f" {robot.age_s:.1f} s ago"
        )
        advice = (
            _LATE
            if robot.delay_s > CLOCK_S
            else f"does its process still run? tfcompose fleet share {robot.robot}"
        )
        yield finding("TF883", message, None, help=advice)
        return
    if robot.state == "silent":
        advice = f"start it on the robot: tfcompose fleet share {robot.robot}"
        message = f"{robot.robot} shares nothing: its router answers, but no message arrived"
        yield finding("TF883", message, None, help=advice)
        return
    if robot.delay_s > CLOCK_S:
        yield finding(
            "TF885",
            f"messages of {robot.robot} arrive {robot.delay_s:.1f} s after they were sent",
            None,
            help=_LATE,
        )
    for edge in robot.edges:
        name = f"{edge.parent} → {edge.child}"
        if edge.age_s is None or edge.stale:
            when = (
                "was never received"
                if edge.age_s is None
                else f"was last sent {edge.age_s:.1f} s ago"
            )
            advice = "does the robot publish it under these names? tfcompose doctor on the robot"
            yield finding("TF884", f"{name} of {robot.robot} {when}", None, help=advice)
        elif edge.delay_s is not None and edge.delay_s < -CLOCK_S:
            message = (
                f"{name} of {robot.robot} is stamped {-edge.delay_s:.1f} s ahead of this"
                " computer's clock"
            )
            yield finding(
                "TF885", message, None, help="synchronise the clocks: chrony, or systemd-timesyncd"
            )
