"""Injection of faults into messages, while they are read from a recording or relayed.

A fault takes one message after another and returns what arrives instead, at the same time or
later. An ``Injector`` puts these in order again. Nothing here reads a file or a clock, and the
same messages with the same faults give the same result.
"""

from __future__ import annotations

import heapq
import random
from dataclasses import dataclass, replace
from itertools import count
from typing import TYPE_CHECKING

from tfcompose.foundation.geometry import Pose, quat_from_axis_angle
from tfcompose.model.plan.topics import GLOBAL, parts_of
from tfcompose.tf.bags import RecordedMessage
from tfcompose.tools.treetest.injections import (
    DropSpec,
    DynamicSpec,
    InjectionSpec,
    JointFault,
    JumpSpec,
    PublishSpec,
    RenameSpec,
    ShiftSpec,
    split_pair,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from tfcompose.model.plan import Plan
    from tfcompose.tf.ros.tf_codec import Row

    Topics = tuple[str, str]
    #: Returns what arrives instead of a message.
    Fault = Callable[[RecordedMessage], Iterable[RecordedMessage]]
    #: Returns a transform in place of another, in its message; None: it is lost.
    ChangeRow = Callable[[Row, RecordedMessage], Row | None]

_SECOND_NS = 1_000_000_000
_NO_ROTATION = (0.0, 0.0, 0.0, 1.0)


class RecordedFaults:
    """Faults in a recording, each from a time after its first message on."""

    def __init__(self, injections: Sequence[InjectionSpec], plan: Plan) -> None:
        self._injectors = {
            _RecordingInjector(fault_of(injection, plan)): round((injection.at or 0) * _SECOND_NS)
            for injection in injections
        }
        #: From the first message to the last so far, in nanoseconds.
        self.length_ns = 0

    def inject(self, messages: Iterable[RecordedMessage]) -> Iterator[RecordedMessage]:
        """Yield the messages with all faults, in the order of their arrival.

        What is delayed beyond the recording's end was not recorded.
        """
        first_ns: int | None = None
        for message in messages:
            if first_ns is None:
                first_ns = message.received_ns
                for injector, at_ns in self._injectors.items():
                    injector.begin_ns = first_ns + at_ns
            self.length_ns = message.received_ns - first_ns
            yield from pass_through(self._injectors, message)


class Injector:
    """Injects a fault from a time on, and keeps the order of arrivals."""

    def __init__(self, fault: Fault) -> None:
        #: The arrival from which on messages are faulty, in nanoseconds; None: none is yet.
        self.begin_ns: int | None = None
        self._fault = fault
        self._waiting: list[tuple[int, int, RecordedMessage]] = []
        self._numbers = count()

    def take(self, message: RecordedMessage) -> None:
        """Take a message, not earlier than those before. One without transforms passes time."""
        self._push(self._fault(message) if self._is_faulty(message) else (message,))

    def _is_faulty(self, message: RecordedMessage) -> bool:
        return self.begin_ns is not None and message.received_ns >= self.begin_ns

    def _push(self, messages: Iterable[RecordedMessage]) -> None:
        for each in messages:
            heapq.heappush(self._waiting, (each.received_ns, next(self._numbers), each))

    def until(self, time_ns: int) -> Iterator[RecordedMessage]:
        """Yield what has arrived by a time, in nanoseconds."""
        while self._waiting and self._waiting[0][0] <= time_ns:
            yield heapq.heappop(self._waiting)[2]


class _RecordingInjector(Injector):
    """Also injects a fault that begins into the fixed edges before: a recording has them once."""

    def __init__(self, fault: Fault) -> None:
        super().__init__(fault)
        self._latched: dict[Topics, dict[str, Row]] = {}

    def take(self, message: RecordedMessage) -> None:
        if self._is_faulty(message):
            for topics, rows in self._latched.items():
                sent = replace(message, topics=topics, rows=tuple(rows.values()), static=True)
                self._push(each for each in self._fault(sent) if each != sent)
            self._latched.clear()
        elif message.static:
            latched = self._latched.setdefault(message.topics, {})
            latched |= {_child(row): row for row in message.rows or ()}
        super().take(message)


def pass_through(
    injectors: Iterable[Injector], message: RecordedMessage
) -> Sequence[RecordedMessage]:
    """Return what arrives, by the time of a message, after it has passed the injectors."""
    messages: Sequence[RecordedMessage] = [message]
    for injector in injectors:
        for each in messages:
            injector.take(each)
        messages = list(injector.until(message.received_ns))
    return messages


def fault_of(injection: InjectionSpec, plan: Plan) -> Fault:
    """Return the fault of an injection into a robot with this plan."""
    fault = injection.fault
    if isinstance(fault, PublishSpec):
        return _Repeated.published(fault, plan)
    if isinstance(fault, DynamicSpec):
        return _SentAsMoving(fault)
    if injection.kind in {"kill", "stop"}:
        children = {edge.child for edge in plan.edges if edge.owner == fault}
        return _changing(lambda row, _: None if _child(row) in children else row)
    if isinstance(fault, DropSpec):
        return _of_edge(fault.edge, _Dropped(fault.share))
    if isinstance(fault, RenameSpec):
        return _changing(lambda row, _: _renamed(row, fault))
    if isinstance(fault, JumpSpec):
        offset = Pose(fault.xyz, fault.rotation or _NO_ROTATION)
        return _of_edge(fault.edge, lambda row, _: _with_pose(row, _pose(row) @ offset))
    if isinstance(fault, JointFault):
        return _at_position(fault, plan)
    if isinstance(fault, ShiftSpec):
        by_ns = round(fault.by * _SECOND_NS)
        if injection.kind == "jitter":
            return _Delayed(split_pair(fault.edge), by_ns)
        by_ns = -by_ns if injection.kind == "late" else by_ns
        return _of_edge(fault.edge, lambda row, _: _stamped(row, _stamp_ns(row) + by_ns))
    return _of_edge(str(fault), _OtherClock())


def _changing(change: ChangeRow) -> Fault:
    """Return the fault that changes each transform, and drops messages that lose all."""

    def take(message: RecordedMessage) -> Iterable[RecordedMessage]:
        if message.rows is None:
            return (message,)
        rows = [row for old in message.rows if (row := change(old, message)) is not None]
        return (replace(message, rows=tuple(rows)),) if rows or not message.rows else ()

    return take


def _of_edge(edge: str, change: ChangeRow) -> Fault:
    """Return the fault that changes each transform of an edge."""
    pair = split_pair(edge)
    return _changing(lambda row, message: change(row, message) if _pair(row) == pair else row)


class _Dropped:
    """Drops a share of transforms, evenly."""

    def __init__(self, share: float) -> None:
        self._share = share
        self._due = 0.0

    def __call__(self, row: Row, message: RecordedMessage) -> Row | None:
        del message
        self._due += self._share
        if self._due < 1:
            return row
        self._due -= 1
        return None


class _OtherClock:
    """Stamps transforms with the time since the first."""

    _first_ns: int | None = None

    def __call__(self, row: Row, message: RecordedMessage) -> Row:
        if self._first_ns is None:
            self._first_ns = message.received_ns
        return _stamped(row, message.received_ns - self._first_ns)


class _Delayed:
    """Delays the transforms of an edge by random times, in order."""

    def __init__(self, pair: tuple[str, str], most_ns: int) -> None:
        self._pair = pair
        self._most_ns = most_ns
        self._random = random.Random(0)  # noqa: S311 (no secret)
        self._last_ns = 0

    def __call__(self, message: RecordedMessage) -> Iterable[RecordedMessage]:
        rest, delayed = split_rows(message, self._pair)
        yield from rest
        for each in delayed:
            by_ns = self._random.randrange(self._most_ns + 1)
            self._last_ns = max(self._last_ns, each.received_ns + by_ns)
            yield delay(each, self._last_ns)


@dataclass(slots=True)
class _Repeated:
    """Repeats a transform on /tf, with the time of its arrival as stamp."""

    topics: Topics
    period_ns: int
    #: Without a valid stamp; None: none is known yet.
    row: Row | None
    _due_ns: int = 0

    @classmethod
    def published(cls, fault: PublishSpec, plan: Plan) -> Fault:
        """Return the fault that adds a publisher."""
        parent, child = split_pair(fault.edge)
        row = (parent, child, 0, 0, *fault.xyz, *(fault.rotation or _NO_ROTATION))
        repeated = cls(topics_of(plan, child), round(_SECOND_NS / fault.rate), row)
        return lambda message: (*repeated.until(message), message)

    def until(self, message: RecordedMessage) -> Iterator[RecordedMessage]:
        """Yield the repetitions that are due when a message arrives."""
        now_ns = message.received_ns
        self._due_ns = self._due_ns or now_ns
        while self.row is not None and self._due_ns <= now_ns:
            ahead_ns = now_ns - self._due_ns
            clock_ns = None if message.clock_ns is None else message.clock_ns - ahead_ns
            row = _stamped(self.row, self._due_ns if clock_ns is None else clock_ns)
            yield RecordedMessage(
                self.topics, (row,), static=False, received_ns=self._due_ns, clock_ns=clock_ns
            )
            self._due_ns += self.period_ns


class _SentAsMoving:
    """Sends a fixed edge on /tf, repeatedly, instead of on /tf_static."""

    def __init__(self, fault: DynamicSpec) -> None:
        self._pair = split_pair(fault.edge)
        self._repeated = _Repeated(GLOBAL, round(_SECOND_NS / fault.rate), row=None)

    def __call__(self, message: RecordedMessage) -> Iterable[RecordedMessage]:
        if not message.static:
            return (*self._repeated.until(message), message)
        rest, fixed = split_rows(message, self._pair)
        for each in fixed:
            self._repeated.topics = each.topics
            self._repeated.row = (each.rows or ())[-1]
        return (*rest, *self._repeated.until(message))


def _at_position(fault: JointFault, plan: Plan) -> Fault:
    """Return the fault that holds a joint at a position."""
    edge, joint = next(
        (edge, edge.joint) for edge in plan.edges if edge.joint and edge.joint.name == fault.name
    )
    axis, position = joint.axis, fault.position
    if joint.type == "prismatic":
        x, y, z = axis
        motion = Pose((x * position, y * position, z * position), _NO_ROTATION)
    else:
        motion = Pose((0.0, 0.0, 0.0), quat_from_axis_angle(axis, position))
    pose = edge.pose @ motion
    pair = (edge.parent, edge.child)
    return _changing(lambda row, _: _with_pose(row, pose) if _pair(row) == pair else row)


def topics_of(plan: Plan, child: str) -> Topics:
    """Return the topics (moving, fixed) of a frame's edge; the global ones if it has none."""
    for topics, part in parts_of(plan).items():
        if any(edge.child == child for edge in part.edges):
            return topics
    return GLOBAL


def split_rows(
    message: RecordedMessage, pair: tuple[str, str]
) -> tuple[list[RecordedMessage], list[RecordedMessage]]:
    """Return the message without an edge, and with that alone; each list may be empty."""
    if not message.rows:
        return [message], []
    parts = ([], [])  # type: tuple[list[Row], list[Row]]
    for row in message.rows:
        parts[_pair(row) == pair].append(row)
    rest, chosen = ([replace(message, rows=tuple(part))] for part in parts)
    return rest if parts[0] else [], chosen if parts[1] else []


def delay(message: RecordedMessage, received_ns: int) -> RecordedMessage:
    """Return the message as it arrives later."""
    by_ns = received_ns - message.received_ns
    clock_ns = None if message.clock_ns is None else message.clock_ns + by_ns
    return replace(message, received_ns=received_ns, clock_ns=clock_ns)


def _child(row: Row) -> str:
    return row[1].removeprefix("/")


def _pair(row: Row) -> tuple[str, str]:
    return row[0].removeprefix("/"), _child(row)


def _pose(row: Row) -> Pose:
    return Pose(row[4:7], row[7:11])


def _with_pose(row: Row, pose: Pose) -> Row:
    return (*row[:4], *pose.xyz, *pose.quat_xyzw)


def _stamp_ns(row: Row) -> int:
    return row[2] * _SECOND_NS + row[3]


def _stamped(row: Row, stamp_ns: int) -> Row:
    return (*row[:2], *divmod(stamp_ns, _SECOND_NS), *row[4:])


def _renamed(row: Row, fault: RenameSpec) -> Row:
    names = {fault.frame: fault.to}
    parent, child = _pair(row)
    return (names.get(parent, parent), names.get(child, child), *row[2:])
