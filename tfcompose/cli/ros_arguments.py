"""``--ros-args`` of a command: ROS arguments for all nodes of the robot."""

from __future__ import annotations

from argparse import ArgumentTypeError
from dataclasses import replace
from typing import TYPE_CHECKING, get_args

from tfcompose.cli.options import namespace
from tfcompose.cli.terminal import UNREADABLE, fail
from tfcompose.model.plan import LogLevel
from tfcompose.spec.language import RosArguments

if TYPE_CHECKING:
    from collections.abc import Sequence


def ros_arguments(argv: Sequence[str]) -> RosArguments:
    """Return the arguments after ``--ros-args``.

    Raises:
        SystemExit: after an error message, if an argument cannot apply to all nodes of a robot.
    """
    arguments, rest = RosArguments(), list(argv)
    while rest:
        flag = rest.pop(0)
        rule = rest.pop(0) if rest and flag in _ROS_FLAGS else ""
        old, sign, new = rule.partition(":=")
        if flag == _LEVEL_FLAG and rule.lower() in _LOG_LEVELS:
            arguments = replace(arguments, level=_LOG_LEVELS[rule.lower()])
        elif not sign or not old or not new:
            fail(f"--ros-args: {f'{flag} {rule}'.strip()} is not one of {_TAKEN}", UNREADABLE)
        elif flag in _REMAP_FLAGS and old == "__ns":
            try:
                arguments = replace(arguments, namespace=namespace(new))
            except ArgumentTypeError as error:
                fail(f"--ros-args: {error}", UNREADABLE)
        elif flag in _REMAP_FLAGS and not old.startswith("__"):
            arguments = replace(arguments, remap={**arguments.remap, old: new})
        elif flag in _PARAM_FLAGS and old == "use_sim_time" and new.lower() in {"true", "false"}:
            arguments = replace(arguments, use_sim_time=new.lower() == "true")
        else:
            advice = "set names and parameters of a single node in the robot file"
            fail(f"--ros-args: {flag} {rule} is not one of {_TAKEN}; {advice}", UNREADABLE)
    return arguments


_REMAP_FLAGS, _PARAM_FLAGS = frozenset({"-r", "--remap"}), frozenset({"-p", "--param"})
_LOG_LEVELS: dict[str, LogLevel] = {level: level for level in get_args(LogLevel)}
_LEVEL_FLAG = "--log-level"
_ROS_FLAGS = _REMAP_FLAGS | _PARAM_FLAGS | {_LEVEL_FLAG}
_TAKEN = "-r __ns:=NAMESPACE, -r FROM:=TO, -p use_sim_time:=true and --log-level LEVEL"
