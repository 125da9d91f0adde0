"""Each window has a selection, joints and unsaved moves of its own; two that edit save in turn."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import viser
from playwright.sync_api import Browser, Page

from tests.support.browser import TIMEOUT_MS, address_of, browser, new_page
from tests.support.waiting import until
from tests.tools.view.test_browser import enter
from tfcompose.cli.parser import parser_of
from tfcompose.cli.reading import read_text
from tfcompose.foundation.geometry import Pose
from tfcompose.tools.view.panel import Panel
from tfcompose.tools.view.reload import WatchedFiles
from tfcompose.tools.view.view_session import session_of
from tfcompose.tools.view.windows import SceneSource, Windows

pytestmark = pytest.mark.xdist_group("browser")

TEXT = """tfcompose: 1
robot: r
links: {base_link: {}, arm: {}}
joints: {j: {type: continuous, parent: base_link, child: arm, xyz: [0, 0, 1], axis: [0, 0, 1]}}
frames:
  tool: {parent: arm, xyz: [1, 0, 0]}
  mast: {parent: base_link, xyz: [0, 0, 2]}
"""


@pytest.fixture
def windows(tmp_path: Path, server: viser.ViserServer) -> Windows:
    (tmp_path / "r.yaml").write_text(TEXT, "utf-8")
    files = WatchedFiles(read_text)
    arguments = parser_of("view").parse_args([str(tmp_path / "r.yaml")])
    session = session_of(str(tmp_path / "r.yaml"), arguments, files)
    return Windows(server, session, files, SceneSource(has_edit=True))


@contextmanager
def opened(
    chromium: Browser, server: viser.ViserServer, windows: Windows
) -> Iterator[tuple[Page, Panel]]:
    """Open one more window; yield its page and its panel."""
    before = len(windows.panels)
    page = new_page(chromium)
    page.goto(address_of(server), wait_until="load")
    assert until(lambda: len(windows.panels) > before, TIMEOUT_MS / 1000)
    try:
        yield page, windows.panels[-1].panel
    finally:
        page.close()


def save(windows: Windows, number: int) -> str:
    """Press save in a window; return what it reports."""
    panel = windows.panels[number].panel
    panel.save()
    return str(windows.panels[number].panel.report.content)


def test_two_windows_choose_for_themselves_and_save_one_after_the_other(
    windows: Windows, server: viser.ViserServer, tmp_path: Path
) -> None:
    file = tmp_path / "r.yaml"
    with browser() as chromium, opened(chromium, server, windows) as (page, first):
        with opened(chromium, server, windows) as (_, second):
            enter(page, "search", "tool")
            assert until(lambda: first.selected == "tool")
            enter(page, "j (deg)", "30")
            assert until(lambda: first.positions["j"] > 0.5)
            assert second.selected != "tool"
            assert second.positions["j"] == 0

            second.session.move("mast", Pose((0, 0, 3)))
            second.session.move("tool", Pose((2, 0, 0)))
            first.session.move("tool", Pose((4, 0, 0)))
            assert "+  tool: {parent: arm, xyz: [4, 0, 0]}" in save(windows, 0)
            assert not first.session.moved

            report = str(windows.panels[1].panel.report.content)
            assert "another window" in report
            assert "tool" in report
            assert second.session.moved == {"mast": Pose((0, 0, 3)), "tool": Pose((2, 0, 0))}
            assert "not saved" in save(windows, 1)
            assert "[4, 0, 0]" in file.read_text("utf-8"), "nothing is lost silently"
            assert "+  mast: {parent: base_link, xyz: [0, 0, 3]}" in save(windows, 1)
            assert "tool: {parent: arm, xyz: [2, 0, 0]}" in file.read_text("utf-8")
            page.get_by_text("another window saved").wait_for()
            edge = windows.panels[0].session.robot.parent_edge("mast")
            assert edge
            assert edge.pose == Pose((0, 0, 3))
            second.session.move("mast", Pose((0, 0, 5)))
            windows.panels[1].panel.choices.selected = "mast"
        assert until(lambda: len(windows.panels) == 1)
        with opened(chromium, server, windows) as (_, third):
            assert third.selected == "mast", "a page that is loaded again goes on"
            assert third.session.moved == {"mast": Pose((0, 0, 5))}


def test_all_windows_show_a_changed_file_and_later_ones_its_errors(
    windows: Windows, server: viser.ViserServer, tmp_path: Path
) -> None:
    file = tmp_path / "r.yaml"
    with (
        browser() as chromium,
        opened(chromium, server, windows),
        opened(chromium, server, windows),
    ):
        file.write_text(TEXT.replace("[0, 0, 2]", "[0, 0, 7]"), "utf-8")
        windows.reload()
        for window in windows.panels:
            assert window.panel.poses()["mast"].xyz == (0, 0, 7)
        file.write_text("tfcompose: [", "utf-8")
        windows.reload()
        with opened(chromium, server, windows):
            for window in windows.panels:
                assert "TF002" in window.report
                assert window.panel.poses()["mast"].xyz == (0, 0, 7)
