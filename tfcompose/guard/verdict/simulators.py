"""Simulators that publish a tree of their own, and how each is stopped from it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

#: The trees that nodes pass on, by the nodes' names, and where each is switched off. ros_gz_bridge
#: has no parameter for it: its ``config_file``, or its arguments, say what is passed on.
_TREES = {
    "ros_gz_bridge": "the tree of Gazebo: take /tf out of its config_file or its arguments, or"
    " give that another ROS topic there"
}


def switch_of_simulator(nodes: Iterable[str]) -> str:
    """Return whose tree one of these nodes passes on and its switch, empty for other nodes."""
    for node in nodes:
        if tree := _TREES.get(node.rpartition("/")[2]):
            return f"{node} passes on {tree}"
    return ""
