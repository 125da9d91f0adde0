"""``nudge --interactive`` at a shell on a terminal: a robot follows, the terminal is restored."""

from __future__ import annotations

import signal
import sys
from typing import TYPE_CHECKING

import pytest

from tests.support.cli import tfcompose_in
from tests.support.domains import entered_domain
from tests.support.running_robot import RunningRobot
from tests.support.shell import PROMPT, Shell
from tests.support.waiting import until
from tfcompose.cli.adjusting import adjust, moved, running_plan
from tfcompose.cli.runs import chosen_run
from tfcompose.foundation.geometry import Pose

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tfcompose.cli.adjusting import Edges
    from tfcompose.model.plan import Plan, PlanEdge

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("nudge --interactive")]
ROBOT = """\
tfcompose: 1
robot: rover
overlays: {by: hostname, folder: overlays}
frames:
  base_link: {}
  imu: {parent: base_link, xyz: [0, -0.2, 0.05]}
  laser: {parent: base_link, xyz: [0.1, 0, 0.3]}
"""
#: What goes to the other screen of a terminal, and what comes back from it.
OTHER_SCREEN, OWN_SCREEN = "\033[?1049h", "\033[?1049l"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The folder of a running robot."""
    folder = tmp_path_factory.mktemp("robot")
    (folder / "overlays").mkdir()
    (folder / "robot.yaml").write_text(ROBOT)
    with entered_domain(tmp_path_factory.mktemp("domain")):
        running = RunningRobot(folder, "robot.yaml")
        try:
            running.says("tree complete")
            yield folder
        finally:
            running.end()


@pytest.fixture
def shell(folder: Path) -> Iterator[Shell]:
    """A shell in which keys move the laser."""
    made = Shell(folder)
    made.type(f"{sys.executable} -m tfcompose nudge laser -i --as ant\n")
    made.shows("▸ laser", "q quit")
    yield made
    made.close()


def laser(plan: Plan | None = None) -> PlanEdge:
    plan = plan or running_plan(chosen_run(None, "nudge")).plan
    return next(edge for edge in plan.edges if edge.child == "laser")


def shows_after(shell: Shell, *words: str) -> None:
    """Wait until the terminal has its first screen again, and shows the words on it."""

    def is_back() -> bool:
        _, left, text = shell.text.rpartition(OWN_SCREEN)
        is_left = bool(left) and OTHER_SCREEN not in text
        return is_left and all(word in text for word in (*words, PROMPT))

    assert until(is_back), shell.text


def is_restored(shell: Shell) -> bool:
    """Return whether the terminal has its settings and its cursor again."""
    shell.type(
        "stty -a | tr ' ;' '\\n\\n' | grep -cxE 'icanon|echo|ixon' | sed 's/^/settings /'\n"
    )
    shell.shows("settings 3")
    return not shell.screen.cursor.hidden


def test_keys_move_a_mount_undo_reset_and_save_it(shell: Shell, folder: Path) -> None:
    shell.type("\033[A" * 40)
    shell.shows("xyz 0.14 0 0.3 m", "adjusted by 40 mm")
    assert len(laser().earlier) < 20, "a held key is not sent key by key"
    shell.type("\033[D\033[D+\033[B")
    shell.shows("rpy 0 -1 0 deg", "adjusted by 40 mm and 1 deg")
    shell.type("s")
    shell.shows("wrote overlays/ant.yaml")
    assert "0.14" in (folder / "overlays/ant.yaml").read_text()
    shell.type("u")
    shell.shows("rpy 0 0 0 deg")

    def step(plan: Plan) -> Edges:
        return {"laser": moved(laser(plan), Pose((1.0, 2.0, 3.0)))}

    adjust(chosen_run(None, "nudge"), step)
    shell.shows("xyz 1 2 3 m")
    shell.type("rr")
    shell.shows("▸ laser", "as built", "xyz 0.1 0 0.3 m")
    shell.type("\tq")
    shows_after(shell)
    assert laser().adjustment is None
    assert is_restored(shell)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, None])
def test_whatever_ends_it_restores_the_terminal(
    shell: Shell, number: signal.Signals | None
) -> None:
    if number is None:
        shell.type("\032")
        shows_after(shell, "Stopped")
        assert is_restored(shell)
        shell.screen.reset()
        shell.type("fg\n")
        shell.shows("▸ laser", "q quit")
        shell.type("\003")
    else:
        shell.view().send_signal(number)
    shows_after(shell)
    shell.type("echo exit code $?\n")
    shell.shows(f"exit code {128 + (number or signal.SIGINT)}")
    assert is_restored(shell)


@pytest.mark.usefixtures("folder")
def test_without_a_terminal_it_is_refused(folder: Path) -> None:
    done = tfcompose_in(folder, "nudge", "--interactive")
    assert (done.returncode, "terminal" in done.stderr) == (2, True), done
    done = tfcompose_in(folder, "nudge", "laser", "-i", "--x", "+2mm")
    assert (done.returncode, "--interactive" in done.stderr) == (2, True), done


def test_a_refused_save_is_shown_and_a_robot_that_ends_ends_it(shell: Shell, folder: Path) -> None:
    (folder / "robot.yaml").write_text(ROBOT.replace("robot: rover", "robot: cart"))
    shell.type("\033[As")
    shell.shows("[TF667]")
    assert tfcompose_in(folder, "down").returncode == 0
    shows_after(shell, "has ended")
    shell.type("echo exit code $?\n")
    shell.shows("exit code 1")
    assert is_restored(shell)
