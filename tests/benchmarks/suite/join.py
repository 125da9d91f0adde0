"""A listener that joins a running robot of fixed edges."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from tests.benchmarks.benchmark import Benchmark, Limit, Opened, Row
from tests.benchmarks.contenders import LAUNCH, RCLPY, TFCOMPOSE_ON_ROS
from tests.benchmarks.fixed_robot import COMMANDS, EDGES, listening

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from tests.benchmarks.benchmark import Sampler, Workspace


def opened(command_of: Callable[[Workspace], list[str]]) -> Opened:
    """Return the function that opens a contender: it runs during all rounds."""

    @contextmanager
    def robot(workspace: Workspace) -> Iterator[Sampler]:
        with workspace.running(*command_of(workspace)):

            def sample() -> Mapping[str, float]:
                with listening(workspace) as has_all:
                    return {"joined": has_all()[0]}

            sample()  # until all has started
            yield sample

    return robot


BENCHMARK = Benchmark(
    name="join",
    about="from rclpy.init of a stock listener until it has all fixed edges of a running robot",
    rows={
        "joined": Row(
            f"a listener that joins has {EDGES} fixed edges after",
            "s",
            (Limit(0.5), Limit(1.0, "worst")),
        )
    },
    contenders={
        contender: opened(COMMANDS[contender]) for contender in (TFCOMPOSE_ON_ROS, RCLPY, LAUNCH)
    },
    runs=40,
    quick_runs=3,
)
