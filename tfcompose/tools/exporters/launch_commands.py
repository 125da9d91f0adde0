"""Classification of processes by the kind of launch action that starts them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from tfcompose.model.process_keys import PROCESS_KEYS

if TYPE_CHECKING:
    from tfcompose.model.plan import PlanProcess

_EXECUTABLE = re.compile(r"\$\{executable:([^/}]+)/([^/}]+)\}")
_LAUNCH = re.compile(r"\$\{launch:([^/}]+)/([^}]+)\}")
_PLACEHOLDER = re.compile(r"\$\{(?:executable:|launch:|plan\}|tfcompose\})")
#: ROS arguments that are keywords of launch's node actions.
_KEYWORDS = ("-r", "--params-file")


def is_launch(process: PlanProcess) -> bool:
    """Return True if the process is a launch file of a package."""
    return bool(process.argv) and _LAUNCH.fullmatch(process.argv[0]) is not None


def is_node(process: PlanProcess) -> bool:
    """Return True if a node action of launch can start the process."""
    return (
        bool(process.argv)
        and _EXECUTABLE.fullmatch(process.argv[0]) is not None
        and len(process.nodes) == 1
        and not _needs_launcher(process)
    )


def is_command(process: PlanProcess) -> bool:
    """Return True if launch can start the process's command without tfcompose."""
    return (
        process.kind == "run"
        and not _needs_launcher(process)
        and not any(map(_PLACEHOLDER.search, process.texts))
    )


def included_file(process: PlanProcess) -> tuple[str, str]:
    """Return the package and the file name of a process that is a launch file."""
    parsed = _LAUNCH.fullmatch(process.argv[0])
    return (parsed[1], parsed[2]) if parsed else ("", "")


def program(process: PlanProcess) -> tuple[str, str]:
    """Return the package and the executable of the process."""
    parsed = _EXECUTABLE.fullmatch(process.argv[0])
    return (parsed[1], parsed[2]) if parsed else ("", "")


def full_name(process: PlanProcess) -> tuple[str, str]:
    """Return the namespace and the name of the process's first node."""
    namespace, _, name = process.nodes[0].rpartition("/")
    return namespace or "/", name


def split_ros_arguments(process: PlanProcess) -> tuple[list[str], list[str]]:
    """Return the program's own arguments, and its ROS arguments.

    ROS arguments that are keywords of launch's node actions are left out.
    """
    argv = list(process.argv[1:])
    end = argv.index("--ros-args") if "--ros-args" in argv else len(argv)
    kept, rest = [], iter(argv[end + 1 :])
    for argument in rest:
        if argument in _KEYWORDS:
            next(rest, None)
        else:
            kept.append(argument)
    return argv[:end], kept


def _needs_launcher(process: PlanProcess) -> bool:
    """Return True if the process has a key that launch does not support."""
    return any(
        key.launch and key.launch.is_external and key.is_set(process) for key in PROCESS_KEYS
    )
