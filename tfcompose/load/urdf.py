"""URDF text as elements with the place of every tag and attribute.

Read with the standard library's expat. Documents that declare entities or a type are refused: a robot needs neither,
and both can make a small file large or read other files.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from xml.parsers import expat

from tfcompose.diagnostic import RejectedError, Span, finding
from tfcompose.frozen import dataclass, field
from tfcompose.load.source import MOST_VALUES, refuse_unreadable

DEEPEST = 100

#: URDF says in about 600 characters what a robot file says in 200.
MOST_CHARACTERS = 16_000_000

_ATTRIBUTE = re.compile(r"""([^\s=/>"']+)\s*=\s*(?:"([^"]*)"|'([^']*)')""")
_BREAK = re.compile("\r\n|\r|\n")


@dataclass(slots=True, eq=False)
class Element:
    """A tag with its attributes; ``places`` are those of the attributes' values, ``raw`` is the element as written.

    ``text`` is what stands directly in it, where that was asked for.
    """

    tag: str
    at: Span
    attributes: dict[str, str] = field(default_factory=dict)
    places: dict[str, Span] = field(default_factory=dict)
    children: list[Element] = field(default_factory=list)
    raw: str = ""
    text: str = ""

    def all(self, tag: str) -> list[Element]:
        """Return the children of a tag."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> Element | None:
        """Return the first child of a tag, or None."""
        return next(iter(self.all(tag)), None)

    def place(self, name: str) -> Span:
        """Return the place of an attribute's value, or the element's where it is missing."""
        return self.places.get(name, self.at)


def load_xml(text: str, file: str, *, with_text: bool = False) -> Element:
    """Return the document's root; ``with_text``, elements have the text that stands in them too.

    Raises:
        RejectedError: if the text is not XML, declares entities, or is too large or too deep.
    """
    refuse_unreadable(text, file, MOST_CHARACTERS)
    reader = _Reader(text, file)
    if with_text:
        reader.parser.CharacterDataHandler = reader.add_text
    return reader.read()


class _Reader:
    def __init__(self, text: str, file: str) -> None:
        self.text, self.file = text, file
        self.data = text.encode()
        self.passed = (0, 0)  # how many bytes and characters stand before the last place that was asked for
        self.starts = [0, *(found.end() for found in _BREAK.finditer(text))]
        self.stack: list[Element] = []
        self.begins: list[tuple[int, int]] = []  # of each open tag: where it begins, and where its attributes end
        self.root: Element | None = None
        self.elements = 0
        self.parser = expat.ParserCreate("utf-8")
        self.parser.StartElementHandler = self._open
        self.parser.EndElementHandler = self._close
        self.parser.StartDoctypeDeclHandler = self._refuse_type

    def read(self) -> Element:
        try:
            self.parser.Parse(self.data, True)  # noqa: FBT003 (the last piece; it takes no keywords)
        except expat.ExpatError as error:
            at = self._span(self._position(self.parser.ErrorByteIndex), 1)
            said = expat.ErrorString(error.code) or "not XML"
            raise RejectedError([finding("TF018", said, at, help="mend it; other readers stop here too")]) from None
        if self.root is None:
            raise RejectedError([finding("TF018", "no element", Span(self.file))])
        return self.root

    def add_text(self, piece: str) -> None:
        if self.stack:
            self.stack[-1].text += piece

    def _refuse_type(self, *_: object) -> None:
        at = self._span(self._position(self.parser.CurrentByteIndex), 9)
        raise RejectedError([finding("TF018", "a document type, which can declare entities", at, help="remove it")])

    def _open(self, tag: str, attributes: dict[str, str]) -> None:
        begin = self._position(self.parser.CurrentByteIndex)
        self.elements += 1
        at = self._span(begin, len(tag) + 1)
        if self.elements > MOST_VALUES or len(self.stack) >= DEEPEST:
            what = f"more than {MOST_VALUES:,} elements" if self.elements > MOST_VALUES else f"deeper than {DEEPEST}"
            raise RejectedError([finding("TF008", what, at)])
        element = Element(tag, at, attributes)
        position = begin + 1 + len(tag)
        for _ in attributes:
            written = _ATTRIBUTE.search(self.text, position)
            if written is None:
                break
            group = 2 if written[2] is not None else 3
            element.places[written[1]] = self._span(written.start(group), len(written[group]) or 1)
            position = written.end()
        if self.stack:
            self.stack[-1].children.append(element)
        else:
            self.root = element
        self.stack.append(element)
        self.begins.append((begin, position))

    def _close(self, _: str) -> None:
        element = self.stack.pop()
        begin, after_attributes = self.begins.pop()
        if len(self.stack) != 1:  # of what stands in the root only
            return
        end = self.text.find(">", after_attributes)
        if self.text[end - 1] != "/":  # it has an end tag; of the others expat's versions give different places
            end = self.text.find(">", self._position(self.parser.CurrentByteIndex))
        element.raw = self.text[begin : end + 1]

    def _position(self, byte: int) -> int:
        """Return the character that begins at a byte; places are asked for in the order of the text."""
        bytes_before, characters = self.passed
        if byte > bytes_before:  # -1 in an empty text
            characters += len(self.data[bytes_before:byte].decode("utf-8", "ignore"))
            self.passed = (byte, characters)
        return characters

    def _span(self, begin: int, length: int) -> Span:
        end = min(begin + length, len(self.text))
        line, end_line = bisect_right(self.starts, begin), bisect_right(self.starts, end)
        return Span(self.file, line, begin - self.starts[line - 1] + 1, end_line, end - self.starts[end_line - 1] + 1)
