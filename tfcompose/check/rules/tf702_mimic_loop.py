"""TF702: mimic loop."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def mimic_loop(robot: Robot) -> Iterator[Finding]:
    """Joints follow each other in a circle.

    None of them has a position of its own.
    """
    joints = {edge.joint.name: edge.joint for edge in robot.edges if edge.joint}
    done: set[str] = set()
    for start in joints:
        path: dict[str, None] = {}  # in order, and quick to look up
        name: str | None = start
        while name in joints and name not in done and name not in path:
            path[name] = None
            name = joints[name].mimic
        if name in path:
            loop = list(path)[list(path).index(name) :]
            notes = [Note(f"{other} is one of them", joints[other].at) for other in loop[1:]]
            message = f"joints follow each other: {' → '.join([*loop, loop[0]])}"
            yield finding("TF702", message, joints[loop[0]].at, notes=notes, help="one of them must lead")
        done.update(path)
