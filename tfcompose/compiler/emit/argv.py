"""Command lines of processes, with ROS arguments of nodes, and parameter files."""

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
    from collections.abc import Collection, Iterator

    from tfcompose.model.robot import Process, Robot


#: The file of parameters, which is named once.
_PARAMS_FILE = "${params_file}"


def argv_of(process: Process, robot: Robot, *, has_params: bool, owns: bool) -> tuple[str, ...]:
    """Return the process's command.

    ``owns``: the process owns edges. ``has_params``: a parameter file is written for it.
    """
    if process.kind in {"external", "component"}:
        return ()
    if process.kind != "run":
        arguments = [
            argument
            for name, value in _own_params(process)
            for argument in ("-p", f"{name}:={json.dumps(value)}")
        ]
        own = (PROGRAM, process.kind, "${plan}", process.name)
        return (*own, "--ros-args", *arguments) if arguments else own
    if process.launch is not None:
        return (f"${{launch:{process.launch}}}", *process.argv)
    if not process.is_node(owns=owns):
        return process.argv
    arguments = _ros_arguments(process, robot, has_params=has_params)
    if process.package is None:
        names = _names(process, robot)
        if "--params-file" in arguments:  # which is keyed by the node's name
            arguments = [*names, *arguments]
        elif process.namespace is not None or (robot.ros.namespace and (arguments or owns)):
            arguments = [*names[-2:], *arguments]
        return (*process.argv, "--ros-args", *arguments) if arguments else process.argv
    program = f"${{executable:{process.package}/{process.executable}}}"
    return (program, *process.argv, "--ros-args", *_names(process, robot), *arguments)


def _ros_arguments(process: Process, robot: Robot, *, has_params: bool) -> list[str]:
    """Return the ROS arguments but for names; a parameter file is named once."""
    ros_args = [
        argument for old, new in process.remap.items() for argument in ("-r", f"{old}:={new}")
    ]
    if process.log_level is not None:
        ros_args += ["--log-level", process.log_level]
    # A value behind -p counts as one for /**: of two for the same nodes the later one holds.
    if has_params and not any(_PARAMS_FILE in text for text in process.texts):
        ros_args += ["--params-file", _PARAMS_FILE]
    if robot.ros.clock == "sim":
        ros_args += ["-p", "use_sim_time:=true"]
    for name, value in _launch_time_params(process.params):
        ros_args += ["-p", f"{name}:={json.dumps(value, ensure_ascii=False)}"]
    return ros_args


def _own_params(process: Process) -> list[tuple[str, Any]]:
    """Return the parameters of one of tfcompose's own processes.

    A number is a double, as its parameter is.
    """
    params: dict[str, Any] = dict(sorted(process.params.items()))
    for name, value in params.items():
        if not isinstance(value, bool):
            params[name] = float(value)
    return list(params.items())


def _launch_time_params(params: dict[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the parameters, by their full names, with paths that only the launcher knows."""
    for key, value in params.items():
        if isinstance(value, dict):
            yield from _launch_time_params(value, f"{above}{key}.")
        elif is_known_at_launch(value):
            yield f"{above}{key}", value


def _names(process: Process, robot: Robot) -> list[str]:
    """Return what gives the node its name and namespace.

    Those that are listed as several have names of their own.

    A name on the command line would rename every node of the process, also those that are not
    listed.
    """
    if len(process.nodes) > 1 or process.ros_nodes[0].path[2:3] == ("nodes",):
        return [
            "-r",
            f"__ns:=/{robot.ros.namespace if process.namespace is None else process.namespace}",
        ]
    namespace, _, node = process.node.rpartition("/")
    return ["-r", f"__node:={node}", "-r", f"__ns:={namespace or '/'}"]


#: Characters that JSON allows in a text and YAML reads as the end of a line, or forbids.
_ESCAPED = re.compile("[\x7f-\x9f\u2028\u2029\ufeff\ufffe\uffff]")


def file_params(process: Process) -> dict[str, dict[str, Any]]:
    """Return the contents of the process's parameter file, by node.

    Sections for other nodes in the files that it names come first, because every node of a process
    reads the file. Its own parameters come last, so that they take precedence. Paths that only the
    launcher knows are omitted: a section for one of its nodes would override the command line.
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
    known = {node: _known_params(params) for node, params in nodes.items()}
    return {node: params for node, params in known.items() if params}


def _without(params: dict[str, Any], names: Collection[str], above: str = "") -> dict[str, Any]:
    """Return parameters without those of these full names."""
    kept = {}
    for key, value in params.items():
        if isinstance(value, dict):
            kept[key] = _without(value, names, f"{above}{key}.")
        elif f"{above}{key}" not in names:
            kept[key] = value
    return kept


def component_params(process: Process, robot: Robot) -> dict[str, Any]:
    """Return the parameters of a component by full name, as ROS values."""
    clock = {"use_sim_time": True} if robot.ros.clock == "sim" else {}
    params = process.ros_nodes[0].flat_texts
    return clock | {name: json_value(_read_as_ros(value)) for name, value in params.items()}


def _read_as_ros(value: Any) -> Any:
    """Return the value of a parameter; a word of a parameter file is what ROS reads there."""
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
    """Return the file's text.

    Strings are quoted, so that ROS reads none as a number.
    """
    lines = []
    for node, params in nodes.items():
        lines += [f"{_text(node)}:", "  ros__parameters:", *_mapping(params, "    ")]
    return "\n".join([*lines, ""])


def _mapping(values: dict[str, Any], indent: str) -> list[str]:
    """Return the mapping as lines of YAML; lists and texts as JSON, which is YAML as well."""
    lines = []
    for key, value in values.items():
        if isinstance(value, dict) and value:
            lines += [f"{indent}{_text(key)}:", *_mapping(value, indent + "  ")]
        else:
            lines.append(f"{indent}{_text(key)}: {_text(value)}")
    return lines


#: A word that YAML reads as one plain word in any place.
_PLAIN = re.compile(r"[A-Za-z0-9_.+-]+")


def _text(value: Any) -> str:
    """Return the value as JSON that is YAML as well.

    A word of a parameter file as it was there.
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
