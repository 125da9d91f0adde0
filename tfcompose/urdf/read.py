"""XML text as elements that know the place of every tag and attribute.

Own code on expat, because no XML library gives the columns of attributes. Documents that declare entities or a document
type are refused: a robot needs neither, and both can make a small file large or read other files.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from itertools import accumulate
from typing import TYPE_CHECKING
from xml.parsers import expat

from tfcompose.findings import RejectedError, Span, finding
from tfcompose.load import MOST_VALUES, refuse_unreadable

if TYPE_CHECKING:
    from collections.abc import Iterator

DEEPEST = 100

#: Four times what a robot file may have: URDF takes about three times as many characters for the same robot.
MOST_CHARACTERS = 16_000_000

_ATTRIBUTE = re.compile(r"""([^\s=/>"']+)\s*=\s*(?:"([^"]*)"|'([^']*)')""")
_BROKEN = re.compile(r"""=\s*(?:"[^"<>]*[\t\r\n]|'[^'<>]*[\t\r\n])""")
_BREAK = re.compile("\r\n|\r|\n")
#: The bytes that begin no character in UTF-8.
_INSIDE = bytes(range(0x80, 0xC0))
_BLOCK = 4096


class _Text:
    """A file's text, with the places of its bytes: few are asked for, and they are computed only then."""

    def __init__(self, text: str, file: str) -> None:
        self.text, self.file = text, file
        self.data = text.encode()
        self.starts = [0, *(found.end() for found in _BREAK.finditer(text))]
        self.has_broken_values = _BROKEN.search(text) is not None
        self.before: list[int] = []  # the characters before each block of bytes; none where each byte is a character
        if len(self.data) != len(text):
            lengths = (_characters(self.data[at : at + _BLOCK]) for at in range(0, len(self.data), _BLOCK))
            self.before = list(accumulate(lengths, initial=0))

    def position(self, byte: int) -> int:
        """Return the character that begins at a byte."""
        if not self.before or byte <= 0:  # -1 in an empty text
            return max(byte, 0)
        block = byte // _BLOCK
        return self.before[block] + _characters(self.data[block * _BLOCK : byte])

    def span(self, begin: int, length: int) -> Span:
        """Return the place of so many characters."""
        end = min(begin + length, len(self.text))
        line, end_line = bisect_right(self.starts, begin), bisect_right(self.starts, end)
        return Span(self.file, line, begin - self.starts[line - 1] + 1, end_line, end - self.starts[end_line - 1] + 1)


def _characters(data: bytes) -> int:
    return len(data.translate(None, _INSIDE))


class Element:
    """A tag with its attributes and child elements; ``text`` is its own text, if it was asked for.

    ``begin`` and ``end`` are the bytes at which its first and its last tag begin.
    """

    __slots__ = ("_source", "attributes", "begin", "children", "end", "tag", "text")

    def __init__(self, tag: str, attributes: dict[str, str], source: _Text, begin: int) -> None:
        self.tag, self.attributes = tag, attributes
        self.children: list[Element] = []
        self.text = ""
        self.begin = self.end = begin
        self._source = source

    @property
    def at(self) -> Span:
        """The place of its tag."""
        return self._source.span(self._source.position(self.begin), len(self.tag) + 1)

    @property
    def raw(self) -> str:
        """The element's source text."""
        text, begin = self._source.text, self._source.position(self.begin)
        after = max((attribute.end() for attribute in self._raw_attributes()), default=begin)
        end = text.find(">", after)
        if text[end - 1] != "/":  # it has an end tag; of the others expat's versions give different places
            end = text.find(">", self._source.position(self.end))
        return text[begin : end + 1]

    def all(self, tag: str) -> list[Element]:
        """Return the children of a tag."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> Element | None:
        """Return the first child of a tag, or None."""
        for child in self.children:
            if child.tag == tag:
                return child
        return None

    def at_value(self, name: str) -> Span:
        """Return the place of an attribute's value, or the element's where it is missing."""
        for attribute in self._raw_attributes():
            if attribute[1] == name:
                group = 2 if attribute[2] is not None else 3
                return self._source.span(attribute.start(group), len(attribute[group]) or 1)
        return self.at

    def raw_value(self, name: str) -> str:
        """Return an attribute's value as in the source: XML turns tabs and line breaks in it into spaces."""
        return next((found[2] or found[3] or "" for found in self._raw_attributes() if found[1] == name), "")

    @property
    def has_broken_values(self) -> bool:
        """Whether in the file a value of some attribute holds a tab or a line break."""
        return self._source.has_broken_values

    def _raw_attributes(self) -> Iterator[re.Match[str]]:
        """Yield the attributes as they are in the source."""
        position = self._source.position(self.begin) + 1 + len(self.tag)
        for _ in self.attributes:
            attribute = _ATTRIBUTE.search(self._source.text, position)
            if attribute is None:
                return
            yield attribute
            position = attribute.end()


def read_xml(text: str, file: str, *, with_text: bool = False) -> Element:
    """Return the document's root; ``with_text``, elements have their own text too.

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
        self.source = _Text(text, file)
        self.stack: list[Element] = []
        self.root: Element | None = None
        self.elements = 0
        self.parser = expat.ParserCreate("utf-8")
        self.parser.StartElementHandler = self._open
        self.parser.EndElementHandler = self._close
        self.parser.StartDoctypeDeclHandler = self._refuse_type

    def read(self) -> Element:
        try:
            self.parser.Parse(self.source.data, True)  # noqa: FBT003 (the last piece; it takes no keywords)
        except expat.ExpatError as error:
            at = self._at(self.parser.ErrorByteIndex, 1)
            reason = expat.ErrorString(error.code) or "not XML"
            raise RejectedError([finding("TF018", reason, at, help="fix it; other parsers stop here too")]) from None
        if self.root is None:
            raise RejectedError([finding("TF018", "no element", Span(self.source.file))])
        return self.root

    def add_text(self, piece: str) -> None:
        if self.stack:
            self.stack[-1].text += piece

    def _at(self, byte: int, length: int) -> Span:
        return self.source.span(self.source.position(byte), length)

    def _refuse_type(self, *_: object) -> None:
        at = self._at(self.parser.CurrentByteIndex, 9)
        raise RejectedError(
            [finding("TF018", "a document type is not allowed: it can declare entities", at, help="remove it")]
        )

    def _open(self, tag: str, attributes: dict[str, str]) -> None:
        self.elements += 1
        element = Element(tag, attributes, self.source, self.parser.CurrentByteIndex)
        if self.elements > MOST_VALUES or len(self.stack) >= DEEPEST:
            what = (
                f"more than {MOST_VALUES:,} elements"
                if self.elements > MOST_VALUES
                else f"nested deeper than {DEEPEST} elements"
            )
            raise RejectedError([finding("TF008", what, element.at)])
        if self.stack:
            self.stack[-1].children.append(element)
        else:
            self.root = element
        self.stack.append(element)

    def _close(self, _: str) -> None:
        self.stack.pop().end = self.parser.CurrentByteIndex
