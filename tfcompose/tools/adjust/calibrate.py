"""Write a measured mount into the overlay of one robot.

Read the pose of SENSOR from a calibration file of easy_handeye2, kalibr, CalibrationTools (tier4),
MoveIt or another known format, and write it into the overlay of this robot: HOSTNAME.yaml in the
folder that overlays: names, or NAME.yaml with --robot NAME. Print the pose before and after, in
millimetres and degrees. A pose that is probably wrong (inverted, copied, or far from the one
before) is written only with --force. The overlay keeps the date, the file and the pose that it
replaced; --undo restores it.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_file, add_variant
from tfcompose.cli.terminal import UNREADABLE, fail, print_findings, reject

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.cli.robot_overlay import RobotOverlay
    from tfcompose.compiler.compile import Compiled
    from tfcompose.compiler.mounts.edit import Mount
    from tfcompose.foundation.findings import Finding
    from tfcompose.spec.load import Source
    from tfcompose.tools.adjust.comparison import PoseComparison

#: Findings about a measured pose that is probably wrong.
_DOUBTS = frozenset({"TF615", "TF616", "TF617", "TF618"})
#: Where tools write their results: easy_handeye2 into the home folder, kalibr beside the bag,
#: CalibrationTools into the folder in which it was started, unless the user names another.
_RESULTS = {
    "CalibrationTools": (".", "calibration_results*.yaml"),
    "easy_handeye2": ("~/.ros2/easy_handeye2/calibrations", "*.calib"),
    "kalibr": (".", "*camchain*.yaml"),
}
_ENDINGS = (".svg", ".png")


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_file(parser)
    parser.add_argument("sensor", metavar="SENSOR", help="a sensor, or a frame")
    add_variant(parser, robot="this computer's hostname")
    choice = parser.add_mutually_exclusive_group(required=True)
    choice.add_argument(
        "--with",
        dest="calibration",
        metavar="CALIBRATION",
        help=f"the calibration file, or for its newest: {', '.join(_RESULTS)}",
    )
    choice.add_argument(
        "--undo", action="store_true", help="restore the pose before the last adjustment"
    )
    parser.add_argument(
        "--parent", metavar="NAME", help="the parent's name in the calibration file: cam0"
    )
    parser.add_argument(
        "--child", metavar="NAME", help="the child's name in the calibration file: imu0"
    )
    parser.add_argument(
        "--picture", metavar="PICTURE", help="draw the pose before and after: .svg or .png"
    )
    parser.add_argument("--dry-run", action="store_true", help="write no overlay")
    parser.add_argument("--force", action="store_true", help="write also what is probably wrong")


def run(arguments: Namespace) -> int:
    """Write the pose; exit code 0, 1 on findings, 2 if something cannot be read or written."""
    from tfcompose.cli.robot_overlay import RobotOverlay
    from tfcompose.foundation.findings import RejectedError
    from tfcompose.foundation.reading import exists

    _check_options(arguments)
    robot = arguments.overlay_robot or os.uname().nodename
    try:
        if arguments.calibration in _RESULTS and not exists(arguments.calibration):
            arguments.calibration = _newest_result(arguments.calibration)
        overlay = RobotOverlay.open(arguments.file, arguments, robot)
        compiled = overlay.compile(overlay.text)
        child = _mounted_frame(compiled, overlay.source, arguments.sensor)
        if arguments.undo:
            return _undo(arguments, overlay, compiled, child)
        return _calibrate(arguments, overlay, compiled, child)
    except RejectedError as error:
        reject(error.findings)
    except OSError as error:
        where = error.filename or arguments.picture
        fail(f"nothing was written: {where}: {error.strerror}", UNREADABLE)


def _check_options(arguments: Namespace) -> None:
    """Refuse options that do not go together, and a picture that cannot be drawn.

    Raises:
        SystemExit: after reporting the reason.
    """
    from tfcompose.cli.writing import require_png_packages

    if arguments.undo and (arguments.parent or arguments.child or arguments.force):
        fail("--parent, --child and --force go with --with", UNREADABLE)
    ending = Path(arguments.picture or "x.svg").suffix.lower()
    if ending not in _ENDINGS:
        fail(f"--picture takes a file ending in .svg or .png, not {arguments.picture}", UNREADABLE)
    if ending == ".png":
        require_png_packages()


def _newest_result(tool: str) -> str:
    """Return the newest calibration file that a tool has written.

    Raises:
        RejectedError: if there is none.
    """
    from tfcompose.foundation.findings import RejectedError, finding

    folder, pattern = _RESULTS[tool]
    files = [path for path in Path(folder).expanduser().glob(pattern) if path.is_file()]
    if not files:
        place = "the current folder" if folder == "." else folder
        message = f"{place} has no result of {tool}, {pattern}"
        raise RejectedError([finding("TF668", message, None, help="name the file: --with FILE")])
    return str(max(files, key=lambda path: path.stat().st_mtime))


def _mounted_frame(compiled: Compiled, source: Source, name: str) -> str:
    """Return the mount of a sensor, or the frame of this name.

    Raises:
        RejectedError: if the robot has neither.
    """
    from tfcompose.foundation.findings import RejectedError, did_you_mean, finding

    robot = compiled.robot
    assert robot is not None  # noqa: S101 (compiled without errors)
    mounts = {sensor.name: sensor.mount for sensor in robot.sensors}
    if name in mounts:
        return mounts[name]
    if name in robot.frames:
        return name
    listed = f"its sensors are {', '.join(mounts)}" if mounts else "it has frames, but no sensors"
    advice = did_you_mean(name, [*mounts, *robot.frames], listed)
    message = f"{robot.name} has no sensor or frame {name}"
    raise RejectedError([finding("TF660", message, source.key_span(("sensors",)), help=advice)])


def _calibrate(arguments: Namespace, overlay: RobotOverlay, compiled: Compiled, child: str) -> int:
    from tfcompose.cli.robot_overlay import fixed_mount

    mount = fixed_mount(compiled, child)
    measured = overlay.compile(overlay.text, _calibration_of(arguments, mount))
    edge = measured.robot.parent_edge(child) if measured.robot else None
    calibration = edge.calibration if edge else None
    assert edge is not None, child  # noqa: S101 (the mount, with another pose)
    assert calibration is not None, child  # noqa: S101 (as above: the file has the pose)
    print(calibration.name)
    _report(arguments, _compare(compiled, measured, calibration.parent, calibration.child))
    doubts = [entry for entry in measured.findings if entry.code in _DOUBTS and _is_new(entry)]
    print_findings(doubts, sys.stderr)
    if doubts and not arguments.force:
        fail("nothing was written; --force writes it nevertheless")
    if arguments.dry_run:
        return 0
    origin = f"{calibration.span.file} ({calibration.format})"
    if overlay.save(child, edge.pose, "calibrate", origin, joins=False):
        print(f"wrote {overlay.path}; calibrate --undo restores the pose before")
    else:
        print("the robot has this pose already")
    return 0


def _is_new(entry: Finding) -> bool:
    """Return whether a finding is about the file that --with names."""
    return entry.span is not None and entry.span.file.startswith("--with ")


def _calibration_of(arguments: Namespace, mount: Mount) -> Source:
    """Return an overlay that gives a mount the calibration file.

    A limit in the robot file remains; a list replaces its other keys.
    """
    from tfcompose.foundation.yaml_text import flow
    from tfcompose.spec.load import load

    entry = {"file": arguments.calibration, "parent": arguments.parent, "child": arguments.child}
    calibration: dict[str, object] = {key: value for key, value in entry.items() if value}
    if (old := mount.edge.calibration) is not None:
        calibration["limit"] = {"xyz": old.limit_m, "rot": old.limit_rad}
    data: dict[str, object] = {"calibration": [calibration]}
    for step in reversed(mount.entry):
        data = {str(step): data}
    return load(flow(data), f"--with {arguments.calibration}")


def _compare(before: Compiled, after: Compiled, parent: str, child: str) -> PoseComparison:
    from tfcompose.compiler.mounts.kinematics import poses_in_roots
    from tfcompose.tools.adjust.comparison import PoseComparison

    robots = [compiled.robot for compiled in (before, after) if compiled.robot]
    poses = [poses_in_roots(robot, {}) for robot in robots]
    old, new = (in_root[parent].inverse() @ in_root[child] for in_root in poses)
    return PoseComparison(parent, child, old, new)


def _report(arguments: Namespace, comparison: PoseComparison) -> None:
    """Print the comparison, and draw it if asked to."""
    print("\n".join(comparison.table()))
    if not arguments.picture:
        return
    from tfcompose.cli.writing import replace_file

    path, drawing = Path(arguments.picture), comparison.drawing()
    if path.suffix.lower() == ".png":
        from tfcompose.compiler.draw.png import png

        replace_file(path, png(drawing))
    else:
        from tfcompose.compiler.draw.svg import svg

        replace_file(path, svg(drawing).encode())
    print(f"wrote {path}")


def _undo(arguments: Namespace, overlay: RobotOverlay, compiled: Compiled, child: str) -> int:
    from tfcompose.cli.robot_overlay import fixed_mount

    mount = fixed_mount(compiled, child)
    undone, text = overlay.without_newest(mount)
    print(f"{undone.tool} of {undone.date} {undone.source}".rstrip())
    restored = overlay.compile(text)
    _report(arguments, _compare(compiled, restored, mount.relative_to, mount.place))
    if not arguments.dry_run:
        overlay.write(text)
        print(f"wrote {overlay.path}")
    return 0
