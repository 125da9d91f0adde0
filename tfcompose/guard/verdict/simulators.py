"""Simulators that publish a second tree, and the way to turn it off."""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

#: TF output of simulators' nodes and how to switch it off, by patterns of the nodes' names. None
#: of them has a parameter for it. ros_gz_bridge forwards the topics in its ``config_file`` or its
#: arguments. Isaac Sim's node has the name of a prim of an action graph, with ``_`` for each
#: ``/``; its default name is that of its type.
_TREES = {
    "ros_gz_bridge": "passes on the tree of Gazebo: take /tf out of its config_file or its"
    " arguments, or give that another ROS topic there",
    "*publish_transform_tree*": "publishes the tree of Isaac Sim: take the robot out of its"
    " targetPrims, or give it another topicName than tf",
}


def switch_of_simulator(nodes: Iterable[str]) -> str:
    """Return the simulator that one of these nodes belongs to, and its switch; empty: none."""
    for node in nodes:
        for pattern, tree in _TREES.items():
            if fnmatchcase(node.rpartition("/")[2], pattern):
                return f"{node} {tree}"
    return ""
