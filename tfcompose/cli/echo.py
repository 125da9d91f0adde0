"""``tfcompose echo``: where one frame is in another, now.

Print the pose of B in A from the live tree: position in metres, quaternion x y z w, roll pitch yaw about fixed axes in
radians and degrees. Where there is none it says why, with exit code 1.
"""

from __future__ import annotations

import os
import sys
import time
from importlib import import_module
from typing import TYPE_CHECKING

from tfcompose.cli.options import positive
from tfcompose.cli.terminal import print_findings
from tfcompose.diagnostic import finding
from tfcompose.emit.numbers import clean
from tfcompose.plan import RosSettings
from tfcompose.render.pose import pose_json, pose_text
from tfcompose.ros.environment import RosError, child_environment, missing_ros
from tfcompose.ros.stop import Stop

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.pose import Pose


#: A stamp that is older is taken to be of another clock than the wall's.
_CLOCKS_AGREE_S = 1e6


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("a", metavar="A", help="the frame in which the pose is given")
    parser.add_argument("b", metavar="B", help="the frame whose pose it is")
    parser.add_argument("--once", action="store_true", help="print one pose and end")
    parser.add_argument(
        "--timeout", type=positive, default=5.0, metavar="S", help="end after S seconds without a new pose; default: 5"
    )
    parser.add_argument("--rate", type=positive, default=1.0, metavar="HZ", help="poses a second; default: 1")
    parser.add_argument("--namespace", default="", metavar="NS", help="listen to /NS/tf and /NS/tf_static")
    parser.add_argument(
        "--format", choices=("text", "json"), default="text", help="json: one object a line; default: text"
    )


def run(arguments: Namespace) -> int:
    """Echo until a signal comes; exit code 1 if there was no pose."""
    missing = missing_ros()
    if missing:
        print_findings([finding("TF901", missing, None)], sys.stderr)
        return 1
    os.environ.update(child_environment(os.environ, RosSettings(), own=True))
    with Stop() as stop:
        module = import_module("tfcompose.observe.echo")
        asked = module.Asked(
            arguments.a, arguments.b, arguments.once, arguments.rate, arguments.timeout, arguments.namespace
        )

        def say(pose: Pose, stamp_ns: int | None) -> None:
            sys.stdout.write(_written(arguments, clean(pose), stamp_ns))
            sys.stdout.flush()

        try:
            missed = module.echo(asked, say, stop)
        except RosError as error:
            print_findings([finding("TF901", str(error), None)], sys.stderr)
            return 1
    if missed is None:
        return 0
    message = f"no pose of {arguments.b} in {arguments.a}: {missed.reason}"
    print_findings([finding("TF814", message, None)], sys.stderr)
    return 1


def _written(arguments: Namespace, pose: Pose, stamp_ns: int | None) -> str:
    if arguments.format == "json":
        return pose_json(arguments.a, arguments.b, pose, stamp_ns=stamp_ns)
    if stamp_ns is None:
        return pose_text(arguments.a, arguments.b, pose, ", fixed")
    age_s = (time.time_ns() - stamp_ns) / 1e9
    ago = f", {age_s:.2f} s ago" if 0 <= age_s < _CLOCKS_AGREE_S else ""
    return pose_text(arguments.a, arguments.b, pose, f" at {stamp_ns // 10**9}.{stamp_ns % 10**9:09d}{ago}")
