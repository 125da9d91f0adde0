"""Stock nodes in the place of tfcompose's own publishers.

Their names, and what robot_state_publisher accepts.

``export launch`` starts them, and ``verify`` takes what they send for their owners', where these
do not run.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.model.plan import Plan

STATE_PUBLISHER = "robot_state_publisher"
#: The highest publish_frequency that it accepts: tfcompose's own publisher passes every joint
#: state on.
MOST_HZ = 1000.0
#: The kinds of processes that stock nodes stand in for.
OWN_KINDS = ("static", "joints")
_NO_NODE = re.compile(r"\W")


def static_names(plan: Plan) -> dict[str, str]:
    """Return the name of the static_transform_publisher of each own fixed edge, by its child.

    No two are the same.
    """
    own = {process.name for process in plan.processes if process.kind in OWN_KINDS}
    names: dict[str, str] = {}
    for edge in plan.edges:
        if edge.owner in own and edge.kind == "static":
            name = f"static_{_NO_NODE.sub('_', edge.child)}"
            while name in names.values():
                name += "_"
            names[edge.child] = name
    return names


def stand_ins(plan: Plan) -> dict[str, frozenset[str]]:
    """Return the stock nodes that may send an own edge instead, by child."""
    own = {process.name for process in plan.processes if process.kind in OWN_KINDS}
    below = f"/{plan.ros.namespace}/" if plan.ros.namespace else "/"
    fixed = static_names(plan)
    return {
        edge.child: frozenset(
            below + name for name in (STATE_PUBLISHER, fixed.get(edge.child, STATE_PUBLISHER))
        )
        for edge in plan.edges
        if edge.owner in own
    }
