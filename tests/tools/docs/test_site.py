"""``help --html``: pages whose links lead somewhere, without a server and other people's files."""

from __future__ import annotations

import json
import os
import re
import sys
from dataclasses import dataclass, field
from html.parser import HTMLParser
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import pytest

from tests.support import processes
from tests.support.browser import page_of
from tests.support.cli import tfcompose_in
from tfcompose.cli.documentation import topics
from tfcompose.cli.parser import all_commands, parser_of
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.spec.language.reference import reference_of
from tfcompose.tools.docs.addresses import Addresses, command_path, key_anchor, topic_path
from tfcompose.tools.docs.markdown import Renderer

if TYPE_CHECKING:
    from pathlib import Path

    from playwright.sync_api import Page

#: One worker builds the site, once.
pytestmark = pytest.mark.xdist_group("docs")


@dataclass
class Parsed(HTMLParser):
    """The anchors and the addresses of a page."""

    anchors: list[str] = field(default_factory=list)
    addresses: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__init__()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        del tag
        for name, value in attrs:
            if name == "id":
                self.anchors.append(value or "")
            elif name in {"href", "src"}:
                self.addresses.append(value or "")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a site that the command wrote."""
    folder = tmp_path_factory.mktemp("site")
    done = tfcompose_in(folder, "help", "--html", "docs")
    assert (done.returncode, done.stderr) == (0, "")
    return folder / "docs"


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Parsed]:
    """Return the pages by their files."""
    parsed = {}
    for file in sorted(site.rglob("*.html")):
        parsed[file] = Parsed()
        parsed[file].feed(file.read_text("utf-8"))
    return parsed


@pytest.fixture(scope="module")
def index(site: Path) -> list[tuple[str, str, str, str]]:
    """Return the rows that the search knows: kind, title, address, text."""
    text = (site / "search-index.js").read_text("utf-8")
    rows: list[tuple[str, str, str, str]] = json.loads(
        text.removeprefix("const searchIndex = ").removesuffix(";\n")
    )
    return rows


def test_every_link_leads_to_a_file_and_an_anchor_of_the_site(
    site: Path, pages: dict[Path, Parsed]
) -> None:
    broken = []
    for file, page in pages.items():
        for address in page.addresses:
            target = urlsplit(address)
            if target.scheme or target.netloc:
                broken.append(f"{file.relative_to(site)} is not alone: {address}")
                continue
            linked_file = (file.parent / target.path).resolve() if target.path else file
            anchors = pages[linked_file].anchors if linked_file in pages else []
            if not linked_file.is_file() or (target.fragment and target.fragment not in anchors):
                broken.append(f"{file.relative_to(site)}: {address}")
    assert not broken


def test_pages_of_codes_follow_each_other_in_the_order_of_the_codes(site: Path) -> None:
    codes, order = sorted(CATALOGUE), sorted(CATALOGUE)[:1]
    while match := re.search(
        r'codes/(\w+)\.html"><small>Next', (site / f"codes/{order[-1]}.html").read_text("utf-8")
    ):
        order.append(match[1])
    assert order == codes


def test_an_anchor_is_there_once_a_page(pages: dict[Path, Parsed]) -> None:
    for file, page in pages.items():
        assert sorted(set(page.anchors)) == sorted(page.anchors), file


def test_nothing_is_fetched_from_elsewhere(site: Path) -> None:
    for file in site.rglob("*"):
        if file.suffix in {".css", ".js", ".svg"} and file.name != "search-index.js":
            text = file.read_text("utf-8").replace("http://www.w3.org/2000/svg", "")
            assert not re.search(r"https?:|//\w+\.|\burl\(|\bfetch\(|@import|\bimport\b", text), (
                file
            )


def test_each_topic_command_code_and_key_has_its_page(
    site: Path, pages: dict[Path, Parsed]
) -> None:
    for name in topics():
        assert site / topic_path(name) in pages
    for name in all_commands():
        anchors = pages[site / command_path(name)].anchors
        for rows in parser_of(name).argument_rows().values():
            assert {row.name for row in rows} <= set(anchors), name
    for code, entry in CATALOGUE.items():
        text = (site / f"codes/{code}.html").read_text("utf-8")
        assert f"<h1>{entry.name} ({code})</h1>" in text
        assert f'<li class="{entry.severity}">' in text
    for language in ("robot", "preset", "node", "fleet", "test"):
        anchors = pages[site / f"keys/{language}.html"].anchors
        for section in reference_of(language).sections:
            keys = {key_anchor(section.title, key.name) for key in section.keys}
            assert keys <= set(anchors)


def test_the_list_of_codes_links_them_all(site: Path, pages: dict[Path, Parsed]) -> None:
    listed = pages[site / "codes/index.html"].addresses
    assert {f"{code}.html" for code in CATALOGUE} <= set(listed)


def test_a_page_of_a_code_shows_what_can_be_set_and_who_mentions_it(site: Path) -> None:
    def text_of(code: str) -> str:
        return re.sub(r"<[^>]+>", "", (site / f"codes/{code}.html").read_text("utf-8"))

    assert "# tfcompose: allow TF401 because" in text_of("TF401")
    assert "TF641: {limit: 50 %}" in text_of("TF641")
    assert "allow TF101" not in text_of("TF101"), "an unknown key cannot be allowed"
    assert "allow TF801" not in text_of("TF801"), "a running robot has no comments"
    assert '<a href="../topics/guard.html">' in (site / "codes/TF862.html").read_text("utf-8")


def test_the_search_knows_every_page(
    site: Path, pages: dict[Path, Parsed], index: list[tuple[str, str, str, str]]
) -> None:
    indexed = set()
    for _, title, address, text in index:
        path, _, anchor = address.partition("#")
        assert title
        assert "<" not in title
        assert "`" not in text
        assert not anchor or anchor in pages[site / path].anchors, address
        indexed.add(site / path)
    assert pages.keys() - indexed == {site / "index.html"}


def test_names_in_a_text_become_links_where_they_first_occur() -> None:
    addresses = Addresses(["guard", "processes"], {"up": ["--for"], "stop": []}, ["TF301"])

    def links(text: str, *, names_keys: bool = False) -> list[str]:
        html = Renderer(addresses).render(text, "topics/x.html", names_keys=names_keys).html
        return re.findall(r'href="([^"#]*#?[^"]*)"', html)

    assert links("TF301 and `TF301`, TF999") == ["../codes/TF301.html"]
    assert links("`tfcompose help guard`, see help processes") == ["guard.html", "processes.html"]
    assert links("`up --for 3`") == ["../commands/up.html#--for"]
    assert links("`tfcompose up robot.yaml`") == ["../commands/up.html"]
    assert links("`up the hill`, `down`, up") == []
    assert links("`sensors.laser.place`") == ["../keys/robot.html#sensor.place"]
    assert links("`guard: {unknown_edges: …}`") == ["../keys/robot.html#guardpolicy.unknown_edges"]
    assert links("`xyz: 3`") == ["../keys/robot.html#key.xyz"]
    assert links("`stop`") == ["../commands/stop.html"]
    assert links("`stop`, `python`", names_keys=True)[0] == "../commands/stop.html"
    key = "../keys/robot.html#key.stop"
    assert links("`stop: {timeout: 1 s}`\n\n## A\n\n`stop`", names_keys=True)[-1] == key
    assert links("`guard`") == [], "a key, and this is no text about keys"
    up = "../commands/up.html"
    assert links("`up` `up`\n\n## A\n\n`up` `up`") == [up, "#a", up]
    assert links("[`up`](y.html)") == ["y.html"]
    assert links("```yaml\nx: 1  # tfcompose: allow TF301\n```") == ["../codes/TF301.html"]


def test_headings_with_one_text_have_two_anchors() -> None:
    rendered = Renderer(Addresses([], {}, [])).render("# T\n\n## A b!\n\n## a B", "x.html")
    assert [heading.anchor for heading in rendered.headings] == ["a-b", "a-b-"]


def test_a_second_run_gives_the_same_site(site: Path, tmp_path: Path) -> None:
    environment = os.environ | {"PYTHONHASHSEED": "7", "COLUMNS": "43"}
    command = [sys.executable, "-m", "tfcompose", "help", "--html", "other"]
    processes.run(command, cwd=tmp_path, env=environment, check=True)
    files = {file.relative_to(site): file.read_bytes() for file in site.rglob("*.*")}
    second_site = tmp_path / "other"
    assert files == {
        file.relative_to(second_site): file.read_bytes() for file in second_site.rglob("*.*")
    }


def test_files_of_others_are_kept_and_pages_of_an_earlier_site_are_not(tmp_path: Path) -> None:
    docs = tmp_path / "docs"
    docs.mkdir()
    (docs / "notes.html").write_text("mine")
    assert tfcompose_in(tmp_path, "help", "--html", "docs").returncode == 0
    manifest = docs / "manifest.txt"
    (docs / "topics/gone.html").write_text("of an earlier version")
    (tmp_path / "outside.html").write_text("mine")
    lines = ["topics/gone.html", "../outside.html", str(tmp_path / "outside.html")]
    manifest.write_text("\n".join([manifest.read_text("utf-8"), *lines]), "utf-8")
    assert tfcompose_in(tmp_path, "help", "--html", "docs").returncode == 0
    assert not (docs / "topics/gone.html").exists()
    assert (docs / "notes.html").read_text() == "mine"
    assert (tmp_path / "outside.html").read_text() == "mine"
    assert "notes.html" not in manifest.read_text("utf-8")


def test_a_file_of_others_in_the_place_of_a_page_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs/index.html").write_text("mine")
    done = tfcompose_in(tmp_path, "help", "--html", "docs")
    assert (done.returncode, done.stdout) == (2, "")
    assert "docs/index.html" in done.stderr
    assert [file.name for file in (tmp_path / "docs").iterdir()] == ["index.html"]


@pytest.mark.parametrize("argv", [("lint", "--html", "docs"), ("--html", "file/docs")])
def test_wrong_use_leaves_the_disk_as_it_is(argv: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    done = tfcompose_in(tmp_path, "help", *argv)
    assert (done.returncode, done.stdout) == (2, "")
    assert [file.name for file in tmp_path.iterdir()] == ["file"]


def results(page: Page, text: str) -> list[str]:
    """Type into the search field; return the titles found."""
    page.keyboard.press("/")
    page.locator(".search input").fill(text)
    page.locator(".results :is(b, p)").first.wait_for()
    return page.locator(".results b").all_inner_texts()


def test_a_browser_finds_pages_changes_the_theme_and_needs_no_server(site: Path) -> None:
    with page_of((site / "topics/guard.html").as_uri()) as page:
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        assert results(page, "tf301")[0] == "TF301 edge_with_two_owners"
        assert results(page, "restart")[0] == "tfcompose restart"
        assert results(page, "lint fail-on")[0] == "lint --fail-on"
        assert results(page, "sensor place")[0] == "Sensor.place"
        assert results(page, "(*[") == []
        results(page, "edge_with_two_owners")
        page.keyboard.press("Enter")
        page.wait_for_url("**/codes/TF301.html")
        page.get_by_role("link", name="Codes", exact=True).first.click()
        page.wait_for_url("**/codes/index.html")

        background = "getComputedStyle(document.body).backgroundColor"
        light = page.evaluate(background)
        page.get_by_role("button", name="Use the dark theme").click()
        dark = page.evaluate(background)
        assert dark != light
        page.reload()
        assert page.evaluate(background) == dark
        page.get_by_role("button", name="Use the light theme").click()
        page.emulate_media(color_scheme="dark")
        assert page.evaluate(background) == dark, "the system's theme applies again"
        assert not errors


def test_pages_are_as_wide_as_a_phone_and_its_menu_opens(site: Path) -> None:
    with page_of((site / "index.html").as_uri(), width=360, height=700) as page:
        for path in (
            "index.html",
            "codes/index.html",
            "codes/TF801.html",
            "commands/lint.html",
            "keys/robot.html",
            "topics/processes.html",
        ):
            page.goto((site / path).as_uri())
            width = "document.documentElement.scrollWidth"
            assert page.evaluate(width) == 360, path
        assert not page.get_by_role("link", name="The guard").is_visible()
        page.get_by_role("button", name="Menu").click()
        menu = page.get_by_role("navigation", name="Pages")
        menu.get_by_text("The guard", exact=True).click()
        page.wait_for_url("**/topics/guard.html")
