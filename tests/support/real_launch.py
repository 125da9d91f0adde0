"""What ROS's launch would start: part process is recorded in its place, and none is started.

``python real_launch.py OUT FILE [NAME:=VALUE …]`` writes the commands, with the parameters of
their files, as JSON.
"""

import json
import os
import sys
from array import array
from itertools import pairwise
from pathlib import Path
from typing import Any

import yaml
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.actions.execute_local import ExecuteLocal
from launch.launch_description_sources import AnyLaunchDescriptionSource
from launch_ros.actions import LoadComposableNodes
from launch_ros.substitutions.executable_in_package import ExecutableInPackage
from rclpy.parameter import parameter_value_to_python

STARTED: list[dict[str, Any]] = []
BEFORE = dict(os.environ)
#: Settings of launch's processes, which it keeps for itself.
SUPERVISION = (
    "emulate_tty",
    "on_exit",
    "output",
    "respawn",
    "respawn_delay",
    "respawn_max_retries",
    "sigkill_timeout",
    "sigterm_timeout",
)


def record(action: Any, context: Any) -> None:
    """Stand in the place of the action's execution."""
    action.prepare(context)
    words = list(action.process_description.final_cmd)
    files = [
        Path(file).read_text("utf-8") for word, file in pairwise(words) if word == "--params-file"
    ]
    params = [yaml.unsafe_load(text) for text in files]
    STARTED.append(
        {
            "words": words,
            "params": params,
            "texts": files,
            "cwd": action.process_description.final_cwd,
            "env": dict(set(action.process_description.final_env.items()) - set(BEFORE.items())),
            "supervision": {
                name: text_of(getattr(action, f"_ExecuteLocal__{name}"), context)
                for name in SUPERVISION
            },
        }
    )


def text_of(value: Any, context: Any) -> Any:
    """Return a setting with its substitutions performed, and the kinds of the actions in it."""
    value = [value] if hasattr(value, "visit") else value
    if isinstance(value, list) and all(hasattr(part, "perform") for part in value):
        return "".join(map(context.perform_substitution, value))
    if isinstance(value, list | tuple):
        return [type(part).__name__ for part in value]
    return value if isinstance(value, str | float | dict | None) else str(value)


def record_loaded(action: Any, requests: list[Any], _context: Any) -> None:
    """Stand in the place of the calls that load components."""
    container = action._LoadComposableNodes__final_target_container_name
    for request in requests:
        values, extra = (
            {request.name: parameter_value_to_python(request.value) for request in parameters}
            for parameters in (request.parameters, request.extra_arguments)
        )
        STARTED.append(
            {
                "component": f"{request.package_name}/{request.plugin_name}",
                "container": f"/{container.strip('/')}",
                "node": f"{request.node_namespace.rstrip('/')}/{request.node_name}",
                "extra_arguments": extra,
                "remap": dict(
                    reversed([rule.split(":=", 1) for rule in request.remap_rules])
                ),  # the first one counts
                "params": {
                    name: list(value) if isinstance(value, array) else value
                    for name, value in values.items()
                },
            }
        )


def executable(substitution: Any, context: Any) -> str:
    """Return the package and the program: they need not be installed."""
    package, program = (
        "".join(map(context.perform_substitution, substitutions))
        for substitutions in (substitution.package, substitution.executable)
    )
    return f"{package}/{program}"


def main(out: str, file: str, *arguments: str) -> None:
    """Record what a launch file starts."""
    ExecuteLocal.execute = record
    ExecutableInPackage.perform = executable
    LoadComposableNodes._load_in_sequence = record_loaded
    service = LaunchService(noninteractive=True)
    values = [tuple(word.split(":=", 1)) for word in arguments]
    included = IncludeLaunchDescription(AnyLaunchDescriptionSource(file), launch_arguments=values)
    service.include_launch_description(LaunchDescription([included]))
    service.run(shutdown_when_idle=True)
    Path(out).write_text(json.dumps(STARTED), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
