"""Reading plain data into a model: all faults of the data, and a model of the valid rest.

pydantic returns either a complete model or errors. So this module removes rejected values from the
data and validates the rest again. Each pass finds all faults at once. A later pass may reject a
value only because another value was removed; such faults are not reported. Most faulty files need
two passes. The number of passes is limited by the depth of the file.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeVar, get_args, get_origin

from pydantic import ValidationError

from tfcompose.foundation.findings import Edit, Finding, Note, did_you_mean, finding, slip_of
from tfcompose.foundation.tool import absent
from tfcompose.foundation.units import format_value
from tfcompose.spec.language.key_hints import habit, usual_value
from tfcompose.spec.language.spec import FIRST, fields_of, kinds_of, mapping_at, value_at

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pydantic_core import ErrorDetails

    from tfcompose.spec.language.spec import Spec
    from tfcompose.spec.load import Path, Source

M = TypeVar("M", bound="Spec")

#: Maximum number of passes. No file is nested deeper.
_MAX_ATTEMPTS = 50


@dataclass(frozen=True, slots=True)
class SpecRefusal:
    """A value or key that the language does not accept."""

    code: str
    #: The path of the value or key in the file.
    path: Path
    message: str
    help: str = ""
    #: Whether the key is wrong, rather than its value.
    on_key: bool = False
    #: The path of a conflicting key.
    conflicts_with: Path | None = None
    #: The correct key or string, if there is only one candidate.
    instead: str | None = None

    def finding(self, source: Source) -> Finding:
        """Return the finding at the refusal's place in the source."""
        span = source.key_span(self.path) if self.on_key else source.span_of(self.path)
        notes = (
            [Note("the other one", source.key_span(self.conflicts_with))]
            if self.conflicts_with
            else []
        )
        edits = [Edit(span, self.instead)] if self.instead is not None else []
        replacement = (
            _overlay_advice(source, self.path)
            if self.code == "TF102" and source.is_variant
            else ""
        )
        if replacement:  # a single finding for all missing keys
            return finding(
                "TF102",
                f"{self.path[-1]} does not exist, and is not complete as a new entry",
                span,
                help=replacement,
                notes=notes,
            )
        return finding(self.code, self.message, span, help=self.help, notes=notes, edits=edits)


def _overlay_advice(source: Source, path: Path) -> str:
    """Return advice for a new entry in an overlay whose name resembles an existing entry."""
    around = source.places.get(path[:-1])
    names = list(around.keys) if around else []
    before = names[: names.index(path[-1])] if path and path[-1] in names else []
    return did_you_mean(str(path[-1]), before) if before else ""


def read(
    model: type[M], data: Any, already: Iterable[Path] = ()
) -> tuple[M | None, list[SpecRefusal]]:
    """Return the model of the data without rejected values, and the refusals.

    ``already`` are paths of values that were rejected before. They are left out, and faults that
    only follow from them are not reported. The model is None if a required key at the top is
    missing.
    """
    refusals: list[SpecRefusal] = []
    gone: set[Path] = set()
    rest = _without(data, already, gone)
    for attempt in range(_MAX_ATTEMPTS):
        if rest is None:
            break
        try:
            return model.model_validate(rest, context=None if attempt else FIRST), refusals
        except ValidationError as error:
            errors = [
                (_path_of(problem["loc"], data), problem)
                for problem in error.errors(include_url=False)
            ]
        follows = {path[:end] for path in gone for end in range(1, len(path) + 1)}
        new = []
        for path, refused in errors:
            old = gone if refused["type"] in UNKNOWN_KEYS else follows
            if path not in old:
                new.append((path, refused))
        refusals += _refusals(model, new, data)
        rest = _without(
            rest,
            [
                _culprit(path, error)
                for path, error in errors
                if not error.get("ctx", {}).get("keeps")
            ],
            gone,
        )
    return None, refusals


def _culprit(path: Path, error: ErrorDetails) -> Path:
    """Return the path to remove: for a missing key, the path of the mapping that lacks it."""
    return path[:-1] if error["type"] == "missing" else path


def _path_of(loc: tuple[int | str, ...], data: Any) -> Path:
    """Return the path in the file.

    pydantic's path also has labels of unions, and indices where a single item replaces a list.
    """
    steps: list[int | str] = []
    for step in loc:
        is_index = isinstance(step, int)
        if (isinstance(data, dict) and step in data) or (isinstance(data, list) and is_index):
            data = data[step]  # type: ignore[index]
        elif (
            is_index or isinstance(data, list) or str(step).startswith("[")
        ):  # [key], and labels of unions
            continue
        else:
            data = None
        steps.append(step)
    return tuple(steps)


def _without(data: Any, paths: Iterable[Path], gone: set[Path]) -> Any:
    """Return the data without the values at the paths, None if nothing is left.

    Removed paths are added to ``gone``. If an item of a list is removed, the entire list is
    removed. The given data are not modified.
    """
    tree: dict[Any, Any] = {}
    for path in paths:
        steps = _existing(data, path)
        if not steps:
            return None
        gone.add(steps)
        node = tree
        for step in steps[:-1]:
            node = node.setdefault(step, {})
            if node is _ALL:
                break
        else:
            node[steps[-1]] = _ALL
    return _prune(data, tree) if tree else data


#: Marks a value to remove completely.
_ALL: Any = {None: None}


def _existing(data: Any, path: Path) -> Path:
    """Return the longest part of the path that ends at an existing key of a mapping.

    Short forms and items of lists have no keys.
    """
    end = 0
    for count, step in enumerate(path, 1):
        if isinstance(data, dict) and step in data:
            end = count
        elif not (isinstance(data, list) and isinstance(step, int)):
            break
        data = data[step]
    return path[:end]


def _prune(data: Any, tree: dict[Any, Any]) -> Any:
    if isinstance(data, list):
        items = list(data)
        for index in tree.keys() & set(range(len(items))):
            items[index] = _prune(items[index], tree[index])
        return items
    kept = {name: item for name, item in data.items() if tree.get(name) is not _ALL}
    for name in tree.keys() & kept.keys():
        kept[name] = _prune(kept[name], tree[name])
    return kept


def _refusals(
    model: type[Spec], errors: list[tuple[Path, ErrorDetails]], data: Any
) -> list[SpecRefusal]:
    """Return what pydantic rejected in a pass, in the words of this project."""
    unknown = [path for path, error in errors if error["type"] in UNKNOWN_KEYS]
    slips = Counter((path[:-1], _slip(model, path)) for path in unknown)
    refusals = []
    for path, error in errors:
        if error["type"] in UNKNOWN_KEYS:
            refusals.append(_unknown_key(model, path, data, slips))
        elif error["type"] != "missing" or not slips[path[:-1], str(path[-1])]:
            refusals.append(_refusal(model, path, error))
    return refusals


#: pydantic's error types for an unknown key of a model or dataclass.
UNKNOWN_KEYS = frozenset({"extra_forbidden", "unexpected_keyword_argument"})


def _slip(model: type[Spec], path: Path) -> str | None:
    model_keys = mapping_at(model, path[:-1])
    return slip_of(str(path[-1]), fields_of(model_keys))


def _unknown_key(
    model: type[Spec], path: Path, data: Any, slips: Counter[tuple[Path, str | None]]
) -> SpecRefusal:
    """Return the refusal of an unknown key.

    A similar key is not proposed if it is already set or similar to several unknown keys.
    """
    holder = mapping_at(model, path[:-1])
    name, keys = str(path[-1]), list(fields_of(holder))
    slip = _slip(model, path)
    around = data
    for step in path[:-1]:
        around = around[step]
    usual = habit(name, keys, around.get(path[-1])) or getattr(holder, "HABITS", {}).get(name, "")
    if not slip and not usual and _is_a_section(model, path):
        message = f"{path[1]} is a section of its own, not one of {path[0]}"
        return SpecRefusal("TF101", path[:2], message, f"indent it as {path[0]} is", on_key=True)
    is_safe = slip not in around and slips[path[:-1], slip] == 1 and not usual
    advice = (
        (absent(name, "key") if len(path) == 1 else "")
        or usual
        or (f"did you mean {slip}?" if slip else "")
        or _indentation_advice(path, around, keys)
    )
    if not advice:
        listing = f"known here: {', '.join(keys)}"
        option = (
            f"an option of its preset goes under options: {{{name}: …}}; "
            if "options" in keys
            else ""
        )
        advice = did_you_mean(name, keys, option + listing)
    return SpecRefusal(
        "TF101",
        path,
        f"unknown key {name}",
        advice,
        on_key=True,
        instead=slip if is_safe else None,
    )


def _is_a_section(model: type[Spec], path: Path) -> bool:
    """Return whether an entry is a section that is indented too far.

    Such an entry has the name of a section.
    """
    return len(path) == 3 and path[1] in fields_of(model) and path[0] != "profiles"  # noqa: PLR2004 (section, entry, key)


def _indentation_advice(path: Path, around: dict[str, Any], keys: list[str]) -> str:
    """Return the help for an unknown key that follows a known key without a value.

    The unknown key probably belongs below the known key.
    """
    before = list(around)[: [*around].index(str(path[-1]))]
    owner = next((name for name in reversed(before) if name in keys), "")
    return f"indent it, if it belongs to {owner}" if owner and around[owner] is None else ""


def _refusal(model: type[Spec], path: Path, error: ErrorDetails) -> SpecRefusal:
    kind, value = error["type"], error["input"]
    context, on_key = error.get("ctx", {}), "[key]" in error["loc"]
    if kind.startswith("TF"):
        conflicting = (
            (*path[:-1], context["conflicts_with"]) if "conflicts_with" in context else None
        )
        is_on_key = on_key or context.get("on_key", False)
        return SpecRefusal(
            kind,
            path,
            context["message"],
            help=context["help"],
            on_key=is_on_key,
            conflicts_with=conflicting,
            instead=context.get("instead"),
        )
    if kind == "missing":
        field = fields_of(mapping_at(model, path[:-1]))[str(path[-1])]
        advice = f"for example {path[-1]}: {field.examples[0]}" if field.examples else ""
        return SpecRefusal("TF102", path[:-1], f"{path[-1]} is missing", advice, on_key=True)
    if kind == "literal_error":
        allowed = [str(text) for text in _allowed_values(model, path)]
        advice = f"one of: {', '.join(allowed)}"
        advice = (
            did_you_mean(usual_value(value, allowed), allowed, advice)
            if isinstance(value, str)
            else advice
        )
        return SpecRefusal(
            "TF106", path, f"{format_value(value)} is not allowed here", advice, on_key
        )
    code, message, advice = WORDS.get(kind, UNFORESEEN)
    if kind == "string_type":
        advice = _as_string(value)
    elif kind == "bool_type" and str(value).lower() in _SWITCHES:
        advice = f"write {_SWITCHES[str(value).lower()]}"
    elif kind in {"model_type", "dataclass_type"}:
        keys = fields_of(mapping_at(model, path))
        advice = _example(model, path, value)
        if path and path[-1] in keys:
            advice = f"{path[-1]} belongs to the entry above: indent it more than the name of that"
    elif kind == "dict_type":
        advice = _as_mapping(model, path, value)
    return SpecRefusal(
        code, path, message.format(value=format_value(value), **context), advice, on_key
    )


def _example(model: type[Spec], path: Path, value: Any) -> str:
    """Return an example of a mapping with known keys, to replace ``value``.

    If possible, the example contains ``value``.
    """
    keys = fields_of(mapping_at(model, path))
    required = [name for name, field in keys.items() if field.is_required()]
    of_word = [name for name in keys if value in _allowed_values(model, (*path, name))]
    chosen = of_word or [name for name in keys if name == value] or required
    if isinstance(value, str) and value not in keys and len(chosen) == 1:
        return f"for example {{{chosen[0]}: {value}}}"
    examples = [(name, keys[name].examples) for name in chosen]
    pairs = [f"{name}: {_in_yaml(those[0])}" for name, those in examples if those]
    if not chosen or len(pairs) < len(chosen):
        return f"its keys can be: {', '.join(keys)}"
    return f"for example {{{', '.join(pairs)}}}"


def _allowed_values(model: type[Spec], path: Path) -> list[Any]:
    """Return the allowed words at a path, if the language lists them."""
    return [
        text
        for kind in kinds_of(value_at(model, path))
        if get_origin(kind) is Literal
        for text in get_args(kind)
    ]


#: Words that are booleans in YAML 1.1 and strings in YAML 1.2.
_SWITCHES = {"yes": "true", "on": "true", "no": "false", "off": "false"}


def _as_string(value: Any) -> str:
    """Return the help for a value that should be a string."""
    if isinstance(value, (int, float)):
        return "put it in quotes"
    inside = list(value.values()) if isinstance(value, dict) else value
    strings = (
        [kind for kind in inside if isinstance(kind, str)] if isinstance(inside, list) else []
    )
    if not strings or len(strings) != len(inside):
        return ""
    return (
        f"write {_in_yaml(strings[0])}"
        if len(strings) == 1
        else f"write one of {', '.join(strings)}"
    )


def _as_mapping(model: type[Spec], path: Path, value: Any) -> str:
    """Return the help for a value that should be a mapping with the user's own keys.

    The help contains the value's items as a mapping, or an example.
    """
    around = mapping_at(model, path[:-1])
    field = fields_of(around).get(str(path[-1])) if around else None
    example = (
        next((example for example in field.examples or [] if isinstance(example, dict)), None)
        if field
        else None
    )
    usual = next(iter(example.values())) if example else {}
    items = [_pair(item, usual) for item in (value if isinstance(value, list) else [value])]
    if items and None not in items:
        inside = ", ".join(f"{key}: {_in_yaml(kind)}" for key, kind in filter(None, items))
        return f"write {path[-1]}: {{{inside}}}" if path else f"write {inside}"
    inside = (
        ", ".join(f"{key}: {_in_yaml(kind)}" for key, kind in example.items())
        if example
        else "NAME: {…}"
    )
    return f"for example {path[-1]}: {{{inside}}}" if path else f"for example {inside}"


#: NAME=VALUE, or ROS's notation NAME:=VALUE.
_ASSIGNED = re.compile(r"([^\s=:]+)(?::=|=)(.*)")


def _pair(item: Any, usual: Any) -> tuple[str, Any] | None:
    """Return key and value of a list item that should be in a mapping like ``usual``."""
    if isinstance(item, str) and (assigned := _ASSIGNED.fullmatch(item)):
        return assigned[1], assigned[2]
    if isinstance(item, str) and item.endswith((".yaml", ".yml")):
        return "file", item
    if isinstance(item, str) and item.isidentifier() and isinstance(usual, (str, dict)):
        return item, usual
    if isinstance(item, list) and len(item) == 2 and all(isinstance(kind, str) for kind in item):  # noqa: PLR2004 (a pair)
        return item[0], item[1]
    if isinstance(item, dict) and isinstance(item.get("name"), str):
        return item["name"], {}
    if isinstance(item, dict) and len(item) == 1:
        name, value = next(iter(item.items()))
        return name, value
    return None


def _in_yaml(value: Any) -> str:
    """Return a value as YAML, with plain words unquoted and mappings abbreviated to {…}."""
    if isinstance(value, dict):
        return "{…}"
    return (
        value
        if isinstance(value, str) and re.fullmatch(r"[A-Za-z_/][\w/.]*", value)
        else format_value(value)
    )


#: pydantic's error types that the models can raise: code, message and help.
WORDS = {
    "bool_type": ("TF103", "expected true or false, got {value}", ""),
    "dataclass_type": ("TF103", "expected a mapping, got {value}", ""),
    "dict_type": ("TF103", "expected a mapping, got {value}", ""),
    "greater_than_equal": ("TF106", "{value} is less than {ge}", ""),
    "int_type": ("TF103", "expected a whole number, got {value}", ""),
    "less_than_equal": ("TF106", "{value} is greater than {le}", ""),
    "model_type": ("TF103", "expected a mapping, got {value}", ""),
    "string_type": ("TF103", "expected a string, got {value}", ""),
    "tuple_type": ("TF103", "expected a list, got {value}", ""),
}
#: For an error type of a later version of pydantic.
UNFORESEEN = ("TF103", "{value} cannot stand here", "")
