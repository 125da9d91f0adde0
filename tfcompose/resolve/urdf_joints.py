"""The joints of a URDF: edges, and what can move."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

from tfcompose.findings import did_you_mean
from tfcompose.geometry import norm
from tfcompose.model import (
    JOINTS,
    STATIC,
    Dynamics,
    Edge,
    Joint,
    Limit,
    ReferencePositions,
    SafetyController,
)
from tfcompose.resolve.joints import FREE

if TYPE_CHECKING:
    from tfcompose.geometry import Vector
    from tfcompose.load.urdf import Element
    from tfcompose.resolve.urdf_values import Values

T = TypeVar("T", Dynamics, Limit, ReferencePositions, SafetyController)

#: Their numbers say how far or how much at the most: one that is endless only says nothing.
_BOUNDS = (Limit, SafetyController)
MOVING = ("revolute", "continuous", "prismatic")
TYPES = (*MOVING, "fixed", "floating", "planar")


def edge_of(element: Element, values: Values) -> Edge | None:
    """Return the edge that a joint is, or None where it has no parent or no child."""
    name, kind = element.attributes.get("name", ""), values.text(element, "type", 'type="fixed"')
    if kind and kind not in TYPES:
        advice = did_you_mean(kind, TYPES, f"one of: {', '.join(TYPES)}")
        values.refuse(f"there is no joint type {kind}", element.place("type"), advice)
    ends = {}
    for tag in ("parent", "child"):
        end = element.first(tag)
        if end is None:
            values.refuse(f"the joint {name} has no {tag}", element.at, f'<{tag} link="…"/>')
        elif values.text(end, "link", f'<{tag} link="…"/>'):
            ends[tag] = end
    moving = _moving(name, kind, element, values) if kind in MOVING or kind in FREE else None
    if len(ends) < 2:  # noqa: PLR2004 (parent and child)
        return None
    free = kind in FREE
    return Edge(
        parent=ends["parent"].attributes["link"],
        child=ends["child"].attributes["link"],
        kind="dynamic" if free else "joint" if moving else "static",
        pose=values.pose(element),
        owner=JOINTS if moving and not free else STATIC,
        at=ends["parent"].place("link"),
        joint=None if free else moving,
        free=moving if free else None,
        joint_name=name,
        joint_at=element.place("name"),
        child_at=ends["child"].place("link"),
    )


def _moving(name: str, kind: Any, element: Element, values: Values) -> Joint:
    written = element.first("axis")
    x, y, z = values.numbers(written, "xyz", (1.0, 0.0, 0.0))
    length = norm((x, y, z))
    if not 0 < length < math.inf:
        values.refuse(f"the axis of {name} has no direction", (written or element).place("xyz"), '<axis xyz="0 0 1"/>')
        x, y, z, length = 1.0, 0.0, 0.0, 1.0
    axis: Vector = (x / length, y / length, z / length)
    mimic = element.first("mimic")
    joint = Joint(name, kind, element.place("name"), axis, axis_length=length)
    if mimic is not None:
        master = values.text(mimic, "joint", '<mimic joint="…"/>')
        multiplier, offset = values.number(mimic, "multiplier", 1.0), values.number(mimic, "offset", 0.0)
        joint = replace(joint, mimic=master or None, multiplier=multiplier, offset=offset)
    return replace(
        joint,
        limit=_limit(name, element.first("limit"), values),
        dynamics=_numbers(Dynamics, element.first("dynamics"), values),
        safety=_safety(name, element.first("safety_controller"), values),
        reference=_numbers(ReferencePositions, element.first("calibration"), values),
    )


def _limit(name: str, said: Element | None, values: Values) -> Limit | None:
    if said is None:
        return None
    for key in ("effort", "velocity"):
        if key not in said.attributes:
            values.refuse(f"the limit of {name} has no {key}", said.at, f'URDF requires it: {key}="1"')
    return _numbers(Limit, said, values)


def _safety(name: str, said: Element | None, values: Values) -> SafetyController | None:
    if said is not None and "k_velocity" not in said.attributes:
        values.refuse(
            f"the safety_controller of {name} has no k_velocity", said.at, 'URDF requires it: k_velocity="10"'
        )
    return _numbers(SafetyController, said, values)


def _numbers(cls: type[T], element: Element | None, values: Values) -> T | None:
    """Return the object whose fields are the element's attributes; those that are missing have their defaults."""
    if element is None:
        return None
    read = values.bound if cls in _BOUNDS else values.number
    given = {name: read(element, name) for name in cls.__slots__}
    return cls(**{name: value for name, value in given.items() if value is not None})
