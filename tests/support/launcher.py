"""The launcher as a process of its own, for plans of plain Python processes."""

import contextlib
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from signal import SIGKILL
from typing import Any

import psutil

from tests.support import processes
from tests.support.waiting import TIMEOUT_S, complete_lines
from tfcompose.model.messages import line_of
from tfcompose.model.plan import GuardPolicy, Plan, PlanProcess, RosSettings
from tfcompose.model.plan.file import write_plan

PYTHON = (sys.executable, "-I", "-S", "-c")
SLEEPER = "import signal, time; signal.signal(signal.SIGINT, signal.SIG_DFL); time.sleep(180)"
#: What tfcompose's own processes do once they handle signals: until then these are blocked.
LISTEN = "import signal; signal.pthread_sigmask(signal.SIG_UNBLOCK, signal.valid_signals())"
#: Runs a plan file as a process of its own, and prints the notices.
LAUNCHER = """
import signal, sys
from pathlib import Path
from tfcompose.model.plan.file import read_plan
from tfcompose.launcher.supervisor import supervise
file = Path(sys.argv[1])
plan = read_plan(file.read_text(), str(file))
sys.exit(supervise(plan, file, report=lambda notice: print(notice, flush=True)))
"""

#: In a sitecustomize: ``up`` executes its processes, so that each of them reads that too.
EXECUTES = """
import sys
if "up" in sys.orig_argv:
    from tfcompose.launcher.forking import Forker
    Forker.can_start = lambda *_: False
"""


def program(name: str, code: str, *words: str, **more: Any) -> PlanProcess:
    return PlanProcess(name, more.pop("kind", "run"), argv=(*PYTHON, code, *words), **more)


def guard(*events: Any, end: str = SLEEPER) -> PlanProcess:
    """Return a guard that says these events, or lines, and then sleeps."""
    lines = b"".join(
        event.encode() if isinstance(event, str) else line_of(event) for event in events
    )
    say = (
        f"{LISTEN}; import os; os.write(int(os.environ['TFCOMPOSE_EVENTS_FD']), {lines!r}); {end}"
    )
    return program("guard", say, kind="guard")


def plan_of(*processes: PlanProcess) -> Plan:
    return Plan("rover", "", None, RosSettings(), (), processes, GuardPolicy())


@dataclass
class Launcher:
    """A launcher that runs as a process of its own."""

    popen: subprocess.Popen[str]
    output: Path

    def pids(self) -> list[int]:
        """Return the process numbers that the children have said so far."""
        lines = [line.split("pids ")[1] for line in complete_lines(self.output) if "pids " in line]
        return [int(word) for words in lines for word in words.rstrip("')").split()]

    def below(self, *, recursive: bool = True) -> list[int]:
        return [
            child.pid for child in psutil.Process(self.popen.pid).children(recursive=recursive)
        ]

    def kill(self) -> None:
        """End it with all that it has started."""
        if self.popen.poll() is None:
            for pid in (*self.below(), self.popen.pid):
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, SIGKILL)
        self.popen.wait(TIMEOUT_S)


def launched(folder: Path, *planned: PlanProcess) -> Launcher:
    """Start a launcher of these processes, whose files and output are in the folder."""
    file, output = folder / "plan.json", folder / "output.txt"
    file.write_text(write_plan(plan_of(*planned)))
    with output.open("wb") as out:
        popen = processes.start(
            [sys.executable, "-c", LAUNCHER, str(file)], stdout=out, stderr=out
        )
    return Launcher(popen, output)
