"""Files of the documentation site: pages, styles and scripts, and the index of the search."""

from __future__ import annotations

import json
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from jinja2 import Environment, FileSystemLoader, StrictUndefined, select_autoescape

from tfcompose import __version__
from tfcompose.cli.documentation import topic_groups
from tfcompose.cli.parser import all_groups, parser_of
from tfcompose.cli.schemas import languages_with_reference
from tfcompose.foundation.catalogue import CATALOGUE, FAMILIES
from tfcompose.foundation.tool import installed_tools
from tfcompose.model.files import File
from tfcompose.tools.docs.addresses import Addresses
from tfcompose.tools.docs.builder import FAMILY_TITLES, Builder
from tfcompose.tools.docs.markdown import Renderer
from tfcompose.tools.docs.pages import PageGroup, SitePage

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

HERE = Path(__file__).parent
ABOUT = (
    "One YAML file says which frames a ROS 2 robot has and who publishes each TF edge. tfcompose"
    " checks it, builds it, starts it and guards it."
)


def build_site() -> list[File]:
    """Return the files of the site.

    The same version and tools always give the same files.
    """
    templates = Environment(
        loader=FileSystemLoader(HERE / "templates"),
        autoescape=select_autoescape(["html"]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return list(_Site(templates).files())


class _Site:
    """All pages, in their groups."""

    def __init__(self, templates: Environment) -> None:
        self._templates = templates
        groups, commands = topic_groups(), all_groups()
        options = {
            name: {row.name for rows in parser_of(name).argument_rows().values() for row in rows}
            for group in commands.values()
            for name in group
        }
        names = [name for group in groups.values() for name in group]
        addresses = Addresses(names, options, list(CATALOGUE))
        settings = templates.get_template("settings.md").render
        self._builder = builder = Builder(Renderer(addresses), settings)
        self._topics = [
            PageGroup(title, [builder.topic(name, about, title) for name, about in group.items()])
            for title, group in groups.items()
        ]
        topics = {page.name: page for page in _pages_of(self._topics)}
        self._commands = [
            PageGroup(
                title,
                [builder.command(name, command, title, topics) for name, command in group.items()],
            )
            for title, group in commands.items()
        ]
        self._keys = PageGroup("Keys", list(map(builder.keys, languages_with_reference())))
        codes = [builder.code(code, tool) for code, tool in sorted(_tools_of_codes().items())]
        self._families = [
            PageGroup(FAMILY_TITLES[family], pages, family)
            for family in FAMILIES
            if (pages := [code for code in codes if code.entry.family == family])
        ]

    def files(self) -> Iterator[File]:
        """Yield the pages, their styles and scripts, and the index of the search."""
        for file in sorted((HERE / "assets").iterdir()):
            yield File(file.name, file.read_text("utf-8"))
        yield File("search-index.js", self._search_index())
        first = SitePage(
            template="index.html", path="index.html", name="", title="tfcompose", about=ABOUT
        )
        yield self._file(first, None, None)
        for pages in (
            list(_pages_of(self._topics)),
            list(_pages_of(self._commands)),
            self._keys.pages,
            sorted(_pages_of(self._families), key=lambda code: code.name),
        ):
            neighbours = zip([None, *pages], [*pages[1:], None], strict=False)
            for page, (before, after) in zip(pages, neighbours, strict=True):
                yield self._file(page, before, after)

    def _file(self, page: SitePage, before: SitePage | None, after: SitePage | None) -> File:
        root = "../" * page.path.count("/")
        text = self._templates.get_template(page.template).render(
            page=page,
            before=before,
            after=after,
            root=root,
            version=__version__,
            navigation=self._navigation(page),
            topics=self._topics,
            commands=self._commands,
            keys=self._keys,
            families=self._families,
            mentions=self._builder.mentions.get(page.path, ()),
        )
        return File(page.path, text)

    def _navigation(self, page: SitePage) -> list[PageGroup]:
        """Return the list of pages next to a page.

        It contains only the codes of the page's own family.
        """
        commands = PageGroup("Commands", list(_pages_of(self._commands)), is_folded=True)
        families = [family for family in self._families if page in family.pages]
        return [*families, *self._topics, self._keys, commands]

    def _search_index(self) -> str:
        """Return a script that defines the rows of the search, one in each line."""
        rows = ",\n".join(
            json.dumps(row, ensure_ascii=False, separators=(",", ":"))
            for row in self._builder.search_rows
        )
        return f"const searchIndex = [\n{rows}\n];\n"


def _pages_of(groups: Sequence[PageGroup]) -> Iterator[SitePage]:
    return chain.from_iterable(group.pages for group in groups)


def _tools_of_codes() -> dict[str, str]:
    """Return the tool of each code; empty for codes of the core."""
    of_tools = {code: tool.name for tool in installed_tools().tools for code in tool.code_names()}
    return {code: of_tools.get(code, "") for code in CATALOGUE}
