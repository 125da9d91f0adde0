"""Reading the result of a build back, beside what yourdfpy alone takes to read it."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from tests.benchmarks.benchmark import TFCOMPOSE, Benchmark, Contender, Limit, Row
from tests.benchmarks.building import TFCOMPOSE_CODE
from tests.benchmarks.measures import usage
from tests.benchmarks.robots import spec_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tests.benchmarks.benchmark import Sampler, Workspace

LINKS = 1_000
YOURDFPY = Contender("yourdfpy")
READ = """import sys, yourdfpy
for file in sys.argv[1:]:
    yourdfpy.URDF.load(file, build_scene_graph=False, load_meshes=False)
"""
_BUILD = ("-c", TFCOMPOSE_CODE, "build", "robot.yaml", "-o", "built")


def _write(workspace: Workspace) -> None:
    (workspace.folder / "robot.yaml").write_text(spec_of("jointed", LINKS), encoding="utf-8")


@contextmanager
def read_back(workspace: Workspace) -> Iterator[Sampler]:
    """Build with and without ``--read-back``: the difference."""
    _write(workspace)

    def sample() -> Mapping[str, float]:
        without, _ = usage(workspace, *_BUILD)
        return {"added": usage(workspace, *_BUILD, "--read-back")[0] - without}

    yield sample


@contextmanager
def yourdfpy(workspace: Workspace) -> Iterator[Sampler]:
    """Read both descriptions of the built robot."""
    _write(workspace)
    usage(workspace, *_BUILD)
    files = ("built/robot.urdf", "built/robot.state_publisher.urdf")

    def sample() -> Mapping[str, float]:
        return {"added": usage(workspace, "-c", READ, *files)[0]}

    yield sample


BENCHMARK = Benchmark(
    name="read_back",
    about="processor time that `--read-back` adds; yourdfpy reads the same descriptions",
    rows={
        "added": Row(
            f"`build --read-back` of {LINKS:,} links adds",
            "s",
            (Limit(1.5, "least", times=YOURDFPY),),
        )
    },
    contenders={TFCOMPOSE: read_back, YOURDFPY: yourdfpy},
    runs=3,
    quick_runs=1,
)
