"""Share edges between robots over Zenoh, and look poses up between them.

`fleet.yaml` lists each robot's router and shared edges. Pass another file as the last argument.
`fleet lint` checks the file. `fleet share ROBOT` runs on the robot and sends its edges; only this
needs ROS. `fleet ps` lists the robots and the age of their shared edges. `fleet echo A B` prints
the pose of frame B in frame A, such as r1/base_link r2/base_link. `fleet doctor` diagnoses
routers, links and clocks. `fleet ps` and `fleet doctor` exit 1 if a robot is not live.
"""

from __future__ import annotations

import sys
import time
from importlib.util import find_spec
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_for, add_format, positive
from tfcompose.cli.terminal import (
    FAILED,
    INTERRUPTED,
    UNREADABLE,
    exit_code_of,
    fail,
    print_findings,
    reject,
    warn,
)

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.foundation.findings import Finding
    from tfcompose.tools.fleet.observe import FleetObserver, FleetRobotStatus
    from tfcompose.tools.fleet.spec import FleetSpec

#: The actions of the command, with the names of their arguments.
_ACTIONS = {"lint": (), "share": ("ROBOT",), "ps": (), "echo": ("A", "B"), "doctor": ()}
_FILE = "fleet.yaml"
_YAML = (".yaml", ".yml")
#: The time of observation in seconds. It is long enough to detect a stale link; a live link is
#: known earlier.
_OBSERVE_S = 3.0
_HEAD = ("ROBOT", "STATE", "AGE", "EDGES", "ROUTER")


def arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``fleet``."""
    parser.add_argument("action", choices=_ACTIONS, help="the action, as above")
    parser.add_argument(
        "words",
        nargs="*",
        default=[],
        metavar="NAME|FILE",
        help="share: ROBOT; echo: A B; last, optionally: the fleet file",
    )
    add_for(
        parser,
        "ps and doctor: listen for S seconds; default: until every robot answers, at most 3 s; "
        "echo: stop after S seconds",
    )
    parser.add_argument(
        "--rate",
        type=positive,
        default=1.0,
        metavar="HZ",
        help="echo: poses per second; default: 1",
    )
    parser.add_argument("--once", action="store_true", help="echo: print one pose and exit")
    parser.add_argument(
        "--namespace",
        metavar="NAME",
        help="share: the namespace of the robot's /tf; default: that of fleet.yaml",
    )
    add_format(parser)


def run(arguments: Namespace) -> int:
    """Run the action; exit code 0, 1 with findings, 2 for wrong use or an unreadable file."""
    files = [argument for argument in arguments.words if argument.endswith(_YAML)]
    names = [argument for argument in arguments.words if not argument.endswith(_YAML)]
    operands = _ACTIONS[arguments.action]
    if len(names) != len(operands) or len(files) > 1:
        usage = " ".join(["tfcompose fleet", arguments.action, *operands, "[FILE]"])
        fail(f"fleet {arguments.action}: wrong number of names; usage: {usage}", UNREADABLE)
    spec, findings = _read(files[0] if files else _FILE)
    print_findings(findings, sys.stderr)
    if spec is None or arguments.action == "lint":
        return _lint_code(findings)
    refuse_without_zenoh()
    if arguments.action == "share":
        return _share(spec, names[0], arguments.namespace)
    from tfcompose.tools.fleet.observe import FleetObserver

    is_echo = arguments.action == "echo"
    observer = FleetObserver(spec, (names[0], names[1]) if is_echo else None)
    try:
        if is_echo:
            return _echo(observer, names[0], names[1], arguments)
        return _report(observer, arguments)
    except KeyboardInterrupt:
        return INTERRUPTED
    finally:
        observer.close()


def refuse_without_zenoh() -> None:
    """End the command if eclipse-zenoh is not installed.

    Raises:
        SystemExit: after printing how to install it.
    """
    from tfcompose.foundation.findings import finding
    from tfcompose.tools.fleet.preflight import INSTALL

    if find_spec("zenoh") is None:
        reject([finding("TF920", "eclipse-zenoh is not installed", None, help=INSTALL)])


def _read(file: str) -> tuple[FleetSpec | None, list[Finding]]:
    """Return the fleet of a file (None if the file has errors), and all findings."""
    from tfcompose.cli.reading import read_text
    from tfcompose.foundation.findings import RejectedError
    from tfcompose.spec.load import load
    from tfcompose.tools.fleet.check import check_fleet
    from tfcompose.tools.fleet.spec import FleetSpec, validate_fleet

    try:
        source = load(read_text(file), file, FleetSpec.BEGIN)
        spec = validate_fleet(source)
    except RejectedError as error:
        return None, list(error.findings)
    findings = list(check_fleet(spec, source))
    return (None if _lint_code(findings) else spec), findings


def _lint_code(findings: list[Finding]) -> int:
    errors = [finding for finding in findings if finding.severity == "error"]
    return exit_code_of(errors) if errors else 0


def _share(spec: FleetSpec, robot: str, namespace: str | None) -> int:
    from tfcompose.cli.live import set_up_ros
    from tfcompose.foundation.findings import did_you_mean, finding
    from tfcompose.foundation.signals import Stop
    from tfcompose.tf.process import ready, say
    from tfcompose.tf.ros.environment import RosError

    if robot not in spec.robots:
        advice = did_you_mean(robot, spec.robots, f"its robots: {', '.join(spec.robots)}")
        fail(f"no robot {robot} in the fleet {spec.name}; {advice}", UNREADABLE)
    set_up_ros()
    from tfcompose.tools.fleet.robot import share  # rclpy reads the environment when it is loaded

    with Stop() as stop:
        try:
            ready()
            share(
                spec,
                robot,
                spec.robots[robot].namespace if namespace is None else namespace,
                stop,
                say,
            )
        except RosError as error:
            reject([finding("TF901", str(error), None)])
    return 0


def _report(observer: FleetObserver, arguments: Namespace) -> int:
    if arguments.duration is None:
        observer.wait(_OBSERVE_S)
    else:
        time.sleep(arguments.duration)
    if arguments.action == "doctor":
        findings = list(observer.findings())
        if arguments.format == "json":
            from tfcompose.compiler.render.formats import render_json

            sys.stdout.write(render_json(findings))
        else:
            print_findings(findings, sys.stdout)
            print(
                f"checked {len(observer.fleet.robots)} robots: {len(findings) or 'nothing is'}"
                " wrong"
            )
        return exit_code_of(findings) if findings else 0
    robots = observer.status()
    if arguments.format == "json":
        from dataclasses import asdict
        from json import dumps

        print(dumps({"robots": [asdict(robot) for robot in robots]}, ensure_ascii=False))
    else:
        from tfcompose.cli.tables import Table

        print("\n".join(Table(right=frozenset({2})).lines([_HEAD, *map(_row, robots)])))
    return 0 if all(robot.state == "live" for robot in robots) else FAILED


def _row(robot: FleetRobotStatus) -> tuple[str, ...]:
    live = sum(edge.age_s is not None and not edge.stale for edge in robot.edges)
    age = "–" if robot.age_s is None else f"{robot.age_s:.1f} s"
    return robot.robot, robot.state, age, f"{live}/{len(robot.edges)}", robot.router


def _echo(observer: FleetObserver, target: str, source: str, arguments: Namespace) -> int:
    """Print poses until a signal comes.

    If a link becomes stale or live again, print this once.
    """
    from tfcompose.compiler.render.pose import pose_json, pose_text
    from tfcompose.foundation.numbers import clean
    from tfcompose.tf.tf2 import TransformException
    from tfcompose.tools.fleet.observe import StaleError

    begun = time.monotonic()
    is_printed = False
    wrong, trouble, due = "", "", 0.0
    try:
        while (now := time.monotonic()) - begun < (arguments.duration or float("inf")):
            try:
                pose, stamp_ns = observer.pose(target, source)
                wrong = ""
            except StaleError as error:
                wrong = str(error)
            except TransformException as error:
                wrong = str(error.detail)
            waiting = not is_printed and now - begun < _OBSERVE_S
            if wrong != trouble and not (wrong and waiting):
                warn(wrong or "the links are live again")
                trouble = wrong
            if not wrong and now >= due:
                due, is_printed = now + 1 / arguments.rate, True
                age_s = None if stamp_ns is None else (time.time_ns() - stamp_ns) / 1e9
                if arguments.format == "json":
                    sys.stdout.write(
                        pose_json(target, source, clean(pose), stamp_ns=stamp_ns, age_s=age_s)
                    )
                else:
                    when = ", fixed" if age_s is None else f", {age_s:.2f} s ago"
                    sys.stdout.write(pose_text(target, source, clean(pose), when))
                sys.stdout.flush()
            if arguments.once and (is_printed or not waiting):
                break
            time.sleep(0.05)
    finally:
        if not is_printed and wrong != trouble:  # also if a signal came earlier
            warn(wrong)
    return 0 if is_printed else FAILED
