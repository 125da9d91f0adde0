"""Results of the checks of a sensor."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Finding
    from tfcompose.foundation.geometry import Pose, Quaternion, Vector

Answer = Literal["agrees", "differs", "cannot tell"]


@dataclass(frozen=True, slots=True)
class CheckResult:
    """The result of a check for a topic."""

    check: str
    answer: Answer
    #: The measured value with its standard error, the reason why it differs, or the reason why the
    #: check cannot tell.
    text: str
    #: The code of the finding, if the measurement differs.
    code: str = ""
    #: The help of the finding, if the measurement differs.
    help: str = ""
    #: The fitting rotation of the message's frame in the base; None if no rotation fits, or if it
    #: is unknown.
    base_from_frame_xyzw: Quaternion | None = None
    #: The fitting position of the message's frame in the base, in metres; None if the declared
    #: position fits.
    base_from_frame_xyz: Vector | None = None
    #: Measured numbers by name, in SI units.
    values: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SensorVerdict:
    """The result of a check, with its sensor, topic and finding."""

    sensor: str
    topic: str
    judgement: CheckResult
    #: The finding, if the measurement differs.
    finding: Finding | None = None
    #: The mount and its pose in its parent that would fit, if a pose would.
    fit: tuple[str, Pose] | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the result as JSON data."""
        judgement = self.judgement
        return {
            "sensor": self.sensor,
            "topic": self.topic,
            "check": judgement.check,
            "answer": judgement.answer,
            "text": judgement.text,
            "values": judgement.values,
            "code": judgement.code or None,
        }
