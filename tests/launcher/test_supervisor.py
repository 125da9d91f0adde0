"""Real processes, without ROS: plain Python children stand in for what a plan starts."""

import os
import shutil
import signal
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from signal import SIGHUP, SIGINT, SIGKILL, SIGTERM
from typing import Any

import psutil
import pytest

from tests.support.findings import expect
from tests.support.launcher import SLEEPER, Launcher, guard, plan_of, program
from tests.support.waiting import TIMEOUT_S, gone, until
from tfcompose.foundation import findings
from tfcompose.foundation.catalogue import Catalogue
from tfcompose.launcher import supervisor
from tfcompose.launcher.child import READ_SIZE
from tfcompose.launcher.output import EventStream
from tfcompose.launcher.preflight import own_env
from tfcompose.launcher.state import Times
from tfcompose.launcher.supervisor import RunSession, supervise
from tfcompose.model.messages import (
    Clear,
    Ended,
    FindingShown,
    Live,
    LogLine,
    Notice,
    OwnerReady,
    ProcessState,
    Remember,
    Stopping,
    TreeComplete,
    line_of,
    read_notice,
)
from tfcompose.model.plan import Plan, PlanProcess, Ready, RosSettings

#: Starts a child of its own that heeds no signal but SIGKILL, and says both process numbers.
PARENT = """
import os, signal, subprocess, sys, time
ignore = "signal.signal(signal.SIGINT, signal.SIG_IGN); signal.signal(signal.SIGTERM, signal.SIG_IGN)"
deaf = f"import signal, time; {ignore}; print('deaf', flush=True); time.sleep(180)"
child = subprocess.Popen([sys.executable, "-I", "-S", "-c", deaf], stdout=subprocess.PIPE)
child.stdout.readline()
print("pids", os.getpid(), child.pid, flush=True)
time.sleep(180)
"""  # noqa: E501 (a text as its reader has it)
HEAD_OF_TF808 = "name: process_failed\nseverity: error\nfamily: processes\n"
DEAF = """
import os, signal, time
signal.signal(signal.SIGINT, signal.SIG_IGN)
signal.signal(signal.SIGTERM, signal.SIG_IGN)
print("pids", os.getpid(), flush=True)
time.sleep(180)
"""


def run(tmp_path: Path, *processes: PlanProcess, **more: Any) -> tuple[int, list[Notice]]:
    """Run the plan in this process and return its exit code and what was told."""
    notices: list[Notice] = []
    code = supervise(plan_of(*processes), tmp_path / "plan.json", report=notices.append, **more)
    return code, notices


def logged(notices: list[Notice], process: str) -> list[str]:
    return [
        notice.text
        for notice in notices
        if isinstance(notice, LogLine) and notice.process == process
    ]


@pytest.mark.parametrize("number", [SIGINT, SIGTERM, SIGHUP])
def test_a_signal_ends_everything_with_0_and_no_process_is_left(
    launch: Callable[..., Launcher], number: int
) -> None:
    launcher = launch(guard(Clear()), program("a", PARENT), program("b", PARENT))
    assert until(lambda: len(launcher.pids()) == 4)
    below = launcher.below()
    assert set(launcher.pids()) < set(below)
    os.kill(launcher.popen.pid, number)
    assert launcher.popen.wait(TIMEOUT_S) == 0
    assert until(lambda: [pid for pid in below if not gone(pid)] == []), (
        "the kernel may still be ending what was killed"
    )


@pytest.mark.parametrize("holder", ["runs", "told", "dead"])
def test_sigkill_of_the_launcher_takes_its_children_along(
    launch: Callable[..., Launcher], holder: str
) -> None:
    launcher = launch(program("a", PARENT), program("b", DEAF))
    assert until(lambda: len(launcher.pids()) == 3)
    below, children = launcher.below(), launcher.below()
    (shell,) = [
        pid for pid in launcher.below(recursive=False) if psutil.Process(pid).name() == "sh"
    ]
    if "told" in holder:
        os.kill(shell, SIGTERM)
    if "dead" in holder:
        children = launcher.below(recursive=False)
        os.kill(shell, SIGKILL)
        assert until(lambda: gone(shell))
    launcher.popen.kill()
    launcher.popen.wait()
    try:
        assert until(lambda: all(gone(pid) for pid in children))
        assert len(children) == (3 if "dead" in holder else 4)
    finally:
        for pid in below:
            if not gone(pid):
                os.kill(pid, SIGKILL)


def test_a_child_that_ignores_sigint_and_sigterm_is_killed(tmp_path: Path) -> None:
    times = Times(interrupt_s=0.2, terminate_s=0.2)
    notices: list[Notice] = []

    def report(notice: Notice) -> None:
        notices.append(notice)
        if isinstance(notice, LogLine):
            os.kill(os.getpid(), SIGINT)

    assert (
        supervise(plan_of(program("a", DEAF)), tmp_path / "plan.json", report=report, times=times)
        == 0
    )
    details = [
        notice.detail
        for notice in notices
        if isinstance(notice, ProcessState) and notice.state == "stopping"
    ]
    assert [detail.split()[-1] for detail in details] == ["SIGINT", "SIGTERM", "SIGKILL"]
    assert gone(int(logged(notices, "a")[0].split()[1]))


def test_what_a_process_leaves_in_its_group_ends_with_it(tmp_path: Path) -> None:
    code, notices = run(tmp_path, program("a", PARENT.replace("time.sleep(180)\n", "")))
    assert code == 0
    assert until(
        lambda: gone(int(logged(notices, "a")[0].split()[2]))
    )  # init may still have to bury it


def test_a_process_that_left_its_group_is_not_waited_for(tmp_path: Path) -> None:
    code = PARENT.replace("stdout=subprocess.PIPE)", "start_new_session=True)")
    code = code.replace("child.stdout.readline()\n", "").replace("time.sleep(180)\n", "")
    code = code.replace(
        "print('deaf', flush=True); ", ""
    )  # nobody may read it any more, and that would end it
    _, notices = run(tmp_path, program("a", code))
    (output,) = [line for line in logged(notices, "a") if line.startswith("pids")]
    assert not gone(int(output.split()[2]))
    os.kill(int(output.split()[2]), SIGKILL)


def test_a_failed_process_is_named_with_its_last_lines_and_exit_code_1(
    tmp_path: Path,
) -> None:
    failing = "import sys; [print(i) for i in range(20)]; sys.exit('no lidar at /dev/ttyUSB0')"
    code, notices = run(tmp_path, program("lidar", failing), program("b", SLEEPER))
    (finding,) = [notice.found for notice in notices if isinstance(notice, FindingShown)]
    assert code == 1
    expect(finding, "TF808", "lidar", "exit code 1", "lidar: no lidar at /dev/ttyUSB0")
    assert len(finding.notes) == 8
    assert notices[-1] == Ended(1, (finding.message, *(note.message for note in finding.notes)))


def test_a_finding_needs_no_file_once_the_plan_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The package may be upgraded, or its disk be lost, under a robot that runs."""
    folder, flag = tmp_path / "codes", tmp_path / "flag"
    folder.mkdir()
    (folder / "TF808.md").write_text(f"---\n{HEAD_OF_TF808}---\n\nA page.\n", encoding="utf-8")
    copy = Catalogue(folder)
    monkeypatch.setattr(supervisor, "CATALOGUE", copy)
    monkeypatch.setattr(findings, "CATALOGUE", copy)
    notices: list[Notice] = []

    def report(notice: Notice) -> None:
        notices.append(notice)
        if isinstance(notice, LogLine) and folder.exists():
            shutil.rmtree(folder)
            flag.touch()

    waits = (
        "import os, sys, time; print('up', flush=True)\n"
        "while not os.path.exists(sys.argv[1]): time.sleep(0.01)\n"
        "sys.exit(1)"
    )
    plan = plan_of(program("lidar", waits, str(flag)))
    assert supervise(plan, tmp_path / "plan.json", report=report, duration_s=60) == 1
    assert [notice.found.code for notice in notices if isinstance(notice, FindingShown)] == [
        "TF808"
    ]


def test_a_process_that_fails_is_started_again(tmp_path: Path) -> None:
    flag = tmp_path / "flag"
    code = (
        "import os, sys; os.path.exists(sys.argv[1]) or sys.exit(bool(open(sys.argv[1], 'w')));"
        " print('again')"
    )
    times = Times(backoff_s=0.05)
    assert logged(
        run(tmp_path, program("a", code, str(flag), restart="on-failure"), times=times)[1], "a"
    ) == ["again"]


def test_a_flood_neither_fills_the_memory_nor_starves_other_processes(
    tmp_path: Path,
) -> None:
    flood = "import os\nwhile True: os.write(1, b'flood\\n' * 1000)"
    endless = "import os\nwhile True: os.write(2, b'x' * 6000)"
    observed = {"a": 0, "b": 0, "c": 0}
    longest = requested = handled = 0

    def report(notice: Notice) -> None:
        nonlocal longest, requested, handled
        if isinstance(notice, LogLine):
            observed[notice.process] += 1
            longest = max(longest, len(notice.text))
            if observed["a"] > 10_000 and observed["b"] > 10 and observed["c"] and not requested:
                requested = observed["a"]
                os.kill(os.getpid(), SIGTERM)
        elif isinstance(notice, Stopping):
            handled = observed["a"]

    tracemalloc.start()
    plan = plan_of(
        program("a", flood),
        program("b", endless),
        program("c", "print('heard', flush=True); " + SLEEPER),
    )
    assert supervise(plan, tmp_path / "plan.json", report=report, duration_s=60) == 0
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 100 * READ_SIZE
    assert (requested > 10_000, observed["b"] > 10, observed["c"]) == (True, True, 1)
    assert handled - requested < 3 * READ_SIZE / len("flood\n"), (
        "the flood was read on before a signal was heeded"
    )
    assert longest == 64 * 1024


def test_what_cannot_be_executed_is_named_and_everything_ends_with_1(tmp_path: Path) -> None:
    broken = tmp_path / "broken"
    broken.write_bytes(b"\x7fnothing")
    broken.chmod(0o755)
    code, notices = run(
        tmp_path, program("b", SLEEPER), PlanProcess("a", "run", argv=(str(broken),))
    )
    (finding,) = [notice.found for notice in notices if isinstance(notice, FindingShown)]
    assert code == 1
    expect(finding, "TF808", "a ", "Exec format error", str(broken))
    assert [
        notice.state
        for notice in notices
        if isinstance(notice, ProcessState) and notice.process == "b"
    ][-1] == "stopped"


def test_the_rest_goes_on_without_missing_or_failed_optional_processes(
    tmp_path: Path,
) -> None:
    absent = PlanProcess(
        "absent", "run", argv=("${executable:no_package/no_program}",), required=False
    )
    failing = program("failing", "raise SystemExit(3)", required=False)
    lasting = program("lasting", "import time; time.sleep(0.3); print('to the end')")
    code, notices = run(tmp_path, absent, failing, lasting)
    assert (code, logged(notices, "lasting")) == (1, ["to the end"])
    findings = [notice.found for notice in notices if isinstance(notice, FindingShown)]
    assert [finding.severity for finding in findings] == ["warning", "warning"]
    expect(findings[0], findings[0].code, "no_package/no_program", "absent")
    expect(findings[1], "TF808", "failing", "exit code 3")


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    code, notices = run(tmp_path, program("a", SLEEPER, cwd="maps"))
    (finding,) = [notice.found for notice in notices if isinstance(notice, FindingShown)]
    assert code == 1
    expect(finding, "TF810", f"{tmp_path}/maps", "a ")


def test_missing_executables_are_all_reported_before_anything_is_started(tmp_path: Path) -> None:
    missing = [PlanProcess(name, "run", argv=(f"no_such_{name}",)) for name in "ab"]
    code, notices = run(tmp_path, program("c", SLEEPER), *missing)
    assert code == 1
    assert [notice.found.code for notice in notices[:-1] if isinstance(notice, FindingShown)] == [
        "TF810"
    ]
    assert notices[1:] == [Ended(1)]


def test_placeholders_environment_and_folder_are_those_of_the_plan(tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    code = (
        "import os, sys; print(*sys.argv[1:], os.getcwd(), os.environ['ROS_DOMAIN_ID'],"
        " os.environ['MINE'])"
    )
    words = ("${plan}", "${build_dir}/x", "${params_file}", "${other}")
    process = program(
        "a", code, *words, cwd="maps", params_file="params/a.yaml", env={"MINE": "1"}
    )
    plan = Plan("rover", "", None, RosSettings(domain_id=7), (), (process,))
    notices: list[Notice] = []
    supervise(plan, tmp_path / "plan.json", report=notices.append)
    expected = [
        tmp_path / "plan.json",
        tmp_path / "x",
        tmp_path / "params/a.yaml",
        "${other}",
        tmp_path / "maps",
        7,
        1,
    ]
    assert logged(notices, "a") == [" ".join(map(str, expected))]
    elsewhere = own_env(
        replace(process, env={"B": "${build_dir}"}), tmp_path / "p", Path("/built")
    )
    assert elsewhere == {"B": "/built"}, "a plan may run from another folder than it was built in"


def test_guard_events_steer_the_start_and_other_lines_are_shown(
    tmp_path: Path,
) -> None:
    observed = Live("a", ("laser",))
    events = guard(Clear(), "rubbish\n", observed, OwnerReady("a"), TreeComplete(1))
    a, b = (
        program("a", SLEEPER, owns=(("base_link", "laser"),)),
        program("b", SLEEPER, after={"a": "ready"}),
    )
    notices: list[Notice] = []

    def report(notice: Notice) -> None:
        notices.append(notice)
        if notice == running_b():
            os.kill(os.getpid(), SIGTERM)

    def running_b() -> Notice | None:
        return next(
            (
                notice
                for notice in notices
                if isinstance(notice, ProcessState)
                and (notice.process, notice.state) == ("b", "running")
            ),
            None,
        )

    assert supervise(plan_of(events, b, a), tmp_path / "plan.json", report=report) == 0
    started = [
        notice.process
        for notice in notices
        if isinstance(notice, ProcessState) and notice.state == "starting"
    ]
    assert started == ["guard", "a", "b"]
    assert logged(notices, "guard")[:1] == ["not an event: rubbish"]


def test_a_pattern_that_never_ends_is_given_up_and_the_launcher_goes_on(
    tmp_path: Path,
) -> None:
    """``re`` would need years for this line, and hears no signal meanwhile."""
    slow = program(
        "slow", f"print('a' * 40 + 'b', flush=True); {SLEEPER}", ready=Ready("log", "(a|aa)+$")
    )
    notices: list[Notice] = []

    def report(notice: Notice) -> None:
        notices.append(notice)
        if isinstance(notice, LogLine) and notice.stream == "stderr":
            os.kill(os.getpid(), SIGTERM)

    assert supervise(plan_of(slow), tmp_path / "plan.json", report=report) == 0
    (given_up,) = (
        line for line in notices if isinstance(line, LogLine) and line.text.startswith("ready: ")
    )  # a program that is stopped while it imports prints a traceback, too
    assert (given_up.process, "(a|aa)+$" in given_up.text) == ("slow", True)


def test_a_guard_that_dies_before_it_is_clear_ends_everything_with_1(tmp_path: Path) -> None:
    code, notices = run(tmp_path, guard(end="raise SystemExit('no rclpy')"), program("a", SLEEPER))
    assert code == 1
    assert [
        notice.process
        for notice in notices
        if isinstance(notice, ProcessState) and notice.state == "starting"
    ] == ["guard"]


def test_a_dead_guards_successor_gets_its_memory_and_leaks_no_descriptor(
    tmp_path: Path,
) -> None:
    code = """
import os, time
if "TFCOMPOSE_MEMORY_FD" in os.environ:
    open("counts", "w").close()
    print("remembers", os.read(int(os.environ["TFCOMPOSE_MEMORY_FD"]), 1000).decode(), flush=True)
    while os.path.exists("counts"):
        time.sleep(0.01)
os.write(int(os.environ["TFCOMPOSE_EVENTS_FD"]), SAID)
"""
    output = line_of(Clear()) + line_of(Remember({"é": [1, None]}))
    dies = program("guard", code.replace("SAID", repr(output)), kind="guard", cwd=".")
    remembered: list[str] = []
    counted: list[int] = []

    def report(notice: Notice) -> None:
        if isinstance(notice, LogLine):
            remembered.append(notice.text)
            counted.append(len(list(Path("/proc/self/fd").iterdir())))  # the guard waits for that
            (tmp_path / "counts").unlink()

    times = Times(backoff_s=0.05, backoff_limit_s=0.05)
    plan = plan_of(dies, program("a", SLEEPER))
    assert supervise(plan, tmp_path / "plan.json", report=report, times=times) == 1
    assert remembered == ['remembers {"é":[1,null]}'] * 5
    assert len(set(counted)) == 1, counted


def test_a_closed_output_ends_everything_with_141_and_no_further_report(
    tmp_path: Path,
) -> None:
    notices: list[Notice] = []

    def report(notice: Notice) -> None:
        notices.append(notice)
        if isinstance(notice, LogLine):
            raise BrokenPipeError

    assert supervise(plan_of(program("a", PARENT)), tmp_path / "plan.json", report=report) == 141
    assert isinstance(notices[-1], LogLine)
    assert len([notice for notice in notices if isinstance(notice, LogLine)]) == 1


def test_an_error_in_the_launcher_itself_leaves_no_process(tmp_path: Path) -> None:
    pids: list[int] = []

    def report(notice: Notice) -> None:
        if isinstance(notice, LogLine):
            pids.extend(int(word) for word in notice.text.split()[1:])
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        supervise(plan_of(program("a", PARENT)), tmp_path / "plan.json", report=report)
    assert until(lambda: all(gone(pid) for pid in pids))
    assert len(pids) == 2


def test_many_runs_leave_no_file_descriptor_open_and_no_handler_in_place(
    tmp_path: Path,
) -> None:
    broken = tmp_path / "broken"
    broken.write_bytes(b"\x7fnothing")
    broken.chmod(0o755)
    sleeper = PlanProcess("a", "run", argv=("sleep", "180"))
    plans = [
        (guard(), sleeper),
        (PlanProcess("g", "guard", argv=(str(broken),)), sleeper),
        (PlanProcess("b", "run", argv=("true",)),),
        (sleeper, PlanProcess("c", "run", argv=(str(broken),))),
    ]
    children = psutil.Process().children()
    before_all = signal.signal(SIGTERM, lambda *_: None)
    handlers = [signal.getsignal(number) for number in (SIGINT, SIGTERM, SIGHUP, signal.SIGCHLD)]
    run(tmp_path, *plans[0], duration_s=0, times=Times(clear_s=0.01))
    before = len(list(Path("/proc/self/fd").iterdir()))
    for i in range(3 * len(plans)):
        run(tmp_path, *plans[i % len(plans)], duration_s=0.01, times=Times(clear_s=0.01))
    assert len(list(Path("/proc/self/fd").iterdir())) == before
    assert [
        signal.getsignal(number) for number in (SIGINT, SIGTERM, SIGHUP, signal.SIGCHLD)
    ] == handlers
    signal.signal(SIGTERM, before_all)
    assert signal.set_wakeup_fd(-1) == -1
    assert psutil.Process().children() == children


def test_a_pipe_gets_each_event_and_the_plan_ends_with_its_reader(tmp_path: Path) -> None:
    pipe = tmp_path / "events"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    read: list[Notice] = []

    def report(notice: Notice) -> None:
        if isinstance(notice, LogLine):
            lines = os.read(reader, 1 << 16).splitlines()
            read.extend(read_notice(line)[0] for line in lines)
            os.close(reader)

    session = RunSession(tmp_path / "plan.json", events=EventStream(str(pipe)))
    plan = plan_of(program("a", "import time; print('up', flush=True); time.sleep(180)"))
    assert supervise(plan, tmp_path / "plan.json", report=report, session=session) == 141
    states = [notice.state for notice in read if isinstance(notice, ProcessState)]
    assert states[:1] == ["starting"]
    with pytest.raises(OSError, match="No such device"):
        EventStream(str(pipe))


def test_a_file_gets_each_event(tmp_path: Path) -> None:
    file = tmp_path / "events.jsonl"
    session = RunSession(tmp_path / "plan.json", events=EventStream(str(file)))
    code, _ = run(tmp_path, program("a", "print('up')"), session=session)
    notices = [read_notice(line)[0] for line in file.read_bytes().splitlines()]
    assert code == 0
    assert isinstance(notices[-1], Ended)
    assert not any(isinstance(notice, LogLine) for notice in notices)
