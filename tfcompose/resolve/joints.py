"""Joints: what is written becomes what can move."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.findings import Finding, finding
from tfcompose.geometry import norm
from tfcompose.model import FREE, Joint

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.findings import Span
    from tfcompose.language.robot import JointSpec
    from tfcompose.load import Path, Source

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
    mimic = written.mimic
    return Joint(
        name=name,
        type=kind,
        at=at,
        axis=(x / length, y / length, z / length),
        limit=written.limit,
        mimic=mimic.joint if mimic else None,
        multiplier=mimic.multiplier if mimic else 1.0,
        offset=mimic.offset if mimic else 0.0,
        axis_length=length,
        dynamics=written.dynamics,
        safety=written.safety_controller,
        reference=written.calibration,
    )


def idle_keys(name: str, joint: JointSpec, source: Source) -> Iterator[Finding]:
    """Yield a finding where a joint has keys that joints of its type do not use."""
    at: Path = ("joints", name)
    idle = source.in_order(at, joint.model_fields_set & {*_IDLE.get(joint.type, ())})
    advice = "leave it out" if joint.type in FREE else f"leave it out; if {name} moves, type: {_MOVING}"
    if joint.type == "continuous" and joint.limit:
        at = (*at, "limit")
        idle = source.in_order(at, [key for key in ("lower", "upper") if getattr(joint.limit, key) is not None])
        advice = "leave it out; if there is an end, type: revolute"
    if idle:
        message = f"the joint {name} is {joint.type}: {', '.join(idle)} {'have' if idle[1:] else 'has'} no effect"
        yield finding("TF727", message, source.at_key((*at, idle[0])), help=advice, severity="warning")
