"""Where the joints of a robot without encoders are: what joint_state_publisher would say of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.run.publishing.follow import SLIDING, TURNING, Joints
from tfcompose.run.publishing.motion import swept

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.plan import Joint, Simulation


class JointSource:
    """The simulated joints, and behind them those of the plan that mimic them, also through chains.

    A robot_state_publisher of the stock kind follows a chain only in the order of the names, so that mimics are sent
    with their own values.
    """

    def __init__(self, simulation: Simulation, joints: Sequence[Joint]) -> None:
        own = list(simulation.joints)
        self._moves = [(start, simulation.sweep.get(name)) for name, start in simulation.joints.items()]
        movable = [joint for joint in joints if joint.type in TURNING + SLIDING]
        followed = {movable[one.joint].name: one for one in Joints(movable).followed(own)}
        self._mimics = [one for name, one in followed.items() if name not in simulation.joints]
        #: The names, in the order of the positions.
        self.names = own + [name for name in followed if name not in simulation.joints]

    def positions(self, time_s: float) -> list[float]:
        """Return where they are so many seconds after the start: rad, or m of those that slide."""
        own = [swept(sweep, start, time_s) if sweep else start for start, sweep in self._moves]
        return own + [one.multiplier * own[one.column] + one.offset for one in self._mimics]
