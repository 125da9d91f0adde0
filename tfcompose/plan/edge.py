"""One edge of a plan, and the joint that moves it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tfcompose.geometry import Pose  # noqa: TC001 (the schema reads the types)

EdgeKind = Literal["static", "joint", "dynamic"]
EDGE_KINDS: tuple[EdgeKind, ...] = ("static", "joint", "dynamic")

#: An edge is silent after four periods, and never before this: what a loaded machine can delay.
SILENT_AT_LEAST_S = 0.6
SILENT_PERIODS = 4.0
#: It is too slow below this part of the rate that is declared.
SLOW_BELOW = 0.8


@dataclass(frozen=True, slots=True)
class Joint:
    """A moving joint: its edge's pose at position q is the edge's ``pose`` followed by the motion along ``axis``.

    ``axis`` is a unit vector in the child's frame at q = 0. With ``mimic`` the position is
    ``multiplier`` · q(mimic) + ``offset``. Positions are radians, or metres for a prismatic joint.
    """

    name: str
    type: str
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    mimic: str | None = None
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class PlanEdge:
    """One TF edge and the process that publishes it. ``node`` is the publishing node's full name.

    ``switched`` holds the further parents between which the owner may change the child; ``parent`` is the nominal one.
    """

    parent: str
    child: str
    kind: EdgeKind
    owner: str
    node: str
    pose: Pose
    rate: float | None
    source: tuple[str, int]
    joint: Joint | None = None
    switched: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The edge as people read it."""
        return f"{self.parent} → {self.child}"

    @property
    def silent_after_s(self) -> float | None:
        """How long a moving edge may be quiet, in seconds, or None if it says no rate."""
        if not self.rate or self.kind == "static":
            return None
        return max(SILENT_AT_LEAST_S, SILENT_PERIODS / self.rate)

    def may_hang_on(self, parent: str) -> bool:
        """Return whether the owner may publish the child below this parent."""
        return parent == self.parent or parent in self.switched
