"""``calibration:`` in a robot file: which file holds a measured pose, and how far it may be from the nominal one."""

from __future__ import annotations

import math

from tfcompose.validate.fields import ANGLE_, LENGTH_, TEXT, choice
from tfcompose.validate.schema import Model, key, record

#: The forms of files that are read; ``tfcompose.validate.calibration_file`` says what each holds.
FORMATS = ("autoware", "easy_handeye2", "moveit", "kalibr", "matrix", "transform_stamped")


class CalibrationLimit(Model):
    """How far a calibration may be from the pose that is written beside it."""

    xyz: float = key(LENGTH_, 0.05, examples=("5 cm",))
    rot: float = key(ANGLE_, math.radians(5), examples=("5 deg",))


class CalibrationSpec(Model):
    """A pose that was measured, in a file. The pose written beside it is the nominal one."""

    file: str = key(TEXT, about="relative to the file that names it", examples=("calibration/sensors.yaml",))
    format: str = key(choice("auto", *FORMATS), "auto")
    parent: str | None = key(TEXT, None, "the entry's parent in that file; left out: the frame that this one hangs on")
    child: str | None = key(TEXT, None, "the entry's child in that file; left out: this frame, or one of the sensor's")
    limit: CalibrationLimit = key(record(CalibrationLimit), CalibrationLimit())


CALIBRATION = record(
    CalibrationSpec, lambda value: {"file": value} if isinstance(value, str) else value, {"type": "string"}
)
