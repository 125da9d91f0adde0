"""Start of a robot of fixed edges, until a listener that was there before has all of them."""

from __future__ import annotations

import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

from tests.benchmarks.benchmark import Benchmark, Opened, Row
from tests.benchmarks.fixed_robot import COMMANDS, EDGES, listening

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from tests.benchmarks.benchmark import Sampler, Workspace


def opened(command_of: Callable[[Workspace], list[str]]) -> Opened:
    """Return the function that opens a contender, which is started anew in each round."""

    @contextmanager
    def robot(workspace: Workspace) -> Iterator[Sampler]:
        command = command_of(workspace)

        def sample() -> Mapping[str, float]:
            with listening(workspace) as has_all:
                began = time.monotonic()
                with workspace.running(*command):
                    return {"listener": has_all()[1] - began}

        yield sample

    return robot


BENCHMARK = Benchmark(
    name="start",
    about="from the start of a program until a stock listener that was there has all fixed edges",
    rows={"listener": Row(f"start: {EDGES} fixed edges are at a listener after", "s")},
    contenders={contender: opened(command) for contender, command in COMMANDS.items()},
    runs=8,
    warm_ups=1,
)
