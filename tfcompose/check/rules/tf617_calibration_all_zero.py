"""TF617: calibration all zero."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding
from tfcompose.geometry import Pose

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Calibration, Robot


def calibration_all_zero(robot: Robot) -> Iterator[Finding]:
    """A calibration is all zero, and the pose written beside it is not.

    So a file looks that was prepared and never filled. Calibrate, or leave calibration out: then the
    nominal pose holds.
    """
    for edge in robot.edges:
        made = edge.calibration
        if made and is_all_zero(made):
            message = f"{made.name} is all zero, and its nominal pose is not"
            advice = "calibrate, or leave calibration out"
            yield finding("TF617", message, made.named_at, help=advice, notes=[Note("zero here", made.at)])


def is_all_zero(made: Calibration) -> bool:
    """Return whether the calibration is all zero where its nominal pose is not."""
    return made.entry == Pose() and made.nominal is not None and max(made.off(Pose())) > 0
