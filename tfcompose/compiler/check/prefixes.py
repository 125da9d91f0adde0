"""Rules about frame prefixes.

A node that looks up frames needs the names that the frames have on /tf.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.check.rule import rule
from tfcompose.foundation.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model.robot import Process, Robot

_COSTMAP = {"global_frame": "map", "robot_base_frame": "base_link"}
_FILTER = {"map_frame": "map", "odom_frame": "odom", "base_link_frame": "base_link"}
_SLAM = {"map_frame": "map", "odom_frame": "odom", "base_frame": "base_footprint"}
#: Frames that programs look up by default, by parameter (Nav2, slam_toolbox and
#: robot_localization, Jazzy).
_DEFAULTS: dict[str, dict[str, str]] = {
    "controller_server": _COSTMAP,
    "planner_server": _COSTMAP,
    "bt_navigator": _COSTMAP,
    "behavior_server": {"local_frame": "odom", **_COSTMAP},
    "collision_monitor": {"base_frame_id": "base_footprint", "odom_frame_id": "odom"},
    "amcl": {"global_frame_id": "map", "odom_frame_id": "odom", "base_frame_id": "base_footprint"},
    "async_slam_toolbox_node": _SLAM,
    "sync_slam_toolbox_node": _SLAM,
    "localization_slam_toolbox_node": _SLAM,
    "ekf_node": _FILTER,
    "ukf_node": _FILTER,
}


@rule("TF318")
def frame_without_prefix(robot: Robot) -> Iterator[Finding]:
    for process in robot.processes if robot.ros.frame_prefix else ():
        if process.kind != "run" or not process.takes_ros_arguments:
            continue
        parameters: set[str] = set()
        for node in process.ros_nodes:
            params = node.flat_params
            parameters |= {_own_name(key) for key in params}
            wrong = {
                key: value
                for key, value in params.items()
                if "frame" in _own_name(key)
                and key not in node.contradicting
                and _lacks_prefix(value, robot)
            }
            if wrong:
                yield _without_prefix(process, wrong, robot)
        usual = (
            {} if robot.tolerates(process.name) else _DEFAULTS.get(process.executable or "", {})
        )
        left = {
            key: frame
            for key, frame in usual.items()
            if key not in parameters and _lacks_prefix(frame, robot)
        }
        if left:
            yield replace(_without_prefix(process, left, robot), severity="warning")


def _own_name(parameter: str) -> str:
    """Return the last part of a parameter's full name."""
    return parameter.rpartition(".")[2]


def _lacks_prefix(value: Any, robot: Robot) -> bool:
    return isinstance(value, str) and value in robot.frames and robot.final(value) != value


def _without_prefix(process: Process, names: dict[str, str], robot: Robot) -> Finding:
    listed = ", ".join(f"{key}: {value}" for key, value in names.items())
    message = (
        f"{process.name} looks frames up without the prefix {robot.ros.frame_prefix}: {listed}"
    )
    args = ", ".join(f'{key}: "${{frame({value})}}"' for key, value in names.items())
    return finding("TF318", message, process.span, help=f"params: {{{args}}}")
