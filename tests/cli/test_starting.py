"""What ``up -d`` says before it leaves the robot to itself."""

from argparse import Namespace
from pathlib import Path
from typing import Any, cast

import pytest

from tfcompose.cli import starting
from tfcompose.launcher.runtime_dir import RuntimeDir
from tfcompose.model.plan import Plan, RosSettings


@pytest.mark.parametrize("goes", [True, False])
def test_a_background_robot_warns_of_a_logout_that_removes_its_folder(
    *,
    goes: bool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(starting, "goes_with_logout", lambda _: goes)
    monkeypatch.setattr(starting, "user_name", lambda: "robot")
    monkeypatch.setattr(starting, "_fork", lambda *_: 7)
    monkeypatch.setattr(starting, "_follow", lambda *_: 0)
    runtime_dir = RuntimeDir("rover@0", tmp_path, tmp_path)
    plan = Plan("rover", "", None, RosSettings(), (), ())
    lock = session = cast("Any", None)
    assert starting._detach(plan, runtime_dir, lock, session, Namespace(duration=None)) == 0
    assert capsys.readouterr().err.count("loginctl enable-linger robot") == goes
