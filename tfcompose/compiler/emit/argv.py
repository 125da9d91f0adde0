"""Command lines of processes, with the ROS arguments of their nodes, and parameter files."""

from __future__ import annotations

import json
import math
import re
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.param_files import matches
from tfcompose.model.plan import PROGRAM, is_known_at_launch
from tfcompose.model.plan.components import json_value
from tfcompose.model.robot import AsInFile, value_of_word

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator

    from tfcompose.model.robot import Process, Robot


#: Placeholder for the parameter file. A command line contains it once.
_PARAMS_FILE = "${params_file}"


def argv_of(process: Process, robot: Robot, *, has_params: bool, owns: bool) -> tuple[str, ...]:
    """Return the command line of the process.

    ``owns``: whether the process owns edges. ``has_params``: whether it has a parameter file.
    """
    if process.kind in {"external", "component"}:
        return ()
    if process.kind != "run":
        arguments = [
            argument
            for name, value in _own_params(process)
            for argument in ("-p", f"{name}:={json.dumps(value)}")
        ]
        argv = (PROGRAM, process.kind, "${plan}", process.name)
        return (*argv, "--ros-args", *arguments) if arguments else argv
    if process.launch is not None:
        return (f"${{launch:{process.launch}}}", *process.argv)
    if not process.is_node(owns=owns):
        return process.argv
    arguments = _ros_arguments(process, robot, has_params=has_params)
    if process.package is None:
        names = _names(process, robot)
        if "--params-file" in arguments:  # the parameter file is keyed by the node's name
            arguments = [*names, *arguments]
        elif process.namespace is not None or (robot.ros.namespace and (arguments or owns)):
            arguments = [*names[-2:], *arguments]
        return (*process.argv, "--ros-args", *arguments) if arguments else process.argv
    program = f"${{executable:{process.package}/{process.executable}}}"
    return (program, *process.argv, "--ros-args", *_names(process, robot), *arguments)


def _ros_arguments(process: Process, robot: Robot, *, has_params: bool) -> list[str]:
    """Return the ROS arguments except names; the parameter file occurs once."""
    ros_args = [
        argument for old, new in process.remap.items() for argument in ("-r", f"{old}:={new}")
    ]
    if process.log_level is not None:
        ros_args += ["--log-level", process.log_level]
    # ROS treats -p NAME:=VALUE as a section /**. If two sections match a node, the later wins.
    if has_params and not any(_PARAMS_FILE in text for text in process.texts):
        ros_args += ["--params-file", _PARAMS_FILE]
    if robot.ros.clock == "sim":
        ros_args += ["-p", "use_sim_time:=true"]
    for name, value in _launch_time_params(process.params):
        ros_args += ["-p", f"{name}:={json.dumps(value, ensure_ascii=False)}"]
    return ros_args


def _own_params(process: Process) -> list[tuple[str, Any]]:
    """Return the parameters of a process that tfcompose provides.

    Numbers become floats, because these processes declare doubles.
    """
    params: dict[str, Any] = dict(sorted(process.params.items()))
    for name, value in params.items():
        if not isinstance(value, bool):
            params[name] = float(value)
    return list(params.items())


def _launch_time_params(params: dict[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield parameters by full name whose values contain paths that only the launcher knows."""
    for key, value in params.items():
        if isinstance(value, dict):
            yield from _launch_time_params(value, f"{above}{key}.")
        elif is_known_at_launch(value):
            yield f"{above}{key}", value


def _names(process: Process, robot: Robot) -> list[str]:
    """Return the remappings that set the node's name and namespace.

    If the process lists several nodes, only the namespace is set. A name on the command line would
    rename every node of the process, including nodes that are not listed.
    """
    if len(process.nodes) > 1 or process.ros_nodes[0].path[2:3] == ("nodes",):
        return [
            "-r",
            f"__ns:=/{robot.ros.namespace if process.namespace is None else process.namespace}",
        ]
    namespace, _, node = process.node.rpartition("/")
    return ["-r", f"__node:={node}", "-r", f"__ns:={namespace or '/'}"]


#: Characters that JSON allows in a string, and that YAML forbids or reads as a line end.
_ESCAPED = re.compile("[\x7f-\x9f\u2028\u2029\ufeff\ufffe\uffff]")


def file_params(process: Process) -> dict[str, dict[str, Any]]:
    """Return the contents of the process's parameter file, by node.

    A process may name parameter files with sections for other nodes. These sections come first,
    because every node of the process reads the file. The parameters of the process come last, so
    that they take precedence. Paths that only the launcher knows are omitted, because a section
    for one node would override the command line.
    """
    if process.kind != "run":
        return {}
    names = [node.name for node in process.ros_nodes]
    nodes = process.other_params | {node.name: node.params for node in process.ros_nodes}
    later = dict(_launch_time_params(process.params))
    for section in [
        declared for declared in nodes if any(matches(declared, name) for name in names)
    ]:
        nodes[section] = _without(nodes[section], later)
    params = {node: _known_params(params) for node, params in nodes.items()}
    return {node: params for node, params in params.items() if params}


def _without(params: dict[str, Any], names: Collection[str], above: str = "") -> dict[str, Any]:
    """Return the parameters without those whose full name is in ``names``."""
    kept = {}
    for key, value in params.items():
        if isinstance(value, dict):
            kept[key] = _without(value, names, f"{above}{key}.")
        elif f"{above}{key}" not in names:
            kept[key] = value
    return kept


def component_params(process: Process, robot: Robot) -> dict[str, Any]:
    """Return the parameters of a component as ROS values, by full name."""
    clock = {"use_sim_time": True} if robot.ros.clock == "sim" else {}
    params = process.ros_nodes[0].flat_texts
    return clock | {name: json_value(_read_as_ros(value)) for name, value in params.items()}


def _read_as_ros(value: Any) -> Any:
    """Return the value as ROS reads it, if it is a plain scalar from a parameter file."""
    if isinstance(value, list):
        items = [_read_as_ros(item) for item in value]
        return (
            [float(item) for item in items]
            if {type(item) for item in items} == {int, float}
            else items
        )
    return value_of_word(value) if isinstance(value, AsInFile) else value


def _known_params(params: dict[str, Any]) -> dict[str, Any]:
    kept = {}
    for key, value in params.items():
        if not is_known_at_launch(value):
            kept[key] = value
        elif isinstance(value, dict) and (rest := _known_params(value)):
            kept[key] = rest
    return kept


def params_file(nodes: dict[str, dict[str, Any]]) -> str:
    """Return the text of the parameter file.

    Strings are quoted, so that ROS does not read a string as a number.
    """
    lines = []
    for node, params in nodes.items():
        lines += [f"{_text(node)}:", "  ros__parameters:", *_mapping(params, "    ")]
    return "\n".join([*lines, ""])


#: The description in a parameter file.
_DESCRIPTION = re.compile(r'^( +"robot_description": )("[^\n]*")$', re.MULTILINE)


def edit_description(params: str, edit: Callable[[str], str]) -> str:
    """Return a text of ``params_file`` with the robot description as ``edit`` returns it."""
    return _DESCRIPTION.sub(lambda match: f"{match[1]}{_text(edit(json.loads(match[2])))}", params)


def _mapping(values: dict[str, Any], indent: str) -> list[str]:
    """Return the mapping as lines of YAML. Lists and strings are JSON, which is valid YAML."""
    lines = []
    for key, value in values.items():
        if isinstance(value, dict) and value:
            lines += [f"{indent}{_text(key)}:", *_mapping(value, indent + "  ")]
        else:
            lines.append(f"{indent}{_text(key)}: {_text(value)}")
    return lines


#: Text that YAML reads as one plain scalar in any position.
_PLAIN = re.compile(r"[A-Za-z0-9_.+-]+")


def _text(value: Any) -> str:
    """Return the value as JSON, which is valid YAML.

    A plain scalar from a parameter file keeps its original text.
    """
    if isinstance(value, AsInFile) and _PLAIN.fullmatch(value):
        return str(value)
    if isinstance(value, list):
        return f"[{', '.join(map(_text, value))}]"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value).replace("inf", ".inf").replace("nan", ".nan")
    return _ESCAPED.sub(
        lambda match: f"\\u{ord(match[0]):04x}", json.dumps(value, ensure_ascii=False)
    )
