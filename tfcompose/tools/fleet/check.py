"""Checks of a fleet file: edges that clash, and robots without a common tree."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.spec.load import Path, Source
    from tfcompose.tools.fleet.spec import FleetSpec


def check_fleet(fleet: FleetSpec, source: Source) -> Iterator[Finding]:
    """Yield the findings about a valid fleet file."""
    yield from _check_shared_twice(fleet, source)
    yield from _apart(fleet, source)


def _check_shared_twice(fleet: FleetSpec, source: Source) -> Iterator[Finding]:
    """Yield a finding for each frame that has two parents.

    Lookups would jump between the two.
    """
    first: dict[str, tuple[str, Path]] = {}
    for robot in fleet.robots:
        for index, shared in enumerate(fleet.edges_of(robot)):
            parent, child = (fleet.final(robot, frame) for frame in shared.ends)
            path = _path(fleet, robot, index)
            first_robot, place = first.setdefault(child, (robot, path))
            if (first_robot, place) == (robot, path):
                continue
            message = (
                f"{parent} → {child} of {robot} is a second parent of {child}, which {first_robot}"
                " shares"
            )
            advice = (
                "give the robots different prefixes"
                if first_robot != robot
                else "remove one of them"
            )
            notes = [Note("the other one", source.span_of(place))]
            yield finding("TF880", message, source.span_of(path), notes=notes, help=advice)


def _path(fleet: FleetSpec, robot: str, index: int) -> Path:
    return (
        ("share", index)
        if fleet.robots[robot].share is None
        else ("robots", robot, "share", index)
    )


def _apart(fleet: FleetSpec, source: Source) -> Iterator[Finding]:
    """Yield a finding for each robot whose frames are not in the tree of the first robot."""
    trees: dict[str, set[str]] = {}
    for robot in fleet.robots:
        frames = {
            fleet.final(robot, frame) for shared in fleet.edges_of(robot) for frame in shared.ends
        }
        if not frames:
            span = source.key_span(("robots", robot))
            yield finding(
                "TF881",
                f"{robot} shares no edge",
                span,
                help="share: [map → odom, odom → base_link]",
            )
            continue
        trees[robot] = frames
    names = list(trees)
    reached, together = set(names[:1]), set().union(*(trees[name] for name in names[:1]))
    while more := [
        name for name in names if name not in reached and not together.isdisjoint(trees[name])
    ]:
        reached.update(more)
        together.update(*(trees[name] for name in more))
    for robot in names:
        if robot not in reached:
            message = f"{robot} shares no frame with {names[0]}: there are no poses between them"
            advice = f"share an edge from one of shared_frames: {', '.join(fleet.shared_frames)}"
            yield finding("TF881", message, source.key_span(("robots", robot)), help=advice)
