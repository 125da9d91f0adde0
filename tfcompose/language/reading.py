"""From plain data to a model: everything that is refused, in this project's words, and a model of the rest.

pydantic gives all or nothing. So what it refuses is taken out of the data and the rest is read again; each turn finds
everything at once, and what is refused then only because something is gone is not reported. Most files with faults take
two turns, and none takes more than it has levels.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeVar, get_args, get_origin

from pydantic import ValidationError

from tfcompose.findings import Edit, Finding, Note, did_you_mean, finding, slip_of
from tfcompose.language.habits import habit
from tfcompose.language.spec import FIRST, at, fields_of, kinds_of, mapping_at
from tfcompose.units import shown

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pydantic_core import ErrorDetails

    from tfcompose.language.spec import Spec
    from tfcompose.load import Path, Source

M = TypeVar("M", bound="Spec")

#: How often the rest is read again at most: no file is nested deeper.
_MAX_ATTEMPTS = 50


@dataclass(frozen=True, slots=True)
class Refusal:
    """One value or key that the language does not take. ``path`` is its place.

    ``on_key`` says that the key is wrong, not its value; ``other`` is the key that it conflicts with. ``instead`` is
    the key or string that belongs there, where only one can be meant.
    """

    code: str
    path: Path
    message: str
    help: str = ""
    on_key: bool = False
    other: Path | None = None
    instead: str | None = None

    def finding(self, source: Source) -> Finding:
        """Return the finding at its place in the source."""
        span = source.at_key(self.path) if self.on_key else source.at(self.path)
        notes = [Note("the other one", source.at_key(self.other))] if self.other else []
        edits = [Edit(span, self.instead)] if self.instead is not None else []
        advice = self.help
        if self.code == "TF102" and source.is_variant:
            advice = _laid_over_nothing(source, self.path) or advice
        return finding(self.code, self.message, span, help=advice, notes=notes, edits=edits)


def _laid_over_nothing(source: Source, path: Path) -> str:
    """Return advice for an entry that a profile or an overlay adds, if it probably means one that is there."""
    around = source.places.get(path[:-1])
    names = list(around.keys) if around else []
    before = names[: names.index(path[-1])] if path and path[-1] in names else []
    return did_you_mean(str(path[-1]), before) if before else ""


def read(model: type[M], data: Any, already: Iterable[Path] = ()) -> tuple[M | None, list[Refusal]]:
    """Return the model of the data without what is refused, and the refusals.

    ``already`` are paths of what was refused before: it is left out, and so is what is refused only because of it. The
    model is None where a required key of the whole is missing.
    """
    refusals: list[Refusal] = []
    gone: set[Path] = set()
    rest = _without(data, already, gone)
    for attempt in range(_MAX_ATTEMPTS):
        if rest is None:
            break
        try:
            return model.model_validate(rest, context=None if attempt else FIRST), refusals
        except ValidationError as error:
            errors = [(_path_of(one["loc"], data), one) for one in error.errors(include_url=False)]
        follows = {path[:end] for path in gone for end in range(1, len(path) + 1)}
        new = [(path, one) for path, one in errors if path not in (gone if one["type"] in UNKNOWN_KEYS else follows)]
        refusals += _refusals(model, new, data)
        rest = _without(
            rest, [_culprit(path, one) for path, one in errors if not one.get("ctx", {}).get("keeps")], gone
        )
    return None, refusals


def _culprit(path: Path, error: ErrorDetails) -> Path:
    """Return the path of what has to go: of a key that is missing, the mapping that it is missing in."""
    return path[:-1] if error["type"] == "missing" else path


def _path_of(loc: tuple[int | str, ...], data: Any) -> Path:
    """Return the path in the file: pydantic's has labels of unions, and indexes where one item stands for a list."""
    steps: list[int | str] = []
    for step in loc:
        is_index = isinstance(step, int)
        if (isinstance(data, dict) and step in data) or (isinstance(data, list) and is_index):
            data = data[step]  # type: ignore[index]
        elif is_index or isinstance(data, list) or str(step).startswith("["):  # [key], and labels of unions
            continue
        else:
            data = None
        steps.append(step)
    return tuple(steps)


def _without(data: Any, paths: Iterable[Path], gone: set[Path]) -> Any:
    """Return the data without what is at the paths, or None if that is all of it; the paths are added to ``gone``.

    A list goes with one of its items. Nothing that is given changes.
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
    return _pruned(data, tree) if tree else data


#: Marks what goes as a whole.
_ALL: Any = {None: None}


def _existing(data: Any, path: Path) -> Path:
    """Return the path as far as it leads to something of its own: short forms and items of lists have no keys."""
    end = 0
    for count, step in enumerate(path, 1):
        if isinstance(data, dict) and step in data:
            end = count
        elif not (isinstance(data, list) and isinstance(step, int)):
            break
        data = data[step]
    return path[:end]


def _pruned(data: Any, tree: dict[Any, Any]) -> Any:
    if isinstance(data, list):
        return [_pruned(item, tree[index]) if index in tree else item for index, item in enumerate(data)]
    return {
        name: _pruned(item, tree[name]) if name in tree else item
        for name, item in data.items()
        if tree.get(name) is not _ALL
    }


def _refusals(model: type[Spec], errors: list[tuple[Path, ErrorDetails]], data: Any) -> list[Refusal]:
    """Return what pydantic refused in one turn, in this project's words."""
    unknown = [path for path, one in errors if one["type"] in UNKNOWN_KEYS]
    meant = Counter((path[:-1], _slip(model, path)) for path in unknown)
    return [
        _unknown_key(model, path, data, meant) if one["type"] in UNKNOWN_KEYS else _refusal(model, path, one)
        for path, one in errors
    ]


#: The kinds of errors for a key that a model, or a dataclass, does not have.
UNKNOWN_KEYS = frozenset({"extra_forbidden", "unexpected_keyword_argument"})


def _slip(model: type[Spec], path: Path) -> str | None:
    known = mapping_at(model, path[:-1])
    return slip_of(str(path[-1]), fields_of(known))


def _unknown_key(model: type[Spec], path: Path, data: Any, meant: Counter[tuple[Path, str | None]]) -> Refusal:
    """Return the refusal of a key; one that is there already, or is meant by two, is not proposed."""
    name, known = str(path[-1]), list(fields_of(mapping_at(model, path[:-1])))
    slip = _slip(model, path)
    around = data
    for step in path[:-1]:
        around = around[step]
    is_safe = slip not in around and meant[path[:-1], slip] == 1
    advice = f"did you mean {slip}?" if slip else _section(model, path) or habit(name, known)
    if not advice:
        listing = f"known here: {', '.join(known)}"
        option = f"an option of its preset goes under options: {{{name}: …}}; " if "options" in known else ""
        advice = did_you_mean(name, known, option + listing)
    return Refusal("TF101", path, f"unknown key {name}", advice, on_key=True, instead=slip if is_safe else None)


def _section(model: type[Spec], path: Path) -> str:
    """Return the help where an entry of a section has the name of a section: it is indented too far."""
    if len(path) != 3 or path[1] not in fields_of(model) or path[0] == "profiles":  # noqa: PLR2004 (section, entry, key)
        return ""
    return f"{path[1]} is a section of its own, not one of {path[0]}: indent it as {path[0]} is"


def _refusal(model: type[Spec], path: Path, error: ErrorDetails) -> Refusal:
    kind, value = error["type"], error["input"]
    context, on_key = error.get("ctx", {}), "[key]" in error["loc"]
    if kind.startswith("TF"):
        other = (*path[:-1], context["other"]) if "other" in context else None
        is_on_key = on_key or context.get("on_key", False)
        return Refusal(kind, path, context["message"], context["help"], is_on_key, other, context.get("instead"))
    if kind == "missing":
        field = fields_of(mapping_at(model, path[:-1]))[str(path[-1])]
        advice = f"for example {path[-1]}: {field.examples[0]}" if field.examples else ""
        return Refusal("TF102", path[:-1], f"{path[-1]} is missing", advice, on_key=True)
    if kind == "literal_error":
        allowed = [
            str(word) for one in kinds_of(at(model, path)) if get_origin(one) is Literal for word in get_args(one)
        ]
        advice = f"one of: {', '.join(allowed)}"
        advice = did_you_mean(value, allowed, advice) if isinstance(value, str) else advice
        return Refusal("TF106", path, f"{shown(value)} is not allowed here", advice, on_key)
    code, message, advice = WORDS.get(kind, UNFORESEEN)
    if kind == "string_type" and isinstance(value, (int, float)):
        advice = "put it in quotes"
    elif kind in {"model_type", "dataclass_type"}:
        advice = f"its keys can be: {', '.join(fields_of(mapping_at(model, path)))}"
    elif kind == "dict_type":
        advice = f"for example {_example_of(model, path)}"
    return Refusal(code, path, message.format(value=shown(value), **context), advice, on_key)


def _example_of(model: type[Spec], path: Path) -> str:
    """Return an example of a mapping with keys of the user's own, as YAML in one line."""
    around = mapping_at(model, path[:-1])
    field = fields_of(around).get(str(path[-1])) if around else None
    example = next((one for one in (field.examples or []) if isinstance(one, dict)), None) if field else None
    inside = ", ".join(f"{key}: {_in_yaml(value)}" for key, value in example.items()) if example else "NAME: {…}"
    return f"{path[-1]}: {{{inside}}}" if path else inside


def _in_yaml(value: Any) -> str:
    """Return a value as it is written in YAML, a plain word without quotes."""
    return value if isinstance(value, str) and value.replace("/", "").isidentifier() else shown(value)


#: pydantic's kinds of errors that the models can raise: code, message and help.
WORDS = {
    "bool_type": ("TF103", "{value} is not true or false", ""),
    "dataclass_type": ("TF103", "{value} is not a mapping", ""),
    "dict_type": ("TF103", "{value} is not a mapping", ""),
    "greater_than_equal": ("TF106", "{value} is less than {ge}", ""),
    "int_type": ("TF103", "{value} is not a whole number", ""),
    "less_than_equal": ("TF106", "{value} is greater than {le}", ""),
    "model_type": ("TF103", "{value} is not a mapping", ""),
    "string_type": ("TF103", "{value} is not a string", ""),
    "tuple_type": ("TF103", "{value} is not a list", ""),
}
#: For a kind that a later pydantic may bring.
UNFORESEEN = ("TF103", "{value} cannot stand here", "")
