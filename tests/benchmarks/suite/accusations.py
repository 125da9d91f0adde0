"""Findings about strange publishers: whether they name the one that sent, in each way of guarding.

A stranger of each kind is started next to a robot. Its finding must name it, accuse no other
process, and be over when it has left.
"""

from __future__ import annotations

import re
import sys
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

from tests.benchmarks.benchmark import Benchmark, Limit, Row
from tests.benchmarks.contenders import TFCOMPOSE_ON_ROS
from tests.support.adversary import GUARDS, OTHER_X, Robot, foreign, node, running
from tests.support.waiting import complete_lines, until

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tests.benchmarks.benchmark import Sampler, Workspace

#: Kinds of strangers: their command, and their name in findings; one that is no ROS node has no
#: process.
KINDS = {
    "a stranger": (node("stranger", OTHER_X, "map odom"), "/stranger"),
    "the owner's name": (node("slam", OTHER_X, "map odom"), "another /slam"),
    "the other owner's name": (node("drive", OTHER_X, "map odom"), "/drive"),
    "the owner's name below it": (
        node("slam", OTHER_X, "map odom", namespace="/slam"),
        "/slam/slam",
    ),
    "the guard's name": (node("tfcompose_guard", OTHER_X, "map odom"), "/tfcompose_guard"),
    "an undeclared edge": (node("slam", OTHER_X, "odom extra"), "/slam"),
    "another parent": (node("stranger", OTHER_X, "odom map"), "/stranger"),
    "another vendor's DDS": (foreign(OTHER_X, "map odom"), "a DDS program that is not a ROS node"),
}
REPORTED_S = 20.0


@contextmanager
def robots(workspace: Workspace) -> Iterator[Sampler]:
    """Run a robot for each way of guarding, one after the other, anew in each round."""
    numbers = iter(range(sys.maxsize))

    def sample() -> Mapping[str, float]:
        values: dict[str, float] = {}
        for guard in GUARDS:
            folder = workspace.folder / str(next(numbers))
            folder.mkdir()
            with running(folder, guard, {}) as robot:
                robot.says("tree complete")
                missed = [kind for kind in KINDS if not _is_named(robot, kind)]
            values[guard] = 100 * len(missed) / len(KINDS)
        return values

    yield sample


def _is_named(robot: Robot, kind: str) -> bool:
    """Start a stranger of that kind; return whether the findings are about it alone."""
    command, name = KINDS[kind]
    after = len(robot.lines())
    process = robot.start(command)

    def text() -> str:
        return "\n".join(complete_lines(robot.output)[after:])

    def is_reported() -> bool:
        return bool(re.search(r"\[TF8\d\d\]", text())) and (
            "not a ROS node" in text() or "runs on this" in text()
        )

    until(is_reported, REPORTED_S)
    time.sleep(1.0)  # another process may be accused with it
    robot.stop(process)
    is_over = until(lambda: " over" in text(), REPORTED_S)
    accused = {int(pid) for pid in re.findall(r"runs on this machine as pid (\d+)", text())}
    is_named = name in text() and not accused - {process.pid}
    if not (is_named and is_over):
        sys.stderr.write(f"{robot.guard}, {kind}: over: {is_over}\n{text()}\n")
    return is_named and is_over


BENCHMARK = Benchmark(
    name="accusations",
    about="a strange publisher of eight kinds in turn next to a running robot",
    rows={
        guard: Row(
            f"strange publishers whom no finding names rightly, {key}", "%", (Limit(0, "worst"),)
        )
        for guard, key in GUARDS.items()
    },
    contenders={TFCOMPOSE_ON_ROS: robots},
    runs=8,
    quick_runs=1,
    timeout_s=3600.0,
)
