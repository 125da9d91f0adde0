"""Show what moved or changed owner between two robot files.

Print what moved from OLD to NEW, in millimetres and degrees, and which frames were added or
removed, or got another parent or owner. Exit code 1 if anything differs.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_variant
from tfcompose.foundation.geometry import angle_between, norm

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.model.robot import Edge, Robot

#: Below these, two poses are one: a micrometre and 1e-6 rad.
MOVED_M = 1e-6
TURNED_RAD = 1e-6


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("old", metavar="OLD", help="a robot file")
    parser.add_argument("new", metavar="NEW", help="the same robot, changed")
    add_variant(parser, "apply this profile to both")


def run(arguments: Namespace) -> int:
    """Print the differences; exit code 0 without any, 1 with some."""
    from tfcompose.cli.compiling import compiled_robot

    lines = differences(
        compiled_robot(arguments.old, arguments), compiled_robot(arguments.new, arguments)
    )
    print("\n".join(lines) or "no difference between the two trees")
    return int(bool(lines))


def differences(old: Robot, new: Robot) -> list[str]:
    """Return a line for each changed frame, in the new robot's order, removed ones last."""
    before = {edge.child: edge for edge in old.edges}
    lines = [
        f"root   {frame} is new"
        for frame in new.frames
        if frame not in old.frames and new.parent_edge(frame) is None
    ]
    for edge in new.edges:
        was = before.get(edge.child)
        if was is None:
            verb = "is new" if edge.child not in old.frames else "was a root"
            lines.append(f"new    {edge.name}: {edge.child} {verb}, owned by {edge.owner}")
        else:
            lines += _changes(was, edge)
    lines += [f"gone   {frame}" for frame in old.frames if frame not in new.frames]
    return lines


def _changes(was: Edge, now: Edge) -> list[str]:
    lines = []
    if was.parent != now.parent:
        lines.append(f"parent {now.child}: {was.parent} → {now.parent}")
    far = norm(tuple(a - b for a, b in zip(was.pose.xyz, now.pose.xyz, strict=True)))
    turned = angle_between(was.pose.quat_xyzw, now.pose.quat_xyzw)
    if was.parent == now.parent and (far > MOVED_M or turned > TURNED_RAD):
        lines.append(f"moved  {now.name}: {far * 1000:.3g} mm, {math.degrees(turned):.3g} deg")
    if set(was.switched) != set(now.switched):
        lines.append(f"switch {now.name}: {_others(was)} → {_others(now)}")
    if was.owner != now.owner:
        lines.append(f"owner  {now.name}: {was.owner} → {now.owner}")
    if was.kind != now.kind:
        lines.append(f"kind   {now.name}: {was.kind} → {now.kind}")
    if was.rate != now.rate:
        lines.append(f"rate   {now.name}: {_hz(was.rate)} → {_hz(now.rate)}")
    return lines


def _others(edge: Edge) -> str:
    return f"or on {', '.join(edge.switched)}" if edge.switched else "no other parent"


def _hz(rate: float | None) -> str:
    return f"{rate:g} Hz" if rate else "none"
