"""Joints: what is written becomes what can move."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.findings import Finding, finding
from tfcompose.geometry import norm
from tfcompose.model import FREE, Dynamics, Joint, Limit, ReferencePositions, SafetyController

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.findings import Span
    from tfcompose.load import Path, Source
    from tfcompose.validate import Validated
    from tfcompose.validate.joints import JointSpec

_MOVING = "revolute, continuous or prismatic"
#: What is said of a joint's motion, by types of joints of which it says nothing.
_IDLE = {
    "fixed": ("axis", "limit", "mimic", "dynamics", "safety_controller", "calibration"),
    "floating": ("axis", "limit", "mimic", "dynamics", "safety_controller", "calibration"),
    "planar": ("mimic",),
}


def joint_of(name: str, written: JointSpec, at: Span) -> Joint | None:
    """Return the joint with a unit axis, or None where it is fixed."""
    kind: Any = written.type
    if kind == "fixed":
        return None
    length = norm(written.axis)
    x, y, z = written.axis
    limit, mimic = written.limit, written.mimic
    dynamics, safety, reference = written.dynamics, written.safety_controller, written.calibration
    return Joint(
        name=name,
        type=kind,
        at=at,
        axis=(x / length, y / length, z / length),
        limit=Limit(limit.lower, limit.upper, limit.effort, limit.velocity) if limit else None,
        mimic=mimic.joint if mimic else None,
        multiplier=mimic.multiplier if mimic else 1.0,
        offset=mimic.offset if mimic else 0.0,
        axis_length=length,
        dynamics=Dynamics(dynamics.damping, dynamics.friction) if dynamics else None,
        safety=SafetyController(**{key: getattr(safety, key) for key in SafetyController.__slots__})
        if safety
        else None,
        reference=ReferencePositions(reference.rising, reference.falling) if reference else None,
    )


def idle_keys(name: str, kind: str, said: dict[str, Any], source: Source) -> Iterator[Finding]:
    """Yield a finding where a joint says what joints of its type do not have; ``said`` is what is written."""
    at: Path = ("joints", name)
    idle = [key for key in said if key in _IDLE.get(kind, ())]
    advice = "leave it out" if kind in FREE else f"leave it out; if {name} moves, type: {_MOVING}"
    limit = said.get("limit")
    if kind == "continuous" and isinstance(limit, dict):
        at, idle = (*at, "limit"), [key for key in ("lower", "upper") if key in limit]
        advice = "leave it out; if there is an end, type: revolute"
    if idle:
        message = f"the joint {name} is {kind}: {', '.join(idle)} {'have' if idle[1:] else 'has'} no effect"
        yield finding("TF727", message, source.at_key((*at, idle[0])), help=advice, severity="warning")


def unjoined(validated: Validated) -> Iterator[tuple[str, str]]:
    """Yield the links, as entries, that hang on nothing only because their joints were refused already."""
    joints = validated.source.data.get("joints")
    for section, name in validated.broken:
        said = joints.get(name) if section == "joints" and isinstance(joints, dict) else None
        child = said.get("child") if isinstance(said, dict) else None
        if isinstance(child, str):
            yield ("links", child)
