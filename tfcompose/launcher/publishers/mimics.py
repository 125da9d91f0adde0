"""Joints whose positions a message determines: those it names, and those that mimic them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.model.plan import PlanJoint

TURNING = ("revolute", "continuous")
SLIDING = ("prismatic",)


@dataclass(frozen=True, slots=True)
class Followed:
    """A joint's position: ``multiplier`` · positions[``column``] + ``offset``, rad or m."""

    joint: int
    column: int
    multiplier: float
    offset: float


class Joints:
    """Joints, each of a type that has a single position, and their mimics.

    A joint that mimics another follows it, also through a chain and in any order: multiplier · q +
    offset at each step. As in robot_state_publisher, a position that was sent for the mimic itself
    wins over the one it would follow. Only what a message says is determined by it: a joint that
    it says nothing about was measured at another time, and that message's stamp would be false for
    it. Joints that follow each other in a circle are never determined.
    """

    def __init__(self, joints: Sequence[PlanJoint]) -> None:
        self._joints = list(joints)
        self._mimics = {joint.name: joint for joint in joints if joint.mimic is not None}

    def follow(self, names: Sequence[str]) -> list[Followed]:
        """Return the joints that a message with these names determines.

        Of a name that comes twice the first counts.
        """
        columns: dict[str, int] = {}
        for column, name in enumerate(names):
            columns.setdefault(name, column)
        found = (self._follow(index, joint, columns) for index, joint in enumerate(self._joints))
        return [joint for joint in found if joint is not None]

    def _follow(self, index: int, joint: PlanJoint, columns: dict[str, int]) -> Followed | None:
        multiplier, offset, name = 1.0, 0.0, joint.name
        for _ in range(len(self._mimics) + 1):
            if name in columns:
                return Followed(index, columns[name], multiplier, offset)
            mimic = self._mimics.get(name)
            if mimic is None or mimic.mimic is None:
                return None
            offset += multiplier * mimic.offset
            multiplier *= mimic.multiplier
            name = mimic.mimic
        return None
