"""YAML text as plain data, with the place of every key and value.

A graph of nodes with marks is walked once. Nothing is constructed by tags, no code is run.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from tfcompose.diagnostic import Allow, Diagnostic, Note, RejectedError, Span, finding
from tfcompose.load.comments import allows_in
from tfcompose.load.nodes import DEEPEST, Node, Sizes, compose
from tfcompose.load.scalars import MAP, SCALAR_TAGS, SEQ, STR, TAG, scalar

Path = tuple[str | int, ...]

MOST_CHARACTERS = 4_000_000
MOST_VALUES = 400_000


@dataclass(frozen=True, slots=True)
class Source:
    """A file's plain data, where each key and value stands, and what was found on the way.

    ``values`` and ``keys`` map the path of a value to the places of the value and of its key; ``replaced`` has the
    place of the value that an overlay replaced there.
    """

    file: str
    data: dict[str, Any]
    values: dict[Path, Span]
    keys: dict[Path, Span]
    found: tuple[Diagnostic, ...] = field(default=(), compare=False)
    allows: tuple[Allow, ...] = field(default=(), compare=False)
    replaced: dict[Path, Span] = field(default_factory=dict, compare=False)

    def at(self, path: Path) -> Span:
        """Return the place of the value, or of the nearest mapping or list around it that has one."""
        return self._nearest(self.values, path)

    def at_key(self, path: Path) -> Span:
        """Return the place of the key, or of the nearest key around it."""
        return self._nearest(self.keys, path)

    def _nearest(self, table: dict[Path, Span], path: Path) -> Span:
        for length in range(len(path), -1, -1):
            if path[:length] in table:
                return table[path[:length]]
        return Span(self.file)

    def part(self, path: Path) -> Source:
        """Return the mapping at ``path`` as a source of its own, without what was found."""
        data: Any = self.data
        for step in path:
            data = data[step]
        n = len(path)
        values = {p[n:]: span for p, span in self.values.items() if p[:n] == path}
        keys = {p[n:]: span for p, span in self.keys.items() if p[:n] == path and len(p) > n}
        return Source(self.file, data, values, keys)


def load(text: str, file: str) -> Source:
    """Return the mapping that the YAML text holds.

    Raises:
        RejectedError: if the text is not YAML, not one document, not a mapping, or too large to be a robot.
    """
    refuse_unreadable(text, file)
    walk = Walk(file)
    node = compose(text, file)
    if node is None or node.kind != "mapping":
        what = "empty" if node is None else "a list" if node.kind == "sequence" else "a single value"
        span = node.span if node else Span(file)
        message = f"the file is {what}, not a mapping of keys and values"
        raise RejectedError([finding("TF002", message, span, help="a robot begins with: tfcompose: 1")])
    data = walk.value(node, ())
    return Source(file, data, walk.values, walk.keys, tuple(walk.found), allows_in(text, file))


def refuse_unreadable(text: str, file: str) -> None:
    """Do nothing for a text that can be a file of this language.

    Raises:
        RejectedError: if it is too large, or no text.
    """
    if len(text) > MOST_CHARACTERS:
        message = f"the file has {len(text):,} characters; a robot has at most {MOST_CHARACTERS:,}"
        raise RejectedError([finding("TF008", message, Span(file))])
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise RejectedError([finding("TF001", "not a text file: it holds a NUL byte", Span(file, line))])


class Walk:
    """One walk over a node graph: collects data, places and findings; bounded in size and depth."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.values: dict[Path, Span] = {}
        self.keys: dict[Path, Span] = {}
        self.found: list[Diagnostic] = []
        self.visits = 0
        self.sizes = Sizes(MOST_VALUES)

    def value(self, node: Node, path: Path) -> Any:
        """Return the node's plain data, and remember where all of it stands."""
        self._bound(node, len(path))
        self.values[path] = node.span
        if node.kind == "mapping":
            self._expect(node, MAP)
            return self._mapping(node, path)
        if node.kind == "sequence":
            self._expect(node, SEQ)
            return [self.value(item, (*path, index)) for index, item in enumerate(node.items)]
        return self._scalar(node)

    def _bound(self, node: Node, depth: int) -> None:
        self.visits += 1
        if depth > DEEPEST:
            message = f"nested deeper than {DEEPEST} levels"
        elif self.visits > MOST_VALUES:
            message = f"more than {MOST_VALUES:,} values once aliases are followed"
        else:
            return
        raise RejectedError([*self.found, finding("TF008", message, node.span)])

    def _measure(self, node: Node) -> None:
        """Refuse what is not walked because nothing uses it, where its aliases make it as long as a bomb."""
        if node.kind == "scalar":
            return
        try:
            self.sizes.measure(node)
        except ValueError as error:
            raise RejectedError([*self.found, finding("TF008", str(error), node.span)]) from None

    def _expect(self, node: Node, tag: str) -> None:
        if node.tag != tag:
            message = f"unknown tag {node.tag.replace(TAG, '!!')}"
            self.found.append(finding("TF005", message, node.span, help="tags are not used: leave it out"))

    def _scalar(self, node: Node) -> Any:
        tag = node.tag
        if tag not in SCALAR_TAGS:
            self._expect(node, STR)
            tag = STR
        try:
            return scalar(tag, node.text)
        except OverflowError as error:
            self.found.append(finding("TF007", str(error), node.span, help="give a finite number"))
            return 0.0
        except ValueError as error:
            self.found.append(finding("TF005", str(error), node.span, help="leave the tag out"))
            return node.text

    def _mapping(self, node: Node, path: Path) -> dict[str, Any]:
        data: dict[str, Any] = {}
        self._take(node, path, data)
        self._inherit(node, path, data, len(path))
        return data

    def _take(self, node: Node, path: Path, data: dict[str, Any]) -> None:
        """Take the mapping's own keys that ``data`` does not have; report those that it gives twice."""
        seen: dict[str, Span] = {}
        for key_node, value_node in node.pairs:
            key = key_node.text if key_node.is_merge else self._key(key_node)
            if key is None:
                continue
            if key in seen:
                note = Note("it stands here first", seen[key])
                self.found.append(finding("TF003", f"the key {key} is given twice", key_node.span, notes=[note]))
                continue
            seen[key] = key_node.span
            if key_node.is_merge or key in data:
                continue
            if not path and key.startswith("x-"):
                self._measure(value_node)
                continue
            at = (*path, key)
            self.keys[at] = key_node.span
            data[key] = self.value(value_node, at)

    def _inherit(self, node: Node, path: Path, data: dict[str, Any], depth: int) -> None:
        """Take what ``<<`` names for the keys that ``data`` does not have; the first mapping that has a key wins."""
        merges = [value for key, value in node.pairs if key.is_merge]
        for source in (item for merge in merges for item in (merge.items if merge.kind == "sequence" else [merge])):
            self._bound(source, depth + 1)
            if source.kind != "mapping":
                self.found.append(finding("TF011", "<< takes a mapping, or a list of mappings", source.span))
                continue
            self._take(source, path, data)
            self._inherit(source, path, data, depth + 1)

    def _key(self, node: Node) -> str | None:
        if node.tag == STR and node.kind == "scalar":
            return node.text
        what = "a number, true, false or null" if node.kind == "scalar" else "a list or a mapping"
        message = f"a key must be a text; this one is {what}"
        self.found.append(finding("TF004", message, node.span, help="put it in quotes"))
        return None
