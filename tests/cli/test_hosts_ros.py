"""Two launchers with two hosts' shares of one plan, in one ROS domain."""

import json
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.cli import tfcompose_in
from tests.support.processes import Started
from tests.support.robots import ON_TWO_HOSTS
from tests.support.waiting import offences, until

pytestmark = pytest.mark.ros


def ps() -> dict[str, dict[str, str]]:
    robots = json.loads(tfcompose_in(Path.cwd(), "ps", "--format", "json").stdout or "[]")
    return {
        robot["name"].partition("@")[0]: {
            process["name"]: process["state"] for process in robot["processes"]
        }
        for robot in robots
    }


def test_two_hosts_start_their_shares_and_each_receives_the_entire_tree(
    start: Callable[..., Started], tmp_path: Path
) -> None:
    file = tmp_path / "rover.yaml"
    file.write_text(
        ON_TWO_HOSTS.replace("robot: rover", "robot: rover\nros: {discovery: localhost}"), "utf-8"
    )
    main = start("up", file, "-o", tmp_path / "a")
    main.until_says("expecting arm_drive (/arm_drive)")
    main.until_says("live  drive")
    jetson = start("up", file, "--host", "jetson", "-o", tmp_path / "b")
    assert until(
        lambda: (
            "tree complete: 3 edges" in main.output and "tree complete: 3 edges" in jetson.output
        )
    ), main.output + jetson.output
    shares = {
        "rover": {
            "static": "running",
            "drive": "running",
            "arm_drive": "expected",
            "guard": "running",
        },
        "rover.jetson": {
            "static": "expected",
            "drive": "expected",
            "arm_drive": "running",
            "guard": "running",
        },
    }
    assert ps() == shares
    assert offences(main.output + jetson.output) == []
    assert jetson.output.index("live  drive") < jetson.output.index("started arm_drive"), (
        "it waits for another host's"
    )
    assert jetson.end() == 0
    assert until(lambda: "TF804" in main.output), (
        "the guard on one host sees that the other's owner fell silent"
    )
    assert main.end() == 0


#: A node that sends its own edge, and another machine's.
LIAR = """
import signal, sys, time
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.ros.node import TFPublisher, open_node
signal.signal(signal.SIGINT, lambda *_: sys.exit())
with open_node("arm_drive", "/", args=sys.argv[2:]) as node:
    publisher = TFPublisher(node, static=False)
    while True:
        for ends in (("base_link", "arm"), ("odom", "base_link")):
            publisher.publish(encode([SentTransform(time.time_ns(), *ends, (0.0, 0.0, 5.0), (0.0, 0.0, 0.0, 1.0))]))
        time.sleep(0.05)
"""  # noqa: E501 (a text as its reader has it)


def test_two_strict_guards_each_filter_their_machine_and_pass_on_to_all(
    start: Callable[..., Started], tmp_path: Path
) -> None:
    (tmp_path / "liar.py").write_text(LIAR, "utf-8")
    file = tmp_path / "rover.yaml"
    run = f"run: [{sys.executable}, {tmp_path / 'liar.py'}]"
    text = ON_TWO_HOSTS.replace(
        "simulate: {fixed: {xyz: [0, 0, 1]}, rate: 20 Hz}, host", f"{run}, node: arm_drive, host"
    )
    text = text.replace("robot: rover", "robot: rover\nros: {discovery: localhost}")
    file.write_text(f"{text}guard: {{mode: strict}}\n", "utf-8")
    main = start("up", file, "-o", tmp_path / "a")
    main.until_says("live  drive")
    jetson = start("up", file, "--host", "jetson", "-o", tmp_path / "b")
    assert until(
        lambda: (
            "tree complete: 3 edges" in main.output and "tree complete: 3 edges" in jetson.output
        )
    ), main.output + jetson.output
    jetson.until_says("error[TF801] odom → base_link is published by /arm_drive;")
    words = [sys.executable, "-m", "tfcompose", "verify", str(file), "--live", "--for", "3"]

    def wrong() -> str:
        done = processes.run(words)
        return done.stdout + done.stderr if done.returncode else ""

    assert until(lambda: not wrong()), wrong()
    assert offences(main.output) == [], "it was held back"
    jetson.until_says("note: held back")
    assert (jetson.end(), main.end()) == (0, 0)


def test_a_share_that_is_live_on_another_machine_is_refused(
    start: Callable[..., Started], tmp_path: Path
) -> None:
    """Started by another supervisor; of another machine's launcher only nodes are visible."""
    file = tmp_path / "rover.yaml"
    file.write_text(
        ON_TWO_HOSTS.replace("robot: rover", "robot: rover\nros: {discovery: localhost}"), "utf-8"
    )
    assert start("build", file, "-o", tmp_path / "a").process.wait(60) == 0
    elsewhere = start("exec", tmp_path / "a" / "plan.json", "drive")
    elsewhere.until_says("simulated at")
    up = start("up", file, "-o", tmp_path / "b", "--settle", 10)
    assert up.process.wait(60) == 1
    up.until_says("ended with exit code 1")
    (line,) = [line for line in up.output.splitlines() if "error[TF807]" in line]
    assert all(name in line for name in ("odom → base_link", "another /drive"))
    assert "started static" not in up.output
    assert elsewhere.end() == 0
