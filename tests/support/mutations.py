"""Seeded mutations of YAML texts: what people get wrong, one to four times in a file.

The place of each key and value comes from PyYAML's own nodes, so that most results are YAML again.
The same name gives the same text on every Python: only ``random()`` of a generator seeded with a
text is used.
"""

import random
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeVar

import yaml

T = TypeVar("T")

#: Values in the place of another: other types, other dimensions, no numbers, no expressions,
#: nested wrongly.
VALUES = (
    "null", "true", "maybe", "3", "-1", "0", "1e400", ".nan", "''", "{}", "[]", "{a: 1}", "[1, 2]", "[[1], 2]",  # noqa: E501 (a text as its reader has it)
    "3 kg", "10 degrees", "5 cmm", "2 Hz", "-4 cm", "1e308 km", "30 °", "'3,5 m'", "12:30", "2020-01-01", "0x1F", "012",  # noqa: E501 (a text as its reader has it)
    "'${nope}'", "'${1/0}'", "'${'", "'${1 m + 1 kg}'", "'${frame(a)}'", "*nowhere", "!degrees 5", "a: b", "base_link",  # noqa: E501 (a text as its reader has it)
    "9999999999999999999999", "~/x", "'a b'", "ü", "[{}, null]", "{xyz: [1, 2, 3], rpy: zero}",
)  # fmt: skip

#: Entries that a mapping may have no use for: unknown keys, keys of other places, and second
#: choices.
ENTRIES = (
    "xzy: [0, 0, 0]", "nmae: x", "extra: 1", "rpy: [0, 0, 0]", "look: up", "look: {down: 1, up: 1}",  # noqa: E501 (a text as its reader has it)
    "quat_xyzw: [0, 0, 0, 2]", "axis_angle: {axis: [0, 0, 0], angle: 1}", "matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 2]]",  # noqa: E501 (a text as its reader has it)
    "run: [x]", "simulate: {circle: {}}", "external: true", "launch: a/b.launch.py", "parent: nowhere", "parent: null",  # noqa: E501 (a text as its reader has it)
    "owner: nobody", "rate: 0", "rate: 10 s", "type: hinge", "preset: generic/lidar2", "options: {streem: [color]}",  # noqa: E501 (a text as its reader has it)
    "box: [1, 1]", "sphere: {radius: -1}", "mass: 3 m", "static: 1", "xyz: [1, 2]", "xyz: [1, 2, 3, 4]",  # noqa: E501 (a text as its reader has it)
    "limit: {lower: x}", "ready: {exit: 300}", "restart: sometimes", "when: {tf: x}", "x-note: 1", "3: 4", "[a]: b",  # noqa: E501 (a text as its reader has it)
    "null: 1", "'': {}",
)  # fmt: skip


@dataclass(frozen=True)
class Spot:
    """A key with its value, or an item of a list (without a key), as offsets in the text."""

    key: tuple[int, int] | None
    value: tuple[int, int]
    is_scalar: bool
    is_flow: bool
    entry: tuple[int, int]


class Chooser:
    """Random choices from a text as the seed."""

    def __init__(self, seed: str) -> None:
        self._random = random.Random(seed).random

    def below(self, count: int) -> int:
        """Return a number from 0 to count - 1."""
        return int(self._random() * count)

    def pick(self, items: Sequence[T]) -> T:
        """Return one of the items."""
        return items[self.below(len(items))]


def mutated(text: str, seed: str) -> str:
    """Return the text with one to four faults, or, once in ten times, with a dozen."""
    chooser = Chooser(seed)
    faults = 12 if chooser.below(10) == 0 else (1, 1, 1, 2, 3, 4)[chooser.below(6)]
    spots = _spots(text)
    if not spots:
        return _other_word(text, chooser)
    after = len(text) + 1
    for spot in sorted(
        (chooser.pick(spots) for _ in range(faults)), key=lambda spot: spot.entry, reverse=True
    ):
        if spot.entry[1] < after:  # else it holds what has been changed
            text = chooser.pick(KINDS)(text, spot, chooser)
            after = spot.entry[0]
    return text


def _other_word(text: str, chooser: Chooser) -> str:
    """Change a word of a text that is no tree: rows of numbers, a launch file."""
    words = re.split(r"(\s+)", text)
    index = 2 * chooser.below((len(words) + 1) // 2)
    words[index] = chooser.pick(
        (chooser.pick(VALUES), _slip(words[index], chooser), "", f"{words[index]} {words[index]}")
    )
    return "".join(words)


@lru_cache(maxsize=8)
def _spots(text: str) -> tuple[Spot, ...]:
    """Return the entries of all mappings and lists; none of a text that is no tree."""
    try:
        return tuple(_below(yaml.compose(text, Loader=yaml.SafeLoader), text))
    except yaml.YAMLError:
        return ()


def _below(root: Any, text: str) -> Iterator[Spot]:
    observed: set[int] = set()
    stack: list[Any] = [root]
    while stack:
        node = stack.pop()
        if node is None or id(node) in observed:
            continue
        observed.add(id(node))
        if isinstance(node, yaml.MappingNode):
            pairs = [
                (key, value)
                for key, value in node.value
                if key.start_mark.index <= value.start_mark.index
            ]
            for key, value in pairs:
                begin, end = key.start_mark.index, _end(text, value)
                yield _spot(node, (begin, key.end_mark.index), value, (begin, end), text)
            stack += [value for _, value in reversed(pairs)]
        elif isinstance(node, yaml.SequenceNode):
            for item in node.value:
                yield _spot(node, None, item, (item.start_mark.index, _end(text, item)), text)
            stack += reversed(node.value)


def _spot(
    parent: Any, key: tuple[int, int] | None, value: Any, entry: tuple[int, int], text: str
) -> Spot:
    span = (value.start_mark.index, _end(text, value))
    return Spot(key, span, isinstance(value, yaml.ScalarNode), bool(parent.flow_style), entry)


def _end(text: str, node: Any) -> int:
    """Return where the node's text ends.

    PyYAML's mark of a block stands behind the blank lines and comments.
    """
    end: int = node.end_mark.index
    if isinstance(node, yaml.ScalarNode) or node.flow_style:
        return end
    return max((_end(text, inner) for inner in _inside(node)), default=end)


def _inside(node: Any) -> list[Any]:
    if isinstance(node, yaml.MappingNode):
        return [
            value for key, value in node.value if key.start_mark.index <= value.start_mark.index
        ]
    return list(node.value)


def _with(text: str, span: tuple[int, int], new: str) -> str:
    return text[: span[0]] + new + text[span[1] :]


def _delete(text: str, spot: Spot, _: Chooser) -> str:
    begin, end = spot.entry
    if spot.is_flow:
        rest = text[end:].lstrip()
        end += len(text[end:]) - len(rest) + (1 if rest.startswith(",") else 0)
        return text[:begin] + text[end:].lstrip(" ")
    if spot.key is None:
        return text[:begin] + "null" + text[end:]
    line = text.rfind("\n", 0, begin) + 1
    stop = text.find("\n", end)
    return (
        text[:line] + (text[stop + 1 :] if stop >= 0 else "")
        if not text[line:begin].strip()
        else text
    )


def _duplicate(text: str, spot: Spot, _: Chooser) -> str:
    begin, end = spot.entry
    entry = text[begin:end]
    if spot.is_flow:
        return text[:end] + ", " + entry + text[end:]
    indent = text[text.rfind("\n", 0, begin) + 1 : begin]
    return text[:end] + "\n" + indent + entry + text[end:]


def _slip(word: str, chooser: Chooser) -> str:
    if not word:
        return "x"
    index = chooser.below(len(word))
    kind = chooser.below(5)
    if kind == 0:
        return word[:index] + word[index + 1 :]
    if kind == 1:
        return word[:index] + word[index] + word[index:]
    if kind == 2:
        return word[:index] + word[index : index + 2][::-1] + word[index + 2 :]
    if kind == 3:
        return word[:index] + word[index].swapcase() + word[index + 1 :]
    return word[:index] + chooser.pick("abeinorst_") + word[index + 1 :]


def _rename(text: str, spot: Spot, chooser: Chooser) -> str:
    span = spot.key or spot.value
    return (
        _with(text, span, _slip(text[slice(*span)], chooser))
        if spot.key or spot.is_scalar
        else text
    )


def _misspell(text: str, spot: Spot, chooser: Chooser) -> str:
    return (
        _with(text, spot.value, _slip(text[slice(*spot.value)], chooser))
        if spot.is_scalar
        else text
    )


def _other_value(text: str, spot: Spot, chooser: Chooser) -> str:
    return _with(text, spot.value, chooser.pick(VALUES))


def _null(text: str, spot: Spot, chooser: Chooser) -> str:
    return _with(text, spot.value, chooser.pick(("null", "", "~")))


def _nested(text: str, spot: Spot, chooser: Chooser) -> str:
    value = text[slice(*spot.value)]
    if not spot.is_flow and not spot.is_scalar and not value.startswith(("{", "[")):
        return _with(text, spot.value, f"[{value.split(':')[0]}]")
    return _with(
        text,
        spot.value,
        chooser.pick(("[{}]", "{{value: {}}}", "[{}, {}]", "'{}'")).replace("{}", value),
    )


def _entry(text: str, spot: Spot, chooser: Chooser) -> str:
    """Add an entry to the mapping that holds the spot, or to the one that is its value."""
    new = chooser.pick(ENTRIES)
    begin, _ = spot.entry
    if text[spot.value[0]] == "{" and chooser.below(2):
        inner = spot.value[0] + 1
        return text[:inner] + new + ("" if text[inner] == "}" else ", ") + text[inner:]
    if spot.is_flow:
        return text[:begin] + new + ", " + text[begin:]
    return text[:begin] + new + "\n" + text[text.rfind("\n", 0, begin) + 1 : begin] + text[begin:]


def _swapped(text: str, spot: Spot, chooser: Chooser) -> str:
    """Put the value of another place here."""
    values = re.findall(r": ([^\n:{}\[\],#]+)", text)
    return _with(text, spot.value, chooser.pick(values).strip()) if values else text


def _unit(text: str, spot: Spot, chooser: Chooser) -> str:
    value = text[slice(*spot.value)].strip("'\"")
    number = value.split(" ", maxsplit=1)[0]
    unit = chooser.pick(
        (
            "cm",
            "deg",
            "kg",
            "s",
            "Hz",
            "metre",
            "degrees",
            "rad/s",
            "Nm",
            "mm mm",
            "CM",
            "m/s",
            "%",
        )
    )
    return (
        _with(text, spot.value, f"{number} {unit}") if number[:1] in set("-.0123456789") else text
    )


KINDS: tuple[Callable[[str, Spot, Chooser], str], ...] = (
    _delete, _duplicate, _rename, _rename, _misspell, _other_value, _other_value, _null, _nested, _entry, _entry,  # noqa: E501 (a text as its reader has it)
    _swapped, _unit, _unit,
)  # fmt: skip
