"""Two that start a robot at the same moment copy its plan to the same folder."""

import shutil
from pathlib import Path
from typing import Any

import pytest

from tests.support.plans import compiled_plan
from tests.support.robots import ROVER
from tfcompose.cli.plans import copy_plan
from tfcompose.launcher.runtime_dir import RuntimeDir, runtime_dir_of


@pytest.fixture
def runtime_dir(tmp_path: Path) -> RuntimeDir:
    return runtime_dir_of(compiled_plan(ROVER), {"XDG_RUNTIME_DIR": str(tmp_path)})


def test_the_loser_copies_again_what_the_winner_takes_for_an_earlier_runs(
    runtime_dir: RuntimeDir, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan, saved = compiled_plan(ROVER), Path.write_bytes
    removed: list[Path] = []

    def late(file: Path, data: Any) -> int:
        if not removed:
            removed.append(file.parent)
            shutil.rmtree(file.parent)
        return saved(file, data)

    monkeypatch.setattr(Path, "write_bytes", late)
    copy = copy_plan(plan, tmp_path / "plan.json", runtime_dir, alone=False)
    assert removed
    assert copy.read_text("utf-8")


def test_a_copy_is_never_half_done_and_stays_while_its_plan_is_the_one(
    runtime_dir: RuntimeDir, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan, saved = compiled_plan(ROVER), Path.write_bytes
    copy = copy_plan(plan, tmp_path / "plan.json", runtime_dir, alone=False)
    full = copy.read_bytes()
    observed: list[bytes] = []

    def slow(file: Path, data: Any) -> int:
        saved(file, data[:10])
        observed.append(copy.read_bytes())
        return saved(file, data)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", slow)
        assert copy_plan(plan, tmp_path / "plan.json", runtime_dir, alone=True) == copy
    assert observed == [full]
    assert [file.name for file in copy.parent.iterdir()] == ["plan.json"]
    assert (
        copy_plan(
            compiled_plan(ROVER.replace("lidar", "lamp")),
            tmp_path / "plan.json",
            runtime_dir,
            alone=True,
        )
        != copy
    )
    assert not copy.exists()
