"""The observed tree of one case, and measurements at their times."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from math import inf
from typing import TYPE_CHECKING, Protocol

from tfcompose.foundation.geometry import Offset, Pose, normalise, offset_of
from tfcompose.tf.live.edges import TreeObserver
from tfcompose.tf.tf2 import TransformException
from tfcompose.tf.tf2.exceptions import rejection_of
from tfcompose.tf.tf2.pose_buffer import PoseBuffer

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from tfcompose.tf.ros.tf_codec import Row

SECOND_NS = 1_000_000_000


def names_of(row: Row) -> tuple[str, str]:
    """Return the parent and the child of a transform, as tf2 stores them."""
    return row[0].removeprefix("/"), row[1].removeprefix("/")


def accepted_pose(row: Row) -> Pose | None:
    """Return the pose of a transform; None for one that tf2 rejects."""
    pose = row[4:11]
    if rejection_of(*names_of(row), pose) is not None:
        return None
    return Pose(row[4:7], normalise(row[7:11]))


@dataclass(slots=True)
class Timeline:
    """The beginning of an observation, shared by its trees."""

    #: Arrival of the first transform; 0: none came.
    begun_ns: int = 0

    def elapsed_s(self, received_ns: int) -> float:
        """Return the seconds from the first transform to a time of arrival."""
        return (received_ns - self.begun_ns) / SECOND_NS


@dataclass(frozen=True, slots=True)
class Arrival:
    """One TF message, after it has entered the buffer."""

    rows: Sequence[Row]
    #: True: it came on /tf_static.
    static: bool
    #: The time of arrival.
    received_ns: int
    #: Since the first transform.
    elapsed_s: float
    #: The time of arrival, by the clock of the stamps.
    clock_ns: int
    buffer: PoseBuffer


class Probe(Protocol):
    """Measures something with each message."""

    def take(self, arrival: Arrival) -> None:
        """Take a message."""


class ProbedTree(TreeObserver):
    """Observes a tree, and passes each message to probes after it has entered the buffer."""

    def __init__(self, timeline: Timeline, window_s: float = 0.0) -> None:
        super().__init__(window_s)
        self.probes: list[Probe] = []
        self.buffer = PoseBuffer()
        self._timeline = timeline

    def take(
        self,
        rows: Iterable[Row],
        *,
        static: bool,
        gid: bytes | None,
        received_ns: int,
        clock_ns: int | None = None,
    ) -> None:
        """Take a message, as ``TreeObserver`` does."""
        rows = tuple(rows)
        super().take(rows, static=static, gid=gid, received_ns=received_ns, clock_ns=clock_ns)
        self.buffer.insert(rows, static=static)
        timeline = self._timeline
        timeline.begun_ns = timeline.begun_ns or received_ns
        arrival = Arrival(
            rows,
            static=static,
            received_ns=received_ns,
            elapsed_s=timeline.elapsed_s(received_ns),
            clock_ns=received_ns if clock_ns is None else clock_ns,
            buffer=self.buffer,
        )
        for probe in self.probes:
            probe.take(arrival)


#: Maximum number of messages of moving edges that a log keeps.
_MOST_KEPT = 100_000


@dataclass(slots=True)
class MessageLog:
    """Keeps the messages of a tree: all of fixed edges, and the newest of moving ones."""

    fixed: list[Arrival] = field(default_factory=list)
    moving: deque[Arrival] = field(default_factory=lambda: deque(maxlen=_MOST_KEPT))

    def take(self, arrival: Arrival) -> None:
        """Keep a message."""
        (self.fixed if arrival.static else self.moving).append(arrival)


@dataclass(slots=True)
class AgeProbe:
    """Finds the oldest stamp of a moving edge at its arrival."""

    child: str
    #: None: no transform of the edge came.
    most_s: float | None = None
    #: When that arrived.
    elapsed_s: float = 0.0

    def take(self, arrival: Arrival) -> None:
        """Compare the stamps of a message with its arrival."""
        if arrival.static:
            return
        for row in arrival.rows:
            if row[1].removeprefix("/") != self.child:
                continue
            age_s = (arrival.clock_ns - row[2] * SECOND_NS - row[3]) / SECOND_NS
            if self.most_s is None or age_s > self.most_s:
                self.most_s, self.elapsed_s = age_s, arrival.elapsed_s


@dataclass(slots=True)
class PoseProbe:
    """Finds the greatest deviation of a pose, looked up after each message that affects it."""

    target: str
    source: str
    #: Position and rotation; None: not compared.
    xyz: tuple[float, float, float] | None
    quat_xyzw: tuple[float, float, float, float] | None
    within: Offset
    #: The pose that deviates most, relative to ``within``; None: no pose could be looked up.
    worst: Pose | None = None
    offset: Offset = field(default_factory=lambda: Offset(0.0, 0.0))
    elapsed_s: float = 0.0
    #: When the deviation first exceeded ``within``; None: never.
    beyond_s: float | None = None
    #: Why the last lookup failed.
    failure: str = "no transform arrived"
    _severity: float = -1.0
    _revision: int = -1
    #: The children of the moving edges between the two frames; None: they differ over time.
    _moving: frozenset[str] | None = None

    def take(self, arrival: Arrival) -> None:
        """Look the pose up if the message affects it, and compare it."""
        if not self._is_affected(arrival):
            return
        try:
            pose, _ = arrival.buffer.lookup(self.target, self.source)
        except TransformException as error:
            self.failure = str(error.detail)
            return
        expected = Pose(self.xyz or pose.xyz, self.quat_xyzw or pose.quat_xyzw)
        offset = offset_of(expected, pose)
        severity = (
            max(
                offset.xyz_m / self.within.xyz_m,
                offset.rot_rad / self.within.rot_rad if self.within.rot_rad > 0 else inf,
            )
            if offset.beyond(self.within)
            else 0.0
        )
        if severity and self.beyond_s is None:
            self.beyond_s = arrival.elapsed_s
        if severity > self._severity:
            self._severity, self.worst, self.offset = severity, pose, offset
            self.elapsed_s = arrival.elapsed_s

    def _is_affected(self, arrival: Arrival) -> bool:
        """Return whether the message may have changed the pose, or made it known."""
        buffer = arrival.buffer
        if buffer.revision != self._revision:  # a frame, a fixed pose or a parent is new
            self._revision = buffer.revision
            try:
                chain = buffer.chain_for_all_times(self.target, self.source)
            except TransformException:
                self._moving = frozenset()
            else:
                children = [cache.child for cache in chain.moving] if chain else []
                self._moving = frozenset(children) if chain else None
            return True
        moving = self._moving
        return moving is None or any(row[1].removeprefix("/") in moving for row in arrival.rows)


@dataclass(slots=True)
class LookupProbe:
    """Looks a pose up at one time, until it succeeds or is too late."""

    target: str
    source: str
    at_s: float
    timeout_s: float
    #: When the lookup succeeded; None: it did not.
    success_s: float | None = None
    #: Why the last attempt failed.
    failure: str = "the observation ends before that time"
    _stamp_ns: int | None = None
    #: When fixed edges first connected the two frames; None: they did not.
    _fixed_s: float | None = None

    def is_decided(self, elapsed_s: float) -> bool:
        """Return whether later messages change nothing."""
        return self.success_s is not None or elapsed_s > self.at_s + self.timeout_s

    def take(self, arrival: Arrival) -> None:
        """Try the lookup, if it is due."""
        if arrival.static:
            self._note_fixed(arrival)
            return
        late_s = arrival.elapsed_s - self.at_s
        if self.success_s is not None or late_s < 0:
            return
        if self._stamp_ns is None:
            self._stamp_ns = arrival.clock_ns - round(late_s * SECOND_NS)
        elif late_s > self.timeout_s:
            return
        try:
            arrival.buffer.lookup(self.target, self.source, self._stamp_ns)
        except TransformException as error:
            self.failure = str(error.detail)
            return
        if late_s <= self.timeout_s:
            self.success_s = arrival.elapsed_s
        else:
            self.failure = f"transforms arrived {late_s:.3g} s late"

    def pass_time(self, elapsed_s: float) -> None:
        """Note that this time is reached: a lookup through fixed edges needs no message then."""
        fixed_s = self._fixed_s
        if self.success_s is not None or elapsed_s < self.at_s:
            return
        if fixed_s is None:
            if self._stamp_ns is None:
                self.failure = "fixed edges do not connect them, and no moving edge came since"
        elif fixed_s <= self.at_s + self.timeout_s:
            self.success_s = max(self.at_s, fixed_s)
        else:
            self.failure = f"transforms arrived {fixed_s - self.at_s:.3g} s late"

    def _note_fixed(self, arrival: Arrival) -> None:
        if self._fixed_s is None:
            with suppress(TransformException):
                chain = arrival.buffer.chain_for_all_times(self.target, self.source)
                if chain is not None and not chain.moving:
                    self._fixed_s = arrival.elapsed_s
