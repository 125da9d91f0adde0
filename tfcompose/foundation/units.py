"""Quantities with units, and the types of the numbers in robot files.

A dimension consists of the exponents of metre, kilogram, second and radian. A number without a
unit has the dimension that its key requires. In code, a type such as ``Length`` is a float in SI.
In a file, it is a number or a text such as ``30 cm``.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from pydantic_core import PydanticCustomError, core_schema

from tfcompose.foundation.findings import did_you_mean, slip_of

if TYPE_CHECKING:
    from pydantic_core import CoreSchema
    from typing_extensions import Self

Dimension = tuple[int, int, int, int]

NUMBER: Dimension = (0, 0, 0, 0)
LENGTH: Dimension = (1, 0, 0, 0)
MASS: Dimension = (0, 1, 0, 0)
TIME: Dimension = (0, 0, 1, 0)
ANGLE: Dimension = (0, 0, 0, 1)
RATE: Dimension = (0, 0, -1, 0)
SPEED: Dimension = (1, 0, -1, 0)
ANGULAR_VELOCITY: Dimension = (0, 0, -1, 1)
FORCE: Dimension = (1, 1, -2, 0)
TORQUE: Dimension = (2, 1, -2, 0)
INERTIA: Dimension = (2, 1, 0, 0)
DENSITY: Dimension = (-3, 1, 0, 0)
DAMPING: Dimension = (0, 1, -1, 0)
ROTATIONAL_DAMPING: Dimension = (2, 1, -1, -1)

DIMENSION_NAMES: dict[Dimension, str] = {
    NUMBER: "number",
    LENGTH: "length",
    MASS: "mass",
    TIME: "time",
    ANGLE: "angle",
    RATE: "rate",
    SPEED: "speed",
    ANGULAR_VELOCITY: "angular velocity",
    FORCE: "force",
    TORQUE: "torque",
    INERTIA: "moment of inertia",
    DENSITY: "density",
    DAMPING: "damping",
    ROTATIONAL_DAMPING: "damping",
}

#: Units, with size in SI and dimension. International inch and foot are exact since 1959; 1 lb is
#: 0.45359237 kg.
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
    "cm/s": (0.01, SPEED),
    "mm/s": (0.001, SPEED),
    "km/h": (1 / 3.6, SPEED),
    "rad/s": (1.0, ANGULAR_VELOCITY),
    "deg/s": (math.pi / 180, ANGULAR_VELOCITY),
    "rpm": (math.pi / 30, ANGULAR_VELOCITY),
    "N": (1.0, FORCE),
    "Nm": (1.0, TORQUE),
    "kg*m^2": (1.0, INERTIA),
    "kg/m^3": (1.0, DENSITY),
    "g/cm^3": (1000.0, DENSITY),
    "Ns/m": (1.0, DAMPING),
    "Nms/rad": (1.0, ROTATIONAL_DAMPING),
}

# Units whose size is a fraction, as numerator and denominator, so that 30 cm is exactly 0.3 and 12
# in exactly 0.3048.
_FRACTIONS: dict[str, tuple[float, float]] = {
    "cm": (1, 100),
    "mm": (1, 1000),
    "um": (1, 1_000_000),
    "in": (254, 10_000),
    "ft": (3048, 10_000),
    "cm/s": (1, 100),
    "mm/s": (1, 1000),
    "km/h": (10, 36),
    "g": (1, 1000),
    "lb": (45_359_237, 100_000_000),
    "ms": (1, 1000),
    "us": (1, 1_000_000),
    "mrad": (1, 1000),
}

_QUANTITY = re.compile(
    r"\s*([-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?)\s*([A-Za-zµ°\"'%][^\s]*)?\s*"
)


@dataclass(frozen=True, slots=True)
class Quantity:
    """A value in SI with its dimension, as the result of an expression."""

    value: float
    dimension: Dimension = NUMBER


#: A variable in the notation of a shell, a launch file or a template; or an expression of names
#: and numbers.
_NAMED = re.compile(
    r"(?:\$\(\s*(?:var|arg)\s+|\{\{\s*|\$)([\w.]+)\s*(?:\)|\}\})?"
    r"|([A-Za-z_]\w*(?:\s*[-+*/]\s*[\w.]+)*)"
)


@dataclass(frozen=True, slots=True)
class Truth:
    """A boolean as the result of an expression."""

    value: bool


#: Numbers with operators between them.
_ARITHMETIC = re.compile(r"[-+(\s]*[\d.][\d.e()\s]*[-+*/][-+*/().\de\s]*")


class UnitError(ValueError):
    """A text is not a quantity.

    ``advice`` tells what to write instead, and ``unit`` is the unknown unit.
    """

    def __init__(self, message: str, advice: str = "", unit: str = "") -> None:
        super().__init__(message)
        self.advice = advice
        self.unit = unit


def quantity(text: str, dimension: Dimension | None = None) -> Quantity:
    """Return the quantity of a text such as ``30 cm`` or ``1e-3``.

    ``dimension`` is the required dimension, for advice only.

    Raises:
        UnitError: if it is not a number, or its unit is unknown.
    """
    match = _QUANTITY.fullmatch(text)
    if not match:
        sample = "30 cm" if dimension is None else example(dimension)
        advice = f"write a number such as 0.5, or a number and a unit such as {sample}"
        named = _NAMED.fullmatch(text.strip())
        if named and not {text.strip().lower()} & {*UNITS, "inf", "nan"}:
            advice += f'; a variable or an expression is written "${{{named[1] or named[2]}}}"'
        if _ARITHMETIC.fullmatch(text):
            advice = 'arithmetic belongs inside the braces, as in "${a / 2}"'
        point = text.replace(",", ".")
        if _QUANTITY.fullmatch(point):
            advice = f"decimals take a point: {point}"
        raise UnitError(f"{text!r} is not a quantity", advice)
    number, unit = float(match[1]), match[2]
    if not math.isfinite(number):
        raise UnitError(f"{text!r} is not finite")
    return in_unit(number, unit, dimension) if unit else Quantity(number)


def in_unit(number: float, unit: str, required: Dimension | None = None) -> Quantity:
    """Return ``number`` times the unit.

    ``required`` is the required dimension, for advice only; None for any.

    Raises:
        UnitError: if the unit is unknown, or the result is too large for a number.
    """
    if unit not in UNITS:
        raise UnitError(f"unknown unit {unit}", _instead_of(unit, required), unit)
    factor, dimension = UNITS[unit]
    above, below = _FRACTIONS.get(unit, (factor, 1))
    value = math.radians(number) if unit == "deg" else number * above / below
    if not math.isfinite(value):
        raise UnitError(f"{number!r} {unit} is not finite")
    return Quantity(value, dimension)


def _instead_of(unit: str, dimension: Dimension | None) -> str:
    """Return the unit of the dimension that the user probably intended, or all units."""
    units = [name for name, (_, its) in UNITS.items() if dimension in {None, its}]
    if _SPELLINGS.get(unit) in units:
        return f"write {_SPELLINGS[unit]}"
    what = "known units" if dimension is None else f"units of {dimension_name(dimension)}"
    return did_you_mean(
        unit, units, f"{what}: {', '.join(units)}" if units else "leave the unit out"
    )


#: Other spellings of units, with their names in this language.
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
        "km/h": "kmh kph km/hr",
        "deg/s": "°/s dps",
    }.items()
    for spelling in spellings.split()
}


def respelt(text: str, unit: str, dimension: Dimension) -> str | None:
    """Return the quantity with the only similar unit of the dimension, None without one."""
    units = [name for name, (_, its) in UNITS.items() if its == dimension]
    unit_meant = _SPELLINGS.get(unit) or _SPELLINGS.get(unit.lower()) or slip_of(unit, units)
    if unit_meant not in units or not text.rstrip().endswith(unit):
        return None
    return text.rstrip().removesuffix(unit) + str(unit_meant)


def dimension_name(dimension: Dimension) -> str:
    """Return the name of the dimension, or its exponents if it has no name."""
    named = DIMENSION_NAMES.get(dimension)
    powers = zip(("m", "kg", "s", "rad"), dimension, strict=True)
    return named or " ".join(f"{base}^{power}" for base, power in powers if power)


def with_article(dimension: Dimension) -> str:
    """Return the name of the dimension with an article: ``a length``, ``an angle``."""
    name = dimension_name(dimension)
    return f"an {name}" if name[0] in "aeiou" else f"a {name}"


def example(dimension: Dimension) -> str:
    """Return an example of a quantity with the dimension."""
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
    ANGULAR_VELOCITY: "0.5 rad/s",
    DENSITY: "2700 kg/m^3",
    DAMPING: "0.5 Ns/m",
    ROTATIONAL_DAMPING: "0.5 Nms/rad",
}


def invalid(code: str, message: str, help: str = "", **more: Any) -> PydanticCustomError:  # noqa: A002
    """Return the error that a validator raises, with code, message and help of a finding.

    ``more`` may contain ``on_key`` (the key is wrong, not its value), ``conflicts_with`` (the
    conflicting key in the same mapping), ``instead`` (the only possible correct key or string),
    and ``keeps`` (later stages can use the value).
    """
    return PydanticCustomError(code, "{message}", {"message": message, "help": help, **more})


def format_value(value: Any) -> str:
    """Return a value for a message: short, and as it is written in YAML."""
    value = value.value if isinstance(value, Truth) else value
    if isinstance(value, bool) or value is None:
        return {True: "true", False: "false", None: "null"}[value]
    if isinstance(value, (dict, list)):
        return "a mapping" if isinstance(value, dict) else f"a list of {len(value)}"
    text = repr(value.value if isinstance(value, Quantity) else value)
    return text if len(text) < _LONGEST_SHOWN else f"{text[: _LONGEST_SHOWN - 4]}…{text[-1]}"


_LONGEST_SHOWN = 60


class WithUnit(float):
    """A number in SI that has a unit in the file. A number without a unit is a plain float."""

    __slots__ = ("dimension",)
    dimension: Dimension

    def __new__(cls, value: float, dimension: Dimension = NUMBER) -> Self:
        """Return the number. ``dimension`` is that of its unit."""
        number = super().__new__(cls, value)
        number.dimension = dimension
        return number


#: Above this limit, and below its inverse for sizes and masses, products of four numbers would
#: overflow or underflow a float.
LARGEST = 1e30
SMALLEST = 1 / LARGEST


@dataclass(frozen=True, slots=True)
class Measure:
    """Annotates a float that may have a unit in the file."""

    #: The dimension; with ``sliding``, the dimension for joints that rotate.
    dimension: Dimension
    #: The smallest allowed value.
    least: float | None = None
    #: The dimension for joints that slide.
    sliding: Dimension | None = None

    @property
    def dimensions(self) -> tuple[Dimension, ...]:
        """The possible dimensions."""
        return (self.dimension, self.sliding) if self.sliding else (self.dimension,)

    @property
    def unit(self) -> str:
        """The SI unit of a number without a unit, as text; empty for a dimensionless number."""
        return (
            ""
            if self.dimension == NUMBER
            else " or ".join(SI_UNITS[dimension] for dimension in self.dimensions)
        )

    @property
    def example(self) -> str:
        """An example of a value."""
        return example(self.dimension)

    @property
    def about(self) -> str:
        """The meaning of a number without a unit, and examples with units."""
        examples = " or ".join(filter(None, map(_EXAMPLES.get, self.dimensions)))
        return f"in {self.unit}, or with a unit: {examples}" if examples else f"in {self.unit}"

    def read(self, value: Any) -> float:
        """Return the value in SI.

        Raises:
            PydanticCustomError: if it is not a number, is too large or too small, or its unit is
                unknown or of another dimension.
        """
        number = self._in_si(value)
        if self.least is not None and number < self.least:
            what = "is not greater than 0" if number <= 0 else f"is less than {self.least:g}"
            advice = f"for example {example(self.dimensions[0])}"
            raise invalid("TF106", f"{format_value(value)} {what}", advice)
        return number

    def _in_si(self, value: Any) -> float:
        kind = type(value)
        if kind is not float and kind is not int:
            value = self._convert(value)
        if not -LARGEST <= value <= LARGEST:
            raise invalid("TF106", f"{format_value(float(value))} is too large to compute with")
        return value if kind is float else value if isinstance(value, WithUnit) else float(value)

    def _convert(self, value: Any) -> float:
        dimension = self.dimensions[-1]
        if isinstance(value, str):
            try:
                value = quantity(value, dimension)
            except UnitError as error:
                instead = respelt(value, error.unit, dimension) if error.unit else None
                message = f"{error}; expected {with_article(dimension)}"
                raise invalid(
                    "TF104" if error.unit else "TF103", message, error.advice, instead=instead
                ) from None
        if isinstance(value, Quantity):
            if value.dimension not in {NUMBER, *self.dimensions}:
                message = (
                    f"expected {with_article(dimension)}, not {with_article(value.dimension)}"
                )
                raise invalid("TF104", message, f"for example {example(dimension)}")
            if value.dimension == NUMBER:
                return value.value
            return WithUnit(value.value, value.dimension)
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            return value
        message = f"{format_value(value)} is not {with_article(self.dimension)}"
        raise invalid("TF103", message, f"for example {example(self.dimension)}")

    def __get_pydantic_core_schema__(self, _source: Any, _handler: Any) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, _schema: CoreSchema, _handler: Any) -> dict[str, Any]:
        if self.dimension == NUMBER:
            return {"anyOf": [{"type": "number"}, {"type": "string", "pattern": EXPRESSION}]}
        units = "|".join(
            re.escape(name) for name, (_, its) in UNITS.items() if its in self.dimensions
        )
        pattern = rf"{EXPRESSION}|^\s*[-+]?[0-9.]+([eE][-+]?[0-9]+)?\s*({units})?\s*$"
        return {"anyOf": [{"type": "number"}, {"type": "string", "pattern": pattern}]}


#: Pattern of a string with an expression, which is computed before validation.
EXPRESSION = r"\$\{"

#: The SI unit of each dimension that a key can have, as text.
SI_UNITS: dict[Dimension, str] = {
    LENGTH: "metres",
    MASS: "kilograms",
    TIME: "seconds",
    ANGLE: "radians",
    RATE: "hertz",
    SPEED: "m/s",
    ANGULAR_VELOCITY: "rad/s",
    FORCE: "N",
    TORQUE: "N m",
    INERTIA: "kg m²",
    DENSITY: "kg/m³",
    DAMPING: "N s/m",
    ROTATIONAL_DAMPING: "N m s/rad",
}

Number = Annotated[float, Measure(NUMBER)]
Length = Annotated[float, Measure(LENGTH)]
Size = Annotated[float, Measure(LENGTH, SMALLEST)]
Angle = Annotated[float, Measure(ANGLE)]
AngularVelocity = Annotated[float, Measure(ANGULAR_VELOCITY)]
Inertia = Annotated[float, Measure(INERTIA)]
Mass = Annotated[float, Measure(MASS, SMALLEST)]
Density = Annotated[float, Measure(DENSITY, SMALLEST)]
Rate = Annotated[float, Measure(RATE, 1e-3)]
Duration = Annotated[float, Measure(TIME, 1e-3)]
JointPosition = Annotated[float, Measure(ANGLE, sliding=LENGTH)]
JointVelocity = Annotated[float, Measure(ANGULAR_VELOCITY, sliding=SPEED)]
JointEffort = Annotated[float, Measure(TORQUE, sliding=FORCE)]
JointDamping = Annotated[float, Measure(ROTATIONAL_DAMPING, sliding=DAMPING)]
