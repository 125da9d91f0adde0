"""TF618: calibration copied."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding
from tfcompose.geometry import Pose

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Calibration, Robot


def calibration_copied(robot: Robot) -> Iterator[Finding]:
    """Two mounts have the very same calibration values.

    Two measurements never agree to the last digit: one was copied and not changed, or both name one entry. Name each
    mount's own entry, or calibrate the second one.
    """
    first: dict[Pose, Calibration] = {}
    for edge in robot.edges:
        made = edge.calibration
        if made is None or made.entry == Pose():
            continue
        other = first.setdefault(made.entry, made)
        if other is not made:
            message = f"{made.name} has the very values of {other.child}"
            notes = [Note("the other one", other.at), Note("this one", made.at)]
            advice = "give each its own measurement"
            yield finding("TF618", message, made.named_at, help=advice, notes=notes)
