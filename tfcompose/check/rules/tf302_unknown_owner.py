"""TF302: unknown owner."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, did_you_mean, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.findings import Span
    from tfcompose.model import Edge, Robot


def unknown_owner(robot: Robot) -> Iterator[Finding]:
    """An edge names an owner that is no process.

    An owner is a process of the plan: one under ``processes``, a sensor with a driver, or the built-in ``static`` and
    ``joints``. A process that somebody else starts is declared with ``external: true``.
    """
    names = {process.name: None for process in robot.processes}
    lost: dict[tuple[str, Span], list[Edge]] = {}  # a part's owner owns many edges, and is one slip
    for edge in robot.edges:
        if edge.owner not in names and not robot.excuses(edge.owner):
            lost.setdefault((edge.owner, edge.owner_at or edge.at), []).append(edge)
    for (owner, at), edges in lost.items():
        more = f" and {len(edges) - 1} more edges" if edges[1:] else ""
        advice = did_you_mean(owner, names, f"processes: {{{owner}: {{external: true}}}}")
        yield finding("TF302", f"the owner of {edges[0].name}{more} is {owner}, which is no process", at, help=advice)
