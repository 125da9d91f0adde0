"""Text of a robot's overlay: one mount's pose replaced, and the history of what it replaced.

A mount's entry and its history are edited in place; all other text stays as it is, with its
comments and its line ends. Comments in a value that is replaced go above its key. The history is
the last section, ``x-adjustments``, which robot files may have and tfcompose does not read
otherwise::

    x-adjustments:
      sensors.eye:
        - {date: 2026-11-28T14:03:11Z, tool: calibrate, replaced: {xyz: [0, 0, 0], rpy: [0, 0, 0]}}
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from itertools import takewhile, zip_longest
from typing import TYPE_CHECKING, Any

import yaml

from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.yaml_text import flow
from tfcompose.spec.language.pose import ROTATIONS
from tfcompose.spec.load import load
from tfcompose.spec.load.editing import with_value

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tfcompose.spec.load import Path

#: The keys of an entry that a pose replaces.
POSE_KEYS = ("calibration", "xyz", *sorted(ROTATIONS))
HISTORY = "x-adjustments"
#: A section ends before the next key. Comments at the margin belong to it if more of it follows.
_MORE = r"(?:\n[ \t]*(?:#[^\n]*)?)*\n[ \t]+[^\s#]"
_SECTION = re.compile(
    rf"^{HISTORY}:[^\n]*(?:\n(?:[ \t][^\n]*|#[^\n]*(?={_MORE}))?)*", re.MULTILINE
)
_ABOUT = "# the poses that calibrate, nudge and prove replaced"
_BARE_END = re.compile(r"(?<!\r)\n")
_KEYS = frozenset({"date", "tool", "from", "replaced", "before"})
#: Quoted text, or a comment, which is the group.
_COMMENT = re.compile(
    r"""(?<![^\s\[{,:])(?:"(?:[^"\\]|\\.)*"|'(?:[^']|'')*')|(?:^|\s)(#[^\n]*)""", re.MULTILINE
)
_ALIAS = re.compile(r"\s*\*[^\s,\]}]+")


class OverlayTextError(ValueError):
    """The text cannot be edited without changing something else."""


@dataclass(frozen=True, slots=True)
class OverlayChange:
    """One change of a mount's pose in an overlay."""

    #: In UTC, as in ISO 8601.
    date: str
    #: The command that wrote the new pose.
    tool: str
    #: The pose that was replaced, in the terms of the mount's entry: ``xyz`` and ``rpy``.
    replaced: Mapping[str, Any]
    #: Where the new pose is from, such as a calibration file; empty: from the user.
    source: str = ""
    #: The keys of the pose that the overlay had before; none if it had no pose of the mount.
    before: Mapping[str, Any] = field(default_factory=dict)
    #: Further keys that the user added.
    further: Mapping[str, Any] = field(default_factory=dict)

    def keys_before(self) -> dict[str, str]:
        """Return the keys of the pose that the overlay had before, as YAML."""
        return {key: flow(value) for key, value in self.before.items()}

    def as_data(self) -> dict[str, Any]:
        """Return it as it is in the file."""
        data: dict[str, Any] = {"date": self.date, "tool": self.tool}
        if self.source:
            data["from"] = self.source
        data["replaced"] = dict(self.replaced)
        if self.before:
            data["before"] = dict(self.before)
        return {**data, **self.further}


@dataclass(frozen=True, slots=True)
class OverlayText:
    """An overlay's text without its history, and the history by the mount's entry.

    In both texts, lines end with a line feed.
    """

    text: str
    #: The oldest first, by the dotted path of the entry.
    history: Mapping[str, tuple[OverlayChange, ...]]
    #: The text of the history; empty if there is none.
    section: str = ""
    #: The end of lines in the file.
    line_end: str = "\n"

    def pose_of(self, entry: Path, file: str) -> dict[str, Any]:
        """Return the keys of a mount's pose in this overlay itself.

        Raises:
            RejectedError: if the text is not YAML.
        """
        mapping: Any = load(self.text, file).data if _has_content(self.text) else {}
        for step in entry:
            mapping = mapping.get(step) if isinstance(mapping, dict) else None
        if not isinstance(mapping, dict):
            return {}
        return {key: value for key, value in mapping.items() if key in POSE_KEYS}

    def with_pose(self, entry: Path, file: str, pose: Mapping[str, str]) -> OverlayText:
        """Return the overlay with these keys, as YAML, as the pose of a mount; none: without one.

        Raises:
            OverlayTextError: if that would change something else.
            RejectedError: if the text is not YAML.
        """
        findings = len(load(self.text, file).findings) if _has_content(self.text) else 0
        expected = _values(self.text)
        _set_pose(expected, entry, pose)
        try:
            text = _edit(self.text, file, entry, pose)
            new = len(load(text, file).findings) if _has_content(text) else 0
            same = new <= findings and _values(text) == expected
        except (RejectedError, yaml.YAMLError):
            same = False
        if not same:
            raise OverlayTextError(f"the entry {'.'.join(map(str, entry))} is not on its own")
        return replace(self, text=text)

    def with_history(self, entry: Path, adjustments: Sequence[OverlayChange]) -> OverlayText:
        """Return the overlay with this history of a mount."""
        name, new = _name(entry), tuple(adjustments)
        history = {**self.history, name: new}
        history = {name: items for name, items in history.items() if items}
        fresh = _history_text(history, _comments(self.section, 0, len(self.section)))
        try:
            section = _edit_history(self.section, name, self.adjustments(entry), new)
            is_edited = _is_same(_history(section, ""), history)
        except (RejectedError, yaml.YAMLError, LookupError, ValueError):  # not as written here
            is_edited = False
        section = section if is_edited else fresh
        comments = {*_comments(section, 0, len(section))} - {_ABOUT}
        return replace(self, history=history, section=section if history or comments else "")

    def adjustments(self, entry: Path) -> tuple[OverlayChange, ...]:
        """Return the history of a mount."""
        return self.history.get(_name(entry), ())

    def render(self, file: str) -> str:
        """Return the text of the file.

        Raises:
            OverlayTextError: if a section cannot be added at its end.
        """
        text = self._render().replace("\n", self.line_end)
        try:
            load(text, file)
            same = _values(text).items() >= _values(self.text).items()
            same = same and read_overlay(text, file).history.keys() == self.history.keys()
        except (RejectedError, yaml.YAMLError):
            same = False
        if not same:
            raise OverlayTextError("it is one mapping in braces, or ends with ...")
        return text

    def _render(self) -> str:
        text = self.text if not self.text or self.text.endswith("\n") else f"{self.text}\n"
        if not _values(text):
            text += "tfcompose: 1\n"  # a file that holds nothing is no overlay
        return text.rstrip("\n") + "\n\n" + self.section if self.section else text


def read_overlay(text: str, file: str) -> OverlayText:
    """Return a robot's overlay; an empty text is one that is not there yet.

    Raises:
        OverlayTextError: if its history has another form.
        RejectedError: if it is not YAML.
    """
    line_end = "\r\n" if "\n" in text and not _BARE_END.search(text) else "\n"
    text = text.replace("\r\n", "\n") if line_end == "\r\n" else text
    section = _SECTION.search(text)
    if section is None:
        return OverlayText(text, {}, line_end=line_end)
    rest = text[: section.start()].rstrip("\n") + "\n" + text[section.end() :]
    above = "\n" * text[: section.start()].count("\n")
    history = _history(section[0], file, above)
    return OverlayText(rest.lstrip("\n"), history, section[0].rstrip() + "\n", line_end)


def _history(section: str, file: str, above: str = "") -> dict[str, tuple[OverlayChange, ...]]:
    """Return the history in a section, which is below the lines ``above``.

    Raises:
        OverlayTextError: if it has another form.
        RejectedError: if it is not YAML.
    """
    if not section:
        return {}
    data = load(f"{above}history:{section.removeprefix(f'{HISTORY}:')}", file).data["history"]
    try:
        return {name: tuple(map(_adjustment, items)) for name, items in (data or {}).items()}
    except (AttributeError, KeyError, TypeError, ValueError):
        raise OverlayTextError(f"{HISTORY} was edited: remove it") from None


def _adjustment(data: Mapping[str, Any]) -> OverlayChange:
    return OverlayChange(
        date=data["date"],
        tool=data["tool"],
        replaced=dict(data["replaced"]),
        source=data.get("from", ""),
        before=dict(data.get("before", {})),
        further={key: value for key, value in data.items() if key not in _KEYS},
    )


def _is_same(
    history: Mapping[str, Sequence[OverlayChange]], expected: Mapping[str, Sequence[OverlayChange]]
) -> bool:
    """Return whether two histories have the same values in a file."""
    texts = [
        {name: [flow(item.as_data()) for item in items] for name, items in each.items()}
        for each in (history, expected)
    ]
    return texts[0] == texts[1]


def _history_text(history: Mapping[str, Sequence[OverlayChange]], comments: Sequence[str]) -> str:
    """Return a new section with these comments, without those of its head."""
    lines = [f"{HISTORY}:   {_ABOUT}", *(f"  {text}" for text in comments if text != _ABOUT)]
    for name, items in history.items():
        lines += [f"  {flow(name)}:", *(f"    - {flow(item.as_data())}" for item in items)]
    return "\n".join(lines) + "\n"


def _edit_history(
    section: str, name: str, old: Sequence[OverlayChange], new: Sequence[OverlayChange]
) -> str:
    """Return a section in which the lines of a mount's changes are edited where they differ."""
    added = _history_text({name: new}, []) if new else ""
    if not section:
        return added
    root: Any = yaml.compose(section, Loader=yaml.BaseLoader)
    mapping = root.value[0][1]
    pairs = mapping.value if isinstance(mapping, yaml.MappingNode) else []
    pair = next((each for each in pairs if each[0].value == name), None)
    if pair is None:
        return section + added.partition("\n")[2]
    value = pair[1]
    if not new:
        return _apply(section, [_pair_removal(section, mapping, *pair)])
    same = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(old, new, strict=False)))
    indent, edits = " " * value.start_mark.column, []
    for node, item in zip_longest(value.value[same:], new[same:]):
        line = f"{indent}- {flow(item.as_data())}\n" if item else ""
        last = node or value.value[-1]
        end = section.find("\n", _end(last)) + 1 or len(section)
        begin = section.rindex("\n", 0, last.start_mark.index) + 1 if node else end
        comments = _comments(section, begin, end)
        edits.append((begin, end, "".join(f"{indent}{text}\n" for text in comments) + line))
    return _apply(section, edits)


def _apply(text: str, edits: Sequence[tuple[int, int, str]]) -> str:
    for begin, end, new in sorted(edits, reverse=True):
        text = text[:begin] + new + text[end:]
    return text


def _name(entry: Path) -> str:
    return ".".join(map(str, entry))


def _values(text: str) -> dict[str, Any]:
    """Return what the text holds, also under ``x-``, with scalars as text and ``<<`` as a key."""
    data = yaml.load(text, yaml.BaseLoader)  # noqa: S506 (it constructs text, lists and mappings)
    return _copy(data) if isinstance(data, dict) else {}


def _copy(value: Any) -> Any:
    """Return a copy in which aliases are values of their own."""
    if isinstance(value, dict):
        return {key: _copy(item) for key, item in value.items()}
    return [*map(_copy, value)] if isinstance(value, list) else value


def _has_content(text: str) -> bool:
    return any(line.strip() and not line.lstrip().startswith("#") for line in text.splitlines())


def _set_pose(data: dict[str, Any], entry: Path, pose: Mapping[str, str]) -> None:
    """Replace the pose of an entry; what is empty then is removed."""
    parents: list[dict[str, Any]] = [data]
    for step in entry:
        below = parents[-1].get(str(step))
        if not isinstance(below, dict):
            below = {}
            parents[-1][str(step)] = below
        parents.append(below)
    for key in POSE_KEYS:
        parents[-1].pop(key, None)
    parents[-1].update({key: _value(value) for key, value in pose.items()})
    for parent, step in reversed([*zip(parents[:-1], entry, strict=True)]):
        if not parent[str(step)]:
            del parent[str(step)]


def _value(text: str) -> Any:
    return yaml.load(text, yaml.BaseLoader)  # noqa: S506 (as above)


def _edit(text: str, file: str, entry: Path, pose: Mapping[str, str]) -> str:
    """Return the text with the pose in place; keys that are not there are added."""
    root = yaml.compose(text, Loader=yaml.BaseLoader) if _has_content(text) else None
    if root is None:
        return with_value(text, file, entry, pose) if pose else text
    chain = [root]
    for step in entry:
        below = _child(chain[-1], str(step))
        if below is None:
            break
        chain.append(below)
    rest = dict(pose)
    edits: list[tuple[int, int, str]] = []
    if len(chain) > len(entry):
        edits, rest = _entry_edits(text, chain, entry, pose)
    elif not isinstance(chain[-1], yaml.MappingNode) or not chain[-1].value:
        depth = len(chain) - 1  # an empty mapping or null: written anew
        edits = [_removal(text, chain[:depth], entry[:depth])]
    text = _apply(text, edits)
    return with_value(text, file, entry, rest) if rest else text


def _entry_edits(
    text: str, chain: list[Any], entry: Path, pose: Mapping[str, str]
) -> tuple[list[tuple[int, int, str]], dict[str, str]]:
    """Return the edits of an entry that is there, and the keys that remain to be added."""
    node = chain[-1]
    pairs = node.value if isinstance(node, yaml.MappingNode) else []
    existing = {key.value: (key, value) for key, value in pairs}
    stale = [pair for key, pair in existing.items() if key in POSE_KEYS and key not in pose]
    rest = {key: value for key, value in pose.items() if key not in existing}
    if not existing or (not pose and len(stale) == len(existing)):
        return [_removal(text, chain[:-1], entry)], rest
    edits = [
        _replacement(text, *existing[key], value) for key, value in pose.items() if key in existing
    ]
    renamed = [*zip(stale, [*rest], strict=False)]
    for (old, value), key in renamed:
        _, end, new = _replacement(text, old, value, rest.pop(key))
        edits.append((old.start_mark.index, end, f"{key}:{new}"))
    removed = stale[len(renamed) :]
    edits += [
        _comments_above(text, node, *pair)
        for key, pair in existing.items()
        if key in POSE_KEYS and (node.flow_style or pair not in removed)
    ]
    return [*edits, *(_pair_removal(text, node, *pair) for pair in removed)], rest


def _removal(text: str, chain: list[Any], path: Path) -> tuple[int, int, str]:
    """Return the edit that removes the entry at a path, and the mappings that become empty."""
    depth = len(path) - 1
    while depth and len(chain[depth].value) == 1:
        depth -= 1
    for key, value in chain[depth].value:
        if key.value == str(path[depth]):
            return _pair_removal(text, chain[depth], key, value)
    raise OverlayTextError("the entry is not on its own")


def _child(node: Any, name: str) -> Any:
    pairs = node.value if isinstance(node, yaml.MappingNode) else []
    return next((value for key, value in pairs if key.value == name), None)


def _replacement(text: str, key: Any, value: Any, new: str) -> tuple[int, int, str]:
    """Return the edit that replaces everything behind a key's colon by a value on its line.

    A comment behind the colon remains.
    """
    begin, end = text.index(":", key.end_mark.index) + 1, _value_end(text, key, value)
    between = text[begin : _line_end(text, key, value)].rstrip()
    return begin, end, f" {new}" + (f"  {between.lstrip()}" if "#" in between else "")


def _comments_above(text: str, node: Any, key: Any, value: Any) -> tuple[int, int, str]:
    """Return the edit that puts the comments inside a value above its key, or its braces."""
    line = text.rfind("\n", 0, (node if node.flow_style else key).start_mark.index) + 1
    rest = text[line:]
    indent = rest[: len(rest) - len(rest.lstrip(" "))]
    comments = _comments(text, _line_end(text, key, value), _value_end(text, key, value))
    return line, line, "".join(f"{indent}{comment}\n" for comment in comments)


def _line_end(text: str, key: Any, value: Any) -> int:
    """Return where the line of a key ends, or the value begins in it."""
    begin = text.index(":", key.end_mark.index) + 1
    start = max(begin, int(value.start_mark.index))
    line_end = text.find("\n", begin, start)
    return start if line_end < 0 else line_end


def _comments(text: str, begin: int, end: int) -> list[str]:
    """Return the comments in a part of YAML text."""
    return [match[1] for match in _COMMENT.finditer(text, begin, end) if match[1]]


def _value_end(text: str, key: Any, value: Any) -> int:
    """Return where a value ends in the text, without the comments behind it."""
    alias = _ALIAS.match(text, text.index(":", key.end_mark.index) + 1)
    return alias.end() if alias else _end(value)


def _end(node: Any) -> int:
    """Return where a node's text ends: a block ends with the last value in it."""
    if isinstance(node, yaml.ScalarNode) or node.flow_style or not node.value:
        return int(node.end_mark.index)
    last = node.value[-1]
    return _end(last[1] if isinstance(last, tuple) else last)


def _pair_removal(text: str, node: Any, key: Any, value: Any) -> tuple[int, int, str]:
    """Return the edit that removes a key with its value; in block style comments remain."""
    begin, end = key.start_mark.index, _value_end(text, key, value)
    if node.flow_style:
        later = re.compile(r"\s*,[ \t]*").match(text, end)
        if later:
            return begin, later.end(), ""
        earlier = re.compile(r"\s*,\s*\Z").search(text[:begin])
        return (earlier.start() if earlier else begin), end, ""
    line_end = text.find("\n", end) + 1 or len(text)
    comments = _comments(text, begin, line_end)
    indent = " " * key.start_mark.column
    return begin - len(indent), line_end, "".join(f"{indent}{line}\n" for line in comments)
