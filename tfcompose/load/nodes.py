"""YAML text as a graph of nodes, built from PyYAML's parser events.

PyYAML's own composer recurses in C and a deeply nested text ends the interpreter; this one has a stack of its own and
stops at a depth that no robot needs. An alias is the node that it names, so a bomb of aliases stays small here.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import yaml

from tfcompose.diagnostic import Diagnostic, Note, RejectedError, Span, finding
from tfcompose.load.scalars import MAP, SEQ, STR, implicit_tag

if TYPE_CHECKING:
    from collections.abc import Iterator

DEEPEST = 40

#: NUL, which no file name, argument or variable can hold, and halves of characters, which no file can.
_FORBIDDEN = re.compile("[\0\ud800-\udfff]")

#: A scalar's items; one for all of them.
_NOTHING: list[Node] = []

_LOADER: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)


@dataclass(slots=True, eq=False)
class Node:
    """A scalar's text, a sequence's items, or a mapping's pairs, with a tag and a place."""

    kind: Literal["scalar", "sequence", "mapping"]
    tag: str
    span: Span
    text: str = ""
    plain: bool = False
    items: list[Node] = field(default_factory=list)

    @property
    def pairs(self) -> Iterator[tuple[Node, Node]]:
        """A mapping's keys and values, as written."""
        return zip(self.items[::2], self.items[1::2], strict=True)

    @property
    def is_merge(self) -> bool:
        """Whether this key is ``<<``."""
        return self.plain and self.text == "<<"


def compose(text: str, file: str) -> Node | None:
    """Return the root of the text's only document, or None if there is nothing in it.

    Raises:
        RejectedError: with one finding, where the text stops being YAML or is too deep.
    """
    return next(iter(_composed(text, file, single=True)), None)


def compose_all(text: str, file: str) -> list[Node]:
    """Return the roots of the text's documents.

    Raises:
        RejectedError: as ``compose`` does.
    """
    return _composed(text, file, single=False)


def _composed(text: str, file: str, *, single: bool) -> list[Node]:
    try:
        return _Composer(file, single=single).compose(text)
    except yaml.MarkedYAMLError as error:
        raise RejectedError([_syntax(error, text, file)]) from None
    except yaml.reader.ReaderError as error:
        hit = yaml.reader.Reader.NON_PRINTABLE.search(text)  # the C parser's position counts bytes
        position = hit.start() if hit else error.position
        line, column = text.count("\n", 0, position) + 1, position - text.rfind("\n", 0, position)
        span = Span(file, line, column, line, column + 1)
        raise RejectedError([finding("TF002", "a character that YAML does not allow", span)]) from None
    except UnicodeEncodeError as error:
        raise RejectedError([finding("TF001", f"the text is not Unicode: {error.reason}", Span(file))]) from None


class _Composer:
    def __init__(self, file: str, *, single: bool) -> None:
        self.file = file
        self.single = single
        self.anchors: dict[str, Node] = {}
        self.stack: list[Node] = []
        self.roots: list[Node] = []

    def compose(self, text: str) -> list[Node]:
        for event in yaml.parse(text, Loader=_LOADER):
            if type(event) is yaml.ScalarEvent:  # most of them are: asked first, and without a search
                self._add(self._scalar(event), event)
            elif isinstance(event, yaml.CollectionStartEvent):
                self._open(event)
            elif isinstance(event, yaml.CollectionEndEvent):
                node = self.stack.pop()
                node.span = _until(node.span, self._span(event))
            elif isinstance(event, yaml.AliasEvent):
                self._add(self._alias(event), None)
            elif isinstance(event, yaml.DocumentStartEvent):
                self.anchors = {}
                if self.single and self.roots:
                    message = "a second document begins here; a robot is one document"
                    raise RejectedError([finding("TF002", message, self._span(event))])
        return self.roots

    def _span(self, event: yaml.Event) -> Span:
        start, end = event.start_mark, event.end_mark
        if start is None or end is None:  # only for events that a program made
            return Span(self.file)
        return Span(self.file, start.line + 1, start.column + 1, end.line + 1, end.column + 1)

    def _add(self, node: Node, event: yaml.NodeEvent | None) -> None:
        if event is not None and event.anchor:
            self.anchors[event.anchor] = node
        if self.stack:
            self.stack[-1].items.append(node)
        else:
            self.roots.append(node)

    def _open(self, event: yaml.CollectionStartEvent) -> None:
        span = self._span(event)
        if len(self.stack) >= DEEPEST:
            raise RejectedError([finding("TF008", f"nested deeper than {DEEPEST} levels", span)])
        mapping = isinstance(event, yaml.MappingStartEvent)
        tag = event.tag if event.tag not in {None, "!"} else MAP if mapping else SEQ
        node = Node("mapping" if mapping else "sequence", tag, span)
        self._add(node, event)
        self.stack.append(node)

    def _scalar(self, event: yaml.ScalarEvent) -> Node:
        span, plain = self._span(event), event.implicit[0]
        if not plain and _FORBIDDEN.search(event.value):  # written as an escape
            raise RejectedError([finding("TF002", "a character that no text can hold", span)])
        if event.tag is not None and event.tag != "!":
            return Node("scalar", event.tag, span, event.value, False, _NOTHING)  # noqa: FBT003 (by place: there are many)
        tag = implicit_tag(event.value) if plain else STR
        return Node("scalar", tag, span, event.value, plain, _NOTHING)

    def _alias(self, event: yaml.AliasEvent) -> Node:
        if event.anchor not in self.anchors:
            message = f"no anchor &{event.anchor} stands above this alias"
            raise RejectedError([finding("TF002", message, self._span(event))])
        return self.anchors[event.anchor]


class Sizes:
    """How many values nodes hold once aliases are followed, counted without following them twice."""

    def __init__(self, most: int) -> None:
        self.most = most
        self._known: dict[int, int] = {}
        self._open: set[int] = set()

    def measure(self, node: Node) -> int:
        """Return the number of values that the node holds, itself too.

        Raises:
            ValueError: if there are more than ``most``, or the node holds itself; it says so in a sentence.
        """
        key = id(node)  # nodes live as long as their root
        if key in self._known:
            return self._known[key]
        if key in self._open or len(self._open) > DEEPEST:
            raise ValueError(
                "an alias stands inside what it names" if key in self._open else f"nested deeper than {DEEPEST} levels"
            )
        self._open.add(key)
        size = 1 + sum(self.measure(item) for item in node.items)
        self._open.remove(key)
        if size > self.most:
            raise ValueError(f"more than {self.most:,} values once aliases are followed")
        self._known[key] = size
        return size


def _until(start: Span, end: Span) -> Span:
    return Span(start.file, start.line, start.column, end.end_line, end.end_column)


def _syntax(error: yaml.MarkedYAMLError, text: str, file: str) -> Diagnostic:
    mark = error.problem_mark or error.context_mark
    line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
    message, advice = ", ".join(filter(None, (error.context, error.problem))), ""
    lines = text.splitlines()
    written = lines[line - 1] if line <= len(lines) else ""
    if "\t" in written[: len(written) - len(written.lstrip())]:
        message, advice = "a tab in the indentation", "indent with spaces; YAML does not allow tabs there"
    notes = []
    if error.context_mark and mark and error.context_mark.line != mark.line:
        at = error.context_mark
        notes = [Note("it began here", Span(file, at.line + 1, at.column + 1, at.line + 1, at.column + 2))]
    return finding("TF002", message, Span(file, line, column, line, column + 1), help=advice, notes=notes)
