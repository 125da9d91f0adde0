"""The core without the folder ``tools`` starts, guards and judges a robot."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from tests.support import processes
from tests.support.core import run_with
from tests.support.processes import Started
from tests.support.robots import ROVER

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("core")]


def test_it_starts_guards_and_judges_a_robot(domain: object, core: Path, tmp_path: Path) -> None:
    assert domain
    (tmp_path / "robot.yaml").write_text(ROVER, "utf-8")
    rehearsed = run_with(core, tmp_path, "up", "--dry-run", "-o", "built")
    assert rehearsed.returncode == 0, rehearsed.stdout + rehearsed.stderr
    command = [sys.executable, "-m", "tfcompose", "up", "-o", "built"]
    environment = os.environ | {"PYTHONPATH": str(core)}
    process = processes.start(
        command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    up = Started(process)
    try:
        up.until_says("tree complete")
        plan = tmp_path / "built/plan.json"
        for judges in (("doctor",), ("verify", plan), ("monitor",)):
            done = run_with(core, tmp_path, *judges, "--for", 2)
            assert done.returncode == 0, (judges, done.stdout, done.stderr)
            assert "Traceback" not in done.stderr
        assert re.search(r"^ +guard +", run_with(core, tmp_path, "ps").stdout, re.MULTILINE)
        assert run_with(core, tmp_path, "down").returncode == 0
        assert not re.search(r"\[TF\d+\]", up.output), up.output
    finally:
        up.close()
