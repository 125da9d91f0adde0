"""Launch file for ``ros2 launch``: includes the user's file, with the plan's settings.

The variable ``TFCOMPOSE_LAUNCH`` holds the settings as JSON: ``file``, ``arguments``,
``namespace``, ``remap``, ``sim_time``. The Python installation of ROS runs this file. tfcompose
need not be installed there.
"""

from __future__ import annotations

import json
import os

from launch import LaunchDescription
from launch.actions import GroupAction, IncludeLaunchDescription
from launch.launch_description_sources import AnyLaunchDescriptionSource
from launch_ros.actions import PushRosNamespace, SetParameter, SetRemap


def generate_launch_description() -> LaunchDescription:
    """Return the user's launch file in a group with namespace, remappings and simulated time."""
    settings = json.loads(os.environ["TFCOMPOSE_LAUNCH"])
    group = [PushRosNamespace(settings["namespace"])] if settings["namespace"] else []
    group += [SetRemap(old, new) for old, new in settings["remap"].items()]
    if settings["sim_time"]:
        group.append(SetParameter("use_sim_time", value=True))
    source = AnyLaunchDescriptionSource(settings["file"])
    group.append(
        IncludeLaunchDescription(source, launch_arguments=list(settings["arguments"].items()))
    )
    return LaunchDescription([GroupAction(group)])
