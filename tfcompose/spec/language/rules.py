"""Rules in the language: severities, limits, and zones that sensors must cover."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Tag

from tfcompose.foundation.units import (
    NUMBER,
    Number,
    Quantity,
    UnitError,
    format_value,
    invalid,
    quantity,
)
from tfcompose.spec.language.spec import Spec, key
from tfcompose.spec.language.values import OneOrMore, Sizes, Text, Xyz

Level = Literal["off", "warning", "error"]


def _percent(value: Any) -> Any:
    """Return the fraction for a percentage: 0.3 for ``30 %``."""
    if isinstance(value, str) and value.rstrip().endswith("%"):
        number = value.rstrip().removesuffix("%")
        try:
            return Quantity(quantity(number).value / 100, NUMBER)
        except UnitError as error:
            raise invalid(
                "TF103", f"{format_value(value)} is not a percentage", error.advice
            ) from None
    return value


def _limit(value: Any) -> Quantity:
    """Return a limit of any kind."""
    value = _percent(value)
    if isinstance(value, str):
        try:
            value = quantity(value)
        except UnitError as error:
            raise invalid("TF104" if error.unit else "TF103", str(error), error.advice) from None
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        value = Quantity(float(value))
    if not isinstance(value, Quantity):
        raise invalid(
            "TF103", f"{format_value(value)} is not a limit", "for example 30 %, 45 deg or 5 cm"
        )
    if value.value < 0:
        raise invalid("TF106", "a limit is not less than 0")
    return value


def _part(value: Any) -> Any:
    value = _percent(value)
    number = value.value if isinstance(value, Quantity) else value
    if isinstance(number, (int, float)) and not 0 <= number <= 1:
        raise invalid(
            "TF106", f"{format_value(value)} is not a part of the zone", "for example 90 %, or 0.9"
        )
    return value


class RuleSpec(Spec):
    """Severity and limit of the findings of a code."""

    severity: Level | None = key(None, "the severity; default: that of the code")
    limit: Annotated[Any, BeforeValidator(_limit, str | float)] = key(
        None,
        "the threshold of a finding: a percentage, an angle or a length, depending on the code",
        "30 %",
        "45 deg",
    )


#: A severity, or a mapping.
RuleSetting = Annotated[
    Annotated[RuleSpec, Tag("[rule]")] | Annotated[Level, Tag("[level]")],
    Discriminator(lambda value: "[rule]" if isinstance(value, (dict, RuleSpec)) else "[level]"),
]


def level_of(setting: RuleSpec | str) -> str:
    """Return the severity that is set, empty for the code's own severity."""
    return setting if isinstance(setting, str) else setting.severity or ""


class ZoneSpec(Spec):
    """A box that sensors must see."""

    frame: Text = key(..., "the frame that it is in", "base_link")
    center: Xyz = key((0.0, 0.0, 0.0), "its centre", [1, 0, 0.2])
    box: Sizes = key(..., "its lengths along x, y and z of the frame", [1, 1, 0.4])
    by: OneOrMore = key(
        (),
        "kinds of streams, or sensors, at least one of which must see each point; default: all",
        ["lidar", "camera"],
    )
    least: Annotated[Number, BeforeValidator(_part, str | float)] = key(
        1.0, "the share of the box that must be seen", "90 %"
    )
