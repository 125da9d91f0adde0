"""Poses that are not what they should be: a fixed edge's, and those that a sensor's driver says against the preset.

A driver sends what its device was calibrated to, which is a few millimetres from nominal; far from it the device is
another one than the preset's. What a preset calls exact, such as the turn of an optical frame, no device changes.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, radians
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding
from tfcompose.geometry import Pose, norm
from tfcompose.verdict.offset import Offset, compared, offset_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.findings import Span
    from tfcompose.plan import Driven, Plan, PlanEdge

#: How far a frame may be from its value: a nominal one, and one that is exact.
NOMINAL, EXACT = Offset(0.02, radians(5.0)), Offset(0.001, radians(0.2))
#: A quaternion's length may be so far from 1.
UNIT_WITHIN = 0.005
_LISTED = 12


@dataclass(frozen=True, slots=True)
class Expected:
    """A frame that a driver publishes, and whether its pose is nominal only."""

    edge: PlanEdge
    driven: Driven
    nominal: bool


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


def is_off(expected: Expected, sent: Pose) -> bool:
    """Return whether a pose is farther from the preset's than a calibration explains; False for what tf2 drops."""
    if not all(map(isfinite, (*sent.xyz, *sent.quat_xyzw))) or abs(norm(sent.quat_xyzw) - 1) >= UNIT_WITHIN:
        return False
    return offset_of(expected.edge.pose, sent).beyond(NOMINAL if expected.nominal else EXACT)


def pose_differs(off: Sequence[tuple[PlanEdge, str, Pose]], publisher: str, place: Span | None = None) -> Finding:
    """Return the finding for edges that come with another pose than the plan's: each with its parent, as it was sent.

    ``publisher`` is empty where it is not known; ``place`` is where the first edge stands in the robot's file.
    """
    (edge, parent, pose), *others = off
    by = f" from {publisher}" if publisher else ""
    more = f", and of {len(others)} more frame{'s' if len(others) > 1 else ''} too" if others else ""
    message = f"the pose of {edge.child} in {parent}{by} is off by {offset_of(edge.pose, pose).text}{more}"
    notes = [
        Note(f"{one.child} in {above} by {offset_of(one.pose, sent).text}: {compared(one.pose, sent)}")
        for one, above, sent in others[:_LISTED]
    ]
    notes += [] if place else [Note(f"{edge.name} is declared in {edge.source[0]}:{edge.source[1]}")]
    advice = "was it changed after the start? tfcompose restart; else correct the one that is wrong"
    return finding("TF846", f"{message}: {compared(edge.pose, pose)}", place, notes=notes, help=advice)


def driver_pose_differs(node: str, off: Sequence[tuple[Expected, Pose]], place: Span | None = None) -> Finding:
    """Return the finding for frames of one sensor that its driver ``node``, empty if not known, sends elsewhere."""
    (expected, sent), *others = off
    driven, edge = expected.driven, expected.edge
    more = f", and {len(others)} more frame{'s' if len(others) > 1 else ''} elsewhere" if others else ""
    sender = f"the driver {node}" if node else f"the driver of {driven.sensor}"
    message = (
        f"the pose of {edge.child} in {edge.parent} from {sender} is {offset_of(edge.pose, sent).text} off "
        f"preset {driven.preset}{more}: {compared(edge.pose, sent)}"
    )
    notes = [Note(f"{one.edge.child} in {one.edge.parent}: {compared(one.edge.pose, pose)}") for one, pose in others]
    own = f"{{{edge.child}: {{xyz: [{_row(sent.xyz)}], quat_xyzw: [{_row(sent.quat_xyzw)}]}}}}"
    advice = (
        f"is {driven.sensor} another model? If this unit is so, say so: sensors: {{{driven.sensor}: {{frames: {own}}}}}"
    )
    return finding("TF828", message, place, help=advice, notes=notes, severity="warning")


def _row(values: tuple[float, ...]) -> str:
    return ", ".join(f"{round(value, 6) + 0.0:g}" for value in values)
