"""What the commands have in common that look at a running tree, or at a bag: arguments, and what can be in the way."""

from __future__ import annotations

import gc
import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING, TypeVar

from tfcompose.cli.options import namespace, positive
from tfcompose.cli.terminal import UNREADABLE, complain, print_findings
from tfcompose.findings import Note, finding
from tfcompose.plan import RosSettings
from tfcompose.ros.environment import RosError, child_environment, ros_trouble
from tfcompose.ros.stop import Stop

if TYPE_CHECKING:
    from argparse import ArgumentParser
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from tfcompose.observe.census import Census

    Topics = tuple[str, str]

T = TypeVar("T")

#: Publishers that were there before are found within this time, or almost always.
SURE_S = 2.0
#: The exit code of what a signal ended, as a shell has it for Ctrl-C.
INTERRUPTED = 130


def add_namespace(parser: ArgumentParser) -> None:
    """Add --namespace."""
    parser.add_argument(
        "--namespace", type=namespace, default="", metavar="NS", help="/NS/tf and /NS/tf_static instead"
    )


def add_bag(parser: ArgumentParser) -> None:
    """Add --bag."""
    parser.add_argument(
        "--bag", metavar="BAG", help="a recording instead of the running tree: a rosbag2 folder, .mcap or .db3"
    )


def add_for(parser: ArgumentParser, text: str, default: float | None = None) -> None:
    """Add --for."""
    parser.add_argument("--for", dest="duration", type=positive, default=default, metavar="S", help=text)


def from_bag(path: str, censuses: Mapping[Topics, Census], *, may_be_silent: bool = False) -> int | None:
    """Put a bag into the censuses of these topics (moving, fixed).

    Return None, or the exit code after saying why not: nothing came is a reason, unless it ``may_be_silent``.
    """
    code: int | None = reading(lambda: import_module("tfcompose.observe.bag").take_bag(path, censuses))
    if code is None and not may_be_silent and not any(census.heard for census in censuses.values()):
        message = f"no message was recorded on {names_of(censuses)} in {path}"
        advice = "was the robot running? /tf_static comes once: who records it must ask for durability transient_local"
        print_findings([finding("TF811", message, None, help=advice)], sys.stderr)
        return 1
    return code


def reading(read: Callable[[], T]) -> T | int:
    """Return what is read from a bag, or the exit code after saying why it cannot be."""
    bag = import_module("tfcompose.observe.bag")
    missing = bag.missing_rosbags()
    if missing:
        message, _, advice = missing.partition(": ")
        print_findings([finding("TF906", message, None, help=advice)], sys.stderr)
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
    may_be_silent: bool = False,
) -> int | None:
    """Fill the censuses from the running system, until the time is over or a signal comes.

    Return None, or the exit code after saying why not: nothing came is a reason, unless it ``may_be_silent``. ``show``
    is called as by ``watch``.
    """
    if not ready_for_ros(ros):
        return 1
    gc.enable()  # it may last
    with Stop() as stop:
        watch = import_module("tfcompose.observe.watching").watch
        try:
            seconds, elsewhere = watch(name, censuses, stop, duration_s=duration_s, every_s=every_s, show=show)
        except RosError as error:
            print_findings([finding("TF901", str(error), None)], sys.stderr)
            return 1
        heard = any(census.heard for census in censuses.values())
        code = ended_early(seconds, duration_s, heard=heard) if stop.requested else None
    return code if code or heard or may_be_silent else _nothing_came(list(censuses), seconds, elsewhere)


def ready_for_ros(ros: RosSettings | None = None) -> bool:
    """Set this process up as the plan says, and return whether ROS can be started so, after saying why not."""
    os.environ.update(child_environment(os.environ, ros or RosSettings(), own=True))
    trouble = ros_trouble(os.environ)
    if trouble:
        print_findings([trouble], sys.stderr)
    return trouble is None


def ended_early(seconds: float, duration_s: float | None, *, heard: bool) -> int | None:
    """Say that a signal ended a look before all publishers can be found, and return the exit code if it saw nothing.

    ``duration_s`` is how long it was to last, None: until the signal.
    """
    if seconds >= min(SURE_S, duration_s or SURE_S):
        return None
    if not heard:
        complain(f"ended by a signal after {seconds:.1f} s, before anything came")
        return INTERRUPTED
    if duration_s is not None:
        complain(f"looked for {seconds:.1f} s only, in which not every publisher is found")
    return None


def _nothing_came(topics: Sequence[Topics], seconds: float, elsewhere: Sequence[str]) -> int:
    """Say that there was no TF at all, and return the exit code."""
    words = import_module("tfcompose.observe.elsewhere")
    message = f"no TF message came on {names_of(topics)} for {seconds:.1f} s"
    notes = [Note(f"looked with {words.said(os.environ)}")]
    print_findings([finding("TF811", message, None, notes=notes, help=words.advice(elsewhere))], sys.stderr)
    return 1


def names_of(topics: Iterable[Topics]) -> str:
    """Return the topics as people read them."""
    return " and ".join(topic for pair in topics for topic in pair)
