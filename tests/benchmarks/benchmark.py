"""A benchmark: a name, rows, and contenders that do the same work.

Each module of ``tests/benchmarks/suite`` has one, as ``BENCHMARK``. ``measure`` opens all
contenders and lets them take turns, so that a busy moment meets each of them.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import psutil

from tests.support import processes
from tests.support.domains import reserved_domain

#: Seconds a contender gets to end after Ctrl-C before it is killed.
END_S = 20.0
Unit = Literal["s", "ms", "µs", "MB", "kB", "% of a core", "%", "times", "findings"]
Statistic = Literal["least", "median", "p90", "worst"]


@dataclass(frozen=True)
class Contender:
    """A program that does the work of a benchmark: tfcompose, or a peer."""

    name: str
    #: Why this machine cannot run it, in a few words; empty where it can.
    missing: Callable[[], str] = field(default=str, compare=False)
    #: The version that is installed, empty where it has none.
    version: Callable[[], str] = field(default=str, compare=False)


TFCOMPOSE = Contender("tfcompose")


@dataclass(frozen=True)
class Limit:
    """An upper bound for tfcompose in a row: a claim, which the record must keep."""

    #: In the row's unit; a factor where ``times`` names a peer.
    most: float
    statistic: Statistic = "median"
    #: The peer whose statistic is multiplied by ``most``.
    times: Contender | None = None
    #: The peer whose statistic ``most`` is added to.
    above: Contender | None = None


@dataclass(frozen=True)
class Row:
    """A measured quantity; less is better."""

    title: str
    unit: Unit
    limits: tuple[Limit, ...] = ()


@dataclass(frozen=True)
class Workspace:
    """Surroundings of one contender."""

    #: An empty folder.
    folder: Path
    #: Of its processes: a ROS domain, with runs and logs in the folder.
    environment: Mapping[str, str]
    #: True for a trial run, whose figures nobody quotes: sizes may be smaller.
    is_quick: bool = False

    @contextmanager
    def running(
        self, *argv: str | Path, environment: Mapping[str, str] | None = None, **options: Any
    ) -> Iterator[subprocess.Popen[str]]:
        """Run a program in the folder until the block ends, then end it as Ctrl-C does.

        Its output is dropped unless ``options``, those of ``subprocess.Popen``, say otherwise.
        """
        env = {**self.environment, **(environment or {})}
        silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        process = processes.start(argv, cwd=self.folder, env=env, **(silent | options))
        try:
            yield process
        finally:
            _interrupt(process)

    def run(self, *argv: str | Path) -> str:
        """Run a program in the folder to its end and return what it prints.

        Raises:
            subprocess.CalledProcessError: if it does not end with 0.
        """
        done = processes.run(argv, cwd=self.folder, env=dict(self.environment), check=True)
        return done.stdout

    @contextmanager
    def entered(self) -> Iterator[None]:
        """Let this process see the contender's environment, for nodes that it opens itself."""
        before = dict(os.environ)
        os.environ.update(self.environment)
        try:
            yield
        finally:
            os.environ.clear()
            os.environ.update(before)


#: One run of a contender: values by the names of rows, in their units.
Sampler = Callable[[], Mapping[str, float]]
#: Prepares a contender and yields its sampler; what was started ends with the block.
Opened = Callable[[Workspace], AbstractContextManager[Sampler]]


@dataclass(frozen=True)
class Benchmark:
    """Rows, the contenders that fill them, and how often each runs."""

    name: str
    #: A sentence on the work, and on where the measurement begins and ends.
    about: str
    rows: Mapping[str, Row]
    contenders: Mapping[Contender, Opened]
    runs: int
    #: Runs of a trial.
    quick_runs: int = 2
    #: Rounds at the start that do not count.
    warm_ups: int = 0
    #: Seconds after which the benchmark has hung.
    timeout_s: float = 600.0


def measure(
    benchmark: Benchmark, *, is_quick: bool, progress: Callable[[str], None]
) -> dict[str, dict[str, list[float]]]:
    """Return the samples of each row by contender; index ``n`` of each is of the same round.

    The order of the contenders alternates from round to round.

    Raises:
        ValueError: if a sampler gives a row that the benchmark does not have.
    """
    runs = benchmark.quick_runs if is_quick else benchmark.runs
    samples: dict[str, dict[str, list[float]]] = {name: {} for name in benchmark.rows}
    with ExitStack() as stack:
        stack.enter_context(processes.ended_at_exit())
        samplers = []
        for contender, opened in benchmark.contenders.items():
            if not contender.missing():
                workspace = stack.enter_context(opened_workspace(is_quick=is_quick))
                samplers.append((contender.name, stack.enter_context(opened(workspace))))
        for number in range(-benchmark.warm_ups, runs):
            for name, sampler in samplers[:: 1 if number % 2 == 0 else -1]:
                began = time.monotonic()
                values = sampler()
                progress(f"{_round(number, runs)} {name} {time.monotonic() - began:.1f} s")
                if unknown := values.keys() - benchmark.rows.keys():
                    raise ValueError(f"{benchmark.name} has no row {', '.join(sorted(unknown))}")
                for row, value in values.items():
                    if number >= 0:
                        samples[row].setdefault(name, []).append(value)
    return samples


def _round(number: int, runs: int) -> str:
    return f"{number + 1}/{runs}" if number >= 0 else "warm-up"


@contextmanager
def opened_workspace(*, is_quick: bool = False) -> Iterator[Workspace]:
    """Make a folder and reserve a ROS domain on the loopback interface."""
    with tempfile.TemporaryDirectory() as name, reserved_domain() as domain:
        folder = Path(name)
        for part in ("work", "runtime", "log"):
            (folder / part).mkdir(mode=0o700)
        environment = {
            **os.environ,
            "ROS_DOMAIN_ID": str(domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "XDG_RUNTIME_DIR": str(folder / "runtime"),
            "ROS_LOG_DIR": str(folder / "log"),
        }
        yield Workspace(folder / "work", environment, is_quick)


def _interrupt(process: subprocess.Popen[str]) -> None:
    """End a process and all below it: as Ctrl-C does, then by SIGKILL."""
    below = []
    with suppress(psutil.NoSuchProcess):
        below = psutil.Process(process.pid).children(recursive=True)
        process.send_signal(signal.SIGINT)
    with suppress(subprocess.TimeoutExpired):
        process.wait(END_S)
    for child in below:
        with suppress(psutil.NoSuchProcess):
            child.kill()
    processes.end(process)


def python(*argv: str | Path) -> Sequence[str | Path]:
    """Return the command of a Python program in this environment."""
    return (sys.executable, *argv)
