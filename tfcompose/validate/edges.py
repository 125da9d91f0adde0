"""The keys of an edge: a parent, a pose, and who publishes it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.validate.calibration import CALIBRATION, CalibrationSpec
from tfcompose.validate.fields import BOOLEAN, RATE_, TEXT
from tfcompose.validate.posed import Posed
from tfcompose.validate.schema import Problems, key, listing, then

if TYPE_CHECKING:
    from tfcompose.load import Path


def _parents(value: tuple[str, ...], path: Path, problems: Problems) -> Any:
    if not value:
        return problems.refuse("TF103", path, "an empty list names no parent", "name the frame that it hangs on")
    twice = next((index for index, name in enumerate(value) if name in value[:index]), None)
    if twice is not None:
        return problems.refuse("TF106", (*path, twice), f"{value[twice]} is in the list already", "remove it")
    return value


#: A parent, or several of which the first is nominal; and one parent, which gives a tuple too.
PARENTS = then(listing(TEXT, single=True), _parents)
PARENT = then(TEXT, lambda value, _path, _problems: (value,))


class EdgeKeys(Posed):
    """What may stand wherever a parent is."""

    parent: tuple[str, ...] | None = key(
        PARENTS, None, "the frame that this one hangs on; a list: now one, now another (a tool changer)", ("base_link",)
    )
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
