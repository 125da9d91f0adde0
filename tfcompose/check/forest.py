"""The trees that the robot's edges make."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.model import Robot


def trees(robot: Robot) -> dict[str, set[str]]:
    """Return the frames of each root's tree, the root too, in the order of declaration.

    A frame with parents in two trees is in both; frames that are each other's ancestors are in none.
    """
    children = robot.children()
    grown: dict[str, set[str]] = {}
    for root in robot.roots():
        frames, todo = {root}, [root]
        while todo:
            below = {edge.child for edge in children.get(todo.pop(), ())} - frames
            frames |= below
            todo += below
        grown[root] = frames
    return grown


def main_root(robot: Robot, grown: dict[str, set[str]]) -> str:
    """Return the root of the tree that holds the robot's base, or of the largest one; empty where there is none."""
    return max(grown, key=lambda root: (robot.base in grown[root], len(grown[root])), default="")
