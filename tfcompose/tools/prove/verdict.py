"""Verdicts on a sensor: its measurements agree, differ, or cannot tell."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Finding
    from tfcompose.foundation.geometry import Quaternion

Answer = Literal["agrees", "differs", "cannot tell"]


@dataclass(frozen=True, slots=True)
class CheckResult:
    """The answer of one check about one topic."""

    check: str
    answer: Answer
    #: The measured value with its uncertainty; why it differs; or why the check cannot tell.
    text: str
    #: The code of the finding, if it differs.
    code: str = ""
    #: The way out, if it differs.
    help: str = ""
    #: The rotation of the message's frame in the base that fits; None: no rotation fits, or it is
    #: not known.
    base_from_frame_xyzw: Quaternion | None = None
    #: Measured numbers by name, in SI units.
    values: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SensorVerdict:
    """A judgement with its sensor, topic and finding."""

    sensor: str
    topic: str
    judgement: CheckResult
    #: The finding if it differs.
    finding: Finding | None = None

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON has it."""
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
