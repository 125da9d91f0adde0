"""Option ``--all-hosts``: run a command on every host over ssh, and print all results."""

from __future__ import annotations

import asyncio
import json
import sys
from argparse import Namespace
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from tfcompose.cli.options import DEFAULT_FILE
from tfcompose.cli.terminal import FAILED, UNREADABLE, fail, print_findings, printable
from tfcompose.model.plan.hosts import hosts_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tfcompose.model.plan import Plan
    from tfcompose.tools.deploy.connection import ConnectedHost


def run_on_all_hosts(
    arguments: Namespace, command: str, *words: str, processes: Sequence[str] = ()
) -> int:
    """Run the command with these arguments on every host, and print the output.

    Return the highest exit code. ``processes`` limits the command to these processes and to hosts
    that run them. Each line begins with its host. With ``--format json``, each object has the key
    ``host``, and ``ps`` prints a single list.

    Raises:
        SystemExit: after printing why there are no hosts.
    """
    if find_spec("asyncssh") is None:
        fail("--all-hosts needs the package asyncssh: pip install 'tfcompose[deploy]'", UNREADABLE)
    if arguments.robot is not None:
        fail("--all-hosts takes the robot of --file: leave out --robot", UNREADABLE)
    plan = _plan(arguments)
    printer = _HostPrinter(command, is_json=getattr(arguments, "format", "text") == "json")
    shares = {
        name: _of_host(plan, name, processes) for name in plan.hosts if name in hosts_of(plan)
    }
    commands = {}
    for name, share in shares.items():
        if share or not processes:
            argv = [command, "--robot", f"{plan.robot}.{name}", *words]
            commands[name] = [*argv, "--", *share] if share else argv
    return asyncio.run(_run(plan, commands, printer))


def _of_host(plan: Plan, host: str, processes: Sequence[str]) -> list[str]:
    """Return the processes that a host may run.

    Names that the plan does not contain go to every host, which then reports them.
    """
    elsewhere = {process.name for process in plan.processes if process.host not in (None, host)}
    return [name for name in processes if name not in elsewhere]


def _plan(arguments: Namespace) -> Plan:
    from tfcompose.cli.plans import expected_plan
    from tfcompose.cli.terminal import reject
    from tfcompose.foundation.findings import RejectedError
    from tfcompose.tools.deploy.rollout import target_of

    file = arguments.file or DEFAULT_FILE
    plan, _ = expected_plan(
        file,
        Namespace(
            file=file, profiles=[], overlays=[], settings=[], arg_values={}, trust=arguments.trust
        ),
    )
    try:
        target_of(plan, [], {})
    except RejectedError as error:
        reject(error.findings)
    return plan


async def _run(plan: Plan, commands: Mapping[str, list[str]], printer: _HostPrinter) -> int:
    printer.width = max(map(len, commands))
    codes = await asyncio.gather(
        *(_run_on(plan, name, argv, printer) for name, argv in commands.items())
    )
    printer.end(list(commands))
    return max(codes)


async def _run_on(plan: Plan, name: str, argv: list[str], printer: _HostPrinter) -> int:
    from tfcompose.tools.deploy.connection import ConnectedHost, connect_host, settings_of

    host = plan.hosts[name]
    connected_host = await connect_host(name, host, settings_of(plan.robot, name, host), None)
    if not isinstance(connected_host, ConnectedHost):
        print_findings([connected_host], sys.stderr)
        return FAILED
    try:
        return await _print_output(connected_host, argv, printer)
    finally:
        await connected_host.close()


async def _print_output(host: ConnectedHost, argv: list[str], printer: _HostPrinter) -> int:
    process = await host.execute(argv)

    async def errors() -> None:
        while line := await process.stderr.readline():
            sys.stderr.write(f"{host.name}: {printable(line.decode(errors='replace').rstrip())}\n")

    complaining = asyncio.create_task(errors())
    while line := await process.stdout.readline():
        printer.take(host.name, line.decode(errors="replace").rstrip("\n"))
    await complaining
    await process.wait_closed()
    return process.exit_status if process.exit_status is not None else FAILED


def _object(line: str) -> dict[str, Any]:
    """Return the JSON object on a line; empty for other lines."""
    try:
        value = json.loads(line)
    except ValueError:
        value = None
    return value if isinstance(value, dict) else {}


def _robots(text: str) -> list[Any]:
    """Return the robots that a host lists; an empty list if its output is not such a list."""
    try:
        robots = json.loads(text)
    except ValueError:
        robots = None
    return robots if isinstance(robots, list) else []


class _HostPrinter:
    """Prints the output of hosts, each line with its host.

    Tables of ``ps`` are printed at the end, host by host.
    """

    def __init__(self, command: str, *, is_json: bool) -> None:
        self.width = 0
        self._is_table = command == "ps"
        self._is_json = is_json
        self._kept: dict[str, list[str]] = {}

    def take(self, host: str, line: str) -> None:
        """Print a line, or keep it for the end."""
        if self._is_table:
            self._kept.setdefault(host, []).append(line)
        elif self._is_json and (event := _object(line)):
            self._put(json.dumps({"host": host} | event, ensure_ascii=False))
        else:
            self._put(f"{host.ljust(self.width)} | {printable(line)}")

    def end(self, hosts: list[str]) -> None:
        """Print all kept lines, host by host."""
        lines = [self._kept.get(host, []) for host in hosts]
        if self._is_table and self._is_json:
            robots = [robot for some in lines for robot in _robots("\n".join(some))]
            self._put(json.dumps(robots, indent=1))
        elif any(lines):
            self._put("\n".join(printable(line) for some in lines for line in some))

    def _put(self, text: str) -> None:
        sys.stdout.write(f"{text}\n")
        sys.stdout.flush()
