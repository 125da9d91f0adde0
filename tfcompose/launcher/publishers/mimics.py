"""Joints whose positions a message determines: named joints, and joints that mimic these."""

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
    """A joint whose position a message determines: multiplier · positions[column] + offset."""

    #: Index of the joint.
    joint: int
    #: Index into the message's positions.
    column: int
    multiplier: float
    #: In rad, or in m for a prismatic joint.
    offset: float


class Joints:
    """Joints with a single position each, and the joints that mimic them.

    A mimicking joint follows its joint, even through chains in any order. At each step its
    position is multiplier · q + offset. As in robot_state_publisher, a position in the message for
    the mimicking joint itself takes precedence. A message determines only the joints that it
    names, and joints that mimic these. Another joint was measured at a different time, so the
    message's stamp would be wrong for it. Joints that mimic each other in a circle are never
    determined.
    """

    def __init__(self, joints: Sequence[PlanJoint]) -> None:
        self._joints = list(joints)
        self._mimics = {joint.name: joint for joint in joints if joint.mimic is not None}

    def follow(self, names: Sequence[str]) -> list[Followed]:
        """Return the joints that a message with these names determines.

        If a name is repeated, its first position counts.
        """
        columns: dict[str, int] = {}
        for column, name in enumerate(names):
            columns.setdefault(name, column)
        positions = (
            self._follow(index, joint, columns) for index, joint in enumerate(self._joints)
        )
        return [joint for joint in positions if joint is not None]

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
