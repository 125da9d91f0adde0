"""A process of a plan, started as ``tfcompose up`` starts it: ``tfcompose exec PLAN_FILE NAME``.

This program becomes the process, so that a supervisor, such as systemd or a container runtime,
supervises the process itself. Exit codes: 1 if something that the process needs is missing, 2 if
the arguments or the plan are invalid.
"""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import RejectedError
from tfcompose.launcher.kernel_settings import apply_settings
from tfcompose.launcher.preflight import commands_of
from tfcompose.model.plan.file import read_plan
from tfcompose.model.variables import JOINS
from tfcompose.tf.ros.environment import child_environment

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.launcher.child import ChildCommand

_ARGUMENTS = 2


def command_of(argv: Sequence[str], base: Mapping[str, str]) -> ChildCommand | int:
    """Return the command to execute, or an exit code after printing the reason."""
    if len(argv) != _ARGUMENTS:
        return _fail("usage: tfcompose exec PLAN_FILE NAME", 2)
    file, name = Path(argv[0]), argv[1]
    try:
        plan = read_plan(file.read_text("utf-8"), str(file))
        process = plan.process(name)
    except (OSError, UnicodeDecodeError, RejectedError) as error:
        return _fail(f"cannot read the plan: {error}", 2)
    except KeyError:
        return _fail(f"the plan {file} has no process {name}", 2)
    if process.kind == "external":
        return _fail(f"{name} is external, and started elsewhere", 2)
    if process.component:
        return _fail(
            f"{name} is a component, which the guard has {process.component.container} load", 2
        )
    # A partition needs the launcher's run to identify messages. A topic for each process does not.
    plan = replace(plan, guard=replace(plan.guard, fence="remap"))
    commands, findings = commands_of(plan, [process], file, base, child_environment)
    if findings:
        return _fail("\n".join(map(_text, findings)), 1)
    # No launcher delays the other processes until the guard has observed the tree. So the guard
    # accepts every owner as the plan's.
    joins = {JOINS: "1"} if process.kind == "guard" else {}
    return replace(commands[name], env=commands[name].env | joins)


def main(argv: Sequence[str]) -> int:
    """Become the process, or return an exit code."""
    command = command_of(argv, os.environ)
    if isinstance(command, int):
        return command
    try:
        os.chdir(command.folder)
        if command.process:
            apply_settings(command.process)
        os.execve(command.argv[0], command.argv, command.env)  # noqa: S606 (this is what it is for)
    except OSError as error:
        return _fail(f"{argv[1]} cannot be started: {error}", 1)


def _text(finding: Finding) -> str:
    return "\n".join(
        [
            finding.message,
            *(f"  {note.message}" for note in finding.notes),
            *([finding.help] if finding.help else []),
        ]
    )


def _fail(what: str, code: int) -> int:
    sys.stderr.write(f"{what}\n")
    return code
