"""Sensor drivers compared with their presets: frames, poses and switches that differ.

A driver may send its device's calibration, which is a few millimetres from nominal. A pose far
from nominal belongs to a different device than the preset's. Some poses in presets are exact, such
as the rotation of an optical frame. No device has a different pose there.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from math import isfinite, radians
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, finding
from tfcompose.foundation.geometry import Offset, Pose, norm, offset_of
from tfcompose.foundation.text import plural
from tfcompose.guard.verdict.publishers import SAME_POSE, compare, pose_differs

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from tfcompose.foundation.findings import Span
    from tfcompose.model.plan import Driven, Plan, PlanEdge, PlanProcess
    from tfcompose.tf.live.publishers import Message, Publishers

    Value = bool | int | float | str

#: Tolerances of a nominal pose and of an exact pose.
NOMINAL, EXACT = Offset(0.02, radians(5.0)), Offset(0.001, radians(0.2))
#: Tolerance for the length of a quaternion, which should be 1.
UNIT_WITHIN = 0.005
#: Maximum number of frames to keep from publishers without a name.
_MOST = 1000


def drives_of(plan: Plan) -> dict[str, tuple[Driven, ...]]:
    """Return the sensors that each node drives, by the node's full name."""
    return {
        node: process.drives
        for process in plan.processes
        for node in process.nodes
        if process.drives
    }


# Poses.


def is_fixed(edge: PlanEdge, owner: PlanProcess) -> bool:
    """Return whether the plan itself, not a preset, states the pose of this process's frame.

    If another owner's frame has no pose in the robot file, its pose in the plan is the identity.
    """
    if edge.kind != "static" or any(driven.publishes for driven in owner.drives):
        return False
    return owner.kind == "static" or edge.pose != Pose()


def fixed_driver_edges(plan: Plan) -> dict[str, PlanEdge]:
    """Return the fixed edges with a pose and an owner other than ``static``, by child."""
    frames, owners = expected_frames(plan), {process.name: process for process in plan.processes}
    return {
        edge.child: edge
        for edge in plan.edges
        if edge.child not in frames
        and edge.owner in owners
        and owners[edge.owner].kind != "static"
        and is_fixed(edge, owners[edge.owner])
    }


@dataclass(frozen=True, slots=True)
class Expected:
    """A frame that a driver publishes. ``nominal``: its pose is only nominal."""

    edge: PlanEdge
    driven: Driven
    nominal: bool


def expected_frames(plan: Plan) -> dict[str, Expected]:
    """Return the frames inside sensors that their drivers publish, by the frame's name."""
    edges = {edge.child: edge for edge in plan.edges}
    return {
        child: Expected(edges[child], driven, kind == "nominal")
        for process in plan.processes
        for driven in process.drives
        for child, kind in driven.frames.items()
        if child in edges and kind != "unknown"
    }


def is_pose(sent: Pose) -> bool:
    """Return whether tf2 accepts the pose."""
    return (
        all(map(isfinite, (*sent.xyz, *sent.quat_xyzw)))
        and abs(norm(sent.quat_xyzw) - 1) < UNIT_WITHIN
    )


def is_off(expected: Expected, sent: Pose) -> bool:
    """Return whether a pose is farther from the preset's pose than a calibration explains.

    False for a pose that tf2 drops.
    """
    return is_pose(sent) and offset_of(expected.edge.pose, sent).beyond(
        NOMINAL if expected.nominal else EXACT
    )


def driver_pose_differs(
    node: str, off: Sequence[tuple[Expected, Pose]], span: Span | None = None
) -> Finding:
    """Return the finding for frames of a sensor that its driver sends with other poses."""
    (expected, sent), *further = off
    driven, edge = expected.driven, expected.edge
    more = f", and {plural(len(further), 'more frame')} elsewhere" if further else ""
    sender = f"the driver {node}" if node else f"the driver of {driven.sensor}"
    message = (
        f"the pose of {edge.child} in {edge.parent} from {sender} is"
        f" {offset_of(edge.pose, sent).text} off preset {driven.preset}{more}:"
        f" {compare(edge.pose, sent)}"
    )
    notes = [
        Note(f"{reading.edge.child} in {reading.edge.parent}: {compare(reading.edge.pose, pose)}")
        for reading, pose in further
    ]
    override = (
        f"{{{edge.child}: {{xyz: [{_row(sent.xyz)}], quat_xyzw: [{_row(sent.quat_xyzw)}]}}}}"
    )
    values = f"sensors: {{{driven.sensor}: {{frames: {override}}}}}"
    advice = (
        f"is {driven.sensor} another model? If these are this unit's values, write them: {values}"
    )
    return finding("TF828", message, span, help=advice, notes=notes, severity="warning")


def _row(values: tuple[float, ...]) -> str:
    return ", ".join(f"{round(value, 6) + 0.0:g}" for value in values)


@dataclass(frozen=True, slots=True)
class SentPose:
    """A pose of a frame that a driver or owner sent, with the expected pose."""

    expected: Expected | PlanEdge
    pose: Pose
    gid: bytes
    static: bool

    @property
    def edge(self) -> PlanEdge:
        """The planned edge."""
        return _edge_of(self.expected)


def _edge_of(expected: Expected | PlanEdge) -> PlanEdge:
    return expected.edge if isinstance(expected, Expected) else expected


class SentPoses:
    """Poses of frames that drivers and other owners publish, recorded from messages.

    If the rmw identifies the sender of a message, each publisher is compared once for each frame.
    """

    def __init__(self, plan: Plan, publishers: Publishers) -> None:
        self._publishers = publishers
        self._expected: dict[str, Expected | PlanEdge] = {
            **fixed_driver_edges(plan),
            **expected_frames(plan),
        }
        self._received: set[tuple[bytes, str]] = set()
        self._waiting: list[SentPose] = []

    def follow(self, plan: Plan) -> None:
        """Compare with another plan's poses. For changed poses, use only messages from now on."""
        before = self._expected
        self._expected = {**fixed_driver_edges(plan), **expected_frames(plan)}
        self._received = {
            (gid, child)
            for gid, child in self._received
            if before.get(child) == self._expected.get(child)
        }

    def take(self, message: Message) -> None:
        """Record the poses in a message."""
        if message.gid is None or not self._expected:
            return
        for (parent, child), pose in zip(message.edges, message.poses, strict=False):
            expected, key = self._expected.get(child), (message.gid, child)
            if (
                expected is None
                or key in self._received
                or parent != _edge_of(expected).parent
                or len(self._received) >= _MOST
            ):
                continue
            self._received.add(key)
            self._waiting.append(SentPose(expected, pose, message.gid, message.static))

    @property
    def frames(self) -> frozenset[str]:
        """The frames whose poses are compared."""
        return frozenset(self._expected)

    def judge(self) -> Iterator[Finding]:
        """Yield findings about deviating poses, once for each publisher and sensor."""
        wrong: dict[tuple[str, str], list[tuple[Expected, Pose]]] = {}
        elsewhere: dict[str, list[tuple[PlanEdge, str, Pose]]] = {}
        waiting = []
        for sent in self._waiting:
            nodes = self._publishers.nodes(sent.gid, static=sent.static)
            if not nodes:
                waiting.append(sent)
            elif nodes != (sent.edge.node,):
                continue
            elif isinstance(sent.expected, Expected):
                if is_off(sent.expected, sent.pose):
                    wrong.setdefault((nodes[0], sent.expected.driven.sensor), []).append(
                        (sent.expected, sent.pose)
                    )
            elif is_pose(sent.pose) and offset_of(sent.edge.pose, sent.pose).beyond(SAME_POSE):
                elsewhere.setdefault(nodes[0], []).append((sent.edge, sent.edge.parent, sent.pose))
        self._waiting = waiting
        for node, poses in elsewhere.items():
            yield pose_differs(poses, node)
        for (node, _), off in wrong.items():
            yield driver_pose_differs(node, off)


# Switches.


def not_taken(
    node: str,
    switches: dict[str, Value],
    values: dict[str, Value | None],
    drives: tuple[Driven, ...] = (),
) -> list[Finding]:
    """Return a finding for each parameter of the node that differs from the plan.

    ``values`` holds the node's values, None for a parameter that the node does not declare.
    """
    return [
        _not_taken(node, name, value, values[name], drives)
        for name, value in switches.items()
        if values[name] is None
        or values[name] != value
        or isinstance(values[name], bool) != isinstance(value, bool)
    ]


def _not_taken(
    node: str, name: str, switch: Value, value: Value | None, drives: tuple[Driven, ...]
) -> Finding:
    plan = f"the plan wrote {name}: {json.dumps(switch)}"
    of = "".join(f" for {drive.sensor} ({drive.preset})" for drive in drives[:1])
    if value is None:
        advice = (
            "is it a version of the node that has another switch, or another node of that name?"
        )
        return finding(
            "TF829", f"{node} has no parameter {name}, and {plan}{of}", None, help=advice
        )
    advice = (
        f"start it with {name}: {json.dumps(switch)}; otherwise it publishes what the plan does"
        " not expect"
    )
    return finding(
        "TF829", f"{node} has {name}: {json.dumps(value)}, and {plan}{of}", None, help=advice
    )
