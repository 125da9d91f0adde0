"""A plan is input, as a robot file is.

What no build writes is refused, and a review shows what is there.
"""

import json
import os
from collections.abc import Callable
from itertools import permutations
from pathlib import Path
from typing import Any

import pytest

from tfcompose.cli import main
from tfcompose.foundation.findings import RejectedError
from tfcompose.model.plan.file import read_plan

BUILT = json.loads(
    (Path(__file__).parents[2] / "golden" / "my_robot" / "plan.json").read_text("utf-8")
)


def changed(**processes: Any) -> Callable[[dict[str, Any]], None]:
    return lambda plan: plan["processes"][0].update(processes)


def deep(levels: int) -> list[Any]:
    made: list[Any] = []
    for _ in range(levels):
        made = [made]
    return made


WRONG: dict[str, Callable[[dict[str, Any]], Any]] = {
    "a program as the robot's name": lambda plan: plan.update(
        robot='r"); import os; os.system("x'
    ),
    "a line as the robot's name": lambda plan: plan.update(robot="r\nExecStart=/bin/x"),
    "a lone surrogate": lambda plan: plan.update(robot="\ud800x"),
    "an escape sequence as a name": changed(name="a\x1b[31m"),
    "a workflow command as a name": changed(name="::error::x"),
    "a NUL in an argument": changed(argv=["a\0b"]),
    "an escape sequence in the environment": changed(env={"A": "\x1b[2J"}),
    "an escape sequence as a variable": changed(env={"\x1b[2J": "1"}),
    "a wait for nobody": changed(after={"nobody": "ready"}),
    "processes that wait for each other": lambda plan: [
        process.update(after={awaited["name"]: "ready"})
        for process, awaited in permutations(plan["processes"][:2])
    ],
    "lists as deep as JSON is read": lambda plan: plan.update(more=deep(900), robot="\ud800"),
    "an owner that is no process": lambda plan: plan["edges"][0].update(owner="nobody"),
    "two processes of a name": lambda plan: plan["processes"].append(plan["processes"][0]),
    "parameters from elsewhere": changed(params_file="/etc/shadow"),
    "parameters from above": changed(params_file="params/../../x.yaml"),
    "a description from elsewhere": lambda plan: plan.update(description="/etc/passwd"),
    "a pattern that is none": changed(
        ready={"kind": "log", "text": "(", "number": 0, "timeout_s": None}
    ),
}


def plan_with(change: Callable[[dict[str, Any]], Any]) -> str:
    plan = json.loads(json.dumps(BUILT))
    change(plan)
    return json.dumps(plan)


def test_what_no_build_writes_is_refused() -> None:
    for name, change in WRONG.items():
        with pytest.raises(RejectedError) as rejected:
            read_plan(plan_with(change), "plan.json")
        findings = rejected.value.findings
        assert {finding.code for finding in findings} == {"TF902"}, name
        assert all(finding.message.isprintable() for finding in findings), name


def test_all_that_is_wrong_is_found_at_once() -> None:
    first, *rest = BUILT["processes"]
    processes = [first | {"after": {"nobody": "ready"}}, *rest]
    with pytest.raises(RejectedError) as rejected:
        read_plan(json.dumps(BUILT | {"robot": "R", "processes": processes}), "plan.json")
    assert len(rejected.value.findings) == 2


def test_a_program_may_be_given_several_lines() -> None:
    plan = read_plan(
        plan_with(changed(argv=["/bin/sh", "-c", "a\n\tb"], env={"A": "b\nc"})), "plan.json"
    )
    assert plan.processes[0].argv[2] == "a\n\tb"


@pytest.mark.parametrize("name", ["ur-driver", "3d_lidar", "cam.left", "arm/ur-driver", "arm/_x"])
def test_every_name_that_a_robot_file_may_give_to_a_process_is_taken(name: str) -> None:
    """As rule TF501 has it."""
    text = plan_with(lambda plan: plan["processes"][-1].update(name=name))
    assert read_plan(text, "plan.json").processes[-1].name == name


@pytest.mark.parametrize("kind", ["pipe", "link", "terminal"])
def test_a_review_neither_waits_nor_reads_elsewhere_nor_moves_the_cursor(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "secret").write_text("password: 7\n")
    folder = tmp_path / "built"
    folder.mkdir()
    (folder / "plan.json").write_text(
        plan_with(changed(params_file="p.yaml", argv=["x", "a\n::error::b"]))
    )
    if kind == "pipe":
        os.mkfifo(folder / "p.yaml")
    elif kind == "link":
        (folder / "p.yaml").symlink_to(tmp_path / "secret")
    else:
        (folder / "p.yaml").write_text("a: 1 # \x1b[2J\x9b2J\n")
    assert main(["up", str(folder / "plan.json"), "--dry-run"]) == 0
    output = capsys.readouterr().out
    assert "password" not in output
    assert all(line.isprintable() and not line.startswith("::") for line in output.splitlines())
