"""Options, topics and checks shared by the commands that observe a tree or read a recording."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, TypeVar

from tfcompose.cli.plans import expected_plan
from tfcompose.cli.terminal import INTERRUPTED, UNREADABLE, fail, reject, warn
from tfcompose.foundation.findings import Note, finding
from tfcompose.foundation.signals import Stop
from tfcompose.guard.verdict.setup import elsewhere_help, settings_text
from tfcompose.model.plan import RosSettings
from tfcompose.model.plan.topics import parts_of, topics_below
from tfcompose.tf.bags import BagError, BagFeed, Recording, missing_rosbags
from tfcompose.tf.live.edges import SETTLE_S, TreeObserver
from tfcompose.tf.live.feed import follow
from tfcompose.tf.ros.environment import (
    RosError,
    child_environment,
    reads_zenoh_alone,
    ros_trouble,
)

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from datetime import date

    from tfcompose.foundation.findings import Finding
    from tfcompose.model.plan import Plan
    from tfcompose.tf.live.feed import Feed

    Topics = tuple[str, str]

T = TypeVar("T")

#: Time in seconds within which almost all existing publishers are discovered.
SURE_S = 2.0


def refuse_live_bag(arguments: Namespace) -> None:
    """Reject --live together with --bag.

    Raises:
        SystemExit: after an error message, if both are used.
    """
    if arguments.live and arguments.bag:
        fail("--live uses the running tree and --bag a recording: give one of them", UNREADABLE)


def observe_for(name: str, arguments: Namespace) -> tuple[Plan | None, dict[Topics, TreeObserver]]:
    """Return the plan of FILE, if given, and the observation of the topics (moving, fixed).

    The topics come from the plan or from --namespace. ``name`` is the name of the observing node.

    Raises:
        SystemExit: after an error message about unreadable input, a failed observation or
            conflicting options.
    """
    refuse_live_bag(arguments)
    plan = None
    if arguments.file is not None:
        plan, _ = expected_plan(arguments.file, arguments, recording_day(arguments.bag))
    ros = plan.ros if plan else None
    pairs = list(parts_of(plan)) if plan else []
    pairs = pairs or [topics_below(ros.namespace if ros else arguments.namespace)]
    duration_s = arguments.duration
    return plan, observe_topics(name, pairs, bag=arguments.bag, ros=ros, duration_s=duration_s)


def from_bag(read: Callable[[], T]) -> T:
    """Return the observation of a bag.

    Raises:
        SystemExit: after an error message, if the bag cannot be read.
    """
    if missing := no_rosbags():
        reject([missing])
    try:
        return read()
    except BagError as error:
        reject([finding("TF907", str(error), None, help=error.help)], UNREADABLE)


def no_rosbags() -> Finding | None:
    """Return the finding that bags cannot be read here, with what to install, or None."""
    missing = missing_rosbags()
    if not missing:
        return None
    message, _, advice = missing.partition(": ")
    return finding("TF906", message, None, help=advice)


def recording_day(bag: str | None) -> date | None:
    """Return the day (UTC) on which the recording of a bag began, None without a bag.

    Raises:
        SystemExit: after an error message, if the bag cannot be read.
    """
    return None if bag is None else from_bag(lambda: Recording(bag).first_day())


def observe_topics(  # noqa: PLR0913 (all but two are named)
    name: str,
    pairs: Iterable[Topics],
    *,
    bag: str | None,
    ros: RosSettings | None = None,
    duration_s: float | None = None,
    may_be_silent: bool = False,
    joint_topics: Iterable[str] = (),
) -> dict[Topics, TreeObserver]:
    """Return the observations of pairs of topics (moving, fixed). See ``observe``."""
    settle_s = 0.0 if bag else SETTLE_S
    observers = {pair: TreeObserver(settle_s=settle_s) for pair in pairs}
    observe(
        name,
        observers,
        bag=bag,
        ros=ros,
        duration_s=duration_s,
        may_be_silent=may_be_silent,
        joint_topics=joint_topics,
    )
    return observers


def observe(  # noqa: PLR0913 (all but two are named)
    name: str,
    observers: Mapping[Topics, TreeObserver],
    *,
    bag: str | None = None,
    ros: RosSettings | None = None,
    duration_s: float | None = None,
    every_s: float = 1.0,
    show: Callable[[], object] | None = None,
    may_be_silent: bool = False,
    joint_topics: Iterable[str] = (),
) -> None:
    """Fill the observers from a bag, or else from the running system.

    The observation ends after ``duration_s`` seconds or with a signal. It calls ``show`` every
    ``every_s`` seconds. It also observes the senders of joint states on the ``joint_topics``.

    Raises:
        SystemExit: after an error message. Silence is also an error, except with
            ``may_be_silent``.
    """
    if bag:
        from_bag(lambda: follow(BagFeed(bag, observers), Stop()))
        if not may_be_silent and not any(observer.received_any for observer in observers.values()):
            _reject_silent_bag(bag, list(observers))
        return
    feed = _live_feed(name, observers, ros, joint_topics)
    with Stop() as stop:
        try:
            with feed:
                seconds = follow(feed, stop, duration_s=duration_s, every_s=every_s, show=show)
                elsewhere = feed.elsewhere()
        except RosError as error:
            reject([finding("TF901", str(error), None)])
        heard = any(observer.received_any for observer in observers.values())
        if stop.requested:
            check_early_end(seconds, duration_s, heard=heard)
    if not heard and not may_be_silent:
        reject_silence(list(observers), seconds, elsewhere)


def _live_feed(
    name: str,
    observers: Mapping[Topics, TreeObserver],
    ros: RosSettings | None,
    joint_topics: Iterable[str],
) -> Feed:
    """Return the feed of live messages, after setting this process up as the plan requires."""
    if set_up_ros(ros, zenoh_alone=True):
        from tfcompose.tf.live.zenoh_feed import ZenohFeed

        return ZenohFeed(observers)
    from tfcompose.tf.live.ros_feed import RosFeed  # its import reads the environment

    return RosFeed(name, observers, joint_topics)


def set_up_ros(ros: RosSettings | None = None, *, zenoh_alone: bool = False) -> bool:
    """Set this process up as the plan requires.

    Return whether to read TF from Zenoh without ROS. This is False unless ``zenoh_alone`` is True.

    Raises:
        SystemExit: after an error message, if ROS cannot start with these settings.
    """
    os.environ.update(child_environment(os.environ, ros or RosSettings(), is_built_in=True))
    if zenoh_alone and reads_zenoh_alone(os.environ):
        return True
    trouble = ros_trouble(os.environ, ros)
    if trouble:
        reject([trouble])
    return False


def check_early_end(seconds: float, duration_s: float | None, *, heard: bool) -> None:
    """Warn if a signal ended an observation before all publishers could be discovered.

    ``duration_s`` is the planned duration, None for an observation until a signal.

    Raises:
        SystemExit: after an error message, if no message arrived.
    """
    if seconds >= min(SURE_S, duration_s or SURE_S):
        return
    if not heard:
        fail(f"interrupted after {seconds:.1f} s, before any message arrived", INTERRUPTED)
    if duration_s is not None:
        warn(f"listened for only {seconds:.1f} s, too short to find every publisher")


def _reject_silent_bag(bag: str, topics: Sequence[Topics]) -> None:
    message = f"{bag} has no messages on {names_of(topics)}"
    help_ = (
        "was the robot running? /tf_static is sent once: record it with durability transient_local"
    )
    reject([finding("TF811", message, None, help=help_)])


def reject_silence(topics: Sequence[Topics], seconds: float, elsewhere: Sequence[str]) -> None:
    """Report that no TF message arrived.

    Raises:
        SystemExit: always.
    """
    message = f"no TF message arrived on {names_of(topics)} in {seconds:.1f} s"
    notes = [Note(f"settings: {settings_text(os.environ)}")]
    reject([finding("TF811", message, None, notes=notes, help=elsewhere_help(elsewhere))])


def names_of(topics: Iterable[Topics]) -> str:
    """Return the topics for display."""
    return " and ".join(topic for pair in topics for topic in pair)
