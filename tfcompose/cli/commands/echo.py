"""Print the live pose of frame B in frame A.

Print the pose of B in A from the live tree: position in metres, quaternion x y z w, roll pitch
yaw about fixed axes in radians and degrees. If there is no pose, say why and exit 1. Without
--once, repeat until Ctrl-C. With --bag, read a recording: with --once the first pose, with --at
the pose at that time.
"""

from __future__ import annotations

import re
import sys
import time
from argparse import ArgumentTypeError
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_bag, add_format, add_frames, add_namespace, positive
from tfcompose.cli.terminal import INTERRUPTED, fail, reject

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.foundation.geometry import Pose
    from tfcompose.tf.live.pose_query import NoPose, OnPose, PoseQuery

#: If a stamp is older than this, in seconds, it comes from another clock than the wall clock.
_CLOCKS_AGREE_S = 1e6
#: The number of significant digits of a double.
_MOST_DIGITS = 15


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_frames(parser)
    parser.add_argument("--once", action="store_true", help="print one pose and exit")
    parser.add_argument(
        "--timeout",
        type=positive,
        default=5.0,
        metavar="S",
        help="exit after S seconds without a new pose; default: 5",
    )
    parser.add_argument(
        "--rate", type=positive, default=1.0, metavar="HZ", help="poses per second; default: 1"
    )
    parser.add_argument(
        "--at",
        type=_time,
        default=0,
        metavar="TIME",
        help=(
            "the pose at this time: seconds since the epoch (once), or relative to the newest:"
            " -0.5"
        ),
    )
    parser.add_argument(
        "--precision",
        type=_digits,
        default=4,
        metavar="N",
        help="decimals of metres and radians in text output; default: 4",
    )
    add_bag(parser)
    add_namespace(parser)
    add_format(parser, text="json: one object per line; default: text")


def run(arguments: Namespace) -> int:
    """Echo until a signal comes; exit code 1 if there was no pose."""
    from tfcompose.cli.live import from_bag
    from tfcompose.foundation.findings import finding
    from tfcompose.foundation.numbers import clean
    from tfcompose.guard.verdict.setup import elsewhere_help
    from tfcompose.model.plan.topics import topics_below
    from tfcompose.tf.live.pose_query import PoseQuery

    # tf2 ignores a slash before a name.
    arguments.a, arguments.b = (name.removeprefix("/") for name in (arguments.a, arguments.b))
    topics = topics_below(arguments.namespace)
    query = PoseQuery(
        arguments.a,
        arguments.b,
        arguments.once,
        rate=arguments.rate,
        timeout_s=arguments.timeout,
        topics=topics,
        at_ns=arguments.at,
    )

    def show(pose: Pose, stamp_ns: int | None) -> None:
        sys.stdout.write(_format_pose(arguments, clean(pose), stamp_ns))
        sys.stdout.flush()

    if arguments.bag:
        from tfcompose.tf.bags import echo_bag

        missed = from_bag(lambda: echo_bag(arguments.bag, query, show))
    else:
        missed = _live(query, show)
    if missed is not None:
        message = f"no pose of {arguments.b} in {arguments.a}: {missed.reason}"
        help_ = missed.help if missed.elsewhere is None else elsewhere_help(missed.elsewhere)
        reject([finding("TF814", message, None, help=help_)])
    return 0


def _live(query: PoseQuery, show: OnPose) -> NoPose | None:
    from tfcompose.cli.live import set_up_ros
    from tfcompose.foundation.findings import finding
    from tfcompose.foundation.signals import Stop
    from tfcompose.tf.ros.environment import RosError

    set_up_ros()
    from tfcompose.tf.live.echo import echo

    begun = time.monotonic()
    has_pose = False

    def note(pose: Pose, stamp_ns: int | None) -> None:
        nonlocal has_pose
        has_pose = True
        show(pose, stamp_ns)

    with Stop() as stop:
        try:
            missed = echo(query, note, stop)
        except RosError as error:
            reject([finding("TF901", str(error), None)])
        if stop.requested and not has_pose and missed is None:
            fail(
                f"interrupted after {time.monotonic() - begun:.1f} s, before there was a pose",
                INTERRUPTED,
            )
    return missed


def _format_pose(arguments: Namespace, pose: Pose, stamp_ns: int | None) -> str:
    from tfcompose.compiler.render.pose import pose_json, pose_text

    if arguments.format == "json":
        return pose_json(arguments.a, arguments.b, pose, stamp_ns=stamp_ns)
    when = ", fixed"
    if stamp_ns is not None:
        age_s = (time.time_ns() - stamp_ns) / 1e9
        ago = f", {age_s:.2f} s ago" if 0 <= age_s < _CLOCKS_AGREE_S else ""
        when = f" at {stamp_ns // 10**9}.{stamp_ns % 10**9:09d}{ago}"
    return pose_text(arguments.a, arguments.b, pose, when, arguments.precision)


def _time(text: str) -> int:
    """Parse seconds, and return exact nanoseconds.

    Raises:
        ArgumentTypeError: if the text is not a number, or too large for a stamp.
    """
    match = re.fullmatch(r"(-?)(\d{1,10})(?:\.(\d{1,9}))?", text)
    if match is None or int(match[2]) >= 1 << 31:
        raise ArgumentTypeError(f"{text} is not a time in seconds, such as 1713000000.25 or -0.5")
    stamp_ns = int(match[2]) * 10**9 + int((match[3] or "").ljust(9, "0"))
    return -stamp_ns if match[1] else stamp_ns


def _digits(text: str) -> int:
    """Parse a number of decimals.

    Raises:
        ArgumentTypeError: if the text is not an integer from 0 to 15.
    """
    if not text.isdecimal() or int(text) > _MOST_DIGITS:
        raise ArgumentTypeError(f"{text} is not a number of decimals from 0 to {_MOST_DIGITS}")
    return int(text)
