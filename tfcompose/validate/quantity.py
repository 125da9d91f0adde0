"""Quantities: numbers with a unit, in SI and radians.

A dimension is the exponents of metre, kilogram, second and radian. A bare number has whatever dimension is asked for.
"""

from __future__ import annotations

import math
import re

from tfcompose.diagnostic import did_you_mean, slip_of
from tfcompose.frozen import dataclass

Dimension = tuple[int, int, int, int]

NUMBER: Dimension = (0, 0, 0, 0)
LENGTH: Dimension = (1, 0, 0, 0)
MASS: Dimension = (0, 1, 0, 0)
TIME: Dimension = (0, 0, 1, 0)
ANGLE: Dimension = (0, 0, 0, 1)
RATE: Dimension = (0, 0, -1, 0)
SPEED: Dimension = (1, 0, -1, 0)
TURN_RATE: Dimension = (0, 0, -1, 1)
FORCE: Dimension = (1, 1, -2, 0)
TORQUE: Dimension = (2, 1, -2, 0)
INERTIA: Dimension = (2, 1, 0, 0)
DENSITY: Dimension = (-3, 1, 0, 0)
DAMPING: Dimension = (0, 1, -1, 0)
TURN_DAMPING: Dimension = (2, 1, -1, -1)

DIMENSION_NAMES: dict[Dimension, str] = {
    NUMBER: "number",
    LENGTH: "length",
    MASS: "mass",
    TIME: "time",
    ANGLE: "angle",
    RATE: "rate",
    SPEED: "speed",
    TURN_RATE: "turn rate",
    FORCE: "force",
    TORQUE: "torque",
    INERTIA: "moment of inertia",
    DENSITY: "density",
    DAMPING: "damping",
    TURN_DAMPING: "damping",
}

#: Unit, its size in SI, its dimension. International inch and foot are exact since 1959; 1 lb = 0.45359237 kg.
UNITS: dict[str, tuple[float, Dimension]] = {
    "m": (1.0, LENGTH),
    "cm": (0.01, LENGTH),
    "mm": (0.001, LENGTH),
    "um": (1e-6, LENGTH),
    "km": (1000.0, LENGTH),
    "in": (0.0254, LENGTH),
    "ft": (0.3048, LENGTH),
    "kg": (1.0, MASS),
    "g": (0.001, MASS),
    "lb": (0.45359237, MASS),
    "s": (1.0, TIME),
    "ms": (0.001, TIME),
    "us": (1e-6, TIME),
    "min": (60.0, TIME),
    "rad": (1.0, ANGLE),
    "mrad": (0.001, ANGLE),
    "deg": (math.pi / 180, ANGLE),
    "Hz": (1.0, RATE),
    "kHz": (1000.0, RATE),
    "m/s": (1.0, SPEED),
    "rad/s": (1.0, TURN_RATE),
    "deg/s": (math.pi / 180, TURN_RATE),
    "rpm": (math.pi / 30, TURN_RATE),
    "N": (1.0, FORCE),
    "Nm": (1.0, TORQUE),
    "kg*m^2": (1.0, INERTIA),
    "kg/m^3": (1.0, DENSITY),
    "g/cm^3": (1000.0, DENSITY),
    "Ns/m": (1.0, DAMPING),
    "Nms/rad": (1.0, TURN_DAMPING),
}

# Units whose size is a fraction, as numerator and denominator: 30 cm is 0.3 and 12 in are 0.3048, to the last bit.
_FRACTIONS: dict[str, tuple[float, float]] = {
    "cm": (1, 100),
    "mm": (1, 1000),
    "um": (1, 1_000_000),
    "in": (254, 10_000),
    "ft": (3048, 10_000),
    "g": (1, 1000),
    "lb": (45_359_237, 100_000_000),
    "ms": (1, 1000),
    "us": (1, 1_000_000),
    "mrad": (1, 1000),
}

_QUANTITY = re.compile(r"\s*([-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?)\s*([A-Za-zµ°\"'%][^\s]*)?\s*")


@dataclass(frozen=True, slots=True)
class Quantity:
    """A value in SI with its dimension."""

    value: float
    dimension: Dimension = NUMBER


class UnitError(ValueError):
    """A text is no quantity; ``advice`` says what to write instead, ``unit`` is the unit that is not known."""

    def __init__(self, message: str, advice: str = "", unit: str = "") -> None:
        super().__init__(message)
        self.advice = advice
        self.unit = unit


def quantity(text: str, wanted: Dimension | None = None) -> Quantity:
    """Return what a text such as ``30 cm`` or ``1e-3`` says; ``wanted`` is the dimension that advice is given for.

    Raises:
        UnitError: if it is no number, or its unit is not known.
    """
    match = _QUANTITY.fullmatch(text)
    if not match:
        raise UnitError(f"{text!r} is no quantity", "write a number, or a number and a unit: 0.3, 30 cm, 15 deg")
    number, unit = float(match[1]), match[2]
    if not math.isfinite(number):
        raise UnitError(f"{text!r} is not finite")
    return in_unit(number, unit, wanted) if unit else Quantity(number)


def in_unit(number: float, unit: str, wanted: Dimension | None = None) -> Quantity:
    """Return ``number`` times the unit; ``wanted`` is the dimension that advice is given for, None: any.

    Raises:
        UnitError: if the unit is not known, or the result too large for a number.
    """
    if unit not in UNITS:
        raise UnitError(f"unknown unit {unit}", _instead_of(unit, wanted), unit)
    factor, dimension = UNITS[unit]
    above, below = _FRACTIONS.get(unit, (factor, 1))
    value = math.radians(number) if unit == "deg" else number * above / below
    if not math.isfinite(value):
        raise UnitError(f"{number!r} {unit} is not finite")
    return Quantity(value, dimension)


def _instead_of(unit: str, wanted: Dimension | None) -> str:
    """Return which unit of the wanted dimension (None: of any) is probably meant, or all that there are."""
    known = [name for name, (_, its) in UNITS.items() if wanted in {None, its}]
    if _SPELLINGS.get(unit) in known:
        return f"write {_SPELLINGS[unit]}"
    what = "known units" if wanted is None else f"units of {dimension_name(wanted)}"
    return did_you_mean(unit, known, f"{what}: {', '.join(known)}" if known else "leave the unit out")


#: How else people write units, and their name here.
_SPELLINGS = {
    spelling: unit
    for unit, spellings in {
        "m": "meter meters metre metres",
        "cm": "centimeter centimeters centimetre centimetres",
        "mm": "millimeter millimeters millimetre millimetres",
        "um": "µm \u03bcm micrometer micrometers micrometre micrometres",
        "km": "kilometer kilometers kilometre kilometres",
        "in": '" inch inches',
        "ft": "' foot feet",
        "kg": "kilogram kilograms kilo kilos",
        "g": "gram grams",
        "lb": "lbs pound pounds",
        "s": "sec secs second seconds",
        "ms": "msec millisecond milliseconds",
        "us": "µs \u03bcs microsecond microseconds",
        "min": "minute minutes",
        "rad": "radian radians",
        "mrad": "milliradian milliradians",
        "deg": "° degree degrees",
        "Hz": "hz hertz",
        "kHz": "khz kilohertz",
        "m/s": "mps",
        "deg/s": "°/s dps",
    }.items()
    for spelling in spellings.split()
}


def respelt(text: str, unit: str, dimension: Dimension) -> str | None:
    """Return the quantity with the only unit of the dimension that can be meant by ``unit``, or None."""
    known = [name for name, (_, its) in UNITS.items() if its == dimension]
    meant = _SPELLINGS.get(unit) or _SPELLINGS.get(unit.lower()) or slip_of(unit, known)
    if meant not in known or not text.rstrip().endswith(unit):
        return None
    return text.rstrip().removesuffix(unit) + str(meant)


def dimension_name(dimension: Dimension) -> str:
    """Return what people call the dimension, or its exponents where it has no name."""
    named = DIMENSION_NAMES.get(dimension)
    powers = zip(("m", "kg", "s", "rad"), dimension, strict=True)
    return named or " ".join(f"{base}^{power}" for base, power in powers if power)


def example(dimension: Dimension) -> str:
    """Return one way to write a quantity of the dimension."""
    return _EXAMPLES.get(dimension, "1")


_EXAMPLES = {
    FORCE: "20 N",
    TORQUE: "2 Nm",
    LENGTH: "30 cm",
    MASS: "10 kg",
    TIME: "200 ms",
    ANGLE: "15 deg",
    RATE: "50 Hz",
    SPEED: "0.5 m/s",
    TURN_RATE: "0.5 rad/s",
    DENSITY: "2700 kg/m^3",
    DAMPING: "0.5 Ns/m",
    TURN_DAMPING: "0.5 Nms/rad",
}
