"""The demos of the gallery run: every edge live, and no finding."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.ros
ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("robot", ["car_roof", "field_rover", "house_robot", "picker"])
def test_a_demo_runs_without_hardware(robot: str, domain: object, tmp_path: Path) -> None:
    assert domain
    words = ["up", f"robots/{robot}.yaml", "-p", "demo", "--for", "10", "-o", str(tmp_path)]
    ran = subprocess.run(
        [sys.executable, "-m", "tfcompose", *words], cwd=ROOT, capture_output=True, text=True, timeout=60, check=False
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "tree complete" in ran.stdout + ran.stderr
    assert "[TF" not in ran.stdout + ran.stderr
