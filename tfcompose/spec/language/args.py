"""``args``.

Build-time values from the command line, the environment or the including robot file.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import date
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator
from pydantic_core import PydanticCustomError

from tfcompose.foundation.findings import Span, did_you_mean
from tfcompose.foundation.units import (
    NUMBER,
    Quantity,
    Truth,
    UnitError,
    format_value,
    invalid,
    quantity,
    with_article,
)
from tfcompose.model.plan import LogLevel
from tfcompose.spec.language.expressions import IDENTIFIER, Value, insertable_text
from tfcompose.spec.language.spec import Checked, key
from tfcompose.spec.language.values import Text, VariableName, plain
from tfcompose.spec.load import Path
from tfcompose.spec.load.scalars import plain as scalar

ArgType = Literal["bool", "int", "float", "string"]
#: Noun for a value of each type.
_CALLED: dict[ArgType, str] = {
    "bool": "true or false",
    "int": "a whole number",
    "float": "a number",
    "string": "a string",
}


@dataclass(frozen=True, slots=True)
class ArgValue:
    """The value of an argument."""

    #: The value, which is a string if it comes from the command line or the environment.
    value: Any
    #: The place where the value is set.
    span: Span


@dataclass(frozen=True, slots=True)
class RosArguments:
    """ROS arguments for the entire robot, from ``--ros-args`` or an enclosing launch file.

    They apply to nodes and topics, never to frames.
    """

    #: The namespace above the robot's own, without surrounding slashes; empty for none.
    namespace: str = ""
    #: Remappings, as with ``-r FROM:=TO``. They precede the remappings of each process.
    remap: Mapping[str, str] = field(default_factory=dict)
    #: Whether nodes follow /clock, None for the setting in the robot file.
    use_sim_time: bool | None = None
    #: The log level of nodes whose process sets none, None for ROS's default.
    level: LogLevel | None = None


@dataclass(frozen=True, slots=True)
class BuildInputs:
    """The inputs of a build: values of arguments by name, environment, ROS arguments, and day."""

    args: Mapping[str, ArgValue] = field(default_factory=dict)
    environment: Mapping[str, str] = field(default_factory=dict)
    ros: RosArguments = field(default_factory=RosArguments)
    #: The day, in UTC, whose calibrations apply; None for calibrations without an end.
    day: date | None = None


class ArgError(ValueError):
    """A value is invalid for its argument.

    ``code`` is the code of the finding, and ``advice`` its help.
    """

    def __init__(self, code: str, message: str, advice: str = "") -> None:
        super().__init__(message)
        self.code = code
        self.advice = advice


def _scalar(value: Any) -> Any:
    value = plain(value)
    if isinstance(value, (dict, list)):
        raise invalid("TF103", f"{format_value(value)} is not a string, number, true or false")
    return value


Scalar = Annotated[Any, BeforeValidator(_scalar, str | float | bool)]


class ArgSpec(Checked):
    """A build-time argument: NAME:=VALUE.

    Without a default it is required.
    """

    type: ArgType | None = key(
        None, "default: the type of default or of the first choice; otherwise string", "int"
    )
    default: Scalar | None = key(None, "the value if none is set", 2, "30 cm", False)
    choices: tuple[Scalar, ...] = key((), "the allowed values", ["velodyne", "ouster"])
    min: Scalar | None = key(None, "the smallest allowed value", 0)
    max: Scalar | None = key(None, "the largest allowed value", 8)
    description: Text | None = key(
        None, "its purpose; --show-args prints it", "how many cameras there are"
    )
    env: VariableName | None = key(
        None, "the environment variable that sets it if the command line does not", "CAMERAS"
    )

    @property
    def kind(self) -> ArgType:
        """The type.

        As declared, otherwise the type of the default, of the first choice or of the bounds.
        """
        if self.type is not None:
            return self.type
        values = [
            value
            for value in (self.default, *self.choices, self.min, self.max)
            if value is not None
        ]
        kinds = [_kind(value) for value in values]
        return (
            "float"
            if "float" in kinds[:1] or (kinds[:1] == ["int"] and "float" in kinds)
            else (*kinds, "string")[0]
        )

    @property
    def alternatives(self) -> tuple[str, ...]:
        """The values to check, in the form of the command line.

        These are all choices, or the bounds and the default of an integer. Empty for an argument
        with neither choices nor bounds.
        """
        if self.choices:
            return tuple(as_given(choice) for choice in self.choices)
        if self.kind == "int" and (self.min is not None or self.max is not None):
            try:
                texts = {
                    insertable_text(self.convert(value)): None
                    for value in (self.min, self.default, self.max)
                    if value is not None
                }
            except ArgError:
                return ()  # it is refused for that
            return tuple(texts)
        return ("false", "true") if self.kind == "bool" else ()

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[Path, PydanticCustomError]]:
        """Yield choices, bounds and defaults of a different type, and impossible defaults."""
        yield from super().check(data)
        try:
            spec = cls.model_validate(
                {name: data[name] for name in data if name in cls.model_fields}
            )
        except ValueError:
            return  # it is refused for that
        for name in ("min", "max"):
            if name in data and spec.kind not in {"int", "float"}:
                message = f"{name} is for numbers, and the argument is {_CALLED[spec.kind]}"
                yield (name,), invalid("TF107", message, on_key=True)
                return
        for path, value in (
            (("min",), spec.min),
            (("max",), spec.max),
            *_with_index(spec.choices),
        ):
            try:
                if value is not None:
                    spec.convert(value)
            except ArgError as error:
                yield path, invalid(error.code, str(error), error.advice)
                return
        try:
            if spec.default is not None:
                spec.value(spec.default)
        except ArgError as error:
            yield ("default",), invalid(error.code, str(error), error.advice)

    def value(self, raw: Any) -> Value:
        """Return the value for expressions, from a raw value or the default.

        Raises:
            ArgError: if the value is invalid for the argument.
        """
        value = self.convert(raw)
        if self.choices:
            choices = [self.convert(choice) for choice in self.choices]
            if value not in choices:
                texts = [as_given(choice) for choice in self.choices]
                raise ArgError(
                    "TF106",
                    f"{format_value(raw)} is not one of the choices",
                    _one_of(insertable_text(value), texts),
                )
        for bound, sign, what in ((self.min, 1, "less"), (self.max, -1, "greater")):
            limit = self.convert(bound) if bound is not None else None
            if (
                isinstance(limit, Quantity)
                and isinstance(value, Quantity)
                and sign * (value.value - limit.value) < 0
            ):
                raise ArgError(
                    "TF106", f"{format_value(raw)} is {what} than {bound}", self._range()
                )
        return value

    def _range(self) -> str:
        bounds = [
            f"at least {self.min}" if self.min is not None else "",
            f"at most {self.max}" if self.max is not None else "",
        ]
        return ", ".join(filter(None, bounds))

    def convert(self, raw: Any) -> Value:
        """Return the value converted to the argument's type.

        Raises:
            ArgError: if it has a different type.
        """
        kind = self.kind
        raw = plain(raw)
        read = _read(raw) if isinstance(raw, str) and kind != "string" else raw
        if kind == "string" and isinstance(raw, str):
            return raw
        if kind == "bool" and isinstance(read, bool):
            return read
        number = read if isinstance(read, Quantity) else None
        if isinstance(read, (int, float)) and not isinstance(read, bool):
            number = Quantity(read)
        if (
            number
            and kind == "int"
            and number.dimension == NUMBER
            and number.value == int(number.value)
        ):
            return Quantity(int(number.value))
        if number and kind == "float":
            self._refuse_dimension(number, raw)
            return (
                Quantity(float(number.value)) if number.dimension == NUMBER else number
            )  # a node's double
        advice = {"bool": "true or false", "string": "put it in quotes"}.get(kind, "")
        raise ArgError("TF103", f"{format_value(raw)} is not {_CALLED[kind]}", advice)

    def _refuse_dimension(self, number: Quantity, raw: Any) -> None:
        values = (self.default, *self.choices, self.min, self.max)
        dimensions = [
            quantity.dimension
            for known_value in values
            if isinstance(known_value, str)
            and isinstance(quantity := _read(known_value), Quantity)
        ]
        expected = next(
            (dimension for dimension in dimensions if dimension != NUMBER), number.dimension
        )
        if number.dimension not in {NUMBER, expected}:
            raise ArgError(
                "TF104",
                f"{format_value(raw)} is {with_article(number.dimension)},"
                f" not {with_article(expected)}",
            )


def _with_index(values: tuple[Any, ...]) -> Iterator[tuple[Path, Any]]:
    for index, value in enumerate(values):
        yield ("choices", index), value


def _one_of(text: str, choices: list[str]) -> str:
    listed = f"one of: {', '.join(choices)}"
    near = did_you_mean(text, choices)
    return f"{near} {listed}" if near else listed


def _kind(value: Any) -> ArgType:
    if isinstance(value, bool):
        return "bool"
    if isinstance(value, (int, float)):
        return "int" if isinstance(value, int) else "float"
    read = _read(value)
    return "float" if isinstance(read, Quantity) and read.dimension != NUMBER else "string"


def _read(text: str) -> Any:
    """Return the value of a text: a number, a quantity, True or False, otherwise the text."""
    try:
        value = scalar(text.strip())
        return value if isinstance(value, (bool, int, float)) else quantity(text)
    except (UnitError, OverflowError):
        return text


def as_given(value: Any) -> str:
    """Return a value in the form of the command line."""
    return format_value(value) if isinstance(value, bool) else str(value)


def _is_name(name: str) -> str:
    if not IDENTIFIER.fullmatch(name):
        raise invalid(
            "TF106",
            f"{name!r} cannot name an argument",
            "a letter or _, then letters, digits and _: for example cameras",
        )
    return name


def full(value: Any) -> Any:
    """Return an argument's declaration as a mapping. A plain value is the default."""
    return (
        value
        if isinstance(value, dict)
        else {"default": value.value if isinstance(value, Truth) else value}
    )


Args = dict[
    Annotated[Text, AfterValidator(_is_name)],
    Annotated[ArgSpec, BeforeValidator(full, str | float | bool | ArgSpec)],
]
