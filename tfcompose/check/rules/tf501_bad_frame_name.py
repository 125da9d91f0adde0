"""TF501: bad frame name."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, Span, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


_GOOD = re.compile(r"[A-Za-z0-9_]+(/[A-Za-z0-9_]+)*")


def bad_frame_name(robot: Robot) -> Iterator[Diagnostic]:
    """A frame or joint has a name that tf2, URDF or a shell takes differently.

    tf2 strips a leading slash, URDF needs names that XML holds, and spaces, quotes and ``&`` break somewhere on the
    way. Use letters, digits and ``_``; a slash stands between a prefix and a name only.
    """
    names: dict[str, Span] = dict(robot.frames)
    for edge in robot.edges:
        names.setdefault(edge.child, edge.child_at or edge.at)
        if edge.joint_name:
            names.setdefault(edge.joint_name, edge.joint.at if edge.joint else edge.at)
    for name, at in names.items():
        if not _GOOD.fullmatch(name):
            better = re.sub(r"[^A-Za-z0-9_/]+|//+", "_", name).strip("/")
            advice = f"for example {better}" if _GOOD.fullmatch(better) else "letters, digits and _"
            yield finding("TF501", f"{name!r} is no good name", at, help=advice)
