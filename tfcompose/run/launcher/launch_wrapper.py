"""What ``ros2 launch`` is given in place of a launch file: that file, with what the plan says for all of its nodes.

The variable ``TFCOMPOSE_LAUNCH`` holds it as JSON: ``file``, ``arguments``, ``namespace``, ``remap``, ``sim_time``.
"""

from __future__ import annotations

import json
import os
from importlib import import_module
from typing import Any

LAUNCH = "TFCOMPOSE_LAUNCH"


def generate_launch_description() -> Any:
    """Return the launch description: the file in a group that sets namespace, remappings and simulated time."""
    launch, ros = import_module("launch"), import_module("launch_ros.actions")
    actions = import_module("launch.actions")
    sources = import_module("launch.launch_description_sources")
    given = json.loads(os.environ[LAUNCH])
    group = [ros.PushRosNamespace(given["namespace"])] if given["namespace"] else []
    group += [ros.SetRemap(old, new) for old, new in given["remap"].items()]
    if given["sim_time"]:
        group.append(ros.SetParameter("use_sim_time", value=True))
    source = sources.AnyLaunchDescriptionSource(given["file"])
    group.append(actions.IncludeLaunchDescription(source, launch_arguments=list(given["arguments"].items())))
    return launch.LaunchDescription([actions.GroupAction(group)])
