"""A plan as a whole."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

from tfcompose.plan.edge import PlanEdge  # noqa: TC001 (the schema reads the types)
from tfcompose.plan.policy import Claim, GuardPolicy, RosSettings
from tfcompose.plan.process import PlanProcess  # noqa: TC001 (the schema reads the types)

VERSION = 1

#: The file beside the plan that holds the whole robot's description.
DESCRIPTION = "robot.full.urdf"
#: What no name of a node may hold.
_NO_NAME = re.compile(r"\W")


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything that ``tfcompose up`` needs, and nothing that it has to compile.

    ``host`` is the machine whose share of the processes this is: it starts those that are not ``external``. None is
    the whole plan, and empty the share of the machine that the plan does not name.
    """

    robot: str
    spec_digest: str
    base: str | None
    ros: RosSettings
    edges: tuple[PlanEdge, ...]
    processes: tuple[PlanProcess, ...]
    guard: GuardPolicy = field(default_factory=GuardPolicy)
    claims: tuple[Claim, ...] = ()
    description: str = DESCRIPTION
    version: int = VERSION
    host: str | None = None

    def process(self, name: str) -> PlanProcess:
        """Return the process of that name.

        Raises:
            KeyError: if there is none.
        """
        for process in self.processes:
            if process.name == name:
                return process
        raise KeyError(name)

    def guards_of(self, host: str | None) -> tuple[str, ...]:
        """Return the nodes of the guard of a host's share; None or empty: of the machine that has no name here."""
        own = [node for process in self.processes if process.kind == "guard" for node in process.nodes]
        # No two nodes have one name.
        return tuple(node.removesuffix(_name_end(self.host)) + _name_end(host) for node in own)

    def claim_on(self, nodes: tuple[str, ...], parent: str, child: str) -> Claim | None:
        """Return what is known of one of the nodes publishing the edge by default, or None."""
        ends = (parent, child)
        return next((one for one in self.claims if one.node in nodes and (one.parent, one.child) == ends), None)

    def may_be_undeclared(self, parent: str, child: str) -> bool:
        """Whether nobody needs to have declared the edge: by policy, or because it is another robot's."""
        policy, ros = self.guard, self.ros
        if ros.frame_prefix and not child.startswith(ros.frame_prefix) and child not in ros.shared_frames:
            return True
        return policy.unknown_edges == "ignore" or any(
            fnmatchcase(parent, parents) and fnmatchcase(child, children) for parents, children in policy.allow
        )

    def edges_of(self, owner: str) -> tuple[PlanEdge, ...]:
        """Return the edges that the process publishes, in the plan's order."""
        return tuple(edge for edge in self.edges if edge.owner == owner)


def _name_end(host: str | None) -> str:
    return f"_{_NO_NAME.sub('_', host)}" if host else ""
