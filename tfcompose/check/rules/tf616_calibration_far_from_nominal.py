"""TF616: calibration far from nominal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.check.rules.tf615_calibration_probably_inverse import why_inverse
from tfcompose.check.rules.tf617_calibration_all_zero import is_all_zero
from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def calibration_far_from_nominal(robot: Robot) -> Iterator[Finding]:
    """A calibration is farther from the pose written beside it than its limit.

    The sensor was moved, the file is of another robot, the frames are others than meant, or the nominal pose is rough.
    Look which; then mend the one that is wrong, or set the limit: {xyz: 5 cm, rot: 5 deg}.
    """
    for edge in robot.edges:
        made = edge.calibration
        if made is None or is_all_zero(made) or why_inverse(robot, edge):
            continue
        far, turned = made.off(made.pose)
        if far > made.limit_m or turned > made.limit_rad:
            off, limit = _both(far, turned), _both(made.limit_m, made.limit_rad)
            message = f"{made.name} is {off} from nominal; the limit is {limit}"
            advice = "mend the pose beside it, or set limit: {xyz: …, rot: …}"
            notes = [Note("measured here", made.at)]
            yield finding("TF616", message, made.named_at, help=advice, notes=notes)


def _both(metres: float, radians: float) -> str:
    return f"{round(metres * 1000, 3):.3g} mm and {round(math.degrees(radians), 3):.2g} deg"
