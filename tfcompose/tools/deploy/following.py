"""Check whether the launchers of a plan can follow another one without a full restart."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.tools.deploy.release import NAMED, WHEELS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.plan import Plan


def can_follow(before: Plan, after: Plan) -> bool:
    """Return whether the robot can go on while hosts change plans one after another.

    It cannot where processes or edges move between hosts, because all have to end first; where
    frames vanish, because buffers of nodes that go on would keep them; where settings of all nodes
    change; and where a guard does more than report, because it would judge by one plan what
    another host does by the other.
    """
    if (before.robot, before.ros, before.guard) != (after.robot, after.ros, after.guard):
        return False
    if after.guard.mode == "strict" or after.guard.on_violation != "report":
        return False
    hosts, places = _hosts(before), _places(before)
    if any(hosts.get(name, host) != host for name, host in _hosts(after).items()):
        return False
    there = _places(after)
    return all(there.get(child) == host for child, host in places.items())


def _hosts(plan: Plan) -> dict[str, str | None]:
    return {process.name: process.host for process in plan.processes}


def _places(plan: Plan) -> dict[str, str | None]:
    """Return on which host each frame gets its parent."""
    hosts = _hosts(plan)
    return {edge.child: hosts.get(edge.owner) for edge in plan.edges}


def same_files(before: Mapping[str, str], after: Mapping[str, str]) -> bool:
    """Return whether two releases, by their manifests, differ only in what is built.

    Others' readers are unknown.
    """
    kinds = (f"{NAMED}/", f"{WHEELS}/")
    named = [
        {path: digest for path, digest in plan.items() if path.startswith(kinds)}
        for plan in (before, after)
    ]
    return named[0] == named[1]
