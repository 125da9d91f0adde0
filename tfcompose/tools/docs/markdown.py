"""Conversion of Markdown to HTML with anchors, highlighted blocks and links."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from markdown_it import MarkdownIt
from markdown_it.token import Token
from markupsafe import Markup
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import get_lexer_by_name
from pygments.util import ClassNotFound

from tfcompose.tools.docs.addresses import key_set_by, relative

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.tools.docs.addresses import Addresses

#: A code in a text, or the name of a topic after "help".
_NAMED = re.compile(r"\b([A-Z]{2,8}\d{3})\b|(?<=\bhelp )([a-z]+)\b")
_NOT_IN_ANCHORS = re.compile(r"[^\w.-]+")


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading within a page."""

    level: int
    anchor: str
    text: str


@dataclass(slots=True)
class Rendered:
    """A page's text as HTML, with its title, headings, links and plain text."""

    #: The heading of the first level. ``html`` does not contain it.
    title: str = ""
    html: Markup = field(default_factory=Markup)
    headings: list[Heading] = field(default_factory=list)
    #: The plain text of each part, by the anchor of its heading. The text before the first heading
    #: has the anchor "".
    parts: dict[str, str] = field(default_factory=dict)
    #: The paths of the pages to which the text links.
    targets: set[str] = field(default_factory=set)


class Renderer:
    """Renders the Markdown of pages. ``addresses`` gives the addresses of links."""

    def __init__(self, addresses: Addresses) -> None:
        self._addresses = addresses
        self._markdown = MarkdownIt(
            "commonmark", {"html": False, "highlight": self._highlight}
        ).enable("table")
        self._page = ""

    def render(self, text: str, page: str, *, names_keys: bool = False) -> Rendered:
        """Return Markdown of a page as HTML.

        With ``names_keys``, a word between backticks can be a key of the robot file.
        """
        self._page = page
        return self._rendered(self._markdown.parse(text), names_keys=names_keys)

    def line(self, text: str, page: str) -> Markup:
        """Return a line of Markdown as HTML, without a paragraph around it."""
        self._page = page
        return self._rendered(self._markdown.parseInline(text)).html

    def plain(self, text: str, page: str) -> Markup:
        """Return paragraphs of plain text as HTML."""
        self._page = page
        paragraphs = filter(None, text.split("\n\n"))
        return self._rendered(
            [token for paragraph in paragraphs for token in _paragraph(paragraph)]
        ).html

    def plain_line(self, text: str, page: str) -> Markup:
        """Return a line of plain text as HTML."""
        self._page = page
        return self._rendered([_inline(text)]).html

    def _rendered(self, tokens: list[Token], *, names_keys: bool = False) -> Rendered:
        page = _Page(self._page, self._addresses, names_keys=names_keys)
        linked = list(page.tokens(tokens))
        html = self._markdown.renderer.render(linked, self._markdown.options, {})
        page.rendered.html = Markup(html)  # noqa: S704 (the renderer escapes what is not its own)
        return page.rendered

    def _highlight(self, text: str, language: str, _: str) -> str:
        """Return a highlighted block as HTML, in which codes of findings are links."""
        try:
            lexer = get_lexer_by_name(language or "text", stripnl=False)
        except ClassNotFound:
            lexer = get_lexer_by_name("text")
        html = highlight(text, lexer, HtmlFormatter(nowrap=True))
        return _NAMED.sub(self._linked_code, html)

    def _linked_code(self, match: re.Match[str]) -> str:
        address = self._addresses.of_code(match[0])
        return f'<a href="{relative(address, self._page)}">{match[0]}</a>' if address else match[0]


class _Page:
    """Converts the tokens of a page."""

    def __init__(self, page: str, addresses: Addresses, *, names_keys: bool) -> None:
        self.rendered = Rendered()
        self._page = page
        self._addresses = addresses
        #: The keys that this page sets; None if words of this page are not keys.
        self._keys: set[str] | None = set() if names_keys else None
        self._part = ""
        #: The addresses to which this part of the page already links. Only the first occurrence of
        #: a name becomes a link.
        self._linked: set[str] = set()

    def tokens(self, tokens: list[Token]) -> Iterator[Token]:
        """Yield the tokens without the title, with anchors, links and scrolling tables."""
        before = Token("", "", 0)
        is_title = False
        if self._keys is not None:
            self._keys |= {key_set_by(child.content) for child in _code_spans(tokens)}
        for token in tokens:
            if token.type == "heading_open" and token.tag == "h1":
                is_title = True
            elif token.type == "heading_close" and is_title:
                is_title = False
            elif is_title:
                self.rendered.title = _text_of(token)
            else:
                yield from self._one(token, before)
            before = token

    def _one(self, token: Token, before: Token) -> Iterator[Token]:
        if token.type == "table_open":
            yield Token("scroll_open", "div", 1, attrs={"class": "table"})
        if token.type == "inline":
            if before.type == "heading_open":
                self._begin_part(before, _text_of(token))
                token.children = [*(token.children or []), *_anchor_link(self._part)]
            else:
                self._add_text(_text_of(token))
                token.children = list(self._children(token.children or []))
        elif token.type == "fence":
            self._add_text(token.content)
        yield token
        if token.type == "table_close":
            yield Token("scroll_close", "div", -1)

    def _begin_part(self, heading: Token, text: str) -> None:
        anchor = _NOT_IN_ANCHORS.sub("-", text.lower()).strip("-")
        taken = {heading.anchor for heading in self.rendered.headings}
        while anchor in taken:
            anchor += "-"
        heading.attrSet("id", anchor)
        self.rendered.headings.append(Heading(int(heading.tag[1]), anchor, text))
        self._part = anchor
        self._linked.clear()

    def _add_text(self, text: str) -> None:
        parts = self.rendered.parts
        parts[self._part] = f"{parts.get(self._part, '')} {' '.join(text.split())}".strip()

    def _children(self, tokens: list[Token]) -> Iterator[Token]:
        """Yield the tokens of a line of text, with links."""
        links = 0
        for token in tokens:
            links += token.nesting if token.type.startswith("link_") else 0
            if links:
                yield token
            elif token.type == "text":
                yield from self._in_text(token.content)
            elif token.type == "code_inline":
                address = self._addresses.of_code_span(token.content, self._keys)
                yield from self._around(token, address)
            else:
                yield token

    def _in_text(self, text: str) -> Iterator[Token]:
        end = 0
        for match in _NAMED.finditer(text):
            address = (
                self._addresses.of_code(match[1])
                if match[1]
                else self._addresses.of_topic(match[2])
            )
            if address:
                yield _text(text[end : match.start()])
                yield from self._around(_text(match[0]), address)
                end = match.end()
        yield _text(text[end:])

    def _around(self, token: Token, address: str) -> Iterator[Token]:
        """Yield the token inside a link to the address.

        Yield it without a link if the address is on this page or already has a link in this part.
        """
        path, _, anchor = address.partition("#")
        if not address or address in self._linked or (path == self._page and not anchor):
            yield token
            return
        self._linked.add(address)
        self.rendered.targets.add(path)
        yield Token("link_open", "a", 1, attrs={"href": relative(address, self._page)})
        yield token
        yield Token("link_close", "a", -1)


def _code_spans(tokens: list[Token]) -> Iterator[Token]:
    for token in tokens:
        yield from (child for child in token.children or [] if child.type == "code_inline")


def _paragraph(text: str) -> tuple[Token, ...]:
    return (Token("paragraph_open", "p", 1), _inline(text), Token("paragraph_close", "p", -1))


def _inline(text: str) -> Token:
    return Token("inline", "", 0, children=[_text(text)])


def _text(content: str) -> Token:
    return Token("text", "", 0, content=content)


def _anchor_link(anchor: str) -> list[Token]:
    attributes = {"class": "anchor", "href": f"#{anchor}", "aria-label": "Link to this section"}
    return [
        Token("link_open", "a", 1, attrs=dict(attributes)),
        _text("#"),
        Token("link_close", "a", -1),
    ]


def _text_of(token: Token) -> str:
    return "".join(_BREAKS.get(child.type, child.content) for child in token.children or [])


_BREAKS = {"softbreak": "\n", "hardbreak": "\n"}
