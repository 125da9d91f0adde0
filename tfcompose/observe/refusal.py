"""Which transforms are not taken, and why: the rejections of tf2's ``BufferCore``."""

from __future__ import annotations

from enum import Enum
from math import isfinite
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.observe.rotation import Seven

#: A quaternion whose squared length is off by this much is refused.
DENORMALISED = 0.01


class Refusal(Enum):
    """Why a transform was not taken; the values are the words of tf2's log."""

    SELF = "TF_SELF_TRANSFORM"
    NO_CHILD = "TF_NO_CHILD_FRAME_ID"
    NO_PARENT = "TF_NO_FRAME_ID"
    NOT_FINITE = "TF_NAN_INPUT"
    DENORMALISED = "TF_DENORMALIZED_QUATERNION"
    OLD = "TF_OLD_DATA"

    @property
    def text(self) -> str:
        """The reason in plain words."""
        return _REFUSALS[self]


_REFUSALS = {
    Refusal.SELF: "it is its own parent",
    Refusal.NO_CHILD: "its child_frame_id is empty",
    Refusal.NO_PARENT: "its frame_id is empty",
    Refusal.NOT_FINITE: "a value is not a finite number",
    Refusal.DENORMALISED: "its quaternion is not of length 1",
    Refusal.OLD: "it is older than all that is kept of its frame",
}


def refusal(parent: str, child: str, pose: Seven) -> Refusal | None:
    """Return why a transform is not taken; as in tf2 the first that holds counts."""
    if parent == child:
        return Refusal.SELF
    if not child:
        return Refusal.NO_CHILD
    if not parent:
        return Refusal.NO_PARENT
    if not all(map(isfinite, pose)):
        return Refusal.NOT_FINITE
    x, y, z, w = pose[3:]
    return None if abs(x * x + y * y + z * z + w * w - 1) < DENORMALISED else Refusal.DENORMALISED
