"""Options ``--all-hosts`` and ``--file`` of commands for a running robot."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_trust
from tfcompose.cli.terminal import UNREADABLE, fail

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        "--all-hosts",
        action="store_true",
        help="on every host of the robot, over ssh",
    )
    parser.add_argument(
        "--file",
        metavar="FILE|PLAN",
        help="with --all-hosts: the robot file with the hosts; default: robot.yaml",
    )
    add_trust(parser)


def run(command: str, arguments: Namespace) -> int | None:
    """Run the command on all hosts and return the highest exit code; None without the option."""
    if not arguments.all_hosts:
        if arguments.file:
            fail("--file goes with --all-hosts", UNREADABLE)
        return None
    from tfcompose.tools.deploy.all_hosts import run_on_all_hosts

    processes = arguments.name if command == "logs" else ()
    return run_on_all_hosts(arguments, command, *_options(arguments), processes=processes)


def _options(arguments: Namespace) -> list[str]:
    """Return the options of the command itself, for the command line on each host."""
    values = vars(arguments)
    options = [
        f"--{name}" for name in ("leftovers", "follow", "times", "previous") if values.get(name)
    ]
    if "format" in values:
        options += ["--format", arguments.format]
    if "timeout" in values:
        options += ["--timeout", f"{arguments.timeout:g}"]
    if values.get("fail_on"):
        options += ["--fail-on", arguments.fail_on]
    if values.get("lines") is not None:
        options += ["--lines", str(arguments.lines)]
    if values.get("since") is not None:
        options += ["--since", datetime.fromtimestamp(arguments.since).astimezone().isoformat()]
    return options
