"""Robots that colcon installed, with the program that it installed: what ``colcon test`` runs.

``colcon.pkg`` names this file. It needs pytest alone, and no package of this project.
"""

import shutil
import subprocess
from pathlib import Path

import pytest

PROGRAM = Path(shutil.which("tfcompose") or "tfcompose is not on PATH")
ROBOTS = sorted(PROGRAM.parent.parent.glob("share/tfcompose/robots/*.yaml"))


def tfcompose(*arguments: str | Path) -> None:
    """Run a command of the installed program, and fail with its findings."""
    done = subprocess.run([PROGRAM, *arguments], capture_output=True, check=False, text=True)
    if done.returncode != 0:
        pytest.fail(done.stdout + done.stderr, pytrace=False)


def test_the_installed_robots_have_no_findings() -> None:
    assert ROBOTS
    tfcompose("lint", *ROBOTS, "--fail-on", "warning")


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_an_installed_robot_builds(robot: Path, tmp_path: Path) -> None:
    tfcompose("build", robot, "--output", tmp_path)
