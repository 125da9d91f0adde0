"""Rules: functions that yield the findings of one code.

``tfcompose/data/codes/CODE.md`` explains the code.
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
    """A code of the catalogue, and the function that yields findings with this code."""

    code: str
    find: Find
    #: Whether the rule also applies to a robot without owners, sensors and processes.
    of_urdf: bool = False
    #: The value that the finding depends on. The rule skips an entry whose value was rejected.
    follows: Follows | None = None
    #: Whether the rule reports unused entries. ``check`` skips such a rule when profiles or
    #: overlays are merged, because the file without them may use the entry.
    idle: bool = False


def rule(
    code: str, *, of_urdf: bool = False, follows: Follows | None = None, idle: bool = False
) -> Callable[[Find], Rule]:
    """Return a decorator that turns a function into the rule of a code.

    The function's name must be the catalogue's name of the code.
    """

    def make_rule(find: Find) -> Rule:
        return Rule(code, find, of_urdf, follows, idle)

    return make_rule
