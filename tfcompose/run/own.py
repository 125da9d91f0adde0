"""What tfcompose's own processes share: their arguments, the plan, and their few lines of output."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.findings import RejectedError, Span, finding
from tfcompose.plan.file import read_plan

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.plan import Plan, PlanEdge, PlanProcess

_ARGUMENTS = 2


@dataclass(frozen=True, slots=True)
class Own:
    """One of the plan's processes, as it runs. ``given`` is what follows ``--ros-args`` on its command line."""

    plan: Plan
    process: PlanProcess
    file: Path
    given: tuple[str, ...]

    @property
    def node_name(self) -> str:
        """The last part of its node's full name."""
        return self._full_name.rpartition("/")[2]

    @property
    def namespace(self) -> str:
        """The rest of its node's full name: empty, or with a slash in front."""
        return self._full_name.rpartition("/")[0]

    @property
    def ros_args(self) -> list[str]:
        """What its node is told: what is on the command line, which comes first, and the plan's remappings."""
        return [*self.given, *(word for old, new in self.process.remap.items() for word in ("-r", f"{old}:={new}"))]

    @property
    def edges(self) -> tuple[PlanEdge, ...]:
        """The edges that it publishes."""
        return self.plan.edges_of(self.process.name)

    @property
    def description(self) -> Path:
        """The file that becomes ``robot_description``; it stands beside the plan."""
        return self.file.parent / (self.process.description or self.plan.description)

    @property
    def _full_name(self) -> str:
        return self.process.nodes[0] if self.process.nodes else self.process.name


def say(line: str) -> None:
    """Write a line of output at once."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def count(number: int, what: str) -> str:
    """Return "1 edge", "2 edges"."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def read_own(argv: Sequence[str], kind: str) -> Own:
    """Return the process of that kind that ``argv`` names, with its plan.

    Raises:
        RejectedError: with a TF902 finding, if there is no such plan or process.
    """
    words = list(argv)
    at = words.index("--ros-args") if "--ros-args" in words else len(words)
    if at != _ARGUMENTS:
        raise _unfit(f"usage: python -m tfcompose.run.{kind} PLAN_FILE PROCESS_NAME [--ros-args …]", "")
    file, name = words[:at]
    try:
        plan = read_plan(Path(file).read_text(encoding="utf-8"), file)
    except (OSError, UnicodeDecodeError) as error:
        raise _unfit(f"cannot read the plan: {error}", file) from None
    try:
        process = plan.process(name)
    except KeyError:
        raise _unfit(f"the plan has no process {name}", file) from None
    if process.kind != kind:
        raise _unfit(f"process {name} is of kind {process.kind}, not {kind}", file)
    if kind == "simulate" and process.simulate is None:
        raise _unfit(f"process {name} does not say what to simulate", file)
    return Own(plan, process, Path(file), tuple(words[at + 1 :]))


def _unfit(message: str, file: str) -> RejectedError:
    return RejectedError([finding("TF902", message, Span(file) if file else None)])
