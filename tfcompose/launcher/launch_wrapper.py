"""The launch file that ``ros2 launch`` runs.

The user's, with the plan's settings for all of its nodes.

The variable ``TFCOMPOSE_LAUNCH`` holds it as JSON: ``file``, ``arguments``, ``namespace``,
``remap``, ``sim_time``. The Python of ROS runs this file, and tfcompose need not be installed
there.
"""

from __future__ import annotations

import json
import os

from launch import LaunchDescription
from launch.actions import GroupAction, IncludeLaunchDescription
from launch.launch_description_sources import AnyLaunchDescriptionSource
from launch_ros.actions import PushRosNamespace, SetParameter, SetRemap


def generate_launch_description() -> LaunchDescription:
    """Return the launch description.

    The file in a group that sets namespace, remappings and simulated time.
    """
    given = json.loads(os.environ["TFCOMPOSE_LAUNCH"])
    group = [PushRosNamespace(given["namespace"])] if given["namespace"] else []
    group += [SetRemap(old, new) for old, new in given["remap"].items()]
    if given["sim_time"]:
        group.append(SetParameter("use_sim_time", value=True))
    source = AnyLaunchDescriptionSource(given["file"])
    group.append(
        IncludeLaunchDescription(source, launch_arguments=list(given["arguments"].items()))
    )
    return LaunchDescription([GroupAction(group)])
