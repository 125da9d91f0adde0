"""Play a recording with the fixed edges of a robot file.

Publish the robot file's fixed edges as latched messages, and run `ros2 bag play BAG` with the
recorded fixed edges on other topics. Also publish recorded fixed edges that the robot file does
not declare. With --print, print the command and start nothing. If `ros2` is not installed, print
the command, so that you can run it yourself; Ctrl-C then ends the publishing.
"""

from __future__ import annotations

import os
import shlex
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.terminal import INTERRUPTED, print_findings, reject
from tfcompose.tools.rebag.command import add_with

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Collection, Mapping, Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.foundation.signals import Stop
    from tfcompose.model.plan import Plan
    from tfcompose.tools.rebag.rewriting import Rewrite

#: The interval at which the end of the player is checked, in seconds.
_POLL_S = 0.1
#: The time in seconds in which the player must end, after Ctrl-C in its terminal and again after
#: SIGINT.
_END_S = 2.0


def arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``play``."""
    parser.add_argument("bag", metavar="BAG", help="a rosbag2 folder, .mcap or .db3")
    parser.add_argument(
        "options",
        nargs="*",
        default=[],
        metavar="OPTION",
        help="after --: options for ros2 bag play",
    )
    add_with(parser)
    parser.add_argument(
        "--print",
        dest="only_print",
        action="store_true",
        help="print the command that plays the bag, and start nothing",
    )


def run(arguments: Namespace) -> int:
    """Play the bag; return the exit code of `ros2 bag play`, or 0 after --print."""
    from tfcompose.cli.live import from_bag, recording_day, set_up_ros
    from tfcompose.cli.plans import expected_plan
    from tfcompose.foundation.findings import finding
    from tfcompose.foundation.signals import Stop
    from tfcompose.tf.ros.environment import RosError, child_environment

    plan, _ = expected_plan(arguments.file, arguments, recording_day(arguments.bag))
    environment = child_environment(os.environ, plan.ros, is_built_in=False)
    if not arguments.only_print:
        set_up_ros(plan.ros)
    with Stop() as stop:
        rewrite = from_bag(lambda: _read(Path(arguments.bag), plan, stop))
        if rewrite is None:
            return INTERRUPTED
        static_topics = [topics[1] for topics in rewrite.corrections]
        command = _command(arguments.bag, static_topics, arguments.options)
        print(shlex.join(command), flush=True)
        on_tf = {edge for each in rewrite.corrections.values() for edge in each.left_moving}
        print_findings(warnings_of(on_tf), sys.stderr)
        if arguments.only_print:
            return 0
        try:
            return _play(command, environment, rewrite, plan, stop)
        except RosError as error:
            reject([finding("TF901", str(error), None)])


def _read(path: Path, plan: Plan, stop: Stop) -> Rewrite | None:
    """Return the corrections with all fixed edges of the bag; None if a signal came.

    Raises:
        BagError: if the bag cannot be read.
    """
    from tfcompose.tools.rebag.bag import bag_at, check_bag, note_static
    from tfcompose.tools.rebag.correction import corrections_of
    from tfcompose.tools.rebag.messages import MessageEditor
    from tfcompose.tools.rebag.rewriting import InterruptedRewrite, Rewrite

    bag = bag_at(path)
    rewrite = Rewrite(
        corrections_of(plan, {}, only_declared=False), MessageEditor({}, {}), {}, stop
    )
    try:
        note_static(bag, rewrite)
        check_bag(bag, rewrite)
    except InterruptedRewrite:
        return None
    rewrite.compress = None  # its messages are published, and not stored
    return rewrite


def _command(bag: str, static_topics: Sequence[str], options: Sequence[str]) -> list[str]:
    """Return the command that plays the bag with remapped fixed edges and the user's options.

    Of several ``--remap`` ros2 bag play takes the last, so the user's rules join these.
    """
    rules = [f"{topic}:={topic}_recorded" for topic in static_topics]
    remaining: list[str] = []
    is_rule = False
    for option in options:
        if option.startswith("-"):
            name, _, rule = option.partition("=")
            is_rule = name in {"--remap", "-m"}
            rules += [rule] if is_rule and rule else []
            remaining += [] if is_rule else [option]
        else:
            (rules if is_rule else remaining).append(option)
    return ["ros2", "bag", "play", bag, "--remap", *rules, *remaining]


def warnings_of(edges: Collection[str]) -> list[Finding]:
    """Return a finding about fixed edges that the bag sends on a topic of moving edges."""
    from tfcompose.foundation.findings import finding

    if not edges:
        return []
    message = (
        f"the bag also sends fixed edges on /tf, which are played: {', '.join(sorted(edges))}"
    )
    return [finding("TF927", message, None, help="tfcompose rebag removes them")]


def _play(
    command: Sequence[str],
    environment: Mapping[str, str],
    rewrite: Rewrite,
    plan: Plan,
    stop: Stop,
) -> int:
    """Publish the fixed edges, and play the bag until it ends or a signal comes.

    Raises:
        RosError: if ROS cannot start a node.
    """
    from tfcompose.tf.ros.node import TFPublisher, open_node

    namespace = plan.ros.namespace or "/"
    with open_node("tfcompose_play", namespace) as node:
        publishers = []  # latched messages end with their publisher
        for channel, data in rewrite.openings(0):  # tf2 ignores the stamp of a fixed edge
            publishers.append(TFPublisher(node, static=True, topic=channel.topic))
            publishers[-1].publish(data)
        program = shutil.which(command[0], path=environment.get("PATH"))
        if program is None:
            stop.wait(None)
            return 0
        with subprocess.Popen([program, *command[1:]], env=environment) as player:
            while player.poll() is None and not stop.wait(_POLL_S):
                pass
            return _end(player)


def _end(player: subprocess.Popen[bytes]) -> int:
    """End the player, if it still runs, and return its exit code."""
    if player.poll() is not None:
        return player.returncode if player.returncode >= 0 else 128 - player.returncode
    for number in (signal.SIGINT, signal.SIGKILL):
        with suppress(subprocess.TimeoutExpired):
            player.wait(_END_S)
            break
        player.send_signal(number)
    return INTERRUPTED
