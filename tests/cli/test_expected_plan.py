"""What the commands that look at a running robot expect of it.

The names that frames have there.
"""

from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest

from tfcompose.cli import main
from tfcompose.cli.commands import doctor
from tfcompose.model.plan import Plan

ROBOT = Path(__file__).parents[2] / "robots" / "my_robot.yaml"


@pytest.fixture
def plans(monkeypatch: pytest.MonkeyPatch) -> list[Plan | None]:
    """Have the doctor look at nothing; the plan that it would have judged by comes here."""
    compiled: list[Plan | None] = []

    def plan(
        arguments: Namespace, real: Callable[[Namespace], Plan | None] = doctor._plan
    ) -> NoReturn:
        compiled.append(real(arguments))
        raise SystemExit(77)

    monkeypatch.setattr(doctor, "_plan", plan)
    return compiled


@pytest.mark.ros
def test_the_doctor_expects_frames_by_their_names_on_the_live_tree(
    plans: list[Plan | None],
) -> None:
    words = ["doctor", str(ROBOT), "--set", "ros.frame_prefix=r1/"]
    assert main(words) == 77
    assert plans[0]
    assert {edge.child.partition("/")[0] for edge in plans[0].edges} == {"r1"}


@pytest.mark.ros
def test_the_doctor_lays_nothing_over_a_built_plan(
    plans: list[Plan | None], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["build", str(ROBOT), "-o", str(tmp_path)]) == 0
    assert main(["doctor", str(tmp_path / "plan.json"), "--set", "ros.frame_prefix=r1/"]) == 2
    assert main(["doctor", "cameras:=4", "--for", "0.1"]) == 2
    assert plans == []
    assert "--set" in capsys.readouterr().err
