"""A real browser without a screen: Debian's Chromium, drawing by software."""

from __future__ import annotations

import shutil
from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import sync_playwright

if TYPE_CHECKING:
    from collections.abc import Iterator

    import viser
    from playwright.sync_api import Browser, Page

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
#: The token of servers of tests.
TOKEN = "token-of-a-test"  # noqa: S105 (no secret)
#: How long a page may take to do something, in milliseconds: software draws slowly.
TIMEOUT_MS = 60_000
_SOFTWARE = [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]
#: Makes a page draw no scene. Drawing by software takes seconds of all cores for each picture, and
#: clicks wait for it. The panel and the server work as usual.
_DRAW_NOTHING = """
const names = ['drawArrays', 'drawArraysInstanced', 'drawElements', 'drawElementsInstanced'];
for (const name of names) WebGL2RenderingContext.prototype[name] = () => {};"""


def address_of(server: viser.ViserServer, host: str = "127.0.0.1") -> str:
    """Return the address that lets a page in."""
    return f"http://{host}:{server.get_port()}/?token={TOKEN}"


@contextmanager
def browser() -> Iterator[Browser]:
    """Start a browser; the test is skipped where there is none."""
    if CHROMIUM is None:
        pytest.skip("there is no Chromium: apt install chromium")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=_SOFTWARE)
        try:
            yield chromium
        finally:
            chromium.close()


def new_page(
    chromium: Browser, width: int = 1000, height: int = 700, *, draws: bool = False
) -> Page:
    """Return a page without an address; only one that ``draws`` has a picture of the scene."""
    page = chromium.new_page(viewport={"width": width, "height": height})
    page.set_default_timeout(TIMEOUT_MS)
    if not draws:
        page.add_init_script(_DRAW_NOTHING)
    return page


@contextmanager
def page_of(
    address: str, width: int = 1000, height: int = 700, *, draws: bool = False
) -> Iterator[Page]:
    """Open the address in a browser, as ``new_page`` does.

    The test is skipped where there is none.
    """
    with browser() as chromium:
        page = new_page(chromium, width, height, draws=draws)
        page.goto(address, wait_until="load")
        yield page
