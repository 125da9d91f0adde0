"""The language as a reference in Markdown.

For every key it has type, unit, default, meaning and example.
"""

from __future__ import annotations

import inspect
import types
from dataclasses import dataclass
from datetime import date
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

from tfcompose.foundation.tool import installed_tools
from tfcompose.foundation.units import Measure
from tfcompose.foundation.yaml_text import flow
from tfcompose.spec.language.json_schema import model_of
from tfcompose.spec.language.spec import (
    describe_key,
    examples_of,
    fields_of,
    is_mapping,
    measure_of,
    unwrap_named_type,
    walk,
)
from tfcompose.spec.language.values import InARow

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo

    from tfcompose.spec.language.spec import Pattern

_HEAD = {
    "robot": "The language of robot files",
    "preset": "The language of sensor presets",
    "node": "The language of node presets",
}
_VALUES = (
    "A bare number is in SI units and radians; a string may carry a unit: `30 cm`, `15 deg`,"
    " `50 Hz`."
)
_EXPRESSIONS = (
    "`${…}` computes from `vars`, `args` and the environment; inside `[ ]` and `{ }` it needs"
    ' quotes: `[0, 0, "${mast}"]`.'
)
_REQUIRED = "Keys marked required must be set; the others may be left out."


@dataclass(frozen=True, slots=True)
class ReferenceKey:
    """A key with its properties as Markdown."""

    name: str
    type: str
    #: The default, "required" for a required key, or empty.
    default: str
    about: str
    examples: str
    is_required: bool


@dataclass(frozen=True, slots=True)
class ReferenceSection:
    """A mapping of a file, with its keys."""

    title: str
    #: Its places and its meaning, as Markdown.
    text: str
    keys: tuple[ReferenceKey, ...]


@dataclass(frozen=True, slots=True)
class Reference:
    """All keys of a language."""

    title: str
    #: Rules for all values, as Markdown.
    rules: tuple[str, ...]
    sections: tuple[ReferenceSection, ...]


def reference_of(language: str) -> Reference:
    """Return the keys of ``robot``, ``preset``, ``node`` or a tool's language."""
    places: dict[Any, list[str]] = {}
    for pattern, kind in walk(model_of(language)):
        places.setdefault(kind, []).append(_place(pattern))
    head = _HEAD.get(language) or installed_tools().languages()[language].title
    return Reference(
        f"{head}, version 1",
        rules=(_VALUES, *([_EXPRESSIONS] if language == "robot" else []), _REQUIRED),
        sections=tuple(_section(kind, place) for kind, place in places.items()),
    )


def reference(language: str) -> str:
    """Return the keys of a language as Markdown, with a table for each section."""
    reference = reference_of(language)
    lines = [f"# {reference.title}", "", *reference.rules, ""]
    for section in reference.sections:
        lines += _table(section)
    return "\n".join(lines).rstrip() + "\n"


def key_page(path: str) -> str | None:
    """Return the meaning of a robot file's key as Markdown, None for an unknown key.

    ``path`` can be the key with its sections, with or without names of entries, such as
    ``sensors.place`` or ``sensors.laser.place``. It can be a kind of section, such as ``sensor``.
    It can be only the key, in which case the page explains all its places.
    """
    steps = tuple(path.split("."))
    places = [(pattern, kind) for pattern, kind in walk(model_of("robot")) if pattern]
    places_by_text: dict[tuple[str, ...], list[str]] = {}
    for pattern, kind in _with_key(steps):
        field = fields_of(kind)[steps[-1]]
        default, example = _default(field), _examples(field)
        lines = [describe_key(field), "", f"- type: {_type(field.rebuild_annotation())}"]
        lines += [f"- default: {default}"] * bool(default)
        lines += [f"- example: {example}"] * bool(example)
        places_by_text.setdefault(tuple(lines), []).append(_place((*pattern, steps[-1])))
    lines = [
        line
        for about, names in places_by_text.items()
        for line in (f"## {_list_places(names)}", "", *about, "")
    ]
    sections = [
        (pattern, kind)
        for pattern, kind in places
        if pattern[-1] != "*" and _is_at(pattern, steps)
    ]
    sections += [
        (pattern, kind)
        for pattern, kind in places
        if pattern[-1] == "*" and _is_at(pattern[:-1], steps)
    ]
    sections = sections or [
        (pattern, kind) for pattern, kind in places if steps == (_title(kind).lower(),)
    ]
    if sections:
        kind = sections[0][1]
        lines += _table(
            _section(kind, [_place(path) for path, place_kind in places if place_kind is kind])
        )
    return "\n".join(lines).rstrip() + "\n" if lines else None


def sections_with_key(path: str) -> list[str]:
    """Return titles of a robot file's sections that have the key; ``path`` as in ``key_page``."""
    return list(dict.fromkeys(_title(kind) for _, kind in _with_key(tuple(path.split(".")))))


def _with_key(steps: tuple[str, ...]) -> list[tuple[Pattern, Any]]:
    """Return the sections that have the key, with their places.

    A key at the top level takes precedence over the same key in sections.
    """
    root = model_of("robot")
    if len(steps) == 1 and steps[0] in fields_of(root):
        return [((), root)]
    return [
        (place, kind)
        for place, kind in walk(root)
        if steps[-1] in fields_of(kind) and (len(steps) == 1 or _is_at(place, steps[:-1]))
    ]


def paths() -> list[str]:
    """Return the path of each key of a robot file without names of entries, as sensors.place."""
    paths = walk(model_of("robot"))
    return [
        ".".join(step for step in (*path, name) if step != "*")
        for path, kind in paths
        for name in fields_of(kind)
    ]


def keys() -> list[str]:
    """Return the names of all keys of a robot file, and the kinds of its sections."""
    kinds = dict.fromkeys(kind for _, kind in walk(model_of("robot")))
    return [
        *dict.fromkeys(name for kind in kinds for name in fields_of(kind)),
        *(_title(kind).lower() for kind in kinds),
    ]


def _is_at(pattern: Pattern, steps: tuple[str, ...]) -> bool:
    """Return whether the steps match the place. Names of entries may be left out."""
    if not pattern or not steps:
        return not steps and all(step == "*" for step in pattern)
    if pattern[0] == "*":
        return _is_at(pattern[1:], steps) or _is_at(pattern[1:], steps[1:])
    return pattern[0] == steps[0] and _is_at(pattern[1:], steps[1:])


def _place(pattern: Pattern) -> str:
    return ".".join(pattern).replace("*", "NAME")


def _list_places(places: list[str]) -> str:
    more = [f"{len(places) - _MOST_PLACES} more places"] if len(places) > _MOST_PLACES else []
    return ", ".join([*places[:_MOST_PLACES], *more])


def _section(kind: Any, places: list[str]) -> ReferenceSection:
    about = [*_places(places), inspect.getdoc(kind) or ""]
    return ReferenceSection(
        _title(kind),
        "\n".join(about).rstrip(),
        tuple(_key(name, field) for name, field in fields_of(kind).items()),
    )


def _key(name: str, field: FieldInfo) -> ReferenceKey:
    return ReferenceKey(
        name,
        _type(field.rebuild_annotation()),
        default=_default(field),
        about=describe_key(field),
        examples=_examples(field),
        is_required=field.is_required(),
    )


def _table(section: ReferenceSection) -> list[str]:
    lines = [f"## {section.title}", "", *section.text.splitlines(), ""]
    lines += ["| key | type | default | meaning | example |", "|---|---|---|---|---|"]
    return [*lines, *map(_row, section.keys), ""]


def _title(kind: Any) -> str:
    return str(kind.__name__).removesuffix("Spec")


_MOST_PLACES = 6


def _places(places: list[str]) -> list[str]:
    """Return a sentence with the places of a mapping, nothing for the top level."""
    named = [f"`{place}`" for place in places if place]
    return [f"At {_list_places(named)}.", ""] if named else []


def _row(key: ReferenceKey) -> str:
    cells = (f"`{key.name}`", key.type, key.default, key.about, key.examples)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _examples(field: FieldInfo) -> str:
    """Return examples, unless the type itself lists the values."""
    if field.examples:
        return " or ".join(f"`{flow(example)}`" for example in examples_of(field))
    measure = measure_of(field.rebuild_annotation())
    return f"`{measure.example}`" if measure else ""


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    default = field.default
    if default is None or default in ((), {}, "") or is_mapping(type(default)):
        return ""
    return f"`{flow(default)}`"


def _type(annotation: Any) -> str:
    """Return a type as text: its name, the type of a list's items, or its choices."""
    annotation = unwrap_named_type(annotation)
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _annotate(inner[0], inner[1:])
    if origin in {Union, types.UnionType}:
        return " or ".join(dict.fromkeys(_type(kind) for kind in inner if kind is not type(None)))
    if origin is Literal:
        return " | ".join(f"`{text}`" for text in inner)
    if origin is dict:
        return f"{_plural(_type(inner[1]))} by name"
    if origin is tuple:
        return f"list of {_plural(_type(inner[0]))}"
    if is_mapping(annotation):
        return f"[{_title(annotation)}](#{_title(annotation).lower()})"
    return {
        str: "string",
        date: "day",
        bool: "true or false",
        int: "whole number",
        float: "number",
        Any: "anything",
    }[annotation]


def _annotate(inner: Any, metadata: tuple[Any, ...]) -> str:
    for annotation in metadata:
        if isinstance(annotation, Measure):
            return "number" if not annotation.unit else "quantity"
        if isinstance(annotation, InARow):
            return f"list of {annotation.count} {_plural(_type(get_args(inner)[0]))}"
        input_type = unwrap_named_type(getattr(annotation, "json_schema_input_type", None))
        if get_origin(input_type) in {Union, types.UnionType, Literal}:
            return _type(input_type)
    return _type(inner)


def _plural(noun: str) -> str:
    plurals = {
        "string": "strings",
        "number": "numbers",
        "quantity": "quantities",
        "whole number": "whole numbers",
    }
    return plurals.get(
        noun, f"lists{noun.removeprefix('list')}" if noun.startswith("list of ") else noun
    )
