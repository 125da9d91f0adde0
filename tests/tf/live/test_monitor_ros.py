"""``tfcompose monitor`` on real nodes."""

import json
import signal
import subprocess
import sys
from typing import Any

import pytest

from tests.support import processes
from tests.support.doctor import OBSERVE_S, at_last
from tests.support.fake_nodes import sending

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("domain")]


def monitor(*words: str, code: int = 0) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tfcompose", "monitor", *words]
    done = processes.run(command)
    assert done.returncode == code, done.stdout + done.stderr
    return done


def rows(done: subprocess.CompletedProcess[str]) -> list[dict[str, Any]]:
    edges: list[dict[str, Any]] = json.loads(done.stdout)["edges"]
    return edges


def test_each_publisher_has_rate_and_delay_and_a_chain_has_a_net_delay() -> None:
    def are_named(seconds: float) -> None:
        rows_by_node = {
            each["publisher"]: each
            for each in rows(monitor("--for", str(seconds), "--format", "json"))
        }
        assert set(rows_by_node) == {"/drive", "/ekf", "/one", "/other"}
        for name, rate in (("one", sender()), ("other", second_sender())):
            assert rows_by_node[f"/{name}"]["child"] == "y"
            assert rows_by_node[f"/{name}"]["rate"] == pytest.approx(rate, rel=0.15)
        assert (
            0
            <= rows_by_node["/one"]["least_delay_s"]
            < 0.25
            <= rows_by_node["/other"]["least_delay_s"]
        )
        assert rows_by_node["/other"]["present"]

    def is_a_chain(seconds: float) -> None:
        done = json.loads(
            monitor("map", "/base_link", "--for", str(seconds), "--format", "json").stdout
        )
        assert done["chain"] == ["map", "odom", "base_link"]
        assert [(each["child"], each["publisher"]) for each in done["edges"]] == [
            ("odom", "/ekf"),
            ("base_link", "/drive"),
        ]
        assert done["most_behind"] == ["map", "odom"]
        assert 0.25 + 0.5 / 20 * 0.9 <= done["net_delay_s"] <= done["most_net_delay_s"]

    with (
        sending("drive", "odom", "base_link", rate=50),
        sending("ekf", "map", "odom", rate=20, late_s=0.25),
        sending("one", "x", "y", rate=50) as sender,
        sending("other", "x", "y", rate=20, late_s=0.25) as second_sender,
    ):
        at_last(are_named)
        at_last(is_a_chain)
    assert "A and B" in monitor("map", code=2).stderr


#: Starts a node as a machine does that is busy with something else.
SLOW = """
import sys, time
import tfcompose.tf.ros.node as node
quick = node._node
def slow(*words):
    made = quick(*words)
    time.sleep(4)
    return made
node._node = slow
from tfcompose.cli import main
sys.exit(main(sys.argv[1:]))
"""


def test_what_a_slow_start_takes_is_not_taken_from_the_time_of_observation() -> None:
    words = [sys.executable, "-c", SLOW, "doctor", "--for", "3"]

    def is_heard() -> bool:
        done = processes.run(words)
        return " 1 edge " in done.stdout

    with sending("drive", "odom", "base_link", rate=50):
        assert any(is_heard() for _ in OBSERVE_S)


def test_a_pipe_gets_a_table_each_second_and_a_signal_ends_it_with_0() -> None:
    command = [sys.executable, "-m", "tfcompose", "monitor", "--every", "0.2"]
    with (
        sending("drive", "odom", "base_link", rate=50),
        processes.start(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process,
    ):
        assert process.stdout
        for line in process.stdout:
            if line.startswith("odom → base_link") and "/drive" in line:
                break
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=60)
        assert process.returncode == 0
    assert errors == ""
