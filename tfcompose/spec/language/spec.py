"""Base of all models of the language, and functions that walk over the models' fields."""

from __future__ import annotations

import dataclasses
import inspect
import types
from functools import cache
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Literal,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic.fields import FieldInfo
from typing_extensions import TypeAliasType

from tfcompose.foundation.units import Measure, invalid
from tfcompose.spec.language.values import Condition, Loops

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pydantic import ModelWrapValidatorHandler, ValidationInfo
    from pydantic_core import InitErrorDetails, PydanticCustomError
    from typing_extensions import Self

    from tfcompose.spec.load import Path

Pattern = tuple[str, ...]
"""Where something is in the language: keys, and ``*`` for any name.

Items of a list stand where the list does.
"""


class Spec(BaseModel):
    """A mapping with known keys. Other keys are rejected. Objects are immutable."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, defer_build=True, protected_namespaces=()
    )

    #: The help for a file of this model that holds no mapping.
    BEGIN: ClassVar[str] = "a robot begins with: tfcompose: 1"


#: Context of the first validation of the data. Later validations get the remaining data, which no
#: longer show the user's intention.
FIRST = "the data are as they were written"


class Checked(Spec):
    """A mapping with checks across its keys."""

    #: Groups of keys of which at most one may be set. If an overlay sets one, the others are
    #: dropped.
    EXCLUSIVE: ClassVar[tuple[frozenset[str], ...]] = ()

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[Path, PydanticCustomError]]:
        """Yield faults of the combination of keys, with paths below the mapping."""
        for keys in cls.EXCLUSIVE:
            if len(keys & data.keys()) > 1:
                first, *surplus = present = [name for name in data if name in keys]
                for name in surplus:
                    advice = f"keep one of {', '.join(present)}"
                    message = f"{name} and {first} exclude each other"
                    yield (
                        (name,),
                        invalid(
                            "TF107", message, advice, on_key=True, conflicts_with=first, keeps=True
                        ),
                    )

    @model_validator(mode="wrap")
    @classmethod
    def _check_first(
        cls, value: Any, handler: ModelWrapValidatorHandler[Self], info: ValidationInfo
    ) -> Self:
        if info.context is not FIRST or not isinstance(value, dict):
            return handler(value)
        errors = list(cls.check(value))
        try:
            done = handler(value)
        except ValidationError as error:
            raise several(*errors, also=error) from None
        if errors:
            raise several(*errors)
        return done


class Entry(Checked):
    """An entry of a section, which may be conditional or repeated.

    ``conditions`` evaluates ``when`` and ``for`` before this model is validated.
    """

    when: Condition | None = Field(
        None,
        description="the entry exists only if this is true: true, false or a condition",
        examples=["${args.sim}", "${args.n > 1}"],
    )
    for_: Loops | None = Field(
        None,
        alias="for",
        description=(
            "repeats the entry for each value; its name contains the variable: camera_${i}"
        ),
        examples=[{"i": "${range(args.cameras)}"}, {"side": ["left", "right"]}],
    )


def several(
    *errors: tuple[Path, PydanticCustomError], also: ValidationError | None = None
) -> ValidationError:
    """Return a validation error for paths below a value, combined with another one."""
    lines: list[InitErrorDetails] = [
        {"type": error, "loc": path, "input": None} for path, error in errors
    ]
    for problem in also.errors(include_url=False) if also else ():
        kind, context = problem["type"], problem.get("ctx", {})
        error = invalid(kind, **context) if kind.startswith("TF") else kind
        lines.append(
            {"type": error, "loc": problem["loc"], "input": problem["input"], "ctx": context}
        )
    return ValidationError.from_exception_data("", lines)


def key(default: Any = ..., about: str = "", *examples: Any, **more: Any) -> Any:
    """Describe a key of a ``Spec``. Without a default, the key is required.

    ``more`` holds further properties, which ``more_of`` returns.
    """
    return Field(
        default,
        description=about or None,
        examples=list(examples) or None,
        json_schema_extra=more or None,
    )


def more_of(field: FieldInfo, name: str, default: Any) -> Any:
    """Return a further property of a key by its name, or the default."""
    more = field.json_schema_extra
    return more.get(name, default) if isinstance(more, dict) else default


def inherit_field(of: type, name: str) -> Any:
    """Return a dataclass's field, for a subclass that narrows the field's type.

    Default and description stay the same.
    """
    base = next(field for field in dataclasses.fields(of) if field.name == name)
    return dataclasses.field(
        default=base.default, default_factory=base.default_factory, metadata=base.metadata
    )


def unwrap_named_type(annotation: Any) -> Any:
    """Return the type that a named type stands for.

    pydantic makes the schema of a named type only once for all models.
    """
    return annotation.__value__ if isinstance(annotation, TypeAliasType) else annotation


def kinds_of(annotation: Any) -> Iterator[Any]:
    """Yield the types that an annotation allows, without None, ``Annotated`` and unions."""
    annotation = unwrap_named_type(annotation)
    origin = get_origin(annotation)
    if origin is Annotated:
        yield from kinds_of(get_args(annotation)[0])
    elif origin in {Union, types.UnionType}:
        for base in get_args(annotation):
            yield from kinds_of(base)
    elif annotation is not type(None):
        yield annotation


def is_mapping(kind: Any) -> bool:
    """Return whether the type is a mapping with known keys.

    This is a ``Spec``, or a dataclass used like one.
    """
    return isinstance(kind, type) and (issubclass(kind, Spec) or dataclasses.is_dataclass(kind))


@cache
def fields_of(kind: Any) -> Mapping[str, FieldInfo]:
    """Return the keys of a mapping with known keys: its own, then inherited keys."""
    if issubclass(kind, Spec):
        spec: type[Spec] = kind
        fields = spec.model_fields
    else:
        hints = get_type_hints(kind, include_extras=True)
        fields = {
            field.name: FieldInfo.from_annotated_attribute(hints[field.name], field)
            for field in dataclasses.fields(kind)
        }
    names = dict.fromkeys(name for base in kind.__mro__ for name in inspect.get_annotations(base))
    return {fields[name].alias or name: fields[name] for name in names if name in fields}


def below(annotation: Any, step: str | int) -> Any:
    """Return the annotation at a key or an index below an annotation, or None."""
    for kind in kinds_of(annotation):
        if is_mapping(kind):
            if step in fields_of(kind):
                return fields_of(kind)[str(step)].rebuild_annotation()
        elif get_origin(kind) is dict:
            return get_args(kind)[1]
        elif get_origin(kind) is tuple:  # a single item may replace a list
            item = get_args(kind)[0]
            value = item if isinstance(step, int) else below(item, step)
            if value is not None:
                return value
    return None


def measure_of(annotation: Any) -> Measure | None:
    """Return the measure of the numbers that an annotation allows, or None."""
    annotation = unwrap_named_type(annotation)
    if get_origin(annotation) is Annotated:
        inner, *more = get_args(annotation)
        return next(
            (annotation for annotation in more if isinstance(annotation, Measure)), None
        ) or measure_of(inner)
    if get_origin(annotation) in {Union, types.UnionType, tuple}:
        return next(
            (measure for base in get_args(annotation) if (measure := measure_of(base))), None
        )
    return None


def value_at(model: Any, path: tuple[str | int, ...]) -> Any:
    """Return the annotation of the value at a path in a file of the model, or None."""
    for step in path:
        model = below(model, step)
    return model


def mappings_at(model: Any, path: tuple[str | int, ...]) -> list[Any]:
    """Return the mappings with known keys that are possible at a path, or in a list there."""
    kinds = list(kinds_of(value_at(model, path)))
    kinds += [
        item for kind in kinds if get_origin(kind) is tuple for item in kinds_of(get_args(kind)[0])
    ]
    return [kind for kind in kinds if is_mapping(kind)]


def mapping_at(model: Any, path: tuple[str | int, ...]) -> Any:
    """Return the first mapping with known keys that is possible at a path, or None."""
    return next(iter(mappings_at(model, path)), None)


def walk(annotation: Any, pattern: Pattern = ()) -> Iterator[tuple[Pattern, Any]]:
    """Yield every mapping with known keys below an annotation, with its place.

    If the annotation is such a mapping, it comes first.
    """
    for kind in kinds_of(annotation):
        if is_mapping(kind):
            yield pattern, kind
            for name, field in fields_of(kind).items():
                yield from walk(field.annotation, (*pattern, name))
        elif get_origin(kind) is dict:
            yield from walk(get_args(kind)[1], (*pattern, "*"))
        elif get_origin(kind) is tuple:
            yield from walk(get_args(kind)[0], pattern)


def describe_key(field: FieldInfo) -> str:
    """Return the description of a key, with its unit."""
    measure = measure_of(field.rebuild_annotation())
    unit = f" ({measure.about})" if measure and measure.unit else ""
    return f"{field.description}{unit}"


def examples_of(field: FieldInfo) -> list[Any]:
    """Return the examples of a key, otherwise those of its type."""
    if field.examples:
        return list(field.examples)
    annotation = field.rebuild_annotation()
    measure = measure_of(annotation)
    if measure:
        return [measure.example]
    texts = [
        text
        for kind in kinds_of(annotation)
        if get_origin(kind) is Literal
        for text in get_args(kind)
    ]
    return texts or [True for kind in kinds_of(annotation) if kind is bool]
