"""Dataclasses as JSON, by the types of their fields.

The plan, messages between processes, and state on disk.

What a type is in JSON:

- ``str``, ``int``, ``bool``, ``None`` and ``Any`` are themselves; a bool is no number. A ``float``
  is a finite number, for which a whole one may stand. A union of these is one of them, a
  ``Literal`` one of its words.
- ``tuple[X, ...]`` and ``tuple[X, Y]`` are lists, ``dict[str, X]`` is a mapping.
- A dataclass or named tuple is a mapping of its fields, in their order. Keys that no field has are
  ignored, so that a later version may write more. Every field must be there, unless it is
  ``OMITTED``.
- ``Annotated[X, Rule(…)]`` is an X that the rule holds for.
"""

from __future__ import annotations

import json
import math
import types
from dataclasses import MISSING, dataclass, field, is_dataclass
from dataclasses import fields as fields_of_dataclass
from functools import cache
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Generic,
    Literal,
    NoReturn,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

T = TypeVar("T")

#: Metadata of a field that is left out at its default, for one that not every writer has; it is
#: never null.
OMITTED: Mapping[str, bool] = types.MappingProxyType({"omitted": True})
#: Metadata of a field that holds a dataclass or named tuple, whose fields stand beside those of
#: the whole.
FLAT: Mapping[str, bool] = types.MappingProxyType({"flat": True})


def documented(default: Any, about: str, *examples: Any, **metadata: Any) -> Any:
    """Return a field of a dataclass that users write as well.

    What an editor and the reference say of the key.
    """
    more = {"examples": list(examples)} if examples else {}
    return field(default=default, metadata={**metadata, "description": about, **more})


def narrowed(kind: type[T], value: T, **changes: Any) -> T:
    """Return a ``kind`` with the fields of ``value``, of one of its subclasses, changed."""
    of: Any = kind
    same = {one.name: getattr(value, one.name) for one in fields_of_dataclass(of) if one.init}
    return kind(**same | changes)


_NONE = type(None)
_PLAIN: dict[Any, str] = {
    str: "a string",
    int: "a whole number",
    float: "a finite number",
    bool: "true or false",
}
#: So much of a value is shown in an error, in characters.
_LONGEST_SHOWN = 60


@dataclass(frozen=True, slots=True, eq=False)
class Rule:
    """What holds for a value beyond its type.

    ``check`` raises a ValueError whose sentence goes on after the path.

    ``schema`` holds keywords of JSON Schema that say the same, as far as it can.
    """

    check: Callable[[Any], object]
    schema: dict[str, Any] = field(default_factory=dict)


class DecodeError(ValueError):
    """Data that are not of the type that is expected.

    One sentence, which begins with the path to them.
    """

    def __init__(self, what: str) -> None:
        super().__init__(what)
        self.what = what
        self.path: list[str | int] = []

    def __str__(self) -> str:
        path = "".join(map(_step, reversed(self.path))).removeprefix(".")
        return f"{path} {self.what}" if path else self.what


@dataclass(frozen=True, slots=True)
class Field:
    """A field as it is written. ``kind`` is its type.

    ``default`` is MISSING where it must be there.
    """

    name: str
    kind: Any
    default: Any
    omitted: bool = False
    flat: bool = False
    description: str = ""


@cache
def fields_of(cls: type) -> tuple[Field, ...]:
    """Return the fields of a dataclass or named tuple, in their order."""
    hints = get_type_hints(cls, include_extras=True)
    if not is_dataclass(cls):
        return tuple(Field(name, hints[name], MISSING) for name in cls._fields)  # type: ignore[attr-defined]
    found = []
    for one in fields_of_dataclass(cls):
        default = one.default if one.default_factory is MISSING else one.default_factory()
        omitted = "omitted" in one.metadata
        kind = _without_none(hints[one.name]) if omitted and default is None else hints[one.name]
        default = default if omitted else MISSING
        about = one.metadata.get("description", "")
        found.append(
            Field(
                one.name,
                kind,
                default,
                omitted=omitted,
                flat="flat" in one.metadata,
                description=about,
            )
        )
    return tuple(found)


def _without_none(kind: Any) -> Any:
    return Union[tuple(one for one in get_args(kind) if one is not _NONE)]  # noqa: UP007 (made, not written)


def is_record(kind: Any) -> bool:
    """Return whether the type is a dataclass or a named tuple."""
    return isinstance(kind, type) and (is_dataclass(kind) or hasattr(kind, "_fields"))


def decode(kind: type[T], data: Any) -> T:
    """Return the data, as the json module reads them, as a value of the type.

    Raises:
        DecodeError: if they are none.
    """
    of: Any = kind
    value: T = _decoder(of)(data)
    return value


def encode(value: Any) -> Any:
    """Return a dataclass or named tuple as data that the json module writes."""
    of: Any = type(value)
    return _encoder(of)(value)


class TaggedUnion(Generic[T]):
    """Classes of messages: ``key`` says which one an object is.

    It holds a class's name, unless the class has a field of that name: then it is one of that
    ``Literal``'s words.
    """

    def __init__(self, key: str, kinds: Iterable[type[T]]) -> None:
        self._key = key
        self._kinds: dict[str, type[T]] = {}
        for kind in kinds:
            of: Any = kind
            words = (
                get_args(get_type_hints(kind)[key])
                if key in of.__dataclass_fields__
                else (kind.__name__,)
            )
            self._kinds |= dict.fromkeys(words, kind)

    def encode(self, message: T) -> dict[str, Any]:
        """Return the message as data, with its tag first."""
        data: dict[str, Any] = encode(message)
        return data if self._key in data else {self._key: type(message).__name__} | data

    def decode(self, data: Any) -> T:
        """Return the message that the data are.

        Raises:
            DecodeError: if they are none.
        """
        tag = data.get(self._key) if isinstance(data, dict) else None
        kind = self._kinds.get(tag) if isinstance(tag, str) else None
        if kind is None:
            words = ", ".join(self._kinds)
            raise DecodeError(
                f"{self._key} is {shown(tag)}, not one of {words}"
                if tag
                else f"there is no {self._key}"
            )
        return decode(kind, data)

    def line(self, message: T) -> str:
        """Return the message as one line of JSON, newline included."""
        return json.dumps(self.encode(message), ensure_ascii=False) + "\n"

    def read(self, line: str | bytes) -> T:
        """Return the message that a line holds.

        Raises:
            ValueError: if it holds none.
        """
        return self.decode(json.loads(line))


def shown(value: Any) -> str:
    """Return a value that was read as an error shows it.

    What kind it is, or the value itself, if it is short.
    """
    if isinstance(value, (dict, list)):
        return "a mapping" if isinstance(value, dict) else "a list"
    text = json.dumps(value, ensure_ascii=False)
    text = text if text.isprintable() else json.dumps(value)
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}…"


def _step(step: str | int) -> str:
    return (
        f".{step}"
        if isinstance(step, str) and step.isidentifier()
        else f"[{json.dumps(step, ensure_ascii=False)}]"
    )


# Reading: one function for each type, made once.


@cache
def _decoder(kind: Any) -> Callable[[Any], Any]:
    origin, inner = get_origin(kind), get_args(kind)
    if kind is Any:
        return _as_it_is
    if kind is float:
        return _float
    if kind in _PLAIN:
        return _plain(kind)
    if is_record(kind):
        return _record(kind)
    if origin is Literal:
        return _word(inner)
    if origin is Annotated:
        return _ruled(inner[0], tuple(rule for rule in inner[1:] if isinstance(rule, Rule)))
    if origin in (Union, types.UnionType):
        return _union(inner)
    if origin is dict:
        return _mapping(inner[1])
    if origin is tuple:
        return _list(inner[0]) if inner[-1] is Ellipsis else _fixed(inner)
    raise TypeError(f"no JSON is read as {kind}")


def _as_it_is(data: Any) -> Any:
    return data


def _refuse(data: Any, expected: str) -> DecodeError:
    return DecodeError(f"is {shown(data)}, not {expected}")


def _miss() -> NoReturn:
    raise DecodeError("is missing")


def _float(data: Any) -> float:
    if type(data) not in (float, int):
        raise _refuse(data, _PLAIN[float])
    try:
        value = float(data)
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise _refuse(data, _PLAIN[float])
    return value


def _plain(kind: type) -> Callable[[Any], Any]:
    def read(data: Any) -> Any:
        if type(data) is not kind:
            raise _refuse(data, _PLAIN[kind])
        return data

    return read


def _word(words: tuple[Any, ...]) -> Callable[[Any], Any]:
    expected = f"one of {', '.join(map(shown, words))}"

    def read(data: Any) -> Any:
        for word in words:
            if word == data and type(word) is type(data):
                return word
        raise _refuse(data, expected)

    return read


def _ruled(kind: Any, rules: tuple[Rule, ...]) -> Callable[[Any], Any]:
    read_kind = _decoder(kind)

    def read(data: Any) -> Any:
        value = read_kind(data)
        try:
            for rule in rules:
                rule.check(value)
        except ValueError as error:
            raise DecodeError(str(error)) from None
        return value

    return read


def _union(kinds: tuple[Any, ...]) -> Callable[[Any], Any]:
    others = tuple(kind for kind in kinds if kind is not _NONE)
    if len(others) > 1 and not set(others) <= _PLAIN.keys():
        raise TypeError(f"no JSON is read as one of {others}")
    readers = {kind: _decoder(kind) for kind in others}
    (only,) = readers.values() if len(others) == 1 else (None,)
    expected = " or ".join(_PLAIN[kind] for kind in others if kind in _PLAIN)

    def read(data: Any) -> Any:
        if data is None and len(others) < len(kinds):
            return None
        if only:
            return only(data)
        reader = readers.get(type(data)) or (readers.get(float) if type(data) is int else None)
        if reader is None:
            raise _refuse(data, expected)
        return reader(data)

    return read


def _mapping(kind: Any) -> Callable[[Any], dict[str, Any]]:
    read_kind = _decoder(kind)

    def read(data: Any) -> dict[str, Any]:
        if not isinstance(data, dict):
            raise _refuse(data, "a mapping")
        found = {}
        for key, value in data.items():
            try:
                found[key] = read_kind(value)
            except DecodeError as error:
                error.path.append(key)
                raise
        return found

    return read


def _items(data: list[Any], readers: Iterable[Callable[[Any], Any]]) -> tuple[Any, ...]:
    found: list[Any] = []
    try:
        for value, read_kind in zip(data, readers, strict=False):
            found.append(read_kind(value))
    except DecodeError as error:
        error.path.append(len(found))
        raise
    return tuple(found)


def _list(kind: Any) -> Callable[[Any], tuple[Any, ...]]:
    read_kind = _decoder(kind)

    def read(data: Any) -> tuple[Any, ...]:
        if not isinstance(data, list):
            raise _refuse(data, "a list")
        return _items(data, (read_kind for _ in data))

    return read


def _fixed(kinds: tuple[Any, ...]) -> Callable[[Any], tuple[Any, ...]]:
    readers = [_decoder(kind) for kind in kinds]

    def read(data: Any) -> tuple[Any, ...]:
        if not isinstance(data, list) or len(data) != len(readers):
            raise _refuse(data, f"a list of {len(readers)}")
        return _items(data, readers)

    return read


def _record(cls: Any) -> Callable[[Any], Any]:
    fields = [(one.name, _decoder(one.kind), one.default, one.flat) for one in fields_of(cls)]

    def read(data: Any) -> Any:
        if not isinstance(data, dict):
            raise _refuse(data, "a mapping")
        values = {}
        for name, read_kind, default, flat in fields:
            try:
                if flat or name in data:
                    values[name] = read_kind(data if flat else data[name])
                elif default is MISSING:
                    _miss()
            except DecodeError as error:
                if not flat:
                    error.path.append(name)
                raise
        try:
            return cls(**values)
        except ValueError as error:
            raise DecodeError(str(error)) from None

    return read


# Writing.


@cache
def _encoder(kind: Any) -> Callable[[Any], Any]:
    origin, inner = get_origin(kind), get_args(kind)
    if is_record(kind):
        return _record_encoder(kind)
    if origin is Annotated:
        return _encoder(inner[0])
    if origin in (Union, types.UnionType):
        return _optional(inner)
    if origin is dict:
        write = _encoder(inner[1])
        return (
            _as_it_is
            if write is _as_it_is
            else lambda value: {key: write(one) for key, one in value.items()}
        )
    if origin is tuple and inner[-1] is Ellipsis:
        write = _encoder(inner[0])
        return _as_it_is if write is _as_it_is else lambda value: [write(one) for one in value]
    return _as_it_is


def _optional(kinds: tuple[Any, ...]) -> Callable[[Any], Any]:
    write = next((write for write in map(_encoder, kinds) if write is not _as_it_is), None)
    return (lambda value: None if value is None else write(value)) if write else _as_it_is


def _record_encoder(cls: Any) -> Callable[[Any], dict[str, Any]]:
    fields = [(one, _encoder(one.kind)) for one in fields_of(cls)]

    def write(value: Any) -> dict[str, Any]:
        data: dict[str, Any] = {}
        for one, write_kind in fields:
            held = getattr(value, one.name)
            if one.flat:
                data |= write_kind(held)
            elif not (one.omitted and held == one.default):
                data[one.name] = write_kind(held)
        return data

    return write
