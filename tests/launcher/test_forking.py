"""Own processes that are forked: in all that others see they are as if they were executed."""

import gc
import json
import os
import sys
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from signal import SIGKILL
from typing import Any

import pytest

from tests.support import processes
from tests.support.waiting import TIMEOUT_S, gone, until
from tfcompose.launcher.child import ChildCommand
from tfcompose.launcher.forking import Forker
from tfcompose.launcher.program import HERE
from tfcompose.model.plan import PlanProcess

#: A program: what it does is in its first argument.
PROGRAM = "import sys\nexec(sys.argv[1], {})\n"
#: A launcher, which has handlers and descriptors of its own. ``start`` starts a program in a way.
LAUNCHER = """
import os, signal, socket, sys, time
from pathlib import Path
from tfcompose.launcher import forking
from tfcompose.launcher.child import ChildCommand, spawn
from tfcompose.foundation.signal_queue import SignalQueue
forking.HERE = (sys.executable, str(Path("program.py").absolute()))
def run():
    exec(sys.argv[1], {})
    return 0
forker = forking.Forker(lambda: None, run)
signals = SignalQueue().__enter__()
file, listener = open("held", "w"), socket.socket()
os.set_inheritable(file.fileno(), True)
theirs, ours = os.pipe()
def start(way, code):
    env = os.environ | {"TFCOMPOSE_RUN": "rover@7", "ROS_DOMAIN_ID": "7"}
    command = ChildCommand((*forking.HERE, code), env, Path.cwd(), is_built_in=True)
    if way == "executed":
        return spawn(command, (theirs,))
    if way == "the kernel refuses":
        forking.show_as = lambda *_: False
    assert forker.can_start(command)
    return forker.start(command, (theirs,))
"""
#: What others see of a process, and what it has.
FACTS = """
import ctypes, json, os, sys
from pathlib import Path
at = ctypes.c_int()
ctypes.CDLL(None).prctl(2, ctypes.byref(at))
status = dict(line.split(":\\t") for line in Path("/proc/self/status").read_text().splitlines())
folder = f"/proc/{os.getpid()}/fd"
fds = [fd for fd in os.listdir(folder) if os.path.exists(f"{folder}/{fd}")]
print(json.dumps({
    "argv": Path("/proc/self/cmdline").read_text().split("\\0"),
    "environ": sorted(Path("/proc/self/environ").read_text().split("\\0")),
    "variables": sorted(f"{name}={value}" for name, value in os.environ.items()),
    "status": [status[name] for name in ("Name", "SigBlk", "SigIgn", "SigCgt", "Umask")],
    "descriptors": sorted((fd, os.readlink(f"{folder}/{fd}").partition(":")[0]) for fd in fds),
    "leads its session": os.getsid(0) == os.getpid(),
    "ends with its launcher": at.value,
    "parent": os.getppid(),
    "folder": os.getcwd(),
    "python": [sys.argv[1:], sys.orig_argv, sys.stdout.encoding.lower(), sys.stderr.errors],
}))
"""


def run_launcher(folder: Path, code: str) -> list[str]:
    """Return what a launcher prints that does this."""
    (folder / "program.py").write_text(PROGRAM)
    done = processes.run([sys.executable, "-c", f"{LAUNCHER}\n{code}"], cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.splitlines()


@pytest.mark.parametrize("way", ["forked", "the kernel refuses"])
def test_a_forked_process_is_to_others_what_an_executed_one_is(way: str, tmp_path: Path) -> None:
    code = f"""
print(os.getpid())
for way in ("executed", {way!r}):
    child = start(way, {FACTS!r})
    print(child.stdout.read().decode(), end="")
    print(child.stderr.read().decode(), end="", file=sys.stderr)
    assert child.wait() == 0
"""
    launcher, executed, forked = map(json.loads, run_launcher(tmp_path, code))
    assert forked == executed
    assert forked["parent"] == launcher
    assert forked["argv"][2:3] == [FACTS]
    assert {"TFCOMPOSE_RUN=rover@7", "ROS_DOMAIN_ID=7"} <= set(forked["environ"])
    assert set(forked["environ"]) == {*forked["variables"], ""}
    assert (forked["leads its session"], forked["ends with its launcher"]) == (True, SIGKILL)
    assert [number for number, _ in forked["descriptors"]][:3] == ["0", "1", "2"]


@pytest.mark.parametrize(
    ("code", "returncode", "last_line"),
    [
        ("pass", 0, ""),
        ("raise SystemExit(4)", 4, ""),
        ("raise ValueError('odd')", 1, "ValueError: odd"),
        ("import os; os.kill(os.getpid(), 9)", -9, ""),
        ("import atexit, os; atexit.register(os.write, 2, b'left')", 0, "left"),
    ],
)
def test_a_forked_process_ends_as_a_program_does(
    code: str, returncode: int, last_line: str, tmp_path: Path
) -> None:
    lines = run_launcher(
        tmp_path,
        f"""
child = start("forked", {code!r})
errors = child.stderr.read().decode().splitlines()
print(child.wait(), *errors[-1:])
""",
    )
    assert lines == [f"{returncode} {last_line}".rstrip()]


def test_a_forked_process_ends_with_its_launcher(tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(PROGRAM)
    code = "print(start('forked', 'import time; time.sleep(180)').pid, flush=True)"
    command = [sys.executable, "-c", f"{LAUNCHER}\n{code}\ntime.sleep(180)"]
    with processes.start(command, cwd=tmp_path, stdout=-1) as launcher:
        assert launcher.stdout
        pid = int(launcher.stdout.readline())
        assert not gone(pid)
        launcher.kill()
        launcher.wait(TIMEOUT_S)
    assert until(lambda: gone(pid))


@pytest.mark.parametrize("way", ["forked", "on terminals"])
def test_a_start_without_free_descriptors_leaves_none_open(way: str, tmp_path: Path) -> None:
    code = f"""
import resource
from tfcompose.model.plan import PlanProcess
def attempt():
    if "{way}" == "forked":
        return start("forked", "pass")
    process = PlanProcess("screen", "run", emulate_tty=True)
    return spawn(ChildCommand(("true",), dict(os.environ), Path.cwd(), process=process), ())
def descriptors():
    return sorted(os.listdir("/proc/self/fd"))
soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
before, free = descriptors(), os.dup(0)
os.close(free)
for spare in (1, 2, 3):
    resource.setrlimit(resource.RLIMIT_NOFILE, (free + spare, hard))
    try:
        attempt()
    except OSError:
        print("refused")
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
print(descriptors() == before)
"""
    assert run_launcher(tmp_path, code) == ["refused"] * 3 + ["True"]


@pytest.fixture
def forker(monkeypatch: pytest.MonkeyPatch) -> Iterator[Forker]:
    monkeypatch.setattr(os, "environ", dict(ENVIRONMENT))  # pytest writes into it
    yield Forker(lambda: None, lambda: 0)
    gc.unfreeze()


STATIC = PlanProcess("static", "static")
ENVIRONMENT = dict(os.environ)


@pytest.mark.parametrize(
    ("change", "is_forked"),
    [
        pytest.param({}, True, id="as the plan has it"),
        pytest.param({"env": {"ROS_DOMAIN_ID": "7"}}, True, id="read when ROS begins"),
        pytest.param({"env": {"LD_LIBRARY_PATH": "/opt/lib"}}, False, id="read before"),
        pytest.param({"env": {"RMW_IMPLEMENTATION": "rmw_x"}}, False, id="a library of ROS"),
        pytest.param({"is_built_in": False}, False, id="not our own"),
        pytest.param({"argv": ("/usr/bin/gdb", *HERE, "static")}, False, id="a prefix"),
        pytest.param({"process": replace(STATIC, emulate_tty=True)}, False, id="a terminal"),
        pytest.param(
            {"process": replace(STATIC, oom_score_adj=500)}, False, id="the kernel's settings"
        ),
    ],
)
def test_what_needs_a_program_that_begins_anew_is_executed(
    forker: Forker, change: dict[str, Any], *, is_forked: bool
) -> None:
    env = ENVIRONMENT | change.get("env", {})
    command = ChildCommand((*HERE, "static"), env, Path("/"), is_built_in=True, process=STATIC)
    changed = replace(command, **(change | {"env": env}))
    assert forker.can_start(changed) is is_forked


def test_a_launcher_with_another_thread_forks_nothing(forker: Forker) -> None:
    command = ChildCommand((*HERE, "static"), ENVIRONMENT, Path("/"), is_built_in=True)
    assert forker.can_start(command)
    ends = threading.Event()
    thread = threading.Thread(target=ends.wait)
    thread.start()
    try:
        assert not forker.can_start(command)
    finally:
        ends.set()
        thread.join()
