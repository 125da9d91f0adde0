"""Compare declared mounts with what sensors measure.

Read messages of the running robot or of a recording, and compare them with the mounts that the
robot file declares. Each check agrees, differs, or cannot tell, for example because the robot
moved too little. IMUs are compared with gravity and odometry, lidars and depth cameras with the
floor, the robot's motion and one another. Check that every message has the frame that the file
declares. Name sensors to check only these.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_bag, add_for, add_format, add_variant
from tfcompose.cli.terminal import FAILED, UNREADABLE, fail, print_findings, reject

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Callable, Mapping, Sequence
    from datetime import date

    from tfcompose.compiler.compile import Compiled
    from tfcompose.foundation.findings import Finding
    from tfcompose.model.plan import RosSettings
    from tfcompose.model.robot import Robot
    from tfcompose.tools.prove.recording import Measurements
    from tfcompose.tools.prove.verdict import SensorVerdict

DURATION_S = 30.0


def arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``prove``."""
    parser.add_argument("file", metavar="ROBOT", help="the robot file")
    parser.add_argument(
        "sensors",
        nargs="*",
        default=[],
        metavar="SENSOR",
        help="a sensor, or a frame; default: all",
    )
    add_variant(parser)
    add_for(parser, f"listen for S seconds; default: {DURATION_S:g}")
    add_bag(parser)
    parser.add_argument(
        "--fix",
        action="store_true",
        help="write the fitting values to the robot file, or with --robot to that overlay",
    )
    parser.add_argument(
        "--as",
        dest="overlay",
        metavar="NAME",
        help="with --fix: write the overlay NAME.yaml, which may be new",
    )
    add_format(parser)


def run(arguments: Namespace) -> int:
    """Check the sensors; exit code 0, 1 if a check differs, 2 if no check can tell."""
    from tfcompose.cli.compiling import compile_without_errors
    from tfcompose.cli.live import recording_day
    from tfcompose.cli.reading import read_text

    if arguments.bag and arguments.duration is not None:
        fail("a recording is always read to its end: leave out --for", UNREADABLE)
    if arguments.overlay and not arguments.fix:
        fail("--as goes with --fix", UNREADABLE)
    if arguments.overlay and arguments.overlay_robot not in {None, arguments.overlay}:
        fail("--as and --robot name two overlays: leave out one of them", UNREADABLE)
    day = recording_day(arguments.bag)
    robot, _ = compile_without_errors(arguments.file, arguments, day)
    _refuse_unknown_sensors(arguments, robot)
    measurements = _measure(arguments, robot.ros)
    if arguments.fix and (arguments.overlay or arguments.overlay_robot):
        verdicts, fixed, refused = _fix_overlay(arguments, measurements, day)
        return _report(arguments, verdicts, fixed, refused)
    prove = _prover(arguments, measurements, day)
    verdicts = prove(read_text)
    fixed = _fix(arguments, prove) if arguments.fix else []
    if fixed:
        verdicts = prove(read_text)
    return _report(arguments, verdicts, fixed)


def _refuse_unknown_sensors(arguments: Namespace, robot: Robot) -> None:
    """Refuse names that are neither sensors nor frames.

    Raises:
        SystemExit: after naming the robot's sensors.
    """
    from tfcompose.foundation.findings import did_you_mean

    sensors = [sensor.name for sensor in robot.sensors]
    has = f"its sensors are {', '.join(sensors)}" if sensors else "it has no sensors, but frames"
    unknown = [
        f"{arguments.file} has no sensor or frame {name};"
        f" {did_you_mean(name, [*sensors, *robot.frames], has)}"
        for name in arguments.sensors
        if name not in sensors and name not in robot.frames
    ]
    if unknown:
        fail("\n".join(unknown), UNREADABLE)


def _measure(arguments: Namespace, ros: RosSettings) -> Measurements:
    """Return the messages of the sensors.

    Raises:
        SystemExit: after reporting why they cannot be read.
    """
    from tfcompose.cli.live import from_bag, set_up_ros
    from tfcompose.foundation.findings import finding
    from tfcompose.foundation.signals import Stop
    from tfcompose.tf.ros.environment import RosError

    def read() -> Measurements:
        with Stop() as stop:
            if arguments.bag:
                from tfcompose.tools.prove.recording import read_bag

                return read_bag(arguments.bag, stop)
            set_up_ros(ros)
            from tfcompose.tools.prove.listening import listen  # rclpy reads the environment

            return listen(arguments.duration or DURATION_S, stop)

    try:
        return from_bag(read)
    except RosError as error:
        reject([finding("TF901", str(error), None)])


def _prover(
    arguments: Namespace, measurements: Measurements, day: date | None
) -> Callable[[Callable[[str], str]], list[SensorVerdict]]:
    """Return a function that checks the robot file.

    The function takes a reader of files, so that it can also check an edited file.
    """
    from tfcompose.cli.compiling import compile_file

    def prove(read: Callable[[str], str]) -> list[SensorVerdict]:
        compiled = compile_file(arguments.file, arguments, day, read)
        if compiled.robot is None or compiled.errors:
            reject(compiled.findings)
        texts = {arguments.file: read(arguments.file)}
        return _verdicts(compiled, texts, measurements, arguments)

    return prove


def _verdicts(
    compiled: Compiled,
    texts: Mapping[str, str] | None,
    measurements: Measurements,
    arguments: Namespace,
) -> list[SensorVerdict]:
    """Return the verdicts on a robot without errors; those that comments allow are no findings.

    ``texts`` are the files to edit; None: findings have no edits.
    """
    from tfcompose.compiler.check import apply
    from tfcompose.spec.language.overlay import setting_name
    from tfcompose.tools.prove.proof import Proof

    assert compiled.robot is not None  # noqa: S101 (compiled without errors)
    proof = Proof(
        compiled.robot,
        compiled.sources[0],
        texts or {},
        measurements,
        frozenset(arguments.sensors),
        has_edits=texts is not None,
        overlays=frozenset([*arguments.overlays, *map(setting_name, arguments.settings)]),
    )
    verdicts = proof.verdicts()
    kept, _ = apply(findings_of(verdicts), compiled.allows)
    allowed = [each for each in verdicts if each.finding and each.finding not in kept]
    return [
        *(each for each in verdicts if each not in allowed),
        *(replace(each, finding=None) for each in allowed),
    ]


def _fix(
    arguments: Namespace, prove: Callable[[Callable[[str], str]], list[SensorVerdict]]
) -> list[Finding]:
    """Write the values that fit, and return the findings that they remove.

    Raises:
        SystemExit: after reporting that the file cannot be written.
    """
    from tfcompose.cli.fixing import Fixer

    def lint(_: str, read: Callable[[str], str]) -> list[Finding]:
        return findings_of(prove(read))

    fixer = Fixer([arguments.file], lint)
    fixer.fix(arguments.file)
    try:
        fixer.write()
    except OSError as error:
        fail(f"{arguments.file} cannot be written: {error.strerror}", UNREADABLE)
    return fixer.fixed


def _fix_overlay(
    arguments: Namespace, measurements: Measurements, day: date | None
) -> tuple[list[SensorVerdict], list[Finding], list[Finding]]:
    """Write the poses that fit into the overlay of one robot.

    As with a robot file, a pose is kept only if its check then agrees and no other differs.
    Returns the verdicts with the overlay, the findings that it removes, and why it cannot set
    other poses.

    Raises:
        SystemExit: after reporting that the overlay cannot be read or written.
    """
    from tfcompose.cli.robot_overlay import RobotOverlay
    from tfcompose.foundation.findings import RejectedError

    def prove(overlay: RobotOverlay) -> list[SensorVerdict]:
        compiled = overlay.compile(overlay.text)
        return _verdicts(compiled, None, measurements, arguments)

    name = arguments.overlay or arguments.overlay_robot
    origin = arguments.bag or "the running robot"
    fixed, refused, tried, placed = [], [], set(), set()
    try:
        overlay = edited = RobotOverlay.open(arguments.file, arguments, name, day)
        verdicts = prove(edited)
        while fitting := [each for each in verdicts if each.fit and each.fit not in tried]:
            fit, problem = fitting[0].fit, fitting[0].finding
            assert fit is not None  # noqa: S101 (as above)
            tried.add(fit)
            try:
                # The poses of a mount are one entry of its history, so that --undo restores the
                # pose before this run.
                text = edited.with_pose(*fit, "prove", origin, joins=fit[0] in placed)
            except RejectedError as error:
                refused += [entry for entry in error.findings if entry not in refused]
                continue
            changed = replace(edited, text=text or edited.text)
            after = prove(changed)
            if problem and len(findings_of(after)) < len(findings_of(verdicts)):
                fixed.append(problem)
                placed.add(fit[0])
                edited, verdicts = changed, after
        if edited.text is not None and fixed:
            overlay.write(edited.text)
            print(f"wrote {overlay.path}", file=sys.stderr)
    except RejectedError as error:
        reject(error.findings)
    except OSError as error:
        fail(f"{error.filename or arguments.file} cannot be written: {error.strerror}", UNREADABLE)
    return verdicts, fixed, refused


def findings_of(verdicts: Sequence[SensorVerdict]) -> list[Finding]:
    """Return the findings of verdicts, in the order of their locations."""
    findings = [verdict.finding for verdict in verdicts if verdict.finding]
    return sorted(findings, key=lambda finding: finding.sort_key)


def _report(
    arguments: Namespace,
    verdicts: list[SensorVerdict],
    fixed: list[Finding],
    refused: Sequence[Finding] = (),
) -> int:
    findings = findings_of(verdicts)
    if arguments.format == "json":
        entries = [verdict.as_json() for verdict in verdicts]
        document = {"checks": entries, "fixed": [finding.message for finding in fixed]}
        print(json.dumps(document, indent=2, ensure_ascii=False))
    else:
        for verdict in verdicts:
            judgement = verdict.judgement
            if verdict.finding is None:
                print(f"{verdict.sensor}: {judgement.check} {judgement.answer}: {judgement.text}")
        for finding in fixed:
            print(f"fixed: {finding.message}")
    print_findings([*findings, *refused], sys.stderr)
    if not verdicts:
        fail(f"no message came in a frame of {arguments.file}, which has no sensors", UNREADABLE)
    if findings:
        return FAILED
    return 0 if any(each.judgement.answer == "agrees" for each in verdicts) else UNREADABLE
