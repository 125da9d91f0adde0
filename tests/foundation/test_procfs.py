"""Processes as /proc shows them, with psutil as the oracle; one file reads it."""

import ast
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from tests.support import processes
from tests.support.house import PACKAGE, ROOT, nodes_of
from tests.support.waiting import until
from tfcompose.foundation import procfs

#: Their text runs where tfcompose is not: on another host, and in a shell.
ELSEWHERE = {"tfcompose/tools/deploy/agent.py", "tfcompose/launcher/children.py"}


def names_proc(file: Path) -> bool:
    """Return whether a text of the file, other than its docstrings, has a path below /proc."""
    nodes = nodes_of(file)
    docstrings = {node.value for node in nodes if isinstance(node, ast.Expr)}
    texts = [
        node.value for node in nodes if isinstance(node, ast.Constant) and node not in docstrings
    ]
    return any(isinstance(text, str) and re.search(r"/proc\b", text) for text in texts)


def test_one_file_knows_the_kernels_folder() -> None:
    files = {
        path.relative_to(ROOT).as_posix() for path in PACKAGE.rglob("*.py") if names_proc(path)
    }
    assert files == {"tfcompose/foundation/procfs.py"} | ELSEWHERE


def test_a_process_is_as_psutil_has_it() -> None:
    code = "import ctypes; sum(range(3_000_000)); print(flush=True); input()"
    argv = [sys.executable, "-c", code, "", "ä) R 1"]
    env = {"EMPTY": "", "EQUAL": "a=b", "LINES": "1\n2"}
    with processes.start(argv, env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        assert child.stdout
        assert child.stdout.readline()
        expected, stat = psutil.Process(child.pid), procfs.stat(child.pid)
        assert child.pid in procfs.pids()
        assert procfs.argv(child.pid) == expected.cmdline() == argv
        assert env.items() <= procfs.environ(child.pid).items()
        assert procfs.environ(child.pid) == expected.environ()
        assert (stat.parent, stat.group) == (os.getpid(), child.pid)
        ticks_per_s = os.sysconf("SC_CLK_TCK")
        assert stat.ticks / ticks_per_s == pytest.approx(sum(expected.cpu_times()[:2]), abs=0.05)
        began = psutil.boot_time() + stat.began / ticks_per_s
        assert began == pytest.approx(expected.create_time(), abs=2)
        assert procfs.memory_bytes(child.pid) == pytest.approx(
            expected.memory_full_info().pss, 0.1
        )
        assert procfs.has_loaded(child.pid, "_ctypes.")
        assert not procfs.has_loaded(child.pid, "librcl.so")
        assert procfs.network(child.pid) == procfs.network("self")
        child.send_signal(signal.SIGSTOP)
        assert until(lambda: procfs.stat(child.pid).state == "T")
        processes.end(child)


@pytest.mark.parametrize(
    "read",
    [procfs.stat, procfs.environ, procfs.argv, procfs.memory_bytes, procfs.network],
    ids=lambda read: read.__name__,
)
def test_a_process_that_has_ended_is_an_os_error(read: Callable[[int], object]) -> None:
    with subprocess.Popen([sys.executable, "--version"], stdout=subprocess.DEVNULL) as child:
        child.wait()
    with pytest.raises(OSError, match=rf"{child.pid}"):
        read(child.pid)
