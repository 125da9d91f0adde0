"""What a rule is: a function that yields the findings of one code, and whose docstring is the code's page."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from tfcompose.foundation.catalogue import CATALOGUE, Code

Follows = Literal["pose"]

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from tfcompose.foundation.findings import Finding
    from tfcompose.model.robot import Robot

    Find = Callable[[Robot], Iterable[Finding]]


@dataclass(frozen=True, slots=True)
class Rule:
    """A code of the catalogue, and the function that finds it.

    A rule ``of_urdf`` makes sense for a robot without owners, sensors and processes, too. What
    ``follows`` from a pose is not reported of an entry whose pose was refused. An ``idle`` rule
    finds what has no use: where profiles or overlays are merged over a robot, the file alone may
    use it.
    """

    code: Code
    find: Find
    of_urdf: bool = False
    follows: Follows | None = None
    idle: bool = False

    @property
    def page(self) -> str:
        """What ``tfcompose explain`` prints: the function's docstring."""
        return inspect.getdoc(self.find) or ""


def rule(
    code: str, *, of_urdf: bool = False, follows: Follows | None = None, idle: bool = False
) -> Callable[[Find], Rule]:
    """Return a decorator that makes a function the rule of a code; the function has the name of the code.

    Raises:
        KeyError: if the catalogue does not have the code.
        ValueError: if it has it under another name.
    """

    def made(find: Find) -> Rule:
        if find.__name__ != CATALOGUE[code].name:
            raise ValueError(
                f"the catalogue calls {code} {CATALOGUE[code].name}, not {find.__name__}"
            )
        return Rule(CATALOGUE[code], find, of_urdf, follows, idle)

    return made
