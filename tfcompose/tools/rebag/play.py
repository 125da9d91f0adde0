"""Play a recording with the fixed edges of a robot file.

Publish the robot file's fixed edges, latched, and run `ros2 bag play BAG`, which plays the
recorded ones on other topics. Recorded fixed edges that the robot file does not declare stay.
With --print nothing starts. Without `ros2`, play the bag yourself as printed; Ctrl-C ends it.
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

from tfcompose.cli.options import add_variant
from tfcompose.cli.terminal import INTERRUPTED, print_findings, reject

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Collection, Mapping, Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.foundation.signals import Stop
    from tfcompose.model.plan import Plan
    from tfcompose.tools.rebag.rewriting import Rewrite

#: The player is asked this often whether it has ended, in seconds.
_POLL_S = 0.1
#: The player gets this long to end after a Ctrl-C in its terminal, and after SIGINT, in seconds.
_END_S = 2.0


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("bag", metavar="BAG", help="a rosbag2 folder, .mcap or .db3")
    parser.add_argument(
        "options", nargs="*", metavar="OPTION", help="after --: options for ros2 bag play"
    )
    parser.add_argument(
        "--with",
        dest="file",
        required=True,
        metavar="FILE|PLAN",
        help="the robot file with the right poses, or its built plan.json",
    )
    add_variant(parser)
    parser.add_argument(
        "--print",
        dest="only_print",
        action="store_true",
        help="print the command that plays the bag, and start nothing",
    )


def run(arguments: Namespace) -> int:
    """Play; return the exit code of `ros2 bag play`, or 0 after --print."""
    from tfcompose.cli.live import from_bag, recording_day, set_up_ros
    from tfcompose.cli.plans import expected_plan
    from tfcompose.foundation.findings import finding
    from tfcompose.foundation.signals import Stop
    from tfcompose.tf.ros.environment import RosError, child_environment

    plan, _ = expected_plan(arguments.file, arguments, recording_day(arguments.bag))
    environment = child_environment(os.environ, plan.ros, own=False)
    if not arguments.only_print:
        set_up_ros(plan.ros)
    with Stop() as stop:
        rewrite = from_bag(lambda: _read(Path(arguments.bag), plan, stop))
        if rewrite is None:
            return INTERRUPTED
        command = _command(arguments.bag, [topics[1] for topics in rewrite.corrections])
        command += arguments.options
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
    """Return the corrections of the bag, which know all its fixed edges; None: a signal came.

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
    return rewrite


def _command(bag: str, static_topics: Sequence[str]) -> list[str]:
    """Return the command that plays the bag with its fixed edges out of the way."""
    rules = [f"{topic}:={topic}_recorded" for topic in static_topics]
    return ["ros2", "bag", "play", bag, "--remap", *rules]


def warnings_of(edges: Collection[str]) -> list[Finding]:
    """Return a finding about fixed edges that the bag sends on the topic of moving ones."""
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
        RosError: if ROS cannot start a node here.
    """
    from tfcompose.tf.ros.node import TFPublisher, open_node

    namespace = plan.ros.namespace or "/"
    with open_node("tfcompose_play", namespace) as node:
        publishers = []  # what is latched ends with its publisher
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
    """End the player, if it has not ended, and return the exit code."""
    if player.poll() is not None:
        return player.returncode if player.returncode >= 0 else 128 - player.returncode
    for number in (signal.SIGINT, signal.SIGKILL):
        with suppress(subprocess.TimeoutExpired):
            player.wait(_END_S)
            break
        player.send_signal(number)
    return INTERRUPTED
