"""Contenders that build robots of many links: tfcompose, and xacro that expands the same."""

from __future__ import annotations

import compileall
import importlib.util
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tests.benchmarks.benchmark import TFCOMPOSE, Contender, Opened
from tests.benchmarks.contenders import XACRO
from tests.benchmarks.measures import usage
from tests.benchmarks.record import ROOT
from tests.benchmarks.robots import Kind, spec_of, xacro_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from tests.benchmarks.benchmark import Sampler, Workspace

#: What the installed command runs.
TFCOMPOSE_CODE = "import sys; from tfcompose.cli import main; sys.exit(main())"
_EXPAND = "import sys, xacro; open('x.urdf', 'w').write(xacro.process(sys.argv[1]))"


@dataclass(frozen=True)
class Robot:
    """A robot to build."""

    kind: Kind
    links: int

    @property
    def row(self) -> str:
        """The name of its row, and the stem of its files."""
        return f"{self.kind}_{self.links}"


def contenders(robots: Sequence[Robot]) -> dict[Contender, Opened]:
    """Return what builds these robots.

    If the last has more links than the first, a trial leaves it out, and tfcompose also has the
    rows ``growth``, from the first to the last, and ``memory`` in MB, for the last.
    """

    @contextmanager
    def tfcompose(workspace: Workspace) -> Iterator[Sampler]:
        compileall.compile_dir(ROOT / "tfcompose", quiet=2)
        for robot in robots:
            text = spec_of(robot.kind, robot.links)
            (workspace.folder / f"{robot.row}.yaml").write_text(text, encoding="utf-8")

        def sample() -> Mapping[str, float]:
            values: dict[str, float] = {}
            for robot in _chosen(robots, workspace):
                build = ("build", f"{robot.row}.yaml", "-o", f"out_{robot.row}")
                values[robot.row], megabytes = usage(workspace, "-c", TFCOMPOSE_CODE, *build)
            if not workspace.is_quick and _grows(robots):
                values["growth"] = values[robots[-1].row] / values[robots[0].row]
                values["memory"] = megabytes
            return values

        yield sample

    @contextmanager
    def xacro(workspace: Workspace) -> Iterator[Sampler]:
        spec = importlib.util.find_spec("xacro")
        assert spec
        assert spec.origin
        compileall.compile_dir(Path(spec.origin).parent, quiet=2)
        for robot in robots:
            text = xacro_of(robot.kind, robot.links)
            (workspace.folder / f"{robot.row}.xacro").write_text(text, encoding="utf-8")

        def sample() -> Mapping[str, float]:
            return {
                robot.row: usage(workspace, "-c", _EXPAND, f"{robot.row}.xacro")[0]
                for robot in _chosen(robots, workspace)
            }

        yield sample

    return {TFCOMPOSE: tfcompose, XACRO: xacro}


def _chosen(robots: Sequence[Robot], workspace: Workspace) -> Sequence[Robot]:
    return robots[:-1] if workspace.is_quick and _grows(robots) else robots


def _grows(robots: Sequence[Robot]) -> bool:
    return robots[-1].links > robots[0].links
