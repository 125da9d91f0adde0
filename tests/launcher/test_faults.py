"""What goes wrong on real robots, without ROS.

Floods, readers that stop, full disks, daemons, many processes.
"""

import contextlib
import os
import re
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import psutil
import pytest

from tests.support import processes
from tests.support.waiting import TIMEOUT_S, gone, until
from tfcompose.launcher.child import BURST, PER_SECOND
from tfcompose.launcher.control import ask, connect
from tfcompose.launcher.leftovers import end, leftovers
from tfcompose.launcher.runtime_dir import RuntimeDir
from tfcompose.launcher.supervisor import LONGEST_SLEEP_S
from tfcompose.model.messages import (
    Done,
    DownRequest,
    ProcessRequest,
    ProcessStatus,
    RobotStatus,
    StatusRequest,
    Verb,
)
from tfcompose.model.plan import Plan, PlanProcess, RosSettings
from tfcompose.model.plan.file import write_plan

#: A launcher with all that ``up`` gives it, for a plan without ROS.
LAUNCHER = """
import resource, sys
from pathlib import Path
from tfcompose.cli.console import Console
from tfcompose.model.plan.file import read_plan
from tfcompose.launcher.output import Logs
from tfcompose.launcher.run_files import RunFiles
from tfcompose.launcher.output import NonBlockingOutput
from tfcompose.launcher.runtime_dir import Lock, RuntimeDir
from tfcompose.launcher.supervisor import RunSession, supervise
file = Path(sys.argv[1])
if len(sys.argv) > 3:
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[3]), int(sys.argv[3])))
place = RuntimeDir(sys.argv[2], file.parent / "place", file.parent / "log")
lock = Lock(place)
plan = read_plan(file.read_text(), str(file))
output, logs = NonBlockingOutput(1), Logs(place.logs)
session = RunSession(file, RunFiles(place, lock, file), None, output)
code = supervise(plan, file, report=Console(plan, output, colour=False, keep=logs.write), session=session)
output.close()
sys.exit(code)
"""  # noqa: E501 (a text as its reader has it)
#: Stands before the launcher: once there is a file "back", the clock is an hour behind.
CLOCK_GOES_BACK = """
import os, time
right = time.time
time.time = lambda: right() - 3600 * os.path.exists("back")
"""
#: The robot of this run of the tests alone: what it leaves behind is ended, and what others run is
#: not.
NAME = f"rover{os.getpid()}@0"
PYTHON = (sys.executable, "-I", "-S", "-c")
SLEEPER = (
    "import signal, time; signal.signal(signal.SIGINT, signal.SIG_DFL); print('up', flush=True);"
    " time.sleep(180)"
)
FLOOD_BYTES = 200_000_000
FLOOD = f"""
import os, time
data, count = b"a line of sixty-three characters, which says nothing worth a word\\n" * 1000, 0
while count < {FLOOD_BYTES}:
    count += os.write(1, data)
open("flooded", "w").write(str(count))
time.sleep(180)
"""
#: A daemon: its child leaves the group and the session, heeds no signal, and goes on when it has
#: ended.
DAEMON = """
import os, signal, time
if os.fork() == 0:
    os.setsid()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    open("daemon", "w").write(str(os.getpid()))
    os.close(1), os.close(2)
    time.sleep(180)
while not os.path.exists("daemon"):  # before, its group is its parent's, and ends with it
    time.sleep(0.01)
"""

#: As DAEMON; and it goes on as a program without a variable in its environment, whose parent stays
#: or goes.
BARE = """
import os, sys, time
if os.fork() == 0:
    os.setsid()
    os.close(1), os.close(2)
    code = "import os, time; open('daemon', 'w').write(str(os.getpid())); time.sleep(180)"
    os.execve(sys.executable, [sys.executable, "-I", "-c", code], {})
while "stays" in sys.argv or not os.path.exists("daemon"):  # before, it is of its parent's group, as in DAEMON
    time.sleep(0.01)
"""  # noqa: E501 (a text as its reader has it)


class Run:
    """A launcher that runs in a folder, and who can be asked there."""

    def __init__(
        self,
        folder: Path,
        planned: tuple[PlanProcess, ...],
        stdout: int,
        *words: str,
        clock: str = "",
    ) -> None:
        file = folder / "plan.json"
        file.write_text(write_plan(Plan("rover", "", None, RosSettings(), (), planned)))
        self.runtime_dir = RuntimeDir(NAME, folder / "place", folder / "log")
        command = [sys.executable, "-c", clock + LAUNCHER, str(file), NAME, *words]
        self.popen = processes.start(command, stdout=stdout, cwd=folder)

    def ps(self) -> dict[str, ProcessStatus]:
        return {
            process.name: process
            for process in ask(self.runtime_dir, StatusRequest(), RobotStatus).processes
        }

    def is_up(self) -> bool:
        try:
            return all(process.state == "running" for process in self.ps().values())
        except OSError:
            return False

    def search(self) -> None:
        """Wait until the launcher has looked what descends from it now."""
        time.sleep(LONGEST_SLEEP_S)  # then it is due, and follows what comes next
        self.ps()
        self.ps()  # it is answered in the turn after that one

    def down(self) -> int:
        assert ask(self.runtime_dir, DownRequest(), Done).ok
        return self.popen.wait(TIMEOUT_S)


@pytest.fixture
def launch(tmp_path: Path) -> Iterator[Callable[..., Run]]:
    runs: list[Run] = []

    def start(
        *processes: PlanProcess,
        stdout: int = subprocess.DEVNULL,
        words: tuple[str, ...] = (),
        clock: str = "",
    ) -> Run:
        runs.append(Run(tmp_path, processes, stdout, *words, clock=clock))
        return runs[-1]

    yield start
    for run in runs:
        if run.popen.poll() is None:
            run.popen.kill()
        run.popen.wait()
    assert until(lambda: not end(leftovers(f"{NAME}:")))


def program(name: str, code: str, **more: Any) -> PlanProcess:
    return PlanProcess(name, "run", argv=(*PYTHON, code), cwd=".", **more)


@pytest.mark.slow
@pytest.mark.alone
def test_a_flood_blocks_no_process_and_takes_little_memory_and_disk(
    launch: Callable[..., Run], tmp_path: Path
) -> None:
    run = launch(program("flood", FLOOD), program("calm", SLEEPER))
    assert until(run.is_up)
    launcher = psutil.Process(run.popen.pid)
    before, began = launcher.memory_info().rss, time.monotonic()
    answers = 0
    while not (tmp_path / "flooded").exists():
        run.ps()
        answers += 1
        time.sleep(0.05)
    assert answers
    assert launcher.memory_info().rss - before < FLOOD_BYTES / 10
    assert sum(file.stat().st_size for file in (tmp_path / "log").iterdir()) < FLOOD_BYTES / 5
    assert run.down() == 0
    kept = "".join(file.read_text() for file in (tmp_path / "log").glob("flood.log*"))
    taken = BURST + PER_SECOND * (time.monotonic() - began)
    assert re.search(r"\d bytes .*dropped here", kept) or taken > FLOOD_BYTES


def test_a_reader_that_stops_reading_stops_nobody(launch: Callable[..., Run]) -> None:
    reader, writer = os.pipe()
    run = launch(program("flood", FLOOD), program("calm", SLEEPER), stdout=writer)
    os.close(writer)
    try:
        assert until(run.is_up)
        assert until(lambda: run.ps()["flood"].state == "running")
        assert run.down() == 0
    finally:
        os.close(reader)


def test_a_disk_that_takes_no_more_stops_nobody(
    launch: Callable[..., Run], tmp_path: Path
) -> None:
    """A limit on the size of files stands in for the full disk."""
    chatty = "import time\nwhile True: print('x' * 100, flush=True); time.sleep(0.0005)"
    with (tmp_path / "output").open("wb") as output:
        run = launch(program("chatty", chatty), stdout=output.fileno(), words=("20000",))
        assert until((tmp_path / "log" / "chatty.log").exists)
        assert until(lambda: (tmp_path / "log" / "chatty.log").stat().st_size >= 19_900)
        time.sleep(0.3)
        assert run.is_up()
        assert run.down() == 0
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] == resource.RLIM_INFINITY


@pytest.mark.parametrize("how", ["is stopped", "is killed"])
def test_a_daemon_that_left_its_group_ends_with_the_run(
    launch: Callable[..., Run], tmp_path: Path, how: str
) -> None:
    run = launch(program("daemon", DAEMON), program("calm", SLEEPER))
    assert until(lambda: (tmp_path / "daemon").exists() and (tmp_path / "daemon").read_text())
    pid = int((tmp_path / "daemon").read_text())
    assert until(lambda: run.ps()["daemon"].state == "exited")
    assert not gone(pid)
    if how == "is killed":
        run.popen.kill()
    else:
        assert run.down() == 0
    assert until(lambda: gone(pid))


@pytest.mark.parametrize("how", ["restart", "stop"])
def test_a_process_outside_its_group_ends_with_its_stopped_process(
    launch: Callable[..., Run], tmp_path: Path, how: Verb
) -> None:
    """A process that ignores signals ends before its successor begins.

    Others end when it is stopped.
    """
    assert "signal.SIG_IGN" in DAEMON
    code = (
        DAEMON if how == "restart" else DAEMON.replace("signal.SIG_IGN", "signal.SIG_DFL")
    ) + "time.sleep(180)\n"
    run = launch(program("lidar", code), program("calm", SLEEPER))
    assert until(lambda: (tmp_path / "daemon").exists() and (tmp_path / "daemon").read_text())
    first = int((tmp_path / "daemon").read_text())
    calm = run.ps()["calm"].pid
    ask(run.runtime_dir, ProcessRequest(how, "lidar"), Done)
    assert until(lambda: gone(first))
    if how == "restart":
        assert until(lambda: (tmp_path / "daemon").read_text() not in {"", str(first)})
        assert not gone(int((tmp_path / "daemon").read_text()))
    assert run.ps()["calm"].pid == calm
    assert run.down() == 0


@pytest.mark.parametrize("parent", ["stays", "goes"])
@pytest.mark.parametrize("how", ["is stopped", "is killed"])
def test_what_left_its_group_and_its_environment_ends_with_the_run(
    launch: Callable[..., Run], tmp_path: Path, how: str, parent: str
) -> None:
    bare = replace(program("bare", BARE), argv=(*PYTHON, BARE, parent))
    run = launch(bare, program("calm", SLEEPER))
    assert until(lambda: (tmp_path / "daemon").exists() and (tmp_path / "daemon").read_text())
    pid = int((tmp_path / "daemon").read_text())
    assert until(lambda: run.ps()["bare"].state == ("running" if parent == "stays" else "exited"))
    assert pid not in {leftover.pid for leftover in leftovers(f"{NAME}:")}
    if how == "is killed":
        run.search()
        run.popen.kill()
    else:
        assert run.down() == 0
    assert until(lambda: gone(pid))


def test_a_child_holder_that_is_killed_is_replaced(
    launch: Callable[..., Run], tmp_path: Path
) -> None:
    run = launch(program("daemon", DAEMON), program("calm", SLEEPER))
    assert until(lambda: (tmp_path / "daemon").exists() and (tmp_path / "daemon").read_text())
    first = holder_of(run)
    assert first
    first.kill()
    assert until(lambda: holder_of(run) not in {None, first})
    run.popen.kill()
    assert until(lambda: gone(int((tmp_path / "daemon").read_text())))


def holder_of(run: Run) -> psutil.Process | None:
    for child in psutil.Process(run.popen.pid).children():
        with contextlib.suppress(psutil.NoSuchProcess):  # another one may just end
            if child.name() == "sh":
                return child
    return None


def test_leftovers_are_recognised_by_the_runs_id_and_ended_on_request_only(
    launch: Callable[..., Run], tmp_path: Path
) -> None:
    run = launch(program("daemon", DAEMON), program("calm", SLEEPER))
    assert until(lambda: (tmp_path / "daemon").exists() and (tmp_path / "daemon").read_text())
    pid = int((tmp_path / "daemon").read_text())
    assert {leftover.launcher for leftover in leftovers(f"{NAME}:")} == {run.popen.pid}
    run.popen.send_signal(signal.SIGSTOP)  # it shall not get another keeper
    child_holder = holder_of(run)
    assert child_holder
    child_holder.kill()
    run.popen.kill()
    run.popen.wait()
    assert until(lambda: [leftover.pid for leftover in leftovers(f"{NAME}:")] == [pid])
    assert [leftover.launcher for leftover in leftovers(f"{NAME}:")] == [None]
    assert leftovers(f"{NAME}1:") == []
    assert end(leftovers(f"{NAME}:"), 0.3) == []
    assert gone(pid)


@pytest.mark.slow
@pytest.mark.alone
def test_200_processes_are_started_listed_and_stopped_and_all_are_gone(
    launch: Callable[..., Run],
) -> None:
    run = launch(
        *(PlanProcess(f"p{number}", "run", argv=("sleep", "180")) for number in range(200))
    )
    assert until(run.is_up)
    pids = [process.pid for process in run.ps().values() if process.pid]
    assert len(set(pids)) == 200
    assert run.down() == 0
    assert all(map(gone, pids))


@pytest.mark.slow
@pytest.mark.alone
def test_500_stops_and_starts_leave_no_process_no_descriptor_and_no_memory(
    launch: Callable[..., Run],
) -> None:
    run = launch(
        PlanProcess("a", "run", argv=("sleep", "180")),
        PlanProcess("b", "run", argv=("sleep", "180")),
    )
    assert until(run.is_up)
    launcher = psutil.Process(run.popen.pid)

    verbs: tuple[tuple[Verb, str], ...] = (("stop", "stopped"), ("start", "running"))

    def cycle(count: int) -> None:
        for _ in range(count):
            for verb, state in verbs:
                assert ask(run.runtime_dir, ProcessRequest(verb, "a"), Done).ok
                assert until(lambda state=state: run.ps()["a"].state == state)  # type: ignore[misc]

    cycle(5)
    fds, children, memory = (
        launcher.num_fds(),
        len(launcher.children(recursive=True)),
        launcher.memory_info().rss,
    )
    cycle(500)
    assert until(lambda: launcher.num_fds() <= fds)
    assert len(launcher.children(recursive=True)) == children
    assert launcher.memory_info().rss < 1.1 * memory
    assert run.ps()["a"].restarts == 505
    assert run.down() == 0


def test_a_clock_that_goes_back_an_hour_stops_nothing_and_delays_nothing(
    launch: Callable[..., Run], tmp_path: Path
) -> None:
    fails = (
        "import os, time\nwhile not os.path.exists('back'): time.sleep(0.01)\nraise SystemExit(3)"
    )
    failing = program("failing", fails, restart="always", max_restarts=2, required=False)
    run = launch(program("a", SLEEPER), failing, clock=CLOCK_GOES_BACK)
    assert until(run.is_up)
    (tmp_path / "back").touch()
    assert until(lambda: run.ps()["failing"].state == "fatal"), "1 s and 2 s of waiting are over"
    assert (run.ps()["a"].uptime or 0) > 2
    assert ask(run.runtime_dir, ProcessRequest("restart", "a"), Done).ok
    assert until(lambda: run.ps()["a"].restarts == 1)
    assert run.down() == 0
    stamps = [
        line.split()[0] for line in (tmp_path / "log" / "tfcompose.log").read_text().splitlines()
    ]
    assert stamps != sorted(stamps), "the clock did go back"


def test_a_socket_left_by_a_killed_launcher_does_not_block_the_next(
    launch: Callable[..., Run],
) -> None:
    first = launch(program("a", SLEEPER))
    assert until(first.is_up)
    first.popen.kill()
    first.popen.wait()
    assert first.runtime_dir.socket.exists()
    assert first.runtime_dir.holder() is None
    second = launch(program("a", SLEEPER))
    assert until(second.is_up)
    assert second.runtime_dir.socket.stat().st_mode & 0o777 == 0o600
    assert second.down() == 0


@pytest.mark.parametrize(
    "line",
    [b"rubbish", b"[1]", b'{"request": "Dance"}', b"x" * 200_000],
    ids=["no JSON", "no object", "no request", "200 kB"],
)
def test_rubbish_on_the_socket_is_answered_and_harms_nobody(
    launch: Callable[..., Run], line: bytes
) -> None:
    run = launch(program("a", SLEEPER))
    assert until(run.is_up)
    with connect(run.runtime_dir) as connection:
        try:
            connection.sendall(line + b"\n")
            assert b"error" in connection.recv(1000) or len(line) > 100_000
        except ConnectionError:
            assert len(line) > 100_000
    assert run.is_up()
    assert run.down() == 0
