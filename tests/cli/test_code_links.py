"""Codes of findings on a terminal are links (OSC 8) to their pages."""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from tests.support.shell import Shell
from tfcompose.cli import terminal
from tfcompose.cli.console import Console
from tfcompose.cli.dashboard import Dashboard
from tfcompose.cli.terminal import code_addresses, code_page, plain, print_findings
from tfcompose.foundation.findings import finding
from tfcompose.model.messages import FindingShown, LogLine
from tfcompose.model.plan import Plan, PlanProcess, RosSettings

FOUND = finding("TF808", "drive ended with exit code 1", None)
PLAN = Plan("rover", "", None, RosSettings(), (), (PlanProcess("drive", "run"),))
URL = "https://example.org/docs"
ADDRESS = f"{URL}/{code_page('TF808')}"
LINK = f"\033]8;;{ADDRESS}\033\\TF808\033]8;;\033\\"


class Terminal(io.StringIO):
    """A stream that says it is a terminal, and keeps what is written."""

    def isatty(self) -> bool:
        return True


class KeptOutput:
    """Keeps what a console writes."""

    text = ""

    def write(self, text: str, *, log: bool = False) -> None:
        del log
        self.text += text


@pytest.fixture(autouse=True)
def _environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("TFCOMPOSE_DOCS", URL)


def printed(stream: io.StringIO) -> str:
    print_findings([FOUND], stream)
    return stream.getvalue()


def test_a_code_leads_to_its_page_below_a_url(monkeypatch: pytest.MonkeyPatch) -> None:
    assert LINK in printed(Terminal())
    monkeypatch.setenv("TFCOMPOSE_DOCS", f"{URL}/")
    assert LINK in printed(Terminal())
    monkeypatch.setenv("TFCOMPOSE_DOCS", "https://example.org/a b\033\\\n")
    assert "https://example.org/a%20b%1B%5C%0A/codes/" in printed(Terminal())


def test_a_code_leads_to_its_page_in_a_folder_that_has_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    page = tmp_path / "my docs" / code_page("TF808")
    page.parent.mkdir(parents=True)
    page.touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TFCOMPOSE_DOCS", "my docs")
    address = urlsplit(code_addresses(Terminal())("TF808"))
    assert (address.scheme, address.netloc) == ("file", os.uname().nodename)
    assert Path(unquote(address.path)) == page
    assert code_addresses(Terminal())("TF809") == "", "no page, no link"


def test_the_projects_own_address_is_the_default(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("TFCOMPOSE_DOCS")
    assert "\033]8" not in printed(Terminal()), "it has none yet"
    monkeypatch.setattr(terminal, "DOCUMENTATION_URL", URL)
    assert LINK in printed(Terminal())


def test_a_pipe_or_a_plain_terminal_gets_no_links(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert "\033]8" not in printed(io.StringIO())
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert "\033]8" not in printed(io.StringIO()), "colours are forced, links are not"
    for name, value in (("NO_COLOR", "1"), ("TERM", "dumb")):
        with monkeypatch.context() as context:
            context.setenv(name, value)
            assert "\033]8" not in printed(Terminal())


def test_up_links_codes_of_its_findings_and_leaves_no_link_of_a_process() -> None:
    output = KeptOutput()
    kept: list[str] = []
    console = Console(
        PLAN,
        output,
        colour=True,
        address_of=code_addresses(Terminal()),
        keep=lambda _, text: kept.append(text),
    )
    console(FindingShown(FOUND))
    console(LogLine("drive", "stdout", f"see {LINK}"))
    assert output.text.count(LINK) == 1
    assert "see TF808" in plain(output.text)
    assert "\033" not in "".join(kept)


def test_the_live_view_links_codes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", Terminal())
    dashboard = Dashboard("rover", PLAN, [FOUND])
    drawn = dashboard.rows(60, 10)
    row = next(row for row in drawn if "TF808" in row)
    assert f";{ADDRESS}\033\\" in row
    assert dashboard.rows(60, 10) == drawn, "a row that is the same is not drawn again"
    assert max(len(plain(row)) for row in drawn) <= 60


def test_lint_links_codes_on_a_real_terminal(tmp_path: Path) -> None:
    text = "tfcompose: 1\nrobot: r\nframes: {Base: {}}\n"
    (tmp_path / "robot.yaml").write_text(text, "utf-8")
    shell = Shell(tmp_path, TFCOMPOSE_DOCS=URL)
    try:
        shell.type(f"{sys.executable} -m tfcompose lint; echo linted-$((1))\n")
        shell.shows("warning[TF503]", "linted-1")
        assert f"\033]8;;{URL}/codes/TF503.html\033\\TF503\033]8;;\033\\" in shell.text
    finally:
        shell.close()
