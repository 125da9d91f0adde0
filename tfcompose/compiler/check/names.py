"""Rules about names of frames, joints, processes, nodes and variables."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from tfcompose.compiler.check.rule import rule
from tfcompose.foundation.findings import Finding, Note, Span, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.foundation.catalogue import Severity
    from tfcompose.model.robot import Robot


_GOOD = re.compile(r"[A-Za-z0-9_]+(/[A-Za-z0-9_]+)*")
#: Names that URDF and TF accept and that a user can type.
_TAKEN = r"[\w.:+@-]+(/[\w.:+@-]+)*"
#: Names that no TF listener can look up, or that an XML file cannot contain.
_LOST = r"(?s)|/.*|\s.*|.*\s|.*[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff].*"
_PROCESS = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*(/[A-Za-z0-9_][A-Za-z0-9_.-]*)*")
_LAUNCHER = "tfcompose"
_NODE = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")


@rule("TF501", of_urdf=True)
def bad_frame_name(robot: Robot) -> Iterator[Finding]:
    names: dict[str, Span] = dict(robot.frames)
    for edge in robot.edges:
        names.setdefault(edge.child, edge.child_at or edge.span)
        if edge.joint_name:
            names.setdefault(edge.joint_name, edge.joint_at or edge.span)
    moving = {edge.joint_name for edge in robot.edges if edge.joint}
    for name, span in names.items():
        if not _GOOD.fullmatch(name):
            is_foreign = robot.is_foreign(span)
            is_accepted = bool(re.fullmatch(_TAKEN, name))
            if is_accepted and is_foreign and name not in moving and name not in robot.frames:
                continue  # ROS does not use the name of a fixed joint
            is_accepted = is_accepted or (is_foreign and not re.fullmatch(_LOST, name))
            yield _invalid(name, span, "name", "warning" if is_accepted else "error")
    for process in robot.processes:
        if not _PROCESS.fullmatch(process.name):
            yield _invalid(process.name, process.span, "process name")
        elif process.name == _LAUNCHER:
            message = (
                f"a process cannot be called {_LAUNCHER}: logs and findings use that name for the"
                " launcher"
            )
            yield finding("TF501", message, process.span, help="give the process another name")
        elif (process.package or process.kind != "run" or process.params) and not _NODE.fullmatch(
            process.node
        ):
            yield _invalid(process.node, process.span, "node name")


def valid_name(name: str) -> str:
    """Return the name with underscores for invalid characters; empty if it is still invalid."""
    better = re.sub(r"[^A-Za-z0-9_/]+|//+", "_", name).strip("/")
    return better if _GOOD.fullmatch(better) else ""


def _invalid(name: str, span: Span, what: str, severity: Severity = "error") -> Finding:
    bare = name.lstrip("/")
    if what == "name" and bare != name and _GOOD.fullmatch(bare):
        return finding(
            "TF501",
            f"invalid {what} {name!r}",
            span,
            help=f"write {bare}: tf2 drops a leading slash",
        )
    better = valid_name(name)
    advice = f"for example {better}" if better and better != name.strip("/") else _ALLOWED
    message = f"invalid {what} {name!r}"
    if severity == "warning":
        message = f"{what} {name!r} has characters that no parameter or topic can have"
    return finding("TF501", message, span, help=advice, severity=severity)


_ALLOWED = "use letters, digits and _; a node's name does not begin with a digit"


@rule("TF503", of_urdf=True)
def upper_case_name(robot: Robot) -> Iterator[Finding]:
    presets = [sensor for sensor in robot.sensors if sensor.name == sensor.name.lower()]
    inside = {frame for sensor in presets for frame in (sensor.mount, *sensor.frames)}
    bad = {
        name: span
        for name, span in robot.frames.items()
        if name != name.lower()
        and name not in inside
        and (name.lower() in robot.frames or not robot.is_foreign(span))
    }
    if bad:
        first, *further = bad
        frames = {name.lower(): name for name in robot.frames if name == name.lower()}
        more = f" and {len(further)} more" if further else ""
        message = f"upper case letters in frame name {first}{more}"
        notes = [
            Note(f"{name} and {lower} are two frames", span)
            for name, span in bad.items()
            if (lower := frames.get(name.lower()))
        ]
        notes += [Note(f"also in {name}", bad[name]) for name in further[:_MOST_LISTED]]
        yield finding("TF503", message, bad[first], help=_lower_case(first), notes=notes)


_MOST_LISTED = 5


def _lower_case(name: str) -> str:
    apart = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
    return f"for example {apart}"


@rule("TF504", idle=True)
def unused_variable(robot: Robot) -> Iterator[Finding]:
    for (section, name), span in robot.unused.items():
        if span.file == robot.file and (section, name) not in robot.broken:
            what, expression = (
                ("argument", f"args.{name}") if section == "args" else ("variable", name)
            )
            yield finding(
                "TF504",
                f"unused {what} {name}",
                span,
                help=f'use it, "${{{expression}}}", or remove it',
            )
