"""Memory and processor of a robot that runs and does nothing else."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

from tests.benchmarks.benchmark import Benchmark, Opened, Row
from tests.benchmarks.contenders import TFCOMPOSE_ON_ROS
from tests.benchmarks.fixed_robot import COMMANDS, EDGES, listening
from tests.benchmarks.measures import cpu_s, pss_mb, tree
from tests.benchmarks.record import ROOT
from tests.support.waiting import until

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from tests.benchmarks.benchmark import Sampler, Workspace

SETTLE_S, SECONDS, QUICK_SECONDS = 3.0, 10.0, 5.0
TUTORIAL = ("up", str(ROOT / "robots" / "autonomous_robot.yaml"), "--profile", "demo")


def opened(command_of: Callable[[Workspace], list[str]], *, has_tutorial: bool) -> Opened:
    """Return the function that opens a contender, which is started anew in each round.

    It runs alone: memory that several share is divided among all that run.
    """

    @contextmanager
    def robot(workspace: Workspace) -> Iterator[Sampler]:
        command = command_of(workspace)

        def sample() -> Mapping[str, float]:
            with workspace.running(*command) as process:
                with listening(workspace) as has_all:
                    has_all()
                memory, core = _idle(process.pid, workspace)
            values = {"memory": memory, "core": core}
            if has_tutorial:
                with _tutorial(workspace) as pid:
                    memory, core = _idle(pid, workspace)
                values |= {"tutorial_memory": memory, "tutorial_core": core}
            return values

        yield sample

    return robot


@contextmanager
def _tutorial(workspace: Workspace) -> Iterator[int]:
    """Run the tutorial robot; yield the launcher's process number when its tree is complete.

    Raises:
        RuntimeError: if the tree is not complete in time.
    """
    output = workspace.folder / "output.txt"
    argv = (sys.executable, "-m", "tfcompose", *TUTORIAL)
    with output.open("wb") as out, workspace.running(*argv, stdout=out) as process:
        if not until(lambda: "tree complete" in output.read_text("utf-8")):
            raise RuntimeError("the tree is not complete")
        yield process.pid


def _idle(pid: int, workspace: Workspace) -> tuple[float, float]:
    """Return the memory in MB and the share of a core in percent of a process and all below it."""
    time.sleep(SETTLE_S)
    processes = tree(pid)
    used, began = cpu_s(processes), time.monotonic()
    time.sleep(QUICK_SECONDS if workspace.is_quick else SECONDS)
    core = 100 * (cpu_s(processes) - used) / (time.monotonic() - began)
    return pss_mb(processes), core


BENCHMARK = Benchmark(
    name="idle",
    about="proportional memory of all processes of a running robot, and their processor time",
    rows={
        "memory": Row(f"memory of {EDGES} fixed edges", "MB"),
        "core": Row("… processor", "% of a core"),
        "tutorial_memory": Row("memory of `autonomous_robot.yaml --profile demo`", "MB"),
        "tutorial_core": Row("… processor", "% of a core"),
    },
    contenders={
        contender: opened(command, has_tutorial=contender == TFCOMPOSE_ON_ROS)
        for contender, command in COMMANDS.items()
    },
    runs=3,
    quick_runs=1,
)
