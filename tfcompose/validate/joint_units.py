"""Units in joints: what turns is measured in angles, what slides in lengths."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.validate.quantity import (
    ANGLE,
    DAMPING,
    FORCE,
    LENGTH,
    SPEED,
    TORQUE,
    TURN_DAMPING,
    TURN_RATE,
    Dimension,
    Quantity,
    UnitError,
    dimension_name,
    example,
    quantity,
)

if TYPE_CHECKING:
    from tfcompose.validate.schema import Problems

_POSITION, _EFFORT = (ANGLE, LENGTH), (TORQUE, FORCE)
#: Each value of a joint that has a unit, with the dimensions that it has where the joint turns, and where it slides.
_MEASURED: dict[str, dict[str, tuple[Dimension, Dimension]]] = {
    "limit": {"lower": _POSITION, "upper": _POSITION, "effort": _EFFORT, "velocity": (TURN_RATE, SPEED)},
    "mimic": {"offset": _POSITION},
    "dynamics": {"damping": (TURN_DAMPING, DAMPING), "friction": _EFFORT},
    "safety_controller": {"soft_lower_limit": _POSITION, "soft_upper_limit": _POSITION},
    "calibration": {"rising": _POSITION, "falling": _POSITION},
}
_SLIDES = {"revolute": False, "continuous": False, "prismatic": True}


def refuse_units_of_others(data: dict[str, Any], problems: Problems) -> None:
    """Refuse lengths in joints that turn, and angles in joints that slide; a bare number has the right unit."""
    joints = data.get("joints")
    for name, said in joints.items() if isinstance(joints, dict) else ():
        kind = said.get("type") if isinstance(said, dict) else None
        if not isinstance(kind, str) or kind not in _SLIDES:
            continue
        for section, inside in said.items():
            if section in _MEASURED and isinstance(inside, dict):
                for key, value in inside.items():
                    if isinstance(value, (str, Quantity)) and key in _MEASURED[section]:
                        _judge(value, kind, _MEASURED[section][key], ("joints", name, section, key), problems)


def _judge(
    value: str | Quantity, kind: str, both: tuple[Dimension, Dimension], path: tuple[str, ...], problems: Problems
) -> None:
    try:
        dimension = (quantity(value) if isinstance(value, str) else value).dimension
    except UnitError:
        return  # it has been refused
    wanted, other = both[::-1] if _SLIDES[kind] else both
    if dimension == other:
        moves = "slides" if _SLIDES[kind] else "turns"
        what = value if isinstance(value, str) else f"a {dimension_name(other)}"
        message = f"{path[1]} is {kind} and {moves}: {path[-1]} cannot be {what}"
        problems.refuse("TF104", path, message, f"for example {example(wanted)}")
