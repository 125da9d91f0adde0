"""The keys of an edge: a parent, a pose, and who publishes it."""

from __future__ import annotations

from tfcompose.validate.calibration import CALIBRATION, CalibrationSpec
from tfcompose.validate.fields import BOOLEAN, RATE_, TEXT
from tfcompose.validate.posed import Posed
from tfcompose.validate.schema import key


class EdgeKeys(Posed):
    """What may stand wherever a parent is."""

    parent: str | None = key(TEXT, None, "the frame that this one hangs on", ("base_link",))
    relative_to: str | None = key(TEXT, None, "the pose is given in this frame; the parent stays the parent")
    owner: str | None = key(TEXT, None, "the process that publishes this edge", ("base_drive",))
    rate: float | None = key(RATE_, None, "how often the owner sends it", ("50 Hz",))
    static: bool | None = key(BOOLEAN, None, "the foreign owner sends it on /tf_static")


class MountKeys(EdgeKeys):
    """What may stand where something is bolted on, and so can be measured."""

    calibration: CalibrationSpec | None = key(
        CALIBRATION,
        None,
        "a file with the measured pose; the pose beside it is nominal",
        ("calibration/hand_eye.yaml",),
    )
