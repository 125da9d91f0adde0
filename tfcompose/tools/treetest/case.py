"""Case of a test file, with the plan of its robot."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tfcompose.foundation.findings import Span
    from tfcompose.model.plan import Plan
    from tfcompose.spec.load import Path as SpecPath
    from tfcompose.spec.load import Source
    from tfcompose.tools.treetest.spec import CaseSpec


@dataclass(frozen=True, slots=True)
class Case:
    """A case, ready to run."""

    spec: CaseSpec
    source: Source
    #: The text of the test file.
    text: str
    #: Where the case is in its file.
    path: SpecPath
    plan: Plan
    #: The robot file.
    robot: str
    #: The path of the recording; None: the robot is started.
    bag: str | None
    #: Whether xacro files may run outside of the sandbox.
    trust: bool
    #: The path of the golden recording; None: there is none.
    golden: str | None = None

    @property
    def file(self) -> str:
        """The test file."""
        return self.source.file

    def span(self, *steps: str | int) -> Span:
        """Return the place of a key below the case, or of the nearest one around it."""
        path = self._path_of(steps)
        return self.source.key_span(path) if self.source.has_key(path) else self.value_span(*steps)

    def value_span(self, *steps: str | int) -> Span:
        """Return the place of a value below the case."""
        return self.source.span_of(self._path_of(steps))

    def _path_of(self, steps: Iterable[str | int]) -> SpecPath:
        """Return the path of steps below the case; one item in place of a list has no number."""
        path = self.path
        for step in steps:
            if isinstance(step, str) or self.source.has((*path, step)):
                path = (*path, step)
        return path


def variant_of(profiles: Iterable[str], *, trust: bool, starts: bool) -> Namespace:
    """Return the arguments with which a robot file is compiled.

    ``trust``: xacro files may run outside of the sandbox. ``starts``: the robot is started here.
    """
    return Namespace(
        profiles=list(profiles),
        overlays=[],
        settings=[],
        arg_values={},
        trust=trust,
        by_hostname=starts,
    )
