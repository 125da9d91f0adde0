"""Rules: functions that yield the findings of one code.

What the code means is in the catalogue: ``tfcompose/data/codes/CODE.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

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

    code: str
    find: Find
    of_urdf: bool = False
    follows: Follows | None = None
    idle: bool = False


def rule(
    code: str, *, of_urdf: bool = False, follows: Follows | None = None, idle: bool = False
) -> Callable[[Find], Rule]:
    """Return a decorator that makes a function the rule of a code.

    The function has the name that the catalogue has for the code.
    """

    def make_rule(find: Find) -> Rule:
        return Rule(code, find, of_urdf, follows, idle)

    return make_rule
