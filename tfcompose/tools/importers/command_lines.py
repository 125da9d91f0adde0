"""Command lines: the program that they start, and their ROS arguments."""

from __future__ import annotations

import posixpath
import re
import shlex
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.findings import RejectedError
from tfcompose.spec.load.params import load_params
from tfcompose.tools.importers.node_params import value_in
from tfcompose.tools.importers.static_transforms import PROGRAM
from tfcompose.tools.importers.texts import Text, concatenate, partition, parts_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.tools.importers.program import Program
    from tfcompose.tools.importers.static_transforms import Reader

#: Commands that run the program in their arguments without changing its meaning.
BEFORE = frozenset({"exec", "nohup", "time", "stdbuf", "setsid"})


def with_ros_arguments(program: Program) -> Program:
    """Return the program of the command line, with its ROS arguments as keys."""
    if program.shell:
        program = _without_shell(program)
    if program.package is None and not program.shell:
        program = _of_command(program)
    return _without_ros_arguments(program) if program.package is not None else program


#: Characters that have a special meaning for a shell.
_OF_SHELLS = re.compile(r"[$`|&;<>(){}*?~#\[\]!\n]|^\s*\w+=")


def _without_shell(program: Program) -> Program:
    """Return the program that a shell command starts.

    This is possible only if the shell does no more than split the text into words. The arguments
    of a package's program are also split. Arguments that need more from a shell are left out and
    noted.
    """
    text = concatenate(program.argv, " ")
    is_known = all(isinstance(part, str) for part in parts_of(text))
    does_more = not is_known or bool(_OF_SHELLS.search(text))
    argv = program.argv
    try:
        argv = tuple(shlex.split(text)) if is_known else argv
    except ValueError:
        does_more = True
    if program.package is not None:
        todo = (f"what a shell makes of {text}",) if does_more else ()
        return replace(program, argv=argv, shell=False, todo=(*program.todo, *todo))
    if not does_more:
        plain = replace(program, argv=argv, shell=False)
        return plain if _of_command(plain).package else program
    if PROGRAM in text:
        return replace(program, todo=(*program.todo, f"the edge of the {PROGRAM} in it"))
    return program


def _of_command(program: Program) -> Program:
    """Return the package's program that a command starts, or the program itself."""
    argv = list(program.argv)
    while argv and argv[0] in BEFORE:
        argv.pop(0)
    match argv:
        case ["ros2", "run", package, executable, *rest] if not package.startswith("-"):
            reader: Reader | None = "ros2"
        case ["rosrun", package, executable, *rest] if not package.startswith("-"):
            reader = "tf" if package == "tf" else "tf2_ros"
        case [path, *rest] if posixpath.basename(path) == PROGRAM:
            package, executable, reader = "tf2_ros", PROGRAM, None
        case _:
            return program
    return replace(
        program,
        package=package,
        executable=executable,
        argv=tuple(rest),
        reader=program.reader or reader,
    )


def _without_ros_arguments(program: Program) -> Program:
    """Return the program with the ROS arguments of its command line as keys.

    ROS arguments without a key stay arguments. The keys come before the values that launch sets:
    of two remapping rules the first counts, of two parameter values the last.
    """
    arguments: list[str] = []
    kept: list[str] = []
    params: list[Mapping[str, Any] | str] = []
    remap: list[tuple[str, str]] = []
    names: dict[str, str] = {}
    keys = dict(program.keys)
    inside = False
    own_argv = iter(program.argv)
    for argument in own_argv:
        if not inside or argument in {"--ros-args", "--"}:
            inside = argument == "--ros-args" if argument in {"--ros-args", "--"} else inside
            if not inside and argument != "--ros-args":
                arguments.append(argument)
            continue
        value = next(own_argv, "") if argument in _WITH_VALUE else ""
        left, _, right = partition(value, ":=")
        if argument in {"-r", "--remap"} and right:
            if left in _NAMES:
                names.setdefault(_NAMES[left], right)
            else:
                remap.append((left, right))
        elif argument in {"-p", "--param"} and right:
            params.append({left: _yaml_value(right)})
        elif argument == "--params-file":
            params.append(value)
        elif argument == "--log-level" and value in _LEVELS:
            keys["log_level"] = value
        else:
            kept += [argument, value] if value else [argument]
    argv = (*arguments, "--ros-args", *kept) if kept else tuple(arguments)
    before = len(params)
    return replace(
        program,
        argv=argv,
        params=(*params, *program.params),
        exact=range(program.exact.start + before, program.exact.stop + before),
        remap=(*remap, *program.remap),
        name=names.get("name", program.name),
        namespace=names.get("namespace", program.namespace),
        keys=keys,
    )


#: Remapping rules that set the name and the namespace of a node.
_NAMES = {"__node": "name", "__name": "name", "__ns": "namespace"}
_WITH_VALUE = frozenset(
    {"-r", "--remap", "-p", "--param", "--params-file", "--log-level", "-e", "--enclave"}
)
_LEVELS = frozenset({"debug", "info", "warn", "error", "fatal"})


def _yaml_value(text: str) -> Any:
    """Return the value of a command-line parameter, which ROS parses as YAML."""
    if isinstance(text, Text):
        return text
    try:
        (section,) = load_params(f"n:\n  ros__parameters:\n    value: {text}\n", "").nodes
    except (RejectedError, ValueError):
        return text
    value = section.params.get("value", text)
    return text if isinstance(value, dict) else value_in(value)
