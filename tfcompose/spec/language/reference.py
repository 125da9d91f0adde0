"""The language as a reference for people, in Markdown.

Every key with its type, unit, default, meaning and example.
"""

from __future__ import annotations

import inspect
import types
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

from tfcompose.foundation.tool import installed
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
_REQUIRED = "Keys without a default are required."


def reference(language: str) -> str:
    """Return the reference of ``robot``, ``preset``, ``node`` or a tool's language."""
    root = model_of(language)
    sections: dict[Any, list[str]] = {}
    for pattern, kind in walk(root):
        sections.setdefault(kind, []).append(_place(pattern))
    rules = [_VALUES, *([_EXPRESSIONS] if language == "robot" else []), _REQUIRED]
    head = _HEAD.get(language) or installed().languages()[language].title
    lines = [f"# {head}, version 1", "", *rules, ""]
    for kind, places in sections.items():
        lines += _section(kind, places)
    return "\n".join(lines).rstrip() + "\n"


def key_page(path: str) -> str | None:
    """Return what a robot file's key means, as Markdown; None where there is no such key.

    ``path`` names it with its sections, with names or without: ``sensors.place`` or
    ``sensors.laser.place``; or the kind of a section: ``sensor``; or it is a key alone, of which
    every place is explained.
    """
    steps = tuple(path.split("."))
    root = model_of("robot")
    places = [(pattern, kind) for pattern, kind in walk(root) if pattern]
    holders: list[tuple[Pattern, Any]] = [((), root), *places]
    if steps[0] in fields_of(root) and len(steps) == 1:
        holders = holders[:1]
    elif len(steps) > 1:
        holders = [(at, kind) for at, kind in holders if _is_at(at, steps[:-1])]
    found: dict[tuple[str, ...], list[str]] = {}
    for at, kind in holders:
        field = fields_of(kind).get(steps[-1])
        if field is not None:
            default, example = _default(field), _examples(field)
            lines = [describe_key(field), "", f"- type: {_type(field.rebuild_annotation())}"]
            lines += [f"- default: {default}"] * bool(default) + [f"- example: {example}"] * bool(
                example
            )
            found.setdefault(tuple(lines), []).append(_place((*at, steps[-1])))
    lines = [
        line for about, at in found.items() for line in (f"## {_list_places(at)}", "", *about, "")
    ]
    sections = [(at, kind) for at, kind in places if at[-1] != "*" and _is_at(at, steps)]
    sections += [(at, kind) for at, kind in places if at[-1] == "*" and _is_at(at[:-1], steps)]
    sections = sections or [(at, kind) for at, kind in places if steps == (_title(kind).lower(),)]
    if sections:
        lines += _section(
            sections[0][1], [_place(at) for at, kind in places if kind is sections[0][1]]
        )
    return "\n".join(lines).rstrip() + "\n" if lines else None


def paths() -> list[str]:
    """Return where each key of a robot file is, such as ``sensors.place``, without names."""
    found = walk(model_of("robot"))
    return [
        ".".join(step for step in (*at, name) if step != "*")
        for at, kind in found
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
    """Return whether words name the place, in which a name may be left out."""
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


def _section(kind: Any, places: list[str]) -> list[str]:
    lines = [
        f"## {_title(kind)}",
        "",
        *_places(places),
        *(inspect.getdoc(kind) or "").splitlines(),
        "",
    ]
    lines += ["| key | type | default | meaning | example |", "|---|---|---|---|---|"]
    return [*lines, *(_row(name, field) for name, field in fields_of(kind).items()), ""]


def _title(kind: Any) -> str:
    return str(kind.__name__).removesuffix("Spec")


_MOST_PLACES = 6


def _places(places: list[str]) -> list[str]:
    """Return where a mapping stands; the whole file needs no word."""
    named = [f"`{place}`" for place in places if place]
    return [f"At {_list_places(named)}.", ""] if named else []


def _row(name: str, field: FieldInfo) -> str:
    cells = (
        f"`{name}`",
        _type(field.rebuild_annotation()),
        _default(field),
        describe_key(field),
        _examples(field),
    )
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _examples(field: FieldInfo) -> str:
    """Return examples where the type itself does not list what there is."""
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
    """Return a type in words: what it is called, of what it is a list, or its choices."""
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
        other = unwrap_named_type(getattr(annotation, "json_schema_input_type", None))
        if get_origin(other) in {Union, types.UnionType, Literal}:
            return _type(other)
    return _type(inner)


def _plural(noun: str) -> str:
    known = {
        "string": "strings",
        "number": "numbers",
        "quantity": "quantities",
        "whole number": "whole numbers",
    }
    return known.get(
        noun, f"lists{noun.removeprefix('list')}" if noun.startswith("list of ") else noun
    )
