"""``tfcompose up`` at a shell on a real terminal, which an emulator reads.

It is drawn, left, and put back.
"""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

import psutil
import pytest

from tests.support.shell import PROMPT, Shell
from tests.support.waiting import gone, until

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

pytestmark = pytest.mark.ros

ROBOT = """\
tfcompose: 1
robot: rover
frames:
  base_link: {}
  laser: {parent: base_link, xyz: [0.2, 0, 0.1]}
processes:
  talker:
    run: [python3, -c, "import time; print('\\\\x1b[2Jspeaks', flush=True); time.sleep(600)"]
"""
#: What goes to the other screen of a terminal, and what comes back from it.
OTHER_SCREEN, OWN_SCREEN = "\033[?1049h", "\033[?1049l"


@pytest.fixture
def shell(domain: object, tmp_path: Path) -> Iterator[Shell]:
    assert domain
    (tmp_path / "robot.yaml").write_text(ROBOT)
    made = Shell(tmp_path)
    yield made
    made.close()


def test_ctrl_c_ends_the_robot_and_restores_the_terminal(
    shell: Shell,
) -> None:
    shell.up()
    shell.shows("all well", "talker", "1/1 edges live")
    started = shell.below()
    shell.type("e")
    shell.shows("base_link → laser")
    shell.type("\033")
    shell.shows("q end")
    shell.type("2")
    shell.shows("log of talker", "speaks")
    for columns, rows in ((200, 60), (40, 8), (80, 24)):
        shell.resize(columns, rows)
        assert until(
            lambda: (
                "speaks" in shell.screen_text
                and "Esc back" in shell.screen_text.rpartition("\n")[2]
            )
        )
    shell.type("\003")
    shell.shows("ended", PROMPT)
    assert until(lambda: all(map(gone, started)))
    assert shell.text.count(OTHER_SCREEN) == shell.text.count(OWN_SCREEN) == 1
    shell.type("echo exit code $?\n")
    shell.shows("exit code 0")
    assert not shell.screen.cursor.hidden


def test_ctrl_z_leaves_the_view_and_not_the_robot_and_fg_shows_it_again(shell: Shell) -> None:
    shell.up()
    shell.shows("all well")
    shell.type("\032")
    shell.shows("Stopped", PROMPT)
    launcher = shell.view().children()[0]
    assert shell.view().status() == psutil.STATUS_STOPPED
    assert launcher.status() != psutil.STATUS_STOPPED
    shell.type("stty -a | tr ' ;' '\\n\\n' | grep -cxE 'icanon|echo' | sed 's/^/settings /'\n")
    shell.shows("settings 2")
    shell.type("fg\n")
    shell.shows("all well", "q end")
    shell.type("q")
    shell.shows("q again")
    shell.type("q")
    shell.shows("ended", PROMPT)
    assert until(lambda: gone(launcher))


@pytest.mark.parametrize("number", [signal.SIGQUIT, signal.SIGKILL, None])
def test_whatever_ends_the_view_ends_the_robot(
    shell: Shell, number: signal.Signals | None
) -> None:
    """Its terminal, too, which goes away."""
    shell.up()
    shell.shows("all well")
    started = shell.below()
    if number is None:
        shell.process.kill()
    else:
        shell.view().send_signal(number)
    assert until(lambda: all(map(gone, started)))


def test_a_process_that_fails_ends_it_and_the_reason_stays_on_the_terminal(
    shell: Shell, tmp_path: Path
) -> None:
    (tmp_path / "robot.yaml").write_text(
        ROBOT.replace("time.sleep(600)", "time.sleep(1); raise SystemExit(3)")
    )
    shell.up()
    shell.shows("talker ended with exit code 3", "ended with exit code 1", PROMPT)
    shell.type("echo exit code $?\n")
    shell.shows("exit code 1")


@pytest.mark.parametrize("words", ["--no-live", "| cat"])
def test_elsewhere_it_prints_lines(shell: Shell, words: str) -> None:
    shell.up(words)
    shell.shows("tree complete")
    started = shell.below()
    shell.type("\003")
    assert until(lambda: all(map(gone, started)))
    assert OTHER_SCREEN not in shell.text


def test_ctrl_s_stops_neither_the_view_nor_its_end(shell: Shell) -> None:
    shell.up()
    shell.shows("all well")
    started = shell.below()
    shell.type("\023e")
    shell.shows("base_link → laser")
    shell.view().send_signal(signal.SIGTERM)
    assert until(lambda: all(map(gone, started)))
    shell.shows("ended", PROMPT)


def test_a_blocked_terminal_keeps_neither_view_nor_robot_from_ending(
    shell: Shell,
) -> None:
    shell.up()
    shell.shows("all well")
    started = shell.below()
    shell.reads.clear()
    for _ in range(100):  # more pictures than a terminal holds
        shell.type("e\033")
        shell.resize(200, 60)
        shell.resize(80, 24)
    shell.view().send_signal(signal.SIGTERM)
    assert until(lambda: all(map(gone, started)))
    shell.reads.set()
    shell.shows(PROMPT)


def test_the_view_shows_findings_of_the_build_and_obeys_no_color(
    domain: object, tmp_path: Path
) -> None:
    assert domain
    (tmp_path / "robot.yaml").write_text(f"{ROBOT}vars: {{idle: 1}}\n")
    shell = Shell(tmp_path, NO_COLOR="1")
    try:
        shell.up()
        shell.shows("1 warning", "TF", "idle", "1/1 edges live")
        shell.type("f")
        shell.shows("robot.yaml:9")
        assert shell.colours == {"default"}
        shell.type("\003")
        shell.shows("ended", PROMPT)
    finally:
        shell.close()
