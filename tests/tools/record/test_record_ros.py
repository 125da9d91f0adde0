"""``tfcompose record`` of a real robot, and what other readers find in the recording."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader

from tests.support import processes
from tests.support.bags import STORE
from tests.support.cli import tfcompose_in
from tests.support.domains import Domain
from tests.support.running_robot import RunningRobot
from tests.support.waiting import TIMEOUT_S

pytestmark = pytest.mark.ros

ROBOT = """\
tfcompose: 1
robot: cart
links: {base_link: {}, wheel: {}}
joints:
  wheel_joint:
    {type: continuous, parent: base_link, child: wheel, xyz: [0, 0.2, 0], axis: [0, 1, 0]}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 50 Hz}
sensors:
  laser: {preset: generic/lidar2d, parent: base_link, xyz: [0.24, 0, 0.3]}
processes:
  drive: {simulate: {circle: {radius: 1 m, speed: 0.5 rad/s}, rate: 50 Hz}}
  wheels: {simulate: {joints: zero, rate: 50 Hz}}
"""


@pytest.fixture
def robot(tmp_path: Path, domain: Domain) -> Path:
    """Return the folder of a robot that runs, and is complete."""
    (tmp_path / "cart.yaml").write_text(ROBOT, "utf-8")
    running = RunningRobot(tmp_path, "cart.yaml", "--no-live", env=domain.environment)
    running.says("tree complete")
    return tmp_path


def record(folder: Path, domain: Domain, *words: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "tfcompose", "record", "cart.yaml", *words]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return processes.start(command, cwd=folder, env=domain.environment, **pipes)


def test_a_recording_has_the_robot_s_tree_and_is_a_test_of_it(robot: Path, domain: Domain) -> None:
    recording = record(robot, domain, "--for", "1.5 s", "-o", "golden.mcap")
    assert recording.wait(TIMEOUT_S) == 0, recording.communicate()
    with (robot / "golden.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    channels = {channel.topic: channel for channel in summary.channels.values()}
    assert set(channels) == {"/tf", "/tf_static", "/joint_states"}
    assert "transient_local" in channels["/tf_static"].metadata["offered_qos_profiles"]
    assert "transient_local" not in channels["/tf"].metadata["offered_qos_profiles"]
    with AnyReader([robot / "golden.mcap"]) as reader:
        poses = {
            transform.child_frame_id: transform.transform.translation
            for connection, _, data in reader.messages()
            if connection.msgtype == "tf2_msgs/msg/TFMessage"
            for transform in STORE.deserialize_cdr(data, connection.msgtype).transforms  # type: ignore[attr-defined]
        }
    assert set(poses) == {"base_link", "wheel", "laser_link"}
    assert (poses["laser_link"].x, poses["laser_link"].z) == (0.24, 0.3)
    assert poses["wheel"].y == 0.2
    done = tfcompose_in(robot, "init", "--tests", "cart.yaml", "--bag", "golden.mcap")
    assert done.returncode == 0, done.stderr
    done = tfcompose_in(robot, "test")
    assert done.returncode == 0, done.stdout


def test_ctrl_c_completes_the_recording(robot: Path, domain: Domain) -> None:
    """Without --for, into a folder as ros2 bag record writes it."""
    recording = record(robot, domain, "-o", "run")
    assert recording.stdout
    assert "run" in recording.stdout.readline(), "it says that it has begun"
    assert any(robot.glob(".run.*/run/run.mcap"))
    assert not (robot / "run").exists(), "there is a bag before it is complete"
    recording.send_signal(signal.SIGINT)
    assert recording.wait(TIMEOUT_S) == 0, recording.communicate()
    assert not list(robot.glob(".run.*"))
    with Reader(robot / "run") as reader:
        assert reader.message_count
        assert reader.topics.keys() & {"/tf", "/tf_static"}, "Ctrl-C may come before the first /tf"


def test_silence_leaves_no_recording(tmp_path: Path, domain: Domain) -> None:
    (tmp_path / "cart.yaml").write_text(ROBOT, "utf-8")
    recording = record(tmp_path, domain, "--for", "0.3", "-o", "golden.mcap")
    _, errors = recording.communicate(timeout=TIMEOUT_S)
    assert recording.returncode == 1
    assert "error[TF811]" in errors
    assert [file.name for file in tmp_path.iterdir()] == ["cart.yaml"]


@pytest.mark.parametrize(
    "words", [("-o", "cart.yaml"), ("-o", "none/golden.mcap"), ("--for", "x")]
)
def test_an_output_that_exists_or_has_no_folder_is_refused(
    words: tuple[str, ...], tmp_path: Path
) -> None:
    (tmp_path / "cart.yaml").write_text(ROBOT, "utf-8")
    done = tfcompose_in(tmp_path, "record", "cart.yaml", *words)
    assert done.returncode == 2
    assert done.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["cart.yaml"]
