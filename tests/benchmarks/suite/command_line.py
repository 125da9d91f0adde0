"""Processor time of short commands, beside a Python program that loads the same libraries."""

from __future__ import annotations

import compileall
from contextlib import contextmanager
from typing import TYPE_CHECKING

from tests.benchmarks.benchmark import TFCOMPOSE, Benchmark, Contender, Limit, Opened, Row
from tests.benchmarks.measures import usage
from tests.benchmarks.record import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tests.benchmarks.benchmark import Sampler, Workspace

MODEL = Contender("one BaseModel and yaml")
NOTHING = Contender("`python -c pass`")
COMMANDS: dict[Contender, dict[str, tuple[str, ...]]] = {
    TFCOMPOSE: {
        "lint": ("-m", "tfcompose", "lint", str(ROOT / "robots" / "autonomous_robot.yaml")),
        "help": ("-m", "tfcompose", "--help"),
    },
    MODEL: {"lint": ("-c", "import yaml, pydantic\nclass A(pydantic.BaseModel):\n a: int = 1")},
    NOTHING: {"help": ("-c", "pass")},
}


def opened(contender: Contender) -> Opened:
    """Return the function that opens a contender: its commands, one after the other."""

    @contextmanager
    def commands(workspace: Workspace) -> Iterator[Sampler]:
        compileall.compile_dir(ROOT / "tfcompose", quiet=2)

        def sample() -> Mapping[str, float]:
            return {
                row: 1e3 * usage(workspace, *argv)[0] for row, argv in COMMANDS[contender].items()
            }

        yield sample

    return commands


BENCHMARK = Benchmark(
    name="command_line",
    about="processor time of a whole process, user and system, its compiled files there",
    rows={
        "lint": Row(
            "`lint` of `autonomous_robot.yaml`", "ms", (Limit(3.5, "least", times=MODEL),)
        ),
        "help": Row("`--help`", "ms", (Limit(3.5, "least", times=NOTHING),)),
    },
    contenders={contender: opened(contender) for contender in COMMANDS},
    runs=21,
    quick_runs=3,
    warm_ups=1,
)
