"""``verify`` of a file, where the robot runs by another plan, as by another profile."""

from argparse import Namespace
from dataclasses import replace
from pathlib import Path

import pytest

from tfcompose.cli import runs
from tfcompose.cli.commands import verify
from tfcompose.foundation.findings import finding
from tfcompose.guard.verdict.verify import Verdict
from tfcompose.launcher.runtime_dir import RuntimeDir
from tfcompose.model.plan import Plan, PlanProcess, RosSettings

REAL = Plan("rover", "a", "base", RosSettings(), (), (PlanProcess("drive", "run", nodes=("/d",)),))
DEMO = replace(REAL, processes=(PlanProcess("drive", "simulate", nodes=("/d",)),))


@pytest.mark.parametrize(
    ("running", "is_other"),
    [
        (DEMO, True),
        (replace(REAL, overlays=("overlays/ant.yaml",)), True),
        (replace(REAL, spec_digest="b"), False),
        (replace(DEMO, robot="x"), False),
    ],
    ids=["another profile", "an overlay", "another pose", "another robot"],
)
def test_a_robot_that_runs_by_a_variant_is_named_first(
    running: Plan,
    is_other: bool,  # noqa: FBT001 (a case of the test)
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    runtime_dir = RuntimeDir("rover@7", tmp_path, tmp_path)
    monkeypatch.setattr(runs, "run_of_domain", lambda: (runtime_dir, running))
    plan = verify.other_plan(Namespace(bag=None), REAL)
    assert (plan is running) is is_other
    assert ("rover@7" in capsys.readouterr().err) is is_other


def test_nothing_is_advised_against_a_process_of_the_plan_that_runs() -> None:
    wrong = finding("TF801", "a → b is published by /d; the owner is x (/x)", None, help="end /d")
    unrelated = finding(
        "TF801", "a → b is published by /e; the owner is x (/x)", None, help="end /e"
    )
    (first, second) = verify.of_other_plan(
        Verdict("a → b", "x", (wrong, unrelated)), DEMO
    ).findings
    assert "--running" in first.help
    assert second == unrelated
