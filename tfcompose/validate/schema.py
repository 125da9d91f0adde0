"""How the language is described: types that read plain YAML data, and mappings with known keys.

One description serves three readers: the validator, which finds everything that is wrong in one pass and keeps what is
right; the JSON Schema, which editors use; and people. A general validation library is not used here because its import
alone costs more than reading, checking and reporting a whole robot does.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from tfcompose.findings import did_you_mean, slip_of
from tfcompose.validate.quantity import Quantity

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.load import Path

BROKEN: Any = type("Broken", (), {"__repr__": lambda _: "BROKEN"})()
"""Stands where a value was refused, here or in an expression; the refusal is among the problems."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One refusal. ``path`` is the place; ``on_key`` says that the key is wrong, not its value.

    ``instead`` is the key or the text that belongs there, where only one can be meant.
    """

    code: str
    path: Path
    message: str
    help: str = ""
    on_key: bool = False
    other: Path | None = None
    instead: str | None = None


@dataclass(slots=True)
class Problems:
    """What was refused, in the order of reading."""

    all: list[Problem] = field(default_factory=list)

    def refuse(  # noqa: PLR0913 (the parts of a problem; all but three are named)
        self,
        code: str,
        path: Path,
        message: str,
        help: str = "",  # noqa: A002 (the field's name)
        *,
        on_key: bool = False,
        other: Path | None = None,
        instead: str | None = None,
    ) -> Any:
        """Note a problem and return ``BROKEN``."""
        self.all.append(Problem(code, path, message, help, on_key, other, instead))
        return BROKEN


class Type:
    """What a value may be: ``read`` returns its meaning or ``BROKEN``; ``schema`` is its JSON Schema.

    A value that is ``BROKEN`` already is never read: mappings and lists see to that.
    """

    __slots__ = ("read", "schema")

    def __init__(self, read: Callable[[Any, Path, Problems], Any], schema: Any) -> None:
        self.read = read
        self.schema = schema


class Key:
    """One key of a mapping: its type, its default (or that it must be there), and what an editor shows."""

    __slots__ = ("about", "default", "examples", "required", "type")

    def __init__(self, type_: Type, default: Any, *, required: bool, about: str, examples: tuple[Any, ...]) -> None:
        self.type = type_
        self.default = default
        self.required = required
        self.about = about
        self.examples = examples


_REQUIRED: Any = object()


def key(type_: Type, default: Any = _REQUIRED, about: str = "", examples: tuple[Any, ...] = ()) -> Any:
    """Describe a key of a ``Model``; without a default it must be there."""
    return Key(type_, default, required=default is _REQUIRED, about=about, examples=examples)


class Model:
    """A mapping with known keys; others are refused. Objects are frozen."""

    KEYS: ClassVar[dict[str, Key]] = {}
    _DEFAULTS: ClassVar[dict[str, Any]] = {}
    _REQUIRED: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls) -> None:
        own = {name: value for name, value in vars(cls).items() if isinstance(value, Key)}
        cls.KEYS = {**cls.KEYS, **own}
        cls._DEFAULTS = {name: described.default for name, described in cls.KEYS.items()}
        cls._REQUIRED = tuple(name for name, described in cls.KEYS.items() if described.required)
        for name in own:
            delattr(cls, name)

    def __init__(self, **values: Any) -> None:
        self.__dict__.update(self._DEFAULTS)
        self.__dict__.update(values)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{name} cannot be set: what the user wrote does not change")

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.__dict__ == other.__dict__

    def __hash__(self) -> int:
        return hash((type(self), *sorted(self.__dict__)))

    def __repr__(self) -> str:
        said = ", ".join(f"{k}={v!r}" for k, v in self.__dict__.items() if v != self.KEYS[k].default)
        return f"{type(self).__name__}({said})"


def shown(value: Any) -> str:
    """Return how a value is named in a message: short, and as it stands in YAML."""
    if isinstance(value, bool) or value is None:
        return {True: "true", False: "false", None: "null"}[value]
    if isinstance(value, (dict, list)):
        return "a mapping" if isinstance(value, dict) else f"a list of {len(value)}"
    if isinstance(value, Quantity):
        return repr(value.value)
    text = repr(value)
    return text if len(text) < 60 else f"{text[:56]}…{text[-1]}"  # noqa: PLR2004 (a message stays one line)


def record(cls: type[Model], normal: Callable[[Any], Any] | None = None, short: Any = None) -> Type:
    """Return the type of a mapping with the keys of ``cls``.

    ``normal`` rewrites a short form first; ``short`` is the JSON Schema of that form.
    """

    def read(value: Any, path: Path, problems: Problems) -> Any:
        value = normal(value) if normal else value
        if not isinstance(value, dict):
            known = ", ".join(cls.KEYS)
            return problems.refuse("TF103", path, f"{shown(value)} is no mapping", f"its keys can be: {known}")
        return _read_model(cls, value, path, problems)

    return Type(read, {"anyOf": [short, cls]} if short else cls)


def _read_model(cls: type[Model], data: dict[str, Any], path: Path, problems: Problems) -> Any:
    known = cls.KEYS
    if not data.keys() <= known.keys():
        _refuse_unknown(cls, data, path, problems)
    values: dict[str, Any] = {}
    for name, item in data.items():
        if name in known and item is not BROKEN:
            value = known[name].type.read(item, (*path, name), problems)
            if value is not BROKEN:
                values[name] = value
    whole = True
    for name in cls._REQUIRED:
        if name not in data:
            examples = known[name].examples
            sample = f"for example {name}: {examples[0]}" if examples else ""
            problems.refuse("TF102", path, f"{name} is missing", sample, on_key=True)
        whole = whole and name in values
    return cls(**values) if whole else BROKEN


def _refuse_unknown(cls: type[Model], data: dict[str, Any], path: Path, problems: Problems) -> None:
    unknown = {name: slip_of(name, cls.KEYS) for name in data if name not in cls.KEYS}
    for name, meant in unknown.items():
        advice = did_you_mean(name, cls.KEYS, f"known here: {', '.join(cls.KEYS)}")
        only = meant if meant not in data and list(unknown.values()).count(meant) == 1 else None
        problems.refuse("TF101", (*path, name), f"unknown key {name}", advice, on_key=True, instead=only)


def mapping(of: Type, short: str | None = None) -> Type:
    """Return the type of a mapping with free names; broken entries are left out. ``short`` stands for an empty one."""

    def read(value: Any, path: Path, problems: Problems) -> Any:
        if short is not None and value == short:
            return {}
        if not isinstance(value, dict):
            return problems.refuse("TF103", path, f"{shown(value)} is no mapping", "for example name: {…}")
        meanings: dict[str, Any] = {}
        sound: dict[int, Any] = {}  # by identity: an alias need not be read again, unless there is something to say
        for name, item in value.items():
            meaning = sound.get(id(item), BROKEN)
            if meaning is BROKEN and item is not BROKEN:
                before = len(problems.all)
                meaning = of.read(item, (*path, name), problems)
                if isinstance(item, dict) and len(problems.all) == before:
                    sound[id(item)] = meaning
            if meaning is not BROKEN:
                meanings[name] = meaning
        return meanings

    schema = {"type": "object", "additionalProperties": of}
    return Type(read, {"anyOf": [{"const": short}, schema]} if short is not None else schema)


def listing(of: Type, *, count: int | None = None, sample: str = "", single: bool = False) -> Type:
    """Return the type of a list, of ``count`` items if given; with ``single`` one item may stand for a list of it."""

    def read(value: Any, path: Path, problems: Problems) -> Any:
        if single and not isinstance(value, list):
            item = of.read(value, path, problems)
            return BROKEN if item is BROKEN else (item,)
        wanted = f"a list of {count}" if count else "a list"
        if not isinstance(value, list):
            return problems.refuse("TF103", path, f"{shown(value)} is not {wanted}", sample and f"for example {sample}")
        if count is not None and len(value) != count:
            return problems.refuse("TF103", path, f"{shown(value)}, and {count} are expected", f"for example {sample}")
        items = [
            BROKEN if item is BROKEN else of.read(item, (*path, index), problems) for index, item in enumerate(value)
        ]
        return BROKEN if BROKEN in items else tuple(items)

    schema: dict[str, Any] = {"type": "array", "items": of}
    if count is not None:
        schema |= {"minItems": count, "maxItems": count}
    return Type(read, {"anyOf": [of, schema]} if single else schema)


def then(inner: Type, convert: Callable[[Any, Path, Problems], Any]) -> Type:
    """Return the type that reads ``inner`` and then converts what it gave."""

    def read(value: Any, path: Path, problems: Problems) -> Any:
        got = inner.read(value, path, problems)
        return BROKEN if got is BROKEN else convert(got, path, problems)

    return Type(read, inner.schema)
