"""List the processes of running robots.

Show state, PID, uptime, restarts, CPU and memory (PSS of the process group) of each process, and
how many of its edges are live.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from typing import TYPE_CHECKING, Any

from tfcompose.cli.options import add_format, add_robot
from tfcompose.cli.terminal import FAILED, UNREADABLE, fail, is_coloured, table_width
from tfcompose.foundation.text import plural

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Mapping, Sequence

    from tfcompose.cli.process_table import Usage
    from tfcompose.foundation.findings import Finding
    from tfcompose.model.messages import RobotStatus


#: For each level of --fail-on, the severities for which the exit code is 1.
_LEVELS: dict[str, frozenset[str]] = {
    "absent": frozenset(),
    "warning": frozenset({"error", "warning"}),
    "error": frozenset({"error"}),
}


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_robot(parser, "all of this user")
    add_format(parser)
    parser.add_argument(
        "--fail-on",
        choices=tuple(_LEVELS),
        help="absent: exit 1 if no robot runs; warning, error: also if a robot has one",
    )


def run(arguments: Namespace) -> int:
    """Print the table. Return 0; 1 if a robot does not answer, or as --fail-on requires."""
    from tfcompose.cli.process_table import HEAD, TABLE, row, state_of, uptime
    from tfcompose.foundation.geometry import Offset
    from tfcompose.launcher.usage import usage_of

    robots, code = _robots(arguments.robot)
    used = usage_of(
        [process.pid for status in robots.values() for process in status.processes if process.pid]
    )
    if arguments.format == "json":
        print(
            json.dumps([_as_json(name, status, used) for name, status in robots.items()], indent=1)
        )
        return code or _exit_code(arguments.fail_on, robots)
    if not robots and not code:
        name = arguments.robot
        print("no robot is running" if name is None else f"{name} is not running")
    for name, status in robots.items():
        state = state_of(status)
        failed = [process.name for process in status.processes if process.failed]
        state += f", without {', '.join(failed)}" if failed else ""
        state += f", {_count_by_severity(status.findings)}" if status.findings else ""
        state += f", launcher {status.launcher}, up {uptime(status.uptime)}"
        state += f", with {', '.join(status.overlays)}" if status.overlays else ""
        print(f"{name}: {state}")
        for finding in status.findings:
            print(f"  {finding.severity}[{finding.code}] {finding.message}")
        for adjustment in status.adjusted:
            offset = Offset(adjustment.xyz_m, adjustment.rot_rad)
            print(f"  {adjustment.edge} is adjusted by {offset.text} (tfcompose nudge)")
        rows = [HEAD, *(row(process, used) for process in status.processes)]
        print(
            *TABLE.lines(
                rows, table_width(sys.stdout), coloured=is_coloured(sys.stdout), indent="  "
            ),
            sep="\n",
        )
    return code or _exit_code(arguments.fail_on, robots)


def _count_by_severity(findings: Sequence[Finding]) -> str:
    """Return the numbers of errors and warnings as text: "1 error and 2 warnings"."""
    counts = Counter(finding.severity for finding in findings)
    return " and ".join(plural(counts[kind], kind) for kind in counts)


def _exit_code(fail_on: str | None, robots: Mapping[str, RobotStatus]) -> int:
    if fail_on is None:
        return 0
    if not robots:
        return FAILED
    severities = _LEVELS[fail_on]
    for status in robots.values():
        has_failed = any(process.failed for process in status.processes)
        if has_failed and severities:
            return FAILED
        if any(finding.severity in severities for finding in status.findings):
            return FAILED
    return 0


def _robots(name: str | None) -> tuple[dict[str, RobotStatus], int]:
    """Return the robots that answer, by name, and the exit code.

    The code is 1 if a robot does not answer. The function reports such robots.
    """
    from tfcompose.cli.runs import is_meant, request, running
    from tfcompose.launcher.runtime_dir import RuntimeDirError
    from tfcompose.model.messages import RobotStatus, StatusRequest

    try:
        places = [
            runtime_dir
            for runtime_dir, _ in running()
            if name is None or is_meant(runtime_dir, name)
        ]
    except RuntimeDirError as error:
        fail(str(error), UNREADABLE)
    answers = {
        runtime_dir.name: request(runtime_dir, StatusRequest(), RobotStatus)
        for runtime_dir in places
    }
    answering = {name: status for name, status in answers.items() if status is not None}
    return answering, 0 if len(answering) == len(answers) else FAILED


def _as_json(name: str, status: RobotStatus, used: Usage) -> dict[str, Any]:
    import msgspec

    data: dict[str, Any] = {"name": name} | msgspec.to_builtins(status)
    for process in data["processes"]:
        cpu, memory = used.get(process["pid"], (None, None))
        process |= {"cpu": cpu, "memory": memory}
    return data
