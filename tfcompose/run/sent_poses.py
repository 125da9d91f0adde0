"""Where a sensor's driver says that its frames are, against the preset.

A driver sends what its device was calibrated to, which is a few millimetres from nominal; far from it the device is
another one than the preset's. What a preset calls exact, such as the turn of an optical frame, no device changes.
A publisher is compared once for each frame, where the rmw says who sent a message.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, isfinite
from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, Note, finding
from tfcompose.pose import Pose, angle_between, norm, normalised
from tfcompose.run.events import Found

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.plan import Driven, Plan, PlanEdge
    from tfcompose.run.events import GuardEvent
    from tfcompose.run.senders import Message, Senders

#: How far a frame may be from its value, in metres and degrees: a nominal one, and one that is exact.
NOMINAL_M, NOMINAL_DEG = 0.02, 5.0
EXACT_M, EXACT_DEG = 0.001, 0.2
#: A quaternion's length may be so far from 1.
UNIT_WITHIN = 0.005
#: So many frames of publishers without a name are kept at most.
_MOST = 1000


@dataclass(frozen=True, slots=True)
class Expected:
    """A frame that a driver publishes, and whether its pose is nominal only."""

    edge: PlanEdge
    driven: Driven
    nominal: bool


@dataclass(frozen=True, slots=True)
class Sent:
    """What a publisher sent of an expected frame."""

    expected: Expected
    pose: Pose
    gid: bytes
    static: bool


class SentPoses:
    """The frames that drivers publish, and what was sent of them."""

    def __init__(self, plan: Plan, senders: Senders) -> None:
        self._senders = senders
        self._expected = expected_of(plan)
        self._seen: set[tuple[bytes, str]] = set()
        self._waiting: list[Sent] = []

    def take(self, message: Message) -> None:
        """Note the poses that a message brings along."""
        if message.gid is None or not self._expected:
            return
        for (parent, child), pose in zip(message.edges, message.poses, strict=False):
            expected, key = self._expected.get(child), (message.gid, child)
            if expected is None or key in self._seen or parent != expected.edge.parent or len(self._seen) >= _MOST:
                continue
            self._seen.add(key)
            self._waiting.append(Sent(expected, pose, message.gid, message.static))

    def judge(self) -> list[GuardEvent]:
        """Return what drivers sent otherwise than their presets say, once for each driver and preset."""
        wrong: dict[tuple[str, str], list[Sent]] = {}
        waiting = []
        for sent in self._waiting:
            nodes = self._senders.nodes(sent.gid, static=sent.static)
            if not nodes:
                waiting.append(sent)
            elif sent.expected.edge.node in nodes and _is_pose(sent.pose) and _is_off(sent):
                wrong.setdefault((nodes[0], sent.expected.driven.sensor), []).append(sent)
        self._waiting = waiting
        return [Found(_finding(node, off)) for (node, _), off in wrong.items()]


def expected_of(plan: Plan) -> dict[str, Expected]:
    """Return the frames inside sensors that their drivers publish, by the frame's name."""
    edges = {edge.child: edge for edge in plan.edges}
    return {
        child: Expected(edges[child], driven, kind == "nominal")
        for process in plan.processes
        for driven in process.drives
        for child, kind in driven.frames.items()
        if child in edges
    }


def distance(expected: Pose, sent: Pose) -> tuple[float, float]:
    """Return how far apart the two are, in metres and degrees."""
    metres = norm((sent.xyz[0] - expected.xyz[0], sent.xyz[1] - expected.xyz[1], sent.xyz[2] - expected.xyz[2]))
    return metres, degrees(angle_between(expected.quat_xyzw, normalised(sent.quat_xyzw)))


def _is_pose(pose: Pose) -> bool:
    """Whether tf2 takes it: numbers, and a quaternion of length 1."""
    return all(map(isfinite, (*pose.xyz, *pose.quat_xyzw))) and abs(norm(pose.quat_xyzw) - 1) < UNIT_WITHIN


def _is_off(sent: Sent) -> bool:
    metres, turn_deg = distance(sent.expected.edge.pose, sent.pose)
    nominal = sent.expected.nominal
    return metres > (NOMINAL_M if nominal else EXACT_M) or turn_deg > (NOMINAL_DEG if nominal else EXACT_DEG)


def _finding(node: str, off: Sequence[Sent]) -> Diagnostic:
    first, *others = off
    driven, edge = first.expected.driven, first.expected.edge
    more = f", and {len(others)} more frame{'s' if len(others) > 1 else ''} elsewhere" if others else ""
    message = (
        f"preset {driven.preset} expects {edge.name} at {_at(edge.pose)}, the driver {node} sent {_at(first.pose)}"
    )
    notes = [
        Note(f"{one.expected.edge.name}: {_at(one.expected.edge.pose)}, and sent {_at(one.pose)}") for one in others
    ]
    own = f"{{{edge.child}: {{xyz: [{_row(first.pose.xyz, ', ')}], quat_xyzw: [{_row(first.pose.quat_xyzw, ', ')}]}}}}"
    advice = (
        f"is {driven.sensor} another model? If this unit is so, say so: sensors: {{{driven.sensor}: {{frames: {own}}}}}"
    )
    return finding("TF828", message + more, None, help=advice, notes=notes, severity="warning")


def _at(pose: Pose) -> str:
    """Return the pose as people read it: metres, and degrees where it is turned."""
    turn = tuple(degrees(angle) for angle in Pose((0.0, 0.0, 0.0), normalised(pose.quat_xyzw)).rpy)
    turned = f" rpy {_row(turn, ' ', 3)} deg" if any(round(angle, 3) for angle in turn) else ""
    return f"xyz {_row(pose.xyz, ' ')}{turned}"


def _row(values: tuple[float, ...], between: str, decimals: int = 6) -> str:
    return between.join(f"{round(value, decimals) + 0.0:g}" for value in values)
