"""A robot with moving joints and no hardware.

Up moves it, and up again gives it another description while it runs.
"""

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
import yourdfpy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from tests.support import processes
from tests.support.waiting import until
from tfcompose.tf.ros.node import JOINT_STATES, LATCHED, Subscription, open_node
from tfcompose.tf.ros.sensor_data import JointStatePublisher
from tfcompose.tf.tf2 import Buffer, TransformListener

pytestmark = pytest.mark.ros

#: The chain is written from its end, and its names sort the other way, too.
ARM = """
tfcompose: 1
robot: arm
ros: {frame_prefix: "r1/"}
links: {base_link: {}, a: {}, b: {}, c: {}, d: {}, e: {}, mount: {parent: base_link}}
joints:
  a_last: {type: prismatic, parent: b, child: c, axis: [0, 1, 0], mimic: {joint: m_mid, multiplier: 0.5, offset: 0.1}, limit: {lower: -1, upper: 1, velocity: 1, effort: 1}}
  m_mid:  {type: revolute, parent: a, child: b, xyz: [0, 0, 0.2], axis: [0, 1, 0], mimic: {joint: z_first, multiplier: -2}, limit: {lower: -3, upper: 3, velocity: 1, effort: 1}}
  z_first: {type: revolute, parent: base_link, child: a, rpy: [0.3, 0, 0], limit: {lower: -1, upper: 1, velocity: 1, effort: 1}}
  lift: {type: prismatic, parent: base_link, child: d, axis: [0, 0, 1], limit: {lower: 0.1, upper: 0.5, velocity: 0.1, effort: 1}}
  wheel: {type: continuous, parent: base_link, child: e, xyz: [0, 0.3, 0], axis: [0, 1, 0]}
rules: {TF708: off}
processes: {states: {simulate: {joints: {z_first: 0.4, wheel: 100 deg}, rate: 50 Hz}}}
"""  # noqa: E501 (a text as its reader has it)


@pytest.fixture
def tfc(
    domain: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[..., str]]:
    """Run a command to its end in the test's folder, and end the robot with the test."""
    assert domain
    (tmp_path / "runtime").mkdir(mode=0o700)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "runtime"))
    (tmp_path / "robot.yaml").write_text(ARM, encoding="utf-8")

    def run(*words: str) -> str:
        command = [sys.executable, "-m", "tfcompose", *words]
        done = processes.run(command)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    yield run
    run("down")


def test_simulated_joints_move_and_a_new_description_arrives_at_run_time(
    tfc: Callable[..., str], tmp_path: Path
) -> None:
    """Positions are those of yourdfpy, from the description that was heard."""
    tfc("up", "--wait")
    with open_node("ears", "") as node, TransformListener(buffer := Buffer()):
        states = Subscription(node, JointState, "/joint_states", JOINT_STATES)
        texts = Subscription(node, String, "/robot_description", LATCHED)
        heard: list[str] = []

        def has_reported(count: int) -> bool:
            heard.extend(
                deserialize_message(message.data, String).data for message in texts.take()
            )
            return len(heard) == count

        assert until(lambda: has_reported(1))
        agrees(buffer, heard[0], _positions(states))
        (tmp_path / "robot.yaml").write_text(
            ARM.replace("xyz: [0, 0.3, 0]", "xyz: [0, 0.3, 0.7]"), encoding="utf-8"
        )
        assert "restarted: joints" in tfc("up", "--wait")
        assert until(lambda: has_reported(2)), "who listens gets the new one"
        assert until(lambda: _z(buffer) == pytest.approx(0.7))
        agrees(buffer, heard[1], _positions(states))


def test_a_fixed_mount_moves_and_no_joint_pauses(tfc: Callable[..., str], tmp_path: Path) -> None:
    tfc("up", "--wait")
    with open_node("ears", "") as node, TransformListener(buffer := Buffer()):
        texts = Subscription(node, String, "/robot_description", LATCHED)
        heard: list[Any] = []

        def has_come(count: int) -> bool:
            heard.extend(texts.take())
            return len(heard) == count

        assert until(lambda: has_come(1))
        moved = "mount: {parent: base_link, xyz: [0, 0, 0.7]}"
        text = ARM.replace("mount: {parent: base_link}", moved)
        (tmp_path / "robot.yaml").write_text(text, encoding="utf-8")
        assert tfc("up", "--wait").splitlines()[0].endswith("moved: r1/base_link → r1/mount")
        assert until(lambda: _z(buffer, "mount") == pytest.approx(0.7))
        assert until(lambda: has_come(2))
    (robot,) = json.loads(tfc("ps", "--format", "json"))
    restarts = {process["name"]: process["restarts"] for process in robot["processes"]}
    assert restarts == {"static": 0, "joints": 0, "states": 0, "guard": 0}


def test_a_second_sender_of_a_joint_is_named_while_it_sends(tfc: Callable[..., str]) -> None:
    tfc("up", "--wait")

    def codes() -> set[str]:
        (robot,) = json.loads(tfc("ps", "--format", "json"))
        return {entry["code"] for entry in robot["findings"]}

    assert codes() == set()
    with open_node("rogue", "") as node:
        rogue = JointStatePublisher(node, ["z_first", "weel"])

        def is_named() -> bool:
            rogue.publish(time.time_ns(), [0.0, 0.0])
            return codes() == {"TF860", "TF861"}

        assert until(is_named)
        verify = [sys.executable, "-m", "tfcompose", "verify", "--format", "json"]
        verifying = processes.start(verify, stdout=subprocess.PIPE)
        assert until(lambda: is_named() and verifying.poll() is not None)
        findings = json.loads(verifying.communicate()[0])
        assert {entry["code"] for entry in findings} == {"TF860", "TF861"}
        assert verifying.returncode == 1
    assert until(lambda: codes() == set())


def agrees(buffer: Buffer, description: str, positions: dict[str, float]) -> None:
    expected = {
        "z_first": 0.4,
        "m_mid": -0.8,
        "a_last": -0.3,
        "lift": 0.3,
        "wheel": 1.7453292519943295,
    }
    assert positions == pytest.approx(expected), (
        "mimics are sent, too; where 0 is out of the limits the middle counts"
    )
    model: Any = yourdfpy.URDF.load(
        BytesIO(description.encode()), load_meshes=False, build_scene_graph=True
    )
    model.update_cfg({name: positions[name] for name in ("z_first", "lift", "wheel")})
    frames = [f"r1/{name}" for name in "abde"]
    assert until(lambda: all(buffer.can_transform("r1/base_link", frame, 0) for frame in frames))
    for frame in frames:
        matrix = buffer.lookup_many("r1/base_link", frame, [0]).matrices()[0]
        assert matrix == pytest.approx(model.get_transform(frame.removeprefix("r1/")), abs=1e-9)
    # yourdfpy follows one step of a mimic only.
    slid = buffer.lookup("r1/b", "r1/c")[0]
    assert slid.xyz == pytest.approx((0.0, -0.3, 0.0))


def _z(buffer: Buffer, frame: str = "e") -> float:
    z: float = buffer.lookup("r1/base_link", f"r1/{frame}")[0].xyz[2]
    return z


def _positions(states: Subscription) -> dict[str, float]:
    positions: dict[str, float] = {}

    def come() -> bool:
        for received in states.take():
            message = deserialize_message(received.data, JointState)
            positions.update(zip(message.name, message.position, strict=True))
        return bool(positions)

    assert until(come)
    return positions
