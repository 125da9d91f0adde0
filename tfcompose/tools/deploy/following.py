"""Test whether running launchers can switch to another plan without a full restart."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.tools.deploy.release import NAMED, WHEELS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.plan import Plan


def can_follow(before: Plan, after: Plan) -> bool:
    """Return whether the robot can keep running while its hosts switch plans one by one.

    It cannot in these cases:

    - Processes or edges move between hosts: the old processes must end first.
    - Frames disappear: buffers of running nodes would keep them.
    - Settings of all nodes change.
    - A guard is strict or stops processes: it could act by the old plan on the new plan's edges.
    """
    if (before.robot, before.ros, before.guard) != (after.robot, after.ros, after.guard):
        return False
    if after.guard.mode == "strict" or after.guard.on_violation != "report":
        return False
    hosts, places = _hosts(before), _places(before)
    if any(hosts.get(name, host) != host for name, host in _hosts(after).items()):
        return False
    places_after = _places(after)
    return all(places_after.get(child) == host for child, host in places.items())


def _hosts(plan: Plan) -> dict[str, str | None]:
    return {process.name: process.host for process in plan.processes}


def _places(plan: Plan) -> dict[str, str | None]:
    """Return the host that publishes the edge above each frame."""
    hosts = _hosts(plan)
    return {edge.child: hosts.get(edge.owner) for edge in plan.edges}


def same_files(before: Mapping[str, str], after: Mapping[str, str]) -> bool:
    """Return whether two releases differ only in built files.

    The arguments are the manifests of the releases. If other files differ, all processes must
    restart, because it is unknown which processes read these files.
    """
    kinds = (f"{NAMED}/", f"{WHEELS}/")
    named = [
        {path: digest for path, digest in plan.items() if path.startswith(kinds)}
        for plan in (before, after)
    ]
    return named[0] == named[1]
