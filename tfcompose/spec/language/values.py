"""Simple values of the language: strings, lists, rows of numbers, and short forms of mappings."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import date
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, Strict
from pydantic_core import core_schema
from typing_extensions import TypeAliasType

from tfcompose.foundation.findings import did_you_mean
from tfcompose.foundation.geometry import Vector, norm
from tfcompose.foundation.units import (
    EXPRESSION,
    NUMBER,
    SMALLEST,
    Length,
    Number,
    Quantity,
    Size,
    Truth,
    format_value,
    invalid,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from pydantic_core import CoreSchema


@dataclass(frozen=True, slots=True)
class Matches:
    """Annotates a string that must match a pattern completely."""

    pattern: str
    #: A description of the pattern.
    means: str

    def check(self, value: str) -> str:
        """Return the string.

        Raises:
            PydanticCustomError: if it does not match.
        """
        if re.fullmatch(self.pattern, value):
            return value
        raise invalid("TF106", f"{format_value(value)} is not {self.means}")

    def __get_pydantic_core_schema__(
        self, source: Any, handler: Callable[[Any], CoreSchema]
    ) -> CoreSchema:
        return core_schema.no_info_after_validator_function(self.check, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: Any) -> dict[str, Any]:
        return {**handler(schema), "pattern": f"^{self.pattern}$"}


@dataclass(frozen=True, slots=True)
class Computable:
    """Annotates a value that may be the result of an expression."""

    #: Converts an expression's result to the value.
    plain: Callable[[Any], Any]

    def __get_pydantic_core_schema__(
        self, source: Any, handler: Callable[[Any], CoreSchema]
    ) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.plain, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: Any) -> dict[str, Any]:
        return {"anyOf": [handler(schema), COMPUTED]}


#: The JSON Schema of a value that is a single expression.
COMPUTED = {"type": "string", "pattern": f"^{EXPRESSION}"}


_AXES = ("x", "y", "z")
_ANGLES = ("roll", "pitch", "yaw")
_ITEM = re.compile(
    r"[^\s,]*\d[^\s,]*(?:\s+[^\s\d,.+-]+)?"
)  # a number with an optional unit, which a space may precede
_OF_A_POSE = 6


@dataclass(frozen=True, slots=True)
class InARow:
    """Annotates a tuple that is written as a list."""

    #: The number of items.
    count: int
    #: An example.
    sample: str

    def check(self, value: Any) -> Any:
        """Return the list.

        Raises:
            PydanticCustomError: if the value is not a list of this length.
        """
        if isinstance(value, list) and len(value) == self.count:
            return value
        raise invalid(
            "TF103",
            f"expected a list of {self.count}, got {format_value(value)}",
            self._advice(value),
        )

    def _advice(self, value: Any) -> str:
        """Return what to write instead.

        The advice interprets a string, a mapping, or numbers with decimal commas.
        """
        if isinstance(value, dict) and value.keys() == {"size"}:  # as in URDF's box
            inner = value["size"]
            is_complete = isinstance(inner, list) and len(inner) == self.count
            return f"write [{', '.join(map(str, inner))}]" if is_complete else self._advice(inner)
        text = value[0] if isinstance(value, list) and len(value) == 1 else value
        items = _ITEM.findall(text) if isinstance(text, str) else None
        for names in (_AXES, _ANGLES):
            if (
                value
                and isinstance(value, dict)
                and self.count == len(names)
                and value.keys() <= set(names)
            ):
                items = [str(value.get(name, 0)) for name in names]
        if items and len(items) == self.count:
            return f"write [{', '.join(items)}]"
        if isinstance(value, list) and self.count < len(value) <= 2 * self.count:
            if len(value) == _OF_A_POSE and any(isinstance(number, float) for number in value):
                first, last = (", ".join(map(str, part)) for part in (value[:3], value[3:]))
                return f"position and rotation are two keys: xyz: [{first}] and rpy: [{last}]"
            return f"decimals take a point: {self.sample}"
        return f"for example {self.sample}"

    def __get_pydantic_core_schema__(
        self, source: Any, handler: Callable[[Any], CoreSchema]
    ) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.check, handler(source))


def short(name: str, of: Any) -> BeforeValidator:
    """Return a validator that lets a string replace a mapping with only the key ``name``.

    ``of`` is the type of the mapping.
    """
    return BeforeValidator(
        lambda value: {name: value} if isinstance(value, str) else value, str | of
    )


def as_list(value: Any) -> Any:
    """Return a list. A single item becomes a list of length 1."""
    return value if isinstance(value, list) else [value]


def plain(value: Any) -> Any:
    """Return data to pass on. A computed quantity becomes its number."""
    if isinstance(value, (Quantity, Truth)):
        return value.value
    if isinstance(value, dict):
        return {name: plain(item) for name, item in value.items()}
    return [plain(item) for item in value] if isinstance(value, list) else value


def _integral(value: Any) -> Any:
    is_integral = (
        isinstance(value, Quantity)
        and value.dimension == NUMBER
        and value.value == int(value.value)
    )
    return int(value.value) if is_integral else value


def _truth(value: Any) -> Any:
    return value.value if isinstance(value, Truth) else value


def _is_true(value: Any) -> bool:
    if _truth(value) is True:
        return True
    is_meant = isinstance(value, str) and value.lower() in {"yes", "on"}
    raise invalid(
        "TF106",
        f"expected true, got {format_value(value)}",
        "write true" if is_meant else "write true, or remove the key",
    )


def _names_a_variable(name: str) -> str:
    if not name or "=" in name:
        raise invalid("TF106", f"{name!r} cannot name a variable")
    return name


def _with_opacity(value: Any) -> Any:
    """Return four components of a colour, from its name or from three or four components."""
    if isinstance(value, str):
        if value not in COLOURS:
            advice = did_you_mean(
                value, COLOURS, f"[0.2, 0.4, 0.8], or one of: {', '.join(COLOURS)}"
            )
            raise invalid("TF106", f"{format_value(value)} is not a colour", advice)
        return [*COLOURS[value], 1.0]
    return [*value, 1.0] if isinstance(value, list) and len(value) == len(_AXES) else value


def _colour_part(value: float) -> float:
    if 0 <= value <= 1:
        return value
    raise invalid(
        "TF106",
        f"{format_value(value)} is not a colour component: 0 to 1",
        "divide values up to 255 by 255",
    )


def _has_direction(axis: Vector) -> Vector:
    length = norm(axis)
    if length > SMALLEST:
        return axis
    raise invalid(
        "TF106", f"an axis of length {length:g} has no direction", "for example [0, 0, 1]"
    )


def _is_visible(factors: Vector) -> Vector:
    if all(abs(factor) > SMALLEST for factor in factors):
        return factors
    raise invalid("TF106", "a scale of 0 leaves nothing of the mesh", "for example 0.001")


def _day(value: Any) -> date:
    try:
        return value if isinstance(value, date) else date.fromisoformat(value)
    except (ValueError, TypeError):
        advice = "write it as YEAR-MONTH-DAY: 2026-03-01"
        raise invalid("TF103", f"{format_value(value)} is not a day", advice) from None


#: Named colours as red, green and blue: the names of HTML 4, and three that are common in robots.
COLOURS = {
    "black": (0.0, 0.0, 0.0),
    "silver": (0.75, 0.75, 0.75),
    "grey": (0.5, 0.5, 0.5),
    "gray": (0.5, 0.5, 0.5),
    "white": (1.0, 1.0, 1.0),
    "maroon": (0.5, 0.0, 0.0),
    "red": (1.0, 0.0, 0.0),
    "purple": (0.5, 0.0, 0.5),
    "magenta": (1.0, 0.0, 1.0),
    "green": (0.0, 0.5, 0.0),
    "lime": (0.0, 1.0, 0.0),
    "olive": (0.5, 0.5, 0.0),
    "yellow": (1.0, 1.0, 0.0),
    "navy": (0.0, 0.0, 0.5),
    "blue": (0.0, 0.0, 1.0),
    "teal": (0.0, 0.5, 0.5),
    "cyan": (0.0, 1.0, 1.0),
    "orange": (1.0, 0.65, 0.0),
    "brown": (0.65, 0.16, 0.16),
}

Anything = Annotated[Any, BeforeValidator(plain)]
NoMapping = Annotated[Anything, Field(json_schema_extra={"not": {"type": "object"}})]
Parameters = dict[str, Anything]
#: A condition. It is evaluated before the entry's other keys are read.
Condition = Annotated[Any, BeforeValidator(lambda value: value, bool | str)]
Loops = Annotated[
    Any, BeforeValidator(lambda value: value, dict[str, str | tuple[str | float | bool, ...]])
]
Text = Annotated[str, Strict()]
#: A boolean, which may be computed.
Boolean = Annotated[bool, Strict(), Computable(_truth)]
OnlyTrue = Annotated[bool, BeforeValidator(_is_true), Field(json_schema_extra={"const": True})]
#: Annotates an integer, which may be computed.
Integral = Computable(_integral)
Name = Annotated[
    Text, Matches(r"[A-Za-z][A-Za-z0-9_]*", "a name: a letter, then letters, digits and _")
]
Namespace = Annotated[
    Text,
    Matches(
        r"(/|/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*)?",
        "a namespace such as robot1 or fleet/robot1",
    ),
]
NodeName = Annotated[
    Text,
    Matches(
        r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*",
        "a node's name: letters, digits and _",
    ),
]
TopicName = Annotated[
    Text,
    Matches(
        r"~?/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*",
        "the name of a topic or a service: letters, digits, _ and /",
    ),
]
#: A name on either side of := in a remapping; it may be computed.
RosName = Annotated[
    Text,
    Matches(
        r"(\$\{[^}]*\}|[^\s:]|:(?!=))+",
        "a name that can be remapped: without spaces, and without :=",
    ),
]
#: The name of an environment variable.
VariableName = Annotated[Text, AfterValidator(_names_a_variable)]
Texts = tuple[Text, ...]
Day = Annotated[date, Strict(), BeforeValidator(_day)]
#: A list of strings, or a single string instead of a list.
OneOrMore = TypeAliasType("OneOrMore", Annotated[Texts, BeforeValidator(as_list, Text | Texts)])
Xyz = TypeAliasType("Xyz", Annotated[tuple[Length, Length, Length], InARow(3, "[0.2, 0, 30 cm]")])
Sizes = Annotated[tuple[Size, Size, Size], InARow(3, "[0.5, 0.4, 0.15]")]
Numbers = Annotated[tuple[Number, Number, Number], InARow(3, "[0, 0, 1]")]
Axis = Annotated[Numbers, AfterValidator(_has_direction)]
_Factors = Annotated[tuple[Number, Number, Number], InARow(3, "[0.001, 0.001, 0.001]")]
#: Three factors, or a single factor for all axes. A negative factor mirrors.
Scale = Annotated[
    _Factors,
    AfterValidator(_is_visible),
    BeforeValidator(
        lambda value: value if isinstance(value, list) else [value] * 3, Number | _Factors
    ),
]
_ColourPart = Annotated[Number, AfterValidator(_colour_part)]
_Rgba = Annotated[
    tuple[_ColourPart, _ColourPart, _ColourPart, _ColourPart], InARow(4, "[0.2, 0.4, 0.8, 1]")
]
#: Red, green, blue and opacity. A colour without opacity, or a named colour, is opaque.
Colour = TypeAliasType(
    "Colour",
    Annotated[
        _Rgba,
        BeforeValidator(
            _with_opacity,
            Literal[tuple(COLOURS)] | tuple[_ColourPart, _ColourPart, _ColourPart] | _Rgba,
        ),
    ],
)
