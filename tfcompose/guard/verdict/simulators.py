"""Simulators that publish a second tree, and how to turn it off."""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

#: TF output of simulators' nodes and how to disable it, by patterns of node names. None of these
#: nodes has a parameter for it. ros_gz_bridge forwards the topics in its ``config_file`` or its
#: arguments. In Isaac Sim, the node is named after a prim of an action graph, with ``_`` for each
#: ``/``; by default the prim is named after its type.
_TREES = {
    "ros_gz_bridge": "passes on the tree of Gazebo: take /tf out of its config_file or its"
    " arguments, or give that another ROS topic there",
    "*publish_transform_tree*": "publishes the tree of Isaac Sim: take the robot out of its"
    " targetPrims, or give it another topicName than tf",
}


def switch_of_simulator(nodes: Iterable[str]) -> str:
    """Return the simulator of one of these nodes, and how to disable its TF; "" without one."""
    for node in nodes:
        for pattern, tree in _TREES.items():
            if fnmatchcase(node.rpartition("/")[2], pattern):
                return f"{node} {tree}"
    return ""
