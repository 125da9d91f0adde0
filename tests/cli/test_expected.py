"""What the commands that look at a running robot expect of it: the names that frames have there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tfcompose.cli.commands import doctor
from tfcompose.cli.parser import main

ROBOT = Path(__file__).parents[2] / "robots" / "my_robot.yaml"


@pytest.fixture
def looked(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Have the doctor look at nothing; what it would have judged by comes here."""
    plans: list[Any] = []
    monkeypatch.setattr(doctor, "_plan", _noting(plans, doctor._plan))
    return plans


def _noting(plans: list[Any], real: Any) -> Any:
    def plan(arguments: Any) -> int:
        plans.append(real(arguments))
        return 77

    return plan


def test_the_doctor_expects_frames_by_their_names_on_the_live_tree(looked: list[Any]) -> None:
    words = ["doctor", str(ROBOT), "--set", "ros.frame_prefix=r1/"]
    assert main(words) == 77
    assert {edge.child.partition("/")[0] for edge in looked[0].edges} == {"r1"}


def test_the_doctor_lays_nothing_over_a_built_plan(
    looked: list[Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["build", str(ROBOT), "-o", str(tmp_path)]) == 0
    assert main(["doctor", str(tmp_path / "plan.json"), "--set", "ros.frame_prefix=r1/"]) == 77
    assert looked == [2]
    assert "those are for building it" in capsys.readouterr().err
