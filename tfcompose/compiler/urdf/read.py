"""XML elements with the span of every tag and attribute, even after xacro expansion.

The reader uses expat directly, because no XML library reports the columns of attributes. It
rejects documents with entities or a document type. A robot needs neither, and both can make a
small file huge or include other files.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from dataclasses import dataclass
from itertools import accumulate
from typing import TYPE_CHECKING
from xml.parsers import expat

from tfcompose.foundation.findings import Finding, Note, RejectedError, Span, finding
from tfcompose.spec.load import MOST_VALUES, refuse_unreadable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tfcompose.compiler.urdf.xacro import Expansion

DEEPEST = 100

#: Four times the limit of a robot file, because URDF takes about three times as many characters
#: for the same robot.
MOST_CHARACTERS = 16_000_000

_TAG = re.compile(r"<[^\s/>]+")
_ATTRIBUTE = re.compile(r"""\s*([^\s=/>"']+)\s*=\s*(?:"([^"]*)"|'([^']*)')""")
_BROKEN = re.compile(r"""=\s*(?:"[^"<>]*[\t\r\n]|'[^'<>]*[\t\r\n])""")
_BREAK = re.compile("\r\n|\r|\n")
#: Continuation bytes of UTF-8.
_INSIDE = bytes(range(0x80, 0xC0))
_BLOCK = 4096


class _Text:
    """A file's text, with the character positions of its bytes, computed on demand."""

    def __init__(self, text: str, file: str) -> None:
        self.text, self.file = text, file
        self.data = text.encode()
        self.starts = [0, *(match.end() for match in _BREAK.finditer(text))]
        self.has_broken_values = _BROKEN.search(text) is not None
        self.before: list[int] = []  # number of characters before each block; empty for ASCII text
        if len(self.data) != len(text):
            lengths = (
                _characters(self.data[offset : offset + _BLOCK])
                for offset in range(0, len(self.data), _BLOCK)
            )
            self.before = list(accumulate(lengths, initial=0))
        self._tag: tuple[int, dict[str, tuple[int, int]], int] = (-1, {}, 0)

    def position(self, byte: int) -> int:
        """Return the index of the character that begins at a byte offset."""
        if not self.before or byte <= 0:  # -1 in an empty text
            return max(byte, 0)
        block = byte // _BLOCK
        return self.before[block] + _characters(self.data[block * _BLOCK : byte])

    def span(self, begin: int, length: int) -> Span:
        """Return the span of ``length`` characters from index ``begin``."""
        end = min(begin + length, len(self.text))
        line, end_line = bisect_right(self.starts, begin), bisect_right(self.starts, end)
        return Span(
            self.file,
            line,
            begin - self.starts[line - 1] + 1,
            end_line,
            end - self.starts[end_line - 1] + 1,
        )

    def tag_at(self, begin: int) -> tuple[dict[str, tuple[int, int]], int]:
        """Return the range of each attribute value, without quotes, and the end of the last value.

        ``begin`` is the index of the tag's first character. The last result is cached.
        """
        if self._tag[0] != begin:
            name = _TAG.match(self.text, begin)
            position, values = name.end() if name else begin, {}
            while attribute := _ATTRIBUTE.match(self.text, position):
                values[attribute[1]] = attribute.span(2 if attribute[2] is not None else 3)
                position = attribute.end()
            self._tag = (begin, values, position)
        return self._tag[1:]


def _characters(data: bytes) -> int:
    return len(data.translate(None, _INSIDE))


@dataclass(frozen=True, slots=True)
class _Origin:
    """The place of an element: the text, and the index of the first character of its tag."""

    source: _Text
    begin: int

    @classmethod
    def at(cls, source: _Text, line: int, column: int) -> _Origin:
        """Return the nearest existing origin to a line, from 1, and a column, from 0."""
        starts = source.starts
        begin = starts[min(max(line, 1), len(starts)) - 1] + column
        return cls(source, min(begin, len(source.text)))


class Element:
    """A tag with its attributes and children; ``text`` is the element's own text, if requested.

    ``begin`` and ``end`` are the byte offsets of its first and last tag. Spans are in the text. In
    an expanded document, they are in the file that contains the element.
    """

    __slots__ = ("_origin", "_source", "attributes", "begin", "children", "end", "tag", "text")

    def __init__(
        self,
        tag: str,
        attributes: dict[str, str],
        source: _Text,
        begin: int,
        origin: _Origin | None = None,
    ) -> None:
        self.tag, self.attributes = tag, attributes
        self.children: list[Element] = []
        self.text = ""
        self.begin = self.end = begin
        self._source, self._origin = source, origin

    def _declared_origin(self) -> _Origin:
        return self._origin or _Origin(self._source, self._source.position(self.begin))

    @property
    def span(self) -> Span:
        """The span of the element's tag."""
        declared = self._declared_origin()
        return declared.source.span(declared.begin, len(self.tag) + 1)

    @property
    def raw(self) -> str:
        """The element's source text."""
        text = self._source.text
        begin = self._source.position(self.begin)
        end = text.find(">", self._source.tag_at(begin)[1])
        if (
            text[end - 1] != "/"
        ):  # it has an end tag; without one, versions of expat report different offsets
            end = text.find(">", self._source.position(self.end))
        return text[begin : end + 1]

    def all(self, tag: str) -> list[Element]:
        """Return the children with this tag."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> Element | None:
        """Return the first child with this tag, or None."""
        for child in self.children:
            if child.tag == tag:
                return child
        return None

    def walk(self) -> Iterator[Element]:
        """Yield this element and all its descendants, in document order."""
        waiting = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting += reversed(element.children)

    def value_span(self, name: str) -> Span:
        """Return the span of an attribute's value, or of the element without this attribute."""
        declared = self._declared_origin()
        place = declared.source.tag_at(declared.begin)[0].get(name)
        return declared.source.span(place[0], place[1] - place[0] or 1) if place else self.span

    def raw_value(self, name: str) -> str:
        """Return an attribute's value as it is in the text.

        XML parsers replace tabs and line breaks in a value with spaces.
        """
        begin, end = self._source.tag_at(self._source.position(self.begin))[0].get(name, (0, 0))
        return self._source.text[begin:end]

    @property
    def has_broken_values(self) -> bool:
        """Whether an attribute value contains a tab or a line break in the text."""
        return self._source.has_broken_values


def read_xml(text: str, file: str, *, with_text: bool = False) -> Element:
    """Return the root of the document; ``with_text``: keep the elements' own text.

    Raises:
        RejectedError: if the text is not XML, declares entities, or is too large or too deep.
    """
    refuse_unreadable(text, file, MOST_CHARACTERS)
    reader = _UrdfReader(text, file)
    if with_text:
        reader.parser.CharacterDataHandler = reader.add_text
    return reader.read()


def read_expansion(expansion: Expansion, file: str, read: Callable[[str], str]) -> Element:
    """Return the root of an expanded document, with elements at the places where they are written.

    Raises:
        RejectedError: as in ``read_xml``.
    """
    refuse_unreadable(expansion.text, file, MOST_CHARACTERS)
    reader = _UrdfReader(expansion.text, file)
    texts = [_Text(read(name), name) for name in expansion.files]
    nowhere = _Origin(_Text("", file), 0)
    reader.origins = []
    for place in expansion.places:
        origin = _Origin.at(texts[place[0]], *place[1:]) if place else nowhere
        reader.origins.append(origin)
    return reader.read()


#: expat's error codes for a tag that is not closed.
_UNCLOSED = frozenset(
    expat.errors.codes[text]
    for text in (expat.errors.XML_ERROR_TAG_MISMATCH, expat.errors.XML_ERROR_NO_ELEMENTS)
)


class _UrdfReader:
    def __init__(self, text: str, file: str) -> None:
        self.source = _Text(text, file)
        self.stack: list[Element] = []
        self.root: Element | None = None
        self.elements = 0
        self.origins: list[_Origin] = []
        self.parser = expat.ParserCreate("utf-8")
        self.parser.StartElementHandler = self._open
        self.parser.EndElementHandler = self._close
        self.parser.StartDoctypeDeclHandler = self._refuse_type

    def read(self) -> Element:
        try:
            self.parser.Parse(self.source.data, True)  # noqa: FBT003 (the last piece; it takes no keywords)
        except expat.ExpatError as error:
            span = self._span_of(self.parser.ErrorByteIndex, 1)
            raise RejectedError([self._not_xml(error.code, span)]) from None
        if self.root is None:
            raise RejectedError([finding("TF018", "no element", Span(self.source.file))])
        return self.root

    def _not_xml(self, code: int, span: Span) -> Finding:
        """Return the finding about the place where the text stops being valid XML."""
        reason = expat.ErrorString(code) or "not XML"
        if not self.stack or code not in _UNCLOSED:
            return finding("TF018", reason, span, help="fix it; other parsers stop here too")
        inner = self.stack[-1]
        message = f"{reason}: <{inner.tag}> is not closed"
        notes = [Note(f"{inner.tag} begins here", inner.span)]
        return finding(
            "TF018", message, span, help=f"write </{inner.tag}> before that", notes=notes
        )

    def add_text(self, piece: str) -> None:
        if self.stack:
            self.stack[-1].text += piece

    def _span_of(self, byte: int, length: int) -> Span:
        return self.source.span(self.source.position(byte), length)

    def _refuse_type(self, *_: object) -> None:
        span = self._span_of(self.parser.CurrentByteIndex, 9)
        raise RejectedError(
            [
                finding(
                    "TF018",
                    "a document type is not allowed: it can declare entities",
                    span,
                    help="remove it",
                )
            ]
        )

    def _open(self, tag: str, attributes: dict[str, str]) -> None:
        is_known = self.elements < len(self.origins)
        origin = self.origins[self.elements] if is_known else None
        self.elements += 1
        element = Element(tag, attributes, self.source, self.parser.CurrentByteIndex, origin)
        if self.elements > MOST_VALUES or len(self.stack) >= DEEPEST:
            what = (
                f"more than {MOST_VALUES:,} elements"
                if self.elements > MOST_VALUES
                else f"nested deeper than {DEEPEST} elements"
            )
            raise RejectedError([finding("TF008", what, element.span)])
        if self.stack:
            self.stack[-1].children.append(element)
        else:
            self.root = element
        self.stack.append(element)

    def _close(self, _: str) -> None:
        self.stack.pop().end = self.parser.CurrentByteIndex
