"""Values that the templates of the site's pages show."""

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
    """Base class of the pages. Each kind of page has a template."""

    template: str
    #: The path of the page in the site's folder.
    path: str
    #: The name of the topic, command, code or language.
    name: str
    title: str
    #: A description in a single line.
    about: str
    #: The title of the page's group.
    group: str = ""
    body: Markup = field(default_factory=Markup)
    headings: Sequence[Heading] = ()

    @property
    def label(self) -> str:
        """The name of the page in the list of pages."""
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
    """A command with its arguments, and its topic if this has a separate page."""

    usage: str
    description: Markup
    #: The title of ``body``, the text of the command; empty if it has no text.
    heading: str
    arguments: Sequence[ArgumentGroup]
    topic: SitePage | None = None

    @property
    def label(self) -> str:
        """The name of the page in the list of pages."""
        return self.name


@dataclass(slots=True, eq=False, kw_only=True)
class CodePage(SitePage):
    """A code, with its limit, if the robot file can set one, and its tool."""

    entry: Code
    limit: str = ""
    tool: str = ""
    #: Text about how to silence the code; empty if that is impossible.
    settings: Markup = field(default_factory=Markup)

    @property
    def label(self) -> str:
        """The name of the page in the list of pages."""
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
    #: The sections that have a key, each with title and anchor, by key.
    all_keys: dict[str, list[tuple[str, str]]]

    @property
    def label(self) -> str:
        """The name of the page in the list of pages."""
        return self.name


@dataclass(frozen=True, slots=True)
class PageGroup:
    """Pages under a title."""

    title: str
    pages: Sequence[SitePage]
    #: The anchor of the title.
    name: str = ""
    #: Whether the group is folded in the list of pages, unless the current page is in it.
    is_folded: bool = False
