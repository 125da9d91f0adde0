"""Record the transforms and joint states of a running robot.

Write the running robot's /tf, /tf_static and joint states, on the topics of its file, and /clock
to a bag: a single file if OUTPUT ends in .mcap, else a folder as ros2 bag record writes it. Stop
after --for, or at Ctrl-C. Exit 0 after a recording, 1 if no transform came, 2 if a file cannot be
read or written; then there is no bag.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.options import DEFAULT_FILE, add_for, add_variant
from tfcompose.cli.terminal import UNREADABLE, fail, reject

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.model.plan import Plan


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "file", nargs="?", default=DEFAULT_FILE, metavar="FILE|PLAN", help="default: robot.yaml"
    )
    add_variant(parser)
    add_for(parser, "record for S seconds; default: until Ctrl-C")
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUTPUT",
        help="the new bag: a file .mcap, or a folder; default: ROBOT.mcap",
    )


def run(arguments: Namespace) -> int:
    """Record; exit code 0, 1 without transforms, 2 if something cannot be read or written."""
    from tfcompose.cli.live import from_bag
    from tfcompose.cli.plans import expected_plan
    from tfcompose.foundation.reading import exists

    plan, _ = expected_plan(arguments.file, arguments)
    output = Path(arguments.output or f"{plan.robot}.mcap")
    if exists(output) or output.is_symlink():
        fail(f"nothing was recorded: {output} exists; -o OUTPUT names another", UNREADABLE)
    from_bag(lambda: None)  # without rosbags nothing starts
    try:
        _record(plan, output, arguments.duration)
    except OSError as error:
        fail(f"{output} cannot be written: {error.strerror}", UNREADABLE)
    return 0


def _record(plan: Plan, output: Path, duration_s: float | None) -> None:
    """Record a robot that is as planned.

    Raises:
        OSError: if the bag cannot be written.
        SystemExit: after reporting that no transform came, or that ROS failed.
    """
    from tfcompose.cli.live import reject_silence, set_up_ros
    from tfcompose.foundation.findings import finding
    from tfcompose.foundation.signals import Stop
    from tfcompose.foundation.text import plural
    from tfcompose.model.plan.topics import joint_states_topics, parts_of
    from tfcompose.tf.bag_writing import BagWriter
    from tfcompose.tf.live.feed import follow
    from tfcompose.tf.ros.environment import RosError

    set_up_ros(plan.ros)
    from tfcompose.tools.record.recorder import Recorder  # rclpy reads the environment when loaded

    pairs = list(parts_of(plan))
    end = "Ctrl-C ends it" if duration_s is None else f"for {duration_s:g} s"
    begun = partial(print, f"recording {output}: {end}", flush=True)
    with Stop() as stop, BagWriter(output) as writer:
        try:
            with Recorder(writer, pairs, joint_states_topics(plan), begun) as recorder:
                seconds = follow(recorder, stop, duration_s=duration_s)
                elsewhere = recorder.elsewhere()
        except RosError as error:
            reject([finding("TF901", str(error), None)])
        if not recorder.received_any:
            reject_silence(pairs, seconds, elsewhere)
    total = plural(sum(writer.counts.values()), "message")
    print(f"wrote {output}: {total} in {seconds:.1f} s")
    for topic, count in sorted(writer.counts.items()):
        print(f"  {topic}  {count}")
