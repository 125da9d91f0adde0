"""What the commands have in common that look at a running tree, or at a bag: arguments, and what can be in the way."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING, TypeVar

from tfcompose.cli.options import positive
from tfcompose.cli.terminal import UNREADABLE, print_findings
from tfcompose.diagnostic import finding
from tfcompose.plan import RosSettings
from tfcompose.ros.environment import RosError, child_environment, missing_ros
from tfcompose.ros.stop import Stop

if TYPE_CHECKING:
    from argparse import ArgumentParser
    from collections.abc import Callable, Mapping

    from tfcompose.observe.census import Census

    Topics = tuple[str, str]

T = TypeVar("T")


def add_namespace(parser: ArgumentParser) -> None:
    """Add --namespace."""
    parser.add_argument("--namespace", default="", metavar="NS", help="/NS/tf and /NS/tf_static instead")


def add_bag(parser: ArgumentParser) -> None:
    """Add --bag."""
    parser.add_argument(
        "--bag", metavar="BAG", help="a recording instead of the running tree: a rosbag2 folder, .mcap or .db3"
    )


def add_for(parser: ArgumentParser, text: str, default: float | None = None) -> None:
    """Add --for."""
    parser.add_argument("--for", dest="duration", type=positive, default=default, metavar="S", help=text)


def from_bag(path: str, censuses: Mapping[Topics, Census]) -> int | None:
    """Put a bag into the censuses of these topics (moving, fixed).

    Return None, or the exit code after saying why not.
    """
    return reading(lambda: import_module("tfcompose.observe.bag").take_bag(path, censuses))


def reading(read: Callable[[], T]) -> T | int:
    """Return what is read from a bag, or the exit code after saying why it cannot be."""
    bag = import_module("tfcompose.observe.bag")
    missing = bag.missing_rosbags()
    if missing:
        print_findings([finding("TF906", missing, None)], sys.stderr)
        return 1
    try:
        return read()
    except bag.BagError as error:
        print_findings([finding("TF907", str(error), None, help=error.help)], sys.stderr)
        return UNREADABLE


def from_live(  # noqa: PLR0913 (all but two are named)
    name: str,
    censuses: Mapping[Topics, Census],
    *,
    ros: RosSettings | None = None,
    duration_s: float | None,
    every_s: float = 1.0,
    show: Callable[[int], None] | None = None,
) -> int | None:
    """Fill the censuses from the running system, until the time is over or a signal comes.

    Return None, or the exit code after saying why not. ``show`` is called as by ``watch``.
    """
    missing = missing_ros()
    if missing:
        print_findings([finding("TF901", missing, None)], sys.stderr)
        return 1
    os.environ.update(child_environment(os.environ, ros or RosSettings(), own=True))
    with Stop() as stop:
        watch = import_module("tfcompose.observe.watching").watch
        try:
            watch(name, censuses, stop, duration_s=duration_s, every_s=every_s, show=show)
        except RosError as error:
            print_findings([finding("TF901", str(error), None)], sys.stderr)
            return 1
    return None


def nothing_came(where: str, seconds: float) -> int:
    """Say that there was no TF at all, and return the exit code."""
    message = f"no TF message came on {where} for {seconds:.1f} s"
    advice = "is the robot running, and with the same ROS_DOMAIN_ID and discovery range?"
    print_findings([finding("TF811", message, None, help=advice)], sys.stderr)
    return 1
