"""``tfcompose guard FILE``: every process but the guard is external."""

from pathlib import Path

import pytest

from tests.support import processes
from tests.support.plans import compiled_plan
from tests.support.robots import ROVER
from tfcompose.launcher.program import HERE
from tfcompose.model.plan.hosts import with_guard_alone


@pytest.mark.parametrize("mode", ["watch", "strict", "off"])
def test_a_guard_alone_starts_nothing_and_watches_the_same_edges(mode: str) -> None:
    plan = compiled_plan(f"{ROVER}guard: {{mode: {mode}}}\n")
    alone = with_guard_alone(plan)
    assert {process.name for process in alone.processes if process.kind != "external"} == {"guard"}
    assert [process.nodes for process in alone.processes] == [
        process.nodes for process in plan.processes
    ]
    assert alone.edges == plan.edges
    assert alone.guard.mode == ("off" if mode == "off" else "watch")


@pytest.mark.parametrize("arguments", [("--dry-run", "robot.yaml"), ("robot.yaml", "--dry-run")])
def test_the_command_and_the_process_guard_have_different_arguments(
    tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    (tmp_path / "robot.yaml").write_text(ROVER, "utf-8")
    done = processes.run((*HERE, "guard", *arguments), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "static (external)" in done.stdout
    assert "guard (guard)" in done.stdout
