"""TF334: parameters of another node."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot

_PARAMETERS = "ros__parameters"


def parameters_of_another_node(robot: Robot) -> Iterator[Finding]:
    """Parameters are for a node that the process does not have.

    ROS gives a node the parameters that stand under its full name, and drops all others without a word. In a parameter
    file a name without a leading slash is below the process's namespace; * is one part of a name and ** any number
    of them. Inline parameters stand without the node's name and ``ros__parameters``, because tfcompose writes these.
    """
    for process in robot.processes:
        for node in process.nodes:
            for key, value in node.params.items():
                if key == _PARAMETERS or (isinstance(value, dict) and _PARAMETERS in value):
                    message = f"the parameters of {process.name} stand under {key}, and the node would not get them"
                    yield finding("TF334", message, node.at, help="params: {NAME: VALUE, …}, or params: {file: …}")
