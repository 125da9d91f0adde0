"""TF501: bad frame name."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Span, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.findings import Severity
    from tfcompose.model import Robot


_GOOD = re.compile(r"[A-Za-z0-9_]+(/[A-Za-z0-9_]+)*")
#: What URDF and TF take, and a person can type.
_TAKEN = r"[\w.:+@-]+(/[\w.:+@-]+)*"
#: What no listener can look up, or no XML file can hold.
_LOST = r"(?s)|/.*|\s.*|.*\s|.*[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff].*"
_PROCESS = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*(/[A-Za-z0-9_][A-Za-z0-9_.-]*)*")
_LAUNCHER = "tfcompose"
_NODE = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")


def bad_frame_name(robot: Robot) -> Iterator[Finding]:
    """A frame, joint, process or node has a name that tf2, URDF, ROS or a file system takes differently.

    tf2 strips a leading slash, a process's name is also that of its parameter file, and spaces, quotes and ``&`` break
    somewhere on the way. Use letters, digits and ``_``; a slash stands between a prefix and a name only. The parts of
    a node's name do not begin with a digit. Hyphens, dots, colons and letters beyond ASCII, as in
    ``base_link-base_fixed_joint``, are warnings: URDF and TF take them, but a parameter or a topic that is named after
    the frame or joint cannot have them. In a URDF that somebody else wrote everything is a warning that can be looked
    up at all.
    """
    names: dict[str, Span] = dict(robot.frames)
    for edge in robot.edges:
        names.setdefault(edge.child, edge.child_at or edge.at)
        if edge.joint_name:
            names.setdefault(edge.joint_name, edge.joint_at or edge.at)
    for name, at in names.items():
        if not _GOOD.fullmatch(name):
            taken = re.fullmatch(_TAKEN, name) or (at.file in robot.foreign and not re.fullmatch(_LOST, name))
            yield _bad(name, at, "name", "warning" if taken else "error")
    for process in robot.processes:
        if not _PROCESS.fullmatch(process.name):
            yield _bad(process.name, process.at, "name for a process")
        elif process.name == _LAUNCHER:
            message = f"{_LAUNCHER} is the launcher's own name, in logs and findings"
            yield finding("TF501", message, process.at, help="give the process another name")
        elif (process.package or process.kind != "run" or process.params) and not _NODE.fullmatch(process.node):
            yield _bad(process.node, process.at, "name for a node")


def _bad(name: str, at: Span, what: str, severity: Severity = "error") -> Finding:
    bare = name.lstrip("/")
    if what == "name" and bare != name and _GOOD.fullmatch(bare):
        return finding("TF501", f"{name!r} is no good {what}", at, help=f"tf2 drops a leading slash: write {bare}")
    better = re.sub(r"[^A-Za-z0-9_/]+|//+", "_", name).strip("/")
    advice = f"for example {better}" if _GOOD.fullmatch(better) and better != name.strip("/") else _LETTERS
    return finding("TF501", f"{name!r} is no good {what}", at, help=advice, severity=severity)


_LETTERS = "letters, digits and _; a node's name does not begin with a digit"
