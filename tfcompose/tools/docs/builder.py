"""Builder of the site's pages for topics, commands, codes and languages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from markupsafe import Markup

from tfcompose.cli.documentation import text_of_command, topic, topic_of_command
from tfcompose.cli.parser import parser_of
from tfcompose.cli.terminal import code_page
from tfcompose.cli.tool_commands import summary_of
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.spec.language.reference import reference_of
from tfcompose.tools.docs.addresses import (
    CODES,
    command_path,
    key_anchor,
    keys_path,
    topic_path,
)
from tfcompose.tools.docs.markdown import Heading
from tfcompose.tools.docs.pages import (
    ArgumentGroup,
    CodePage,
    CommandArgument,
    CommandPage,
    KeyEntry,
    KeySection,
    KeysPage,
    SitePage,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.cli.command_parser import ArgumentRow, CommandModule
    from tfcompose.foundation.catalogue import Family
    from tfcompose.spec.language.reference import ReferenceKey, ReferenceSection
    from tfcompose.tools.docs.markdown import Rendered, Renderer

#: Titles of the families of codes.
FAMILY_TITLES: dict[Family, str] = {
    "load": "Files that cannot be read",
    "language": "Keys and values",
    "tree": "Tree",
    "ownership": "Ownership",
    "poses": "Poses and conventions",
    "names": "Names",
    "sensors": "Sensors and calibration",
    "bodies": "Bodies and joints",
    "processes": "Processes",
    "guard": "Running robots: the guard",
    "live": "Running robots: live tools",
    "environment": "Environment",
}
#: Families of findings about a robot file. A comment in the file can allow such a finding.
_OF_FILES = frozenset({"tree", "ownership", "poses", "names", "sensors", "bodies"})
#: The group of topics about the robot file. In these topics, words between backticks can be keys.
ROBOT_FILE = "Robot file"
#: The width of commands' usage texts, in columns.
_USAGE_COLUMNS = 76


class Builder:
    """Builds pages, and collects the rows of the search and the links between pages."""

    def __init__(self, renderer: Renderer, settings: Callable[..., str]) -> None:
        """Set the renderer, and the template for the settings of a code."""
        self._renderer = renderer
        self._settings = settings
        #: The rows of the search: kind, title, address and text.
        self.search_rows: list[tuple[str, str, str, str]] = []
        #: The pages that link to a page, by the path of that page.
        self.mentions: dict[str, list[SitePage]] = {}

    def topic(self, name: str, about: str, group: str) -> SitePage:
        """Return the page of a topic."""
        path = topic_path(name)
        text = topic(name, with_reference=False)
        rendered = self._renderer.render(text, path, names_keys=group == ROBOT_FILE)
        page = SitePage(
            template="codes.html" if name == CODES else "topic.html",
            path=path,
            name=name,
            title=rendered.title,
            about=about,
            group=group,
            body=rendered.html,
            headings=rendered.headings,
        )
        self._take(page, rendered)
        self._add_parts("topic", page, rendered)
        return page

    def command(
        self, name: str, command: CommandModule, group: str, topics: Mapping[str, SitePage]
    ) -> CommandPage:
        """Return the page of a command.

        If the command's text is not the page of a topic, the page contains this text.
        """
        path, parser = command_path(name), parser_of(name, _USAGE_COLUMNS)
        of_topic = topics.get(topic_of_command(name, command))
        text = "" if of_topic else text_of_command(name, command)
        rendered = self._renderer.render(text, path)
        description = self._renderer.plain(parser.description or "", path)
        groups = [
            ArgumentGroup(
                f"{name}-{title.lower()}", title, [self._argument(row, path) for row in rows]
            )
            for title, rows in parser.argument_rows().items()
        ]
        page = CommandPage(
            template="command.html",
            path=path,
            name=name,
            title=f"tfcompose {name}",
            about=summary_of(command),
            group=group,
            usage=parser.format_usage().removeprefix("usage: ").rstrip(),
            description=description,
            heading=rendered.title,
            arguments=groups,
            topic=of_topic,
            body=rendered.html,
            headings=[
                *(Heading(2, part.anchor, part.title) for part in groups),
                *([Heading(2, f"{name}-details", rendered.title)] if rendered.title else []),
                *rendered.headings,
            ],
        )
        self._take(page, rendered)
        rows = [row for rows in parser.argument_rows().values() for row in rows]
        words = " ".join(row.help for row in rows)
        lead = f"{page.about}. {parser.description or ''} {rendered.parts.pop('', '')}"
        self._add_row("command", page.title, path, f"{lead} {words}")
        for row in rows:
            if row.name.startswith("-"):
                self._add_row("option", f"{name} {row.name}", f"{path}#{row.name}", row.help)
        self._add_parts("command", page, rendered)
        return page

    def _argument(self, row: ArgumentRow, path: str) -> CommandArgument:
        return CommandArgument(row.name, row.form, self._renderer.plain_line(row.help, path))

    def code(self, code: str, tool: str) -> CodePage:
        """Return the page of a code; ``tool`` is the tool of the code, empty for the core."""
        entry, path = CATALOGUE[code], code_page(code)
        rendered = self._renderer.render(CATALOGUE.page(code), path)
        limit = _limit(entry.limit)
        settings = Markup()
        headings = []
        if entry.can_be_allowed and entry.family in _OF_FILES:
            text = self._settings(code=code, limit=limit)
            settings = self._renderer.render(text, path).html
            headings = [Heading(2, "settings", "Allow or change it")]
        page = CodePage(
            template="code.html",
            path=path,
            name=code,
            title=f"{entry.name} ({code})",
            about=CATALOGUE.summary(code),
            group=FAMILY_TITLES[entry.family],
            body=rendered.html,
            entry=entry,
            limit=limit,
            tool=tool,
            settings=settings,
            headings=headings,
        )
        self._take(page, rendered)
        self._add_row("code", f"{code} {entry.name}", path, rendered.parts.get("", ""))
        return page

    def keys(self, language: str) -> KeysPage:
        """Return the page with all keys of a language."""
        path, reference = keys_path(language), reference_of(language)
        sections = [self._section(entry, path) for entry in reference.sections]
        all_keys: dict[str, list[tuple[str, str]]] = {}
        for section in sections:
            for key in section.keys:
                all_keys.setdefault(key.name, []).append((section.title, key.anchor))
        rendered = self._renderer.render("\n\n".join(reference.rules), path)
        page = KeysPage(
            template="keys.html",
            path=path,
            name=language,
            title=reference.title,
            about=f"{len(all_keys)} keys with type, default and example",
            group="Keys",
            body=rendered.html,
            headings=[
                *(Heading(2, section.anchor, section.title) for section in sections),
                Heading(2, "all-keys", "All keys"),
            ],
            sections=sections,
            all_keys=dict(sorted(all_keys.items())),
        )
        for entry in reference.sections:
            self._add_row("keys", entry.title, f"{path}#{entry.title.lower()}", entry.text)
            for row in entry.keys:
                address = f"{path}#{key_anchor(entry.title, row.name)}"
                self._add_row("key", f"{entry.title}.{row.name}", address, row.about)
        return page

    def _section(self, section: ReferenceSection, path: str) -> KeySection:
        anchor = section.title.lower()
        return KeySection(
            anchor,
            section.title,
            about=self._renderer.render(section.text, path).html,
            keys=[self._key(section.title, key, path) for key in section.keys],
        )

    def _key(self, section: str, key: ReferenceKey, path: str) -> KeyEntry:
        def inline(text: str) -> Markup:
            return self._renderer.line(text, path)

        return KeyEntry(
            anchor=key_anchor(section, key.name),
            name=key.name,
            type=inline(key.type),
            default=inline(key.default),
            about=inline(key.about),
            examples=inline(key.examples),
            is_required=key.is_required,
        )

    def _take(self, page: SitePage, rendered: Rendered) -> None:
        for target in sorted(rendered.targets):
            self.mentions.setdefault(target, []).append(page)

    def _add_parts(self, kind: str, page: SitePage, rendered: Rendered) -> None:
        titles = {heading.anchor: heading.text for heading in rendered.headings}
        for anchor, text in rendered.parts.items():
            title = f"{page.title}: {titles[anchor]}" if anchor else page.title
            self._add_row(kind, title, f"{page.path}#{anchor}" if anchor else page.path, text)

    def _add_row(self, kind: str, title: str, address: str, text: str) -> None:
        self.search_rows.append((kind, title, address, " ".join(text.replace("`", "").split())))


def _limit(limit: tuple[float, str] | None) -> str:
    """Return a limit in the form of a robot file; empty if there is none."""
    if limit is None:
        return ""
    value, unit = limit
    if unit == "rad":
        return f"{math.degrees(value):g} deg"
    return f"{value * 100:g} %" if unit == "%" else f"{value:g} {unit}"
