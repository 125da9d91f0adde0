"""Copy a robot to its computers, and start it there.

Build the robot once, copy it over ssh to every computer under hosts:, start it there as a systemd
unit, and wait until every edge of every host is live. If an edge does not become live, return
every host to the previous release. A second run with the same files copies and changes nothing.
See tfcompose help hosts.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_file, add_variant, positive
from tfcompose.cli.terminal import FAILED, UNREADABLE, fail, print_findings, printable, reject

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.tools.deploy.release import Release
    from tfcompose.tools.deploy.rollout import DeployTarget, Rollout


def arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``deploy``."""
    add_file(parser)
    add_variant(parser, robot="that of the hostname of static's host, if there is one")
    parser.add_argument(
        "--check", action="store_true", help="change nothing; exit 1 if something would change"
    )
    parser.add_argument(
        "--diff", action="store_true", help="print the differences from the files on the hosts"
    )
    parser.add_argument("--rollback", action="store_true", help="return to the previous release")
    parser.add_argument(
        "--host",
        action="append",
        default=[],
        metavar="NAME",
        dest="hosts",
        help="only this host; repeatable",
    )
    parser.add_argument(
        "--no-wait",
        dest="wait",
        action="store_false",
        help="keep the release without waiting for its edges",
    )
    parser.add_argument("--wait", action="store_true", help="wait for the edges (default)")
    parser.add_argument(
        "--timeout",
        type=positive,
        default=60.0,
        metavar="S",
        help="return to the previous release unless every edge is live S seconds after the "
        "start; default: 60",
    )
    parser.add_argument(
        "--clock-limit",
        type=positive,
        default=0.1,
        metavar="S",
        help="refuse hosts whose clocks differ by more than S seconds; default: 0.1",
    )
    parser.add_argument(
        "--wheels",
        metavar="FOLDER",
        help="install these wheels on the hosts, in a separate Python of the release",
    )
    parser.add_argument(
        "--system", action="store_true", help="system units, as root; default: user units"
    )
    parser.set_defaults(wait=True)


def run(arguments: Namespace) -> int:
    """Deploy; exit code 0, 1 for a failure or a difference with --check, 2 if unreadable."""
    from importlib.util import find_spec

    from tfcompose.cli.compiling import compile_without_errors
    from tfcompose.cli.plans import in_folder, is_plan
    from tfcompose.compiler.emit.plan import plan_of
    from tfcompose.foundation.findings import RejectedError

    if find_spec("asyncssh") is None:
        fail("deploy needs the package asyncssh: pip install 'tfcompose[deploy]'", UNREADABLE)
    if is_plan(in_folder(arguments.file)):
        fail(
            f"{arguments.file} is a built plan, but deploy builds: name the robot file", UNREADABLE
        )
    wheels = Path(arguments.wheels) if arguments.wheels else None
    if wheels and not any(wheels.glob("*.whl")):
        fail(f"no wheels in {wheels}", UNREADABLE)
    import asyncio

    from tfcompose.tools.deploy.release import pack_release
    from tfcompose.tools.deploy.rollout import target_of

    try:
        arguments.overlay_robot = asyncio.run(_overlay_robot(arguments, arguments.overlay_robot))
        robot, _ = compile_without_errors(arguments.file, arguments)
        places = {name: host.span for name, host in robot.hosts.items()}
        target = target_of(
            plan_of(robot.with_final_names()),
            arguments.hosts,
            places,
            system=arguments.system,
            clock_limit_s=arguments.clock_limit,
            timeout_s=arguments.timeout,
            waits=arguments.wait,
        )
        release = None if arguments.rollback else pack_release(robot, wheels)
        return asyncio.run(_deploy(target, release, arguments))
    except RejectedError as error:
        reject(error.findings)


async def _overlay_robot(arguments: Namespace, named: str | None) -> str | None:
    """Return the name of the overlay to merge.

    This is ``named`` or, without it, the hostname of the computer that runs ``static``, if the
    robot file has an overlay with this name.

    Raises:
        RejectedError: if the host cannot be reached, or a file cannot be read.
    """
    from tfcompose.cli.compiling import compile_file, load_robot, robots_of
    from tfcompose.compiler.emit.plan import plan_of
    from tfcompose.foundation.findings import Finding, RejectedError
    from tfcompose.model.robot import STATIC
    from tfcompose.tools.deploy.connection import hostname_of, settings_of

    if named is not None or arguments.rollback:
        return named
    robots = robots_of(load_robot(arguments.file))
    robot = compile_file(arguments.file, arguments).robot if robots else None
    plan = plan_of(robot.with_final_names()) if robot else None
    if robot is None or plan is None:
        return None
    names = [process.host for process in plan.processes if process.name == STATIC]
    main = next((name for name in names if name in plan.hosts), None)
    if main is None:
        return None
    host, span = plan.hosts[main], robot.hosts[main].span
    settings = settings_of(plan.robot, main, host, system=arguments.system)
    hostname = await hostname_of(main, host, settings, span)
    if isinstance(hostname, Finding):
        raise RejectedError([hostname])
    if hostname not in robots:
        return None
    _report(f"{main}: {arguments.file} with the overlay of {hostname}")
    return hostname


async def _deploy(target: DeployTarget, release: Release | None, arguments: Namespace) -> int:
    from tfcompose.tools.deploy.rollout import reach_hosts

    async with reach_hosts(
        target, has_wheels=bool(release and release.has_wheels), report=_report
    ) as rollout:
        if findings := await rollout.examine():
            print_findings(findings, sys.stderr)
            return FAILED
        if not arguments.check:
            await rollout.lock()
        if release is None:
            await rollout.plan_return()
        else:
            await rollout.compare(release)
        if findings := rollout.strangers():
            print_findings(findings, sys.stderr)
            return FAILED
        if arguments.diff and release is not None:
            for line in await rollout.difference():
                print(printable(line))
        changes = rollout.changes()
        if not changes:
            waits = target.waits and not arguments.check
            return await _report_unchanged(rollout, waits=waits)
        if arguments.check:
            print(
                "\n".join(f"{name}: {line}" for name, lines in changes.items() for line in lines)
            )
            return FAILED
        if release is not None:
            await rollout.send()
        print(await rollout.activate())
    return 0


def _report(line: str) -> None:
    print(printable(line), flush=True)


async def _report_unchanged(rollout: Rollout, *, waits: bool) -> int:
    """Print that the hosts already run the release, and report edges that are not live.

    Return exit code 1 if there are such edges. With ``waits``, wait for them first.
    """
    _report(f"nothing to change: {rollout.describe()}")
    findings = await rollout.not_live(waits=waits)
    print_findings(findings, sys.stderr)
    return FAILED if findings else 0
