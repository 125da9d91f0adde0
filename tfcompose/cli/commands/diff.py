"""Show what moved or changed owner between two robot files.

Print the frames that moved between OLD and NEW, in millimetres and degrees, and frames that were
added, removed, or got another parent or owner. Exit 1 on a difference.
"""

from __future__ import annotations

import json
import math
from copy import copy
from typing import TYPE_CHECKING, NamedTuple

from tfcompose.cli.options import add_format, add_variant
from tfcompose.cli.terminal import UNREADABLE, fail
from tfcompose.foundation.geometry import angle_between, norm

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Iterator

    from tfcompose.model.robot import Edge, Robot

#: Two poses count as equal if they differ by less than these limits: a micrometre and 1e-6 rad.
MOVED_M = 1e-6
TURNED_RAD = 1e-6


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("old", metavar="OLD", help="a robot file")
    parser.add_argument("new", nargs="?", metavar="NEW", help="the same robot, changed")
    add_variant(parser, "apply this profile to both")
    parser.add_argument(
        "--robots",
        nargs=2,
        metavar=("A", "B"),
        help="instead of NEW: compare OLD with the overlays of two robots",
    )
    add_format(parser)


class Change(NamedTuple):
    """A difference of a frame, or of the edge to its parent (``A → B``)."""

    change: str
    of: str
    detail: str = ""

    def __str__(self) -> str:
        return f"{self.change:<6} {': '.join(filter(None, self[1:]))}"


def run(arguments: Namespace) -> int:
    """Print the differences; exit code 0 without any, 1 with some."""
    from tfcompose.cli.compiling import compile_or_exit

    if (arguments.new is None) == (arguments.robots is None):
        fail("diff takes OLD NEW, or OLD --robots A B", UNREADABLE)
    if arguments.robots and arguments.overlay_robot is not None:
        fail("diff takes --robot NAME for both files, or --robots A B", UNREADABLE)
    sides = []
    for index in range(2):
        file = arguments.new if index and arguments.new else arguments.old
        side = copy(arguments)
        if arguments.robots:
            side.overlay_robot = arguments.robots[index]
        sides.append(compile_or_exit(file, side))
    changes = differences(*sides)
    if arguments.format == "json":
        print(
            json.dumps(
                [difference._asdict() for difference in changes], indent=2, ensure_ascii=False
            )
        )
    else:
        print("\n".join(map(str, changes)) or "no difference between the two trees")
    return int(bool(changes))


def differences(old: Robot, new: Robot) -> list[Change]:
    """Return the changes of each frame in the new robot's order, then the removed frames."""
    before = {edge.child: edge for edge in old.edges}
    changes = [
        Change("root", frame, "is new")
        for frame in new.frames
        if frame not in old.frames and new.parent_edge(frame) is None
    ]
    for edge in new.edges:
        was = before.get(edge.child)
        if was is None:
            verb = "is new" if edge.child not in old.frames else "was a root"
            changes.append(Change("new", edge.name, f"{edge.child} {verb}, owned by {edge.owner}"))
        else:
            changes += _changes(was, edge)
    return changes + [Change("gone", frame) for frame in old.frames if frame not in new.frames]


def _changes(was: Edge, now: Edge) -> Iterator[Change]:
    if was.parent != now.parent:
        yield Change("parent", now.child, f"{was.parent} → {now.parent}")
    before, after = was.mount, now.mount
    far = norm(tuple(a - b for a, b in zip(before.xyz, after.xyz, strict=True)))
    turned = angle_between(before.quat_xyzw, after.quat_xyzw)
    if was.parent == now.parent and (far > MOVED_M or turned > TURNED_RAD):
        yield Change("moved", now.name, f"{far * 1000:.3g} mm, {math.degrees(turned):.3g} deg")
    if abs(_zero_offset(was) - _zero_offset(now)) > TURNED_RAD:
        yield Change("offset", now.name, f"{_offset_text(was)} → {_offset_text(now)}")
    if set(was.switched) != set(now.switched):
        yield Change("switch", now.name, f"{_other_parents(was)} → {_other_parents(now)}")
    if was.owner != now.owner:
        yield Change("owner", now.name, f"{was.owner} → {now.owner}")
    if was.kind != now.kind:
        yield Change("kind", now.name, f"{was.kind} → {now.kind}")
    if was.rate != now.rate:
        yield Change("rate", now.name, f"{_hz(was.rate)} → {_hz(now.rate)}")


def _zero_offset(edge: Edge) -> float:
    return edge.joint.zero_offset if edge.joint else 0.0


def _offset_text(edge: Edge) -> str:
    return edge.joint.zero_offset_text if edge.joint and edge.joint.zero_offset else "none"


def _other_parents(edge: Edge) -> str:
    return f"or on {', '.join(edge.switched)}" if edge.switched else "no other parent"


def _hz(rate: float | None) -> str:
    return f"{rate:g} Hz" if rate else "none"
