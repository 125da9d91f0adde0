"""Check whether the launchers of a plan can follow another one without a full restart."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.tools.deploy.release import NAMED, WHEELS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.plan import Plan


def can_follow(before: Plan, after: Plan) -> bool:
    """Return whether the robot can keep running while hosts change plans one after another.

    It cannot in these cases:

    - Processes or edges move between hosts: the old ones must end first.
    - Frames vanish: buffers of running nodes would keep them.
    - Settings of all nodes change.
    - A guard does more than report: it would act by one plan on a host that runs the other.
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
    """Return the host that publishes each frame's parent edge."""
    hosts = _hosts(plan)
    return {edge.child: hosts.get(edge.owner) for edge in plan.edges}


def same_files(before: Mapping[str, str], after: Mapping[str, str]) -> bool:
    """Return whether two releases, by their manifests, differ only in built files.

    Which processes read the other files is unknown.
    """
    kinds = (f"{NAMED}/", f"{WHEELS}/")
    named = [
        {path: digest for path, digest in plan.items() if path.startswith(kinds)}
        for plan in (before, after)
    ]
    return named[0] == named[1]
