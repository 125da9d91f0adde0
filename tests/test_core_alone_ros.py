"""The core without the folder ``tools`` starts, guards and judges a robot."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest

from tests.support.core import copy_core, run_with
from tests.support.house import ROOT

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.support.processes import Started

pytestmark = pytest.mark.ros
ROBOT = ROOT / "robots/autonomous_robot.yaml"


def test_it_starts_guards_and_judges_a_robot(
    start: Callable[..., Started], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    core = copy_core(tmp_path / "core")
    monkeypatch.chdir(tmp_path)
    rehearsed = run_with(core, tmp_path, "up", ROBOT, "-p", "demo", "--dry-run", "-o", "built")
    assert rehearsed.returncode == 0, rehearsed.stdout + rehearsed.stderr
    up = start("tfcompose", "up", ROBOT, "-p", "demo", "-o", tmp_path / "built",
               PYTHONPATH=str(core))  # fmt: skip
    up.until_says("tree complete")
    plan = tmp_path / "built/plan.json"
    for command in (("doctor",), ("verify", plan), ("monitor", "--for", 3), ("ps",)):
        done = run_with(core, tmp_path, *command)
        assert done.returncode == 0, (command, done.stdout, done.stderr)
        assert "Traceback" not in done.stderr
    assert re.search(r"^ +guard +", run_with(core, tmp_path, "ps").stdout, re.MULTILINE)
    assert run_with(core, tmp_path, "down").returncode == 0
    assert not re.search(r"\[TF\d+\]", up.output), up.output
