"""``tfcompose up`` as people run it: a process with children, signals, strangers, and ends."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.robots import EXTERNAL, ROVER
from tests.support.running_robot import RunningRobot
from tests.support.waiting import gone, until

pytestmark = pytest.mark.ros

#: Publishes odom → base_link on /tf without end.
ROGUE = """
import time
from tfcompose.tf.ros.tf_codec import Template
from tfcompose.tf.ros.node import TFPublisher, open_node
template = Template([("odom", "base_link")])
with open_node("rogue", "/strange") as node:
    publisher = TFPublisher(node, static=False)
    print("sends", flush=True)
    while True:
        template.set_stamp(time.time_ns())
        publisher.publish(template.data)
        time.sleep(0.02)
"""
#: Lets nobody but rclpy, which needs it, import yaml, and nobody pydantic.
WITHOUT_COMPILER = """
import sys
class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name == "pydantic" or (name == "yaml" and "rclpy" not in sys.modules):
            raise ImportError(name + " is not there")
sys.meta_path.insert(0, Blocker())
"""


def first_on_the_path(folder: Path) -> dict[str, str]:
    """Return the environment in which this folder's modules come first."""
    before = os.environ.get("PYTHONPATH")
    return {"PYTHONPATH": os.pathsep.join([str(folder), *([before] if before else [])])}


@pytest.fixture
def up(
    domain: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[..., RunningRobot]]:
    """Run ``tfcompose up`` on this text, or on these words, in a folder of the test's own."""
    assert domain
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runtime").mkdir(mode=0o700)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "runtime"))
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
    running: list[RunningRobot] = []

    def run(text: str | None, *words: str, **environment: str) -> RunningRobot:
        if text is not None:
            (tmp_path / "rover.yaml").write_text(text, encoding="utf-8")
            words = ("rover.yaml", *words)
        output = f"output{len(running)}.txt"
        running.append(RunningRobot(tmp_path, *words, env=environment, output=output))
        return running[-1]

    yield run
    for robot in running:
        if robot.popen.poll() is None:
            below = robot.below()
            robot.popen.kill()
            robot.popen.wait()
            assert all(until(partial(gone, process)) for process in below)
        assert "KeyboardInterrupt" not in robot.text, (
            "a process of its own was interrupted before it could handle it"
        )


@pytest.fixture
def rogue(domain: object) -> Iterator[Callable[[], subprocess.Popen[str]]]:
    """Let somebody publish odom → base_link."""
    assert domain
    running: list[subprocess.Popen[str]] = []

    def run() -> subprocess.Popen[str]:
        popen = processes.start([sys.executable, "-c", ROGUE], stdout=subprocess.PIPE)
        running.append(popen)
        assert popen.stdout
        assert popen.stdout.readline() == "sends\n"
        return popen

    yield run
    for popen in running:
        popen.kill()
        popen.communicate()


@pytest.mark.parametrize("seconds", [0.0, 0.2, 0.5, 1.2])
def test_ctrl_c_during_the_start_leaves_no_process_and_no_traceback(
    up: Callable[..., RunningRobot], seconds: float
) -> None:
    """0 is a clean stop; 130 before anything was started."""
    robot = up(ROVER)
    assert until(robot.below), "nobody builds"
    time.sleep(seconds)
    below, has_started = robot.below(), "| started " in robot.text
    robot.popen.send_signal(signal.SIGINT)
    assert robot.wait() in ((0,) if has_started else (0, 130))
    assert until(lambda: all(map(gone, below)))
    assert "Traceback" not in robot.text


def test_own_processes_are_forked_from_the_launcher_and_end_with_it(
    up: Callable[..., RunningRobot],
) -> None:
    robot = up(ROVER)
    robot.says("tree complete")
    processes = robot.below()
    # The kernel gives each program that is executed random bytes at an address of its own.
    vector = Path(f"/proc/{robot.popen.pid}/auxv").read_bytes()
    forked = [
        process
        for process in processes
        if Path(f"/proc/{process.pid}/auxv").read_bytes() == vector
    ]
    assert {process.cmdline()[2] for process in forked} >= {"guard", "static"}
    assert all(process.environ()["TFCOMPOSE_RUN"] for process in forked)
    robot.popen.kill()
    assert until(lambda: all(map(gone, processes)))


def test_policy_stop_ends_everything_with_1_and_names_the_offender_once(
    up: Callable[..., RunningRobot], rogue: Callable[[], object]
) -> None:
    robot = up(ROVER + "guard: {on_violation: stop}\n")
    robot.says("tree complete")
    below = robot.below()
    rogue()
    assert robot.wait() == 1
    assert [process for process in below if not gone(process)] == []
    (line,) = [line for line in robot.text.splitlines() if "error[TF801]" in line]
    assert all(name in line for name in ("odom → base_link", "/strange/rogue;", "drive (/drive)"))
    assert "stopping: TF801 foreign_publisher\n" in robot.text


def test_an_edge_with_a_publisher_is_refused_with_the_name_of_its_node(
    up: Callable[..., RunningRobot], rogue: Callable[[], object]
) -> None:
    rogue()
    robot = up(ROVER, "--settle", "40")  # what is found sooner is said at once
    assert robot.wait() == 1
    assert re.search(r"error\[TF807\] odom → base_link\b.* /strange/rogue\b", robot.text)
    assert re.findall(r"started (\w+)", robot.text) == ["guard"]


def test_equal_edges_of_another_robot_are_refused_and_a_signal_ends_with_0(
    up: Callable[..., RunningRobot],
) -> None:
    first = up(ROVER)
    first.says("tree complete: 2 edges live after ")
    second = up(ROVER.replace("robot: rover", "robot: other"), "--settle", "40")
    assert second.wait() == 1
    assert f"rover (pid {first.popen.pid}, since " in second.text
    assert second.text.index("isolate: topics") < second.text.index("started guard")
    assert re.search(
        r"error\[TF854\] (rover|other)@\d+ \(pid \d+, since [0-9:]+\) runs in this domain",
        second.text,
    )
    assert "isolate: topics" in second.text
    assert re.findall(r"started (\w+)", second.text) == ["guard"]
    below = first.below()
    assert {"guard", "static", "drive"} <= {process.cmdline()[-1] for process in below}
    first.popen.send_signal(signal.SIGTERM)
    assert first.wait() == 0
    assert [process for process in below if not gone(process)] == []
    assert first.text.splitlines()[-1].endswith("| ended")
    assert "SIGTERM" not in first.text.split("stopping: ", 1)[1].split("\n", 1)[1]


def test_two_simultaneous_starts_of_the_same_edges_do_not_pass_unreported(
    up: Callable[..., RunningRobot], tmp_path: Path
) -> None:
    """Each says it, or the later of the two, which has ended then."""
    (tmp_path / "other.yaml").write_text(ROVER.replace("robot: rover", "robot: other"))
    both = [up(ROVER), up(None, "other.yaml")]

    def ended() -> list[RunningRobot]:
        return [robot for robot in both if robot.popen.poll() is not None]

    def know() -> bool:
        return all("error[TF854]" in robot.text for robot in both)

    assert until(lambda: ended() or know()), [robot.text for robot in both]
    assert know() or all("error[TF854]" in robot.text for robot in ended()), [
        robot.text for robot in both
    ]


def test_an_external_owner_is_awaited_by_name_and_missing_at_the_end(
    up: Callable[..., RunningRobot],
) -> None:
    robot = up(EXTERNAL, "--for", "6")
    robot.says("waiting for drive (/diff_drive): odom → base_link")
    robot.says("live  static (/tfcompose_static): base_link → lidar  ")
    assert "expecting drive (/diff_drive)" in robot.text
    assert robot.wait() == 1
    assert re.search(r"error\[TF811\] drive\b.* odom → base_link", robot.text)


def test_a_built_plan_starts_without_yaml_and_pydantic(
    up: Callable[..., RunningRobot], tmp_path: Path
) -> None:
    (tmp_path / "rover.yaml").write_text(ROVER, encoding="utf-8")
    processes.run([sys.executable, "-m", "tfcompose", "build", "rover.yaml"], check=True)
    stubs = tmp_path / "stubs"
    stubs.mkdir()
    (stubs / "sitecustomize.py").write_text(WITHOUT_COMPILER)
    without = first_on_the_path(stubs)
    assert up(ROVER, **without).wait() != 0
    robot = up(None, "build/rover/plan.json", **without)
    robot.says("tree complete")
    assert robot.end() == 0


def test_without_a_guard_live_edges_are_reported_and_no_node_is_judged(
    up: Callable[..., RunningRobot], rogue: Callable[[], object]
) -> None:
    rogue()
    robot = up(ROVER, "--guard", "off", "--for", "5")  # it would be judged by then
    assert robot.wait() == 0
    assert "tree complete" in robot.text
    assert "TF80" not in robot.text


def test_observing_before_the_start_does_not_shorten_the_requested_time(
    up: Callable[..., RunningRobot],
) -> None:
    begun = time.monotonic()
    robot = up(ROVER, "--settle", "3", "--for", "4")
    late = {"TF804", "TF805"}  # a busy machine is, in truth
    code, codes = robot.wait(), set(re.findall(r"\[(TF\d+)\]", robot.text))
    assert code == bool(codes & late), robot.text
    assert not codes - late, robot.text
    assert time.monotonic() - begun >= 7
    assert "tree complete" in robot.text
