"""The simple types of the language: texts, choices, quantities and lists of them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from tfcompose.findings import did_you_mean
from tfcompose.geometry import norm
from tfcompose.validate.quantity import (
    ANGLE,
    DAMPING,
    DENSITY,
    FORCE,
    INERTIA,
    LENGTH,
    MASS,
    NUMBER,
    RATE,
    SPEED,
    TIME,
    TORQUE,
    TURN_DAMPING,
    TURN_RATE,
    Dimension,
    Quantity,
    UnitError,
    dimension_name,
    example,
    quantity,
    respelt,
    with_article,
)
from tfcompose.validate.schema import BROKEN, Problems, Type, listing, shown, then

if TYPE_CHECKING:
    from tfcompose.geometry import Vector
    from tfcompose.load import Path


def text(pattern: str | None = None, means: str = "") -> Type:
    """Return the type of a text, of a pattern if given; ``means`` says the pattern in words."""
    compiled = re.compile(pattern) if pattern else None

    def read(value: Any, path: Path, problems: Problems) -> Any:
        if not isinstance(value, str):
            advice = "put it in quotes" if isinstance(value, (int, float)) else ""
            return problems.refuse("TF103", path, f"{shown(value)} is no text", advice)
        if compiled and not compiled.fullmatch(value):
            return problems.refuse("TF106", path, f"{shown(value)} is not {means}")
        return value

    return Type(read, {"type": "string"} | ({"pattern": f"^{pattern}$"} if pattern else {}))


def choice(*allowed: str | int) -> Type:
    """Return the type of one of the values."""

    def read(value: Any, path: Path, problems: Problems) -> Any:
        if value in allowed and not isinstance(value, bool):
            return value
        advice = f"one of: {', '.join(map(str, allowed))}"
        if isinstance(value, str):
            advice = did_you_mean(value, [str(one) for one in allowed], advice)
        return problems.refuse("TF106", path, f"{shown(value)} is not allowed here", advice)

    return Type(read, {"enum": list(allowed)})


def _boolean(value: Any, path: Path, problems: Problems) -> Any:
    return value if isinstance(value, bool) else problems.refuse("TF103", path, f"{shown(value)} is not true or false")


def _true(value: Any, path: Path, problems: Problems) -> Any:
    return True if value is True else problems.refuse("TF106", path, f"{shown(value)} is not true", "leave the key out")


def integer(least: int, most: int) -> Type:
    """Return the type of a whole number within bounds."""

    def read(value: Any, path: Path, problems: Problems) -> Any:
        if isinstance(value, Quantity) and value.dimension == NUMBER and value.value == int(value.value):
            value = int(value.value)
        if isinstance(value, bool) or not isinstance(value, int):
            return problems.refuse("TF103", path, f"{shown(value)} is no whole number")
        if not least <= value <= most:
            return problems.refuse("TF106", path, f"{value} is not between {least} and {most}")
        return value

    return Type(read, {"type": "integer", "minimum": least, "maximum": most})


def read_quantity(value: Any, path: Path, problems: Problems, dimension: Dimension) -> Any:
    """Return the value in SI, or ``BROKEN``: it is no number, its unit is unknown, or it has another dimension."""
    if isinstance(value, str):
        try:
            value = quantity(value, dimension)
        except UnitError as error:
            code = "TF104" if error.unit else "TF103"
            instead = respelt(value, error.unit, dimension) if error.unit else None
            message = f"{error}; {with_article(dimension)} is expected"
            return problems.refuse(code, path, message, error.advice, instead=instead)
    if isinstance(value, Quantity):
        if value.dimension not in {NUMBER, dimension}:
            message = f"{with_article(dimension)} is expected; this is of the kind {dimension_name(value.dimension)}"
            return problems.refuse("TF104", path, message, f"for example {example(dimension)}")
        value = value.value
    elif isinstance(value, bool) or not isinstance(value, (int, float)):
        message = f"{shown(value)} is no {dimension_name(dimension)}"
        return problems.refuse("TF103", path, message, f"for example {example(dimension)}")
    if -LARGEST <= value <= LARGEST:
        return float(value)
    return problems.refuse("TF106", path, f"{shown(float(value))} is beyond what can be computed with")


#: Beyond this, and for sizes and masses below its inverse, products of four such numbers leave the range of floats.
LARGEST = 1e30


def measure(dimension: Dimension, least: float | None = None) -> Type:
    """Return the type of a quantity, in SI, with the least value that it can have."""

    def read(value: Any, path: Path, problems: Problems) -> Any:
        number = read_quantity(value, path, problems, dimension)
        if least is not None and number is not BROKEN and number < least:
            what = "is not greater than 0" if number <= 0 else f"is less than {least:g}"
            return problems.refuse("TF106", path, f"{shown(value)} {what}")
        return number

    about = f"a {dimension_name(dimension)}: a bare number is SI, a text may carry a unit"
    return Type(read, {"type": ["number", "string"], "description": about, "examples": [example(dimension)]})


def either(turning: Dimension, sliding: Dimension) -> Type:
    """Return the type of what is one quantity for a turning joint and another for a sliding one, in SI."""

    def read(value: Any, path: Path, problems: Problems) -> Any:
        if isinstance(value, (int, float)):
            return read_quantity(value, path, problems, turning)
        number = read_quantity(value, path, Problems(), turning)
        return number if number is not BROKEN else read_quantity(value, path, problems, sliding)

    about = f"a {dimension_name(turning)} for a turning joint, a {dimension_name(sliding)} for a sliding one"
    examples = [example(turning), example(sliding)]
    return Type(read, {"type": ["number", "string"], "description": about, "examples": examples})


def _colour_part(value: float, path: Path, problems: Problems) -> Any:
    if 0 <= value <= 1:
        return value
    advice = "divide values up to 255 by 255"
    return problems.refuse("TF106", path, f"{shown(value)} is no part of a colour: 0 to 1", advice)


def _has_direction(axis: Vector, path: Path, problems: Problems) -> Any:
    length = norm(axis)
    if length > 1 / LARGEST:
        return axis
    return problems.refuse("TF106", path, f"an axis of length {length:g} has no direction", "for example [0, 0, 1]")


def _scale(value: Any, path: Path, problems: Problems) -> Any:
    """Return a scale's three factors; a negative one is a mirror."""
    factors = _THREE.read(value if isinstance(value, list) else [value] * 3, path, problems)
    if factors is BROKEN or all(abs(factor) > 1 / LARGEST for factor in factors):
        return factors
    return problems.refuse("TF106", path, "a scale of 0: nothing is left of the mesh", "for example 0.001")


def _plain(value: Any) -> Any:
    """Return plain data, as it is passed on: a computed quantity is its number."""
    if isinstance(value, Quantity):
        return value.value
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, list) else value


ANYTHING = Type(lambda value, _path, _problems: _plain(value), {})
TEXT = text()
NAME = text(r"[A-Za-z][A-Za-z0-9_]*", "a name: a letter, then letters, digits and _")
NAMESPACE = text(r"(/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*)?", "a namespace such as robot1 or fleet/robot1")
BOOLEAN = Type(_boolean, {"type": "boolean"})
ONLY_TRUE = Type(_true, {"const": True})
NUMBER_ = measure(NUMBER)
LENGTH_ = measure(LENGTH)
ANGLE_ = measure(ANGLE)
TURN_RATE_ = measure(TURN_RATE)
INERTIA_ = measure(INERTIA)
SIZE = measure(LENGTH, 1 / LARGEST)
MASS_ = measure(MASS, 1 / LARGEST)
DENSITY_ = measure(DENSITY, 1 / LARGEST)
RATE_ = measure(RATE, 1e-3)
DURATION = measure(TIME, 1e-3)
POSITION = either(ANGLE, LENGTH)
JOINT_SPEED = either(TURN_RATE, SPEED)
JOINT_EFFORT = either(TORQUE, FORCE)
JOINT_DAMPING = either(TURN_DAMPING, DAMPING)
XYZ = listing(LENGTH_, count=3, sample="[0.2, 0, 30 cm]")
SIZES = listing(SIZE, count=3, sample="[0.5, 0.4, 0.15]")
NUMBERS = listing(NUMBER_, count=3, sample="[0, 0, 1]")
_THREE = listing(NUMBER_, count=3, sample="[0.001, 0.001, 0.001]")
SCALE = Type(_scale, {"anyOf": [NUMBER_.schema, _THREE.schema]})
AXIS = then(NUMBERS, _has_direction)
RGBA = listing(then(NUMBER_, _colour_part), count=4, sample="[0.2, 0.4, 0.8, 1]")
