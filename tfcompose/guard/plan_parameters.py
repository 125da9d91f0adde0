"""The plan's origin as parameters of the guard's node, for ``ros2 param``."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rclpy.node import Node

    from tfcompose.guard.judge import Judge
    from tfcompose.model.plan import Plan
    from tfcompose.tf.ros.parameter_server import ParameterServer, Value

_DESCRIPTIONS = {
    "robot": "the robot's name",
    "file": "the name of the robot file",
    "profiles": "the profiles that are merged over the robot file",
    "overlays": "the overlays that are merged over the robot file",
    "spec_digest": "the digest of the merged robot file; plan.json has the same",
}


class PlanParameters:
    """Parameters of the guard's node.

    They are offered as soon as no process waits for the guard's reports.
    """

    def __init__(self, node: Node, plan: Plan) -> None:
        self._node = node
        self._values = _values(plan)
        self._server: ParameterServer | None = None

    def check(self, judges: Sequence[Judge], now: float) -> None:
        """Answer received requests without blocking."""
        if self._server:
            self._server.check()
        elif not any(judge.is_starting(now) for judge in judges):
            from tfcompose.tf.ros.parameter_server import ParameterServer  # noqa: PLC0415 (its cost)

            self._server = ParameterServer(self._node, self._values, _DESCRIPTIONS)

    def follow(self, plan: Plan) -> None:
        """Report the values of another plan."""
        self._values = _values(plan)
        if self._server:
            self._server.update(self._values)


def _values(plan: Plan) -> dict[str, Value]:
    return {
        "robot": plan.robot,
        "file": plan.file,
        "profiles": list(plan.profiles),
        "overlays": list(plan.overlays),
        "spec_digest": plan.spec_digest,
        "use_sim_time": plan.ros.clock == "sim",
    }
