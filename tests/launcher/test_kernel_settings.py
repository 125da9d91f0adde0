"""Processors, real-time priority and prefixes: asked of the kernel before the start, and there in the process."""

from __future__ import annotations

import json
import os
import sys
from dataclasses import replace
from typing import TYPE_CHECKING
from unittest import mock

import pytest

from tests.support import processes
from tests.support.findings import expect
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.launcher.child import spawn
from tfcompose.launcher.kernel_settings import refused_settings
from tfcompose.launcher.preflight import commands_of
from tfcompose.model.plan import Plan, PlanProcess, RosSettings, Schedule
from tfcompose.tf.ros.environment import child_environment

if TYPE_CHECKING:
    from pathlib import Path

    from tfcompose.foundation.findings import Finding
    from tfcompose.launcher.child import Command
    from tfcompose.model.plan import SchedulingPolicy

ASKS = (
    "import json, os; print(json.dumps([sorted(os.sched_getaffinity(0)), os.sched_getscheduler(0),"
    " os.nice(0)]))"
)
ASKS_AS_NOBODY = """
import json, os
from tfcompose.launcher.kernel_settings import refused_settings
from tfcompose.model.plan import PlanProcess, Schedule
if not os.getuid():
    os.setuid(65534)
before = os.sched_getscheduler(0)
found = refused_settings(PlanProcess("p", "run", schedule=Schedule((), "{policy}")))
print(json.dumps([[one.message for one in found], os.sched_getscheduler(0) - before]))
"""
PROCESS = PlanProcess("p", "run", argv=(sys.executable, "-c", ASKS))


def commands(folder: Path, process: PlanProcess) -> tuple[dict[str, Command], list[Finding]]:
    plan = Plan("r", "", None, RosSettings(), (), (process,))
    return commands_of(plan, [process], folder / "plan.json", os.environ, child_environment)


def answer(folder: Path, process: PlanProcess) -> list[object]:
    made, found = commands(folder, process)
    assert found == []
    child = spawn(made["p"], ())
    output = child.communicate(timeout=30)[0]
    assert child.returncode == 0
    return list(json.loads(output))


def test_a_process_runs_on_its_processors_with_its_policy_and_below_its_prefix(
    tmp_path: Path,
) -> None:
    before = os.sched_getaffinity(0), os.sched_getscheduler(0)
    last = max(before[0])
    process = replace(PROCESS, schedule=Schedule((last,), "batch"), prefix=("nice", "-n", "5"))
    cpus, policy, nice = answer(tmp_path, process)
    assert (cpus, policy) == ([last], os.SCHED_BATCH)
    assert nice == min(os.nice(0) + 5, 19), "a suite that is nice itself"
    assert (os.sched_getaffinity(0), os.sched_getscheduler(0)) == before


def test_what_the_kernel_refuses_is_a_finding_and_nothing_is_started(tmp_path: Path) -> None:
    before = os.sched_getaffinity(0)
    _, found = commands(tmp_path, replace(PROCESS, schedule=Schedule((4095,))))
    expect(found[0], "TF911", "p", "CPU 4095")
    with mock.patch.object(os, "sched_setscheduler", side_effect=PermissionError):
        (refused,) = refused_settings(
            replace(PROCESS, schedule=Schedule((min(before),), "fifo", 80))
        )
    expect(refused, "TF911", "p", "fifo", "80")
    assert os.sched_getaffinity(0) == before


@pytest.mark.parametrize("policy", ["batch", "idle"])
def test_what_asks_the_kernel_keeps_its_own_schedule_without_a_right_to_it(
    policy: SchedulingPolicy,
) -> None:
    """A process without privileges cannot leave the policy idle, once it has it."""
    done = processes.run([sys.executable, "-c", ASKS_AS_NOBODY.format(policy=policy)], check=True)
    assert json.loads(done.stdout) == [[], 0]


def test_a_prefix_that_is_not_there_is_named(tmp_path: Path) -> None:
    _, found = commands(tmp_path, replace(PROCESS, prefix=("no_such_runner",)))
    expect(found[0], "TF810", "no_such_runner")


ROBOT = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\nprocesses:\n  p: {run: [x], %s}\n"


def test_the_keys_reach_the_plan() -> None:
    text = (
        ROBOT % "restart: always, restart_delay: 2 s, prefix: gdb -ex 'run fast' --args, schedule:"
        " {priority: 80}"
    )
    robot = compile_robot(text, "r.yaml", library()).robot
    assert robot is not None
    process = plan_of(robot).process("p")
    assert (process.restart_delay, process.schedule) == (2.0, Schedule((), "fifo", 80))
    assert process.prefix == ("gdb", "-ex", "run fast", "--args")


@pytest.mark.parametrize(
    ("keys", "code"),
    [
        ("schedule: {policy: other, priority: 1}", "TF107"),
        ("schedule: {policy: rr}", "TF102"),
        ("schedule: {priority: 100}", "TF106"),
        ('prefix: "a \'b"', "TF106"),
        ("respawn_delay: 2", "TF101"),
    ],
)
def test_wrong_keys_are_findings(keys: str, code: str) -> None:
    assert [one.code for one in compile_robot(ROBOT % keys, "r.yaml", library()).errors] == [code]
