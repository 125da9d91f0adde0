"""Pages of the site: the values that their templates show."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from markupsafe import Markup

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.foundation.catalogue import Code
    from tfcompose.tools.docs.markdown import Heading


@dataclass(slots=True, eq=False, kw_only=True)
class SitePage:
    """A page, which has a template."""

    template: str
    #: From the folder of the site.
    path: str
    #: A topic's, a command's, a code's or a language's.
    name: str
    title: str
    #: One line.
    about: str
    #: The title of the group that it is in.
    group: str = ""
    body: Markup = field(default_factory=Markup)
    headings: Sequence[Heading] = ()

    @property
    def label(self) -> str:
        """Its name in the list of pages."""
        return self.title


@dataclass(frozen=True, slots=True)
class CommandArgument:
    """An argument of a command: ``-p NAME, --profile NAME``."""

    anchor: str
    form: str
    help: Markup


@dataclass(frozen=True, slots=True)
class ArgumentGroup:
    """Arguments of a command under their heading."""

    anchor: str
    title: str
    arguments: Sequence[CommandArgument]


@dataclass(slots=True, eq=False, kw_only=True)
class CommandPage(SitePage):
    """A command with its arguments, and its topic if that is a page of its own."""

    usage: str
    description: Markup
    #: The title of its text, ``body``; empty if it has none.
    heading: str
    arguments: Sequence[ArgumentGroup]
    topic: SitePage | None = None

    @property
    def label(self) -> str:
        """Its name in the list of pages."""
        return self.name


@dataclass(slots=True, eq=False, kw_only=True)
class CodePage(SitePage):
    """A code, with the limit that can be set, and the tool that brings it."""

    entry: Code
    limit: str = ""
    tool: str = ""
    #: How to silence it; empty where that is impossible.
    settings: Markup = field(default_factory=Markup)

    @property
    def label(self) -> str:
        """Its name in the list of pages."""
        return f"{self.name} {self.entry.name}"


@dataclass(frozen=True, slots=True)
class KeyEntry:
    """A key of a file."""

    anchor: str
    name: str
    type: Markup
    default: Markup
    about: Markup
    examples: Markup
    is_required: bool


@dataclass(frozen=True, slots=True)
class KeySection:
    """A mapping of a file, with its keys."""

    anchor: str
    title: str
    about: Markup
    keys: Sequence[KeyEntry]


@dataclass(slots=True, eq=False, kw_only=True)
class KeysPage(SitePage):
    """All keys of a language."""

    sections: Sequence[KeySection]
    #: The sections that have a key: title, anchor.
    all_keys: dict[str, list[tuple[str, str]]]

    @property
    def label(self) -> str:
        """Its name in the list of pages."""
        return self.name


@dataclass(frozen=True, slots=True)
class PageGroup:
    """Pages under a title."""

    title: str
    pages: Sequence[SitePage]
    #: The anchor of the title.
    name: str = ""
    #: Folded in the list of pages, unless one of them is shown.
    is_folded: bool = False
