"""What the kernel follows of a process: asked before the start, and there in the process."""

from __future__ import annotations

import json
import os
import resource
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING
from unittest import mock

import pytest

from tests.support import processes
from tests.support.findings import expect
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.launcher.child import spawn
from tfcompose.launcher.kernel_settings import SETTINGS, check_settings
from tfcompose.launcher.preflight import commands_of
from tfcompose.model.plan import Plan, PlanProcess, RosSettings, Schedule
from tfcompose.tf.ros.environment import child_environment
from tfcompose.tools.exporters.kubernetes import Cluster, kubernetes
from tfcompose.tools.exporters.launch import launch
from tfcompose.tools.exporters.launch_frontends import LaunchFile
from tfcompose.tools.exporters.supervisors import Machine, compose, systemd

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Finding
    from tfcompose.launcher.child import ChildCommand
    from tfcompose.model.plan import SchedulingPolicy

#: What the cases ask the kernel by.
KERNEL = {"os": os, "resource": resource, "Path": Path}
LAST_CPU = max(os.sched_getaffinity(0))
ROBOT = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\nprocesses:\n  p: {%s, %s}\n"


@dataclass(frozen=True, slots=True)
class Case:
    """A key in a robot file, and what comes of it.

    ``planned`` is its value in the plan; ``asks`` Python that gives what the kernel says of the
    process that runs it, which is ``answer``. ``unit`` and ``service`` are lines of the exports
    for systemd and compose. ``refused`` is a value that a user without rights cannot have.
    """

    text: str
    planned: object
    asks: str
    answer: object
    refused: object
    unit: str = ""
    service: str = ""


CASES = {
    "schedule": Case(
        f"{{cpus: [{LAST_CPU}], policy: batch}}",
        Schedule((LAST_CPU,), "batch"),
        "[sorted(os.sched_getaffinity(0)), os.sched_getscheduler(0)]",
        [[LAST_CPU], os.SCHED_BATCH],
        Schedule(policy="fifo", priority=80),
    ),
    "oom_score_adj": Case(
        "500",
        500,
        "int(Path('/proc/self/oom_score_adj').read_text())",
        500,
        -999,
        unit="OOMScoreAdjust=500",
        service="oom_score_adj: 500",
    ),
    "open_files": Case(
        "256",
        256,
        "list(resource.getrlimit(resource.RLIMIT_NOFILE))",
        [256, 256],
        2**30,
        unit="LimitNOFILE=256",
        service="nofile: 256",
    ),
}
ASKS_AS_NOBODY = """
import os
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.launcher.kernel_settings import check_settings
from tfcompose.model.plan import PlanProcess, Schedule
CATALOGUE.load()  # the installation may be of another user
if not os.getuid():
    os.setuid(65534)
before = {asks}
found = check_settings(PlanProcess("p", "run", {key}={value!r}))
print([one.code for one in found], {asks} == before)
"""
PROCESS = PlanProcess("p", "run", argv=(sys.executable, "-c", "import os; print(os.nice(0))"))


def process_with(key: str, case: Case) -> PlanProcess:
    """Return the process of a robot file that has the key and prints what the kernel says."""
    program = [
        sys.executable,
        "-c",
        f"import json, os, resource; from pathlib import Path; print(json.dumps({case.asks}))",
    ]
    text = ROBOT % (f"run: {json.dumps(program)}", f"{key}: {case.text}")
    robot = compile_robot(text, "r.yaml", library()).robot
    assert robot is not None
    return plan_of(robot).process("p")


def commands(folder: Path, process: PlanProcess) -> tuple[dict[str, ChildCommand], list[Finding]]:
    plan = Plan("r", "", None, RosSettings(), (), (process,))
    return commands_of(plan, [process], folder / "plan.json", os.environ, child_environment)


def answer(folder: Path, process: PlanProcess) -> object:
    made, findings = commands(folder, process)
    assert findings == []
    child = spawn(made["p"], ())
    output = child.communicate(timeout=30)[0]
    assert child.returncode == 0
    return json.loads(output)


def test_each_setting_has_a_case() -> None:
    assert CASES.keys() == {setting.key for setting in SETTINGS}


@pytest.mark.parametrize("key", CASES)
def test_a_key_reaches_the_plan_the_process_and_other_supervisors(
    key: str, tmp_path: Path
) -> None:
    case = CASES[key]
    process = process_with(key, case)
    assert getattr(process, key) == case.planned
    before = eval(case.asks, KERNEL)  # noqa: S307 (of this table)
    assert answer(tmp_path, process) == case.answer
    assert eval(case.asks, KERNEL) == before  # noqa: S307
    plan = Plan("r", "", None, RosSettings(), (), (process,))
    for export, line in ((systemd, case.unit), (compose, case.service)):
        text = "".join(file.text for file in export(plan, Machine("/plan"))[0])
        assert line in [lines.strip() for lines in text.splitlines()] or not line


@pytest.mark.parametrize("key", CASES)
def test_launch_starts_such_a_process_by_the_launcher_and_a_pod_names_it(key: str) -> None:
    process = process_with(key, CASES[key])
    plan = Plan("r", "", None, RosSettings(), (), (process,))
    text = "".join(file.text for file in launch(plan, LaunchFile("/plan"), "<robot/>")[0])
    assert 'process("p"' in text
    gaps = kubernetes(plan, Cluster("image"), {"plan.json": ""})[1]
    assert any(key in gap for gap in gaps) == (key != "schedule")


@pytest.mark.parametrize("key", CASES)
def test_what_a_user_has_no_right_to_is_a_finding(key: str) -> None:
    case = CASES[key]
    code = ASKS_AS_NOBODY.format(key=key, value=case.refused, asks=case.asks)
    done = processes.run(
        [sys.executable, "-c", f"import resource; from pathlib import Path{code}"], check=True
    )
    assert done.stdout.split("\n")[0] == "['TF911'] True"


def test_a_process_runs_below_its_prefix(tmp_path: Path) -> None:
    process = replace(PROCESS, prefix=("nice", "-n", "5"))
    assert answer(tmp_path, process) == min(os.nice(0) + 5, 19), "a suite that is nice itself"


def test_what_the_kernel_refuses_is_a_finding_and_nothing_is_started(tmp_path: Path) -> None:
    before = os.sched_getaffinity(0)
    _, findings = commands(tmp_path, replace(PROCESS, schedule=Schedule((4095,))))
    expect(findings[0], "TF911", "p", "CPU 4095")
    with mock.patch.object(os, "sched_setscheduler", side_effect=PermissionError):
        (refused,) = check_settings(
            replace(PROCESS, schedule=Schedule((min(before),), "fifo", 80))
        )
    expect(refused, "TF911", "p", "fifo", "80")
    assert os.sched_getaffinity(0) == before


@pytest.mark.parametrize("policy", ["batch", "idle"])
def test_what_asks_the_kernel_keeps_its_own_schedule_without_a_right_to_it(
    policy: SchedulingPolicy,
) -> None:
    """A process without privileges cannot leave the policy idle, once it has it."""
    code = ASKS_AS_NOBODY.format(
        key="schedule", value=Schedule((), policy), asks="os.sched_getscheduler(0)"
    )
    done = processes.run([sys.executable, "-c", code], check=True)
    assert done.stdout.split("\n")[0] == "[] True"


def test_a_prefix_that_is_not_there_is_named(tmp_path: Path) -> None:
    _, findings = commands(tmp_path, replace(PROCESS, prefix=("no_such_runner",)))
    expect(findings[0], "TF810", "no_such_runner")


def test_the_keys_reach_the_plan() -> None:
    keys = "restart_delay: 2 s, prefix: gdb -ex 'run fast' --args, schedule: {priority: 80}"
    text = ROBOT % ("run: [x], restart: always", keys)
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
    assert [
        finding.code
        for finding in compile_robot(ROBOT % ("run: [x]", keys), "r.yaml", library()).errors
    ] == [code]
