"""The edges between two frames of a robot file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.terminal import complain
from tfcompose.findings import did_you_mean

if TYPE_CHECKING:
    from tfcompose.model import Edge, Robot


def edges_between(robot: Robot, a: str, b: str) -> tuple[list[Edge], list[Edge]] | None:
    """Return the edges from ``a`` up to where the ways meet, and those from ``b`` up to there.

    None, once that was said, if a frame is not there or nothing connects the two.
    """
    for frame in (a, b):
        if frame not in robot.frames:
            complain(f"no frame {frame}; {did_you_mean(frame, robot.frames, f'{robot.file} has other frames')}")
            return None
    up, down = _ancestry(robot, a), _ancestry(robot, b)
    shared = {id(edge) for edge in up} & {id(edge) for edge in down}
    rising = [edge for edge in up if id(edge) not in shared]
    falling = [edge for edge in down if id(edge) not in shared]
    if (rising[-1].parent if rising else a) != (falling[-1].parent if falling else b):
        complain(f"{a} and {b} are in two trees")
        return None
    return rising, falling


def _ancestry(robot: Robot, frame: str) -> list[Edge]:
    chain = []
    while edge := robot.parent_edge(frame):
        chain.append(edge)
        frame = edge.parent
    return chain
