"""Stock nodes of ROS that can replace tfcompose's publishers: their names and limits.

``export launch`` starts them. ``verify`` accepts edges from them in place of the owners, if the
owners do not run.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.model.plan import Plan

STATE_PUBLISHER = "robot_state_publisher"
#: The maximum publish_frequency that robot_state_publisher accepts. tfcompose's own publisher
#: passes on every joint state.
MOST_HZ = 1000.0
#: Kinds of processes that stock nodes can replace.
OWN_KINDS = ("static", "joints")
_NO_NODE = re.compile(r"\W")


def static_names(plan: Plan) -> dict[str, str]:
    """Return a unique name of a static_transform_publisher for each fixed edge, by child.

    Only edges of tfcompose's ``static`` are included.
    """
    owners = {process.name for process in plan.processes if process.kind in OWN_KINDS}
    names: dict[str, str] = {}
    for edge in plan.edges:
        if edge.owner in owners and edge.kind == "static":
            name = f"static_{_NO_NODE.sub('_', edge.child)}"
            while name in names.values():
                name += "_"
            names[edge.child] = name
    return names


def stand_ins(plan: Plan) -> dict[str, frozenset[str]]:
    """Return the stock nodes that may publish an edge instead of its owner, by child."""
    owners = {process.name for process in plan.processes if process.kind in OWN_KINDS}
    below = f"/{plan.ros.namespace}/" if plan.ros.namespace else "/"
    fixed = static_names(plan)
    return {
        edge.child: frozenset(
            below + name for name in (STATE_PUBLISHER, fixed.get(edge.child, STATE_PUBLISHER))
        )
        for edge in plan.edges
        if edge.owner in owners
    }
