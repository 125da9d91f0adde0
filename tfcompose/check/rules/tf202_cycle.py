"""TF202: cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def cycle(robot: Robot) -> Iterator[Finding]:
    """Frames are each other's ancestors.

    A transform tree has no loops: a lookup through one never ends, and URDF refuses it. One of the edges points the
    wrong way; turn it round, or hang its child elsewhere.
    """
    above = {edge.child: edge for edge in reversed(robot.edges)}
    done: set[str] = set()
    for start in above:
        path: dict[str, None] = {}  # in order, and quick to look up
        frame = start
        while frame in above and frame not in done and frame not in path:
            path[frame] = None
            frame = above[frame].parent
        if frame in path:
            loop = list(path)[list(path).index(frame) :]
            names = " → ".join([*reversed(loop), loop[-1]])
            notes = [Note(above[child].name, above[child].at) for child in loop[1:]]
            yield finding("TF202", f"a cycle: {names}", above[loop[0]].at, notes=notes, help="one edge must go")
        done.update(path)
    for edge in robot.edges:
        for parent in edge.switched:
            path = {}
            frame = parent
            while frame != edge.child and frame in above and frame not in path:
                path[frame] = None
                frame = above[frame].parent
            if frame == edge.child:
                names = " → ".join((frame, *reversed(path), frame))
                message = f"a cycle when {edge.child} hangs on {parent}: {names}"
                yield finding("TF202", message, edge.at, help=f"remove {parent} from its parents")
