"""A plan with a stock robot_state_publisher, played by a node that does the same."""

import os
import stat
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rclpy.serialization import deserialize_message
from std_msgs.msg import String

from tests.support.processes import Started
from tests.support.waiting import until
from tfcompose.tf.ros.graph import UNKNOWN_NODE, writers
from tfcompose.tf.ros.node import LATCHED, Subscription, open_node

pytestmark = pytest.mark.ros

ROBOT = """
tfcompose: 1
robot: rover
ros: {state_publisher: stock, discovery: localhost, frame_prefix: r1/, namespace: rover}
links:
  base_link: {visual: {box: [1, 1, 1]}, inertial: {mass: 3}}
  wheel: {visual: {mesh: mesh.stl}}
joints: {wheel_joint: {type: continuous, parent: base_link, child: wheel}}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
  mast: {parent: base_link, xyz: [0, 0, 1]}
  swing: {parent: mast, owner: drive, rate: 20 Hz}
  lamp: {parent: swing, xyz: [0.1, 0, 0]}
processes:
  drive: {simulate: {fixed: {xyz: [0, 0, 0]}, rate: 20 Hz}}
  wheels: {simulate: {joints: zero, rate: 20 Hz}}
xml: {note: "<gazebo><a>it's: a \\"quote\\" # no comment \\u00e9</a></gazebo>"}
"""
#: Fixed joints once, moving ones with each joint state, floating ones never; and the description
#: on its topic.
STAND_IN = """#!{python}
import sys, xml.etree.ElementTree as ET
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from tfcompose.foundation.geometry import Pose, quat_from_rpy
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.ros.node import JOINT_STATES, latch, open_node
from tfcompose.foundation.signals import Stop
from tfcompose.tf.ros.node import Subscription, TFPublisher, wait
at = sys.argv.index("--ros-args")
with Stop() as stop, open_node("robot_state_publisher", "", args=sys.argv[at + 1:]) as node:
    for name, kind in (("robot_description", Parameter.Type.STRING), ("frame_prefix", Parameter.Type.STRING)):
        node.declare_parameter(name, kind)
    node.declare_parameter("publish_frequency", 20.0)
    text = node.get_parameter("robot_description").value
    prefix = node.get_parameter("frame_prefix").value
    assert node.get_parameter("publish_frequency").value == 1000.0
    description = latch(node, "robot_description", text)
    kinds = {{"fixed": [], "moving": [], "floating": []}}
    for joint in ET.fromstring(text).findall("joint"):
        kind = joint.get("type") if joint.get("type") in kinds else "moving"
        ends = [prefix + joint.find(end).get("link") for end in ("parent", "child")]
        origin = joint.find("origin").get if joint.find("origin") is not None else lambda key, other: other
        xyz, rpy = (tuple(map(float, origin(key, "0 0 0").split())) for key in ("xyz", "rpy"))
        kinds[kind].append([*ends, xyz, quat_from_rpy(*rpy)])
    still = [SentTransform(0, *fixed) for fixed in kinds["fixed"]]
    fixed, moving = TFPublisher(node, static=True), TFPublisher(node, static=False)
    fixed.publish(encode(still))
    states = Subscription(node, JointState, "joint_states", JOINT_STATES)
    while not stop.requested:
        wait(node, [states], None, stop)
        for received in states.take():
            stamp = deserialize_message(received.data, JointState).header.stamp
            stamp_ns = stamp.sec * 10**9 + stamp.nanosec
            moving.publish(encode([SentTransform(stamp_ns, *at_zero) for at_zero in kinds["moving"]]))
"""  # noqa: E501 (a text as its reader has it)


def test_the_tree_and_description_are_complete_and_each_owner_publishes(
    tmp_path: Path, start: Callable[..., Started], monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "prefix/lib/robot_state_publisher/robot_state_publisher"
    program.parent.mkdir(parents=True)
    program.write_text(STAND_IN.format(python=sys.executable))
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    (tmp_path / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    (tmp_path / "mesh.stl").write_text("solid\nendsolid\n")
    path = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    monkeypatch.chdir(tmp_path)
    up = start("up", AMENT_PREFIX_PATH=str(tmp_path / "prefix"), PYTHONPATH=path)
    up.until_says("tree complete")  # so everybody publishes
    heard, nodes = description()
    code = up.end()
    up.close()
    assert code == 0, up.output
    built = (tmp_path / "build/rover/robot.urdf").read_text("utf-8")
    assert heard == built.replace('"../../mesh.stl"', f'"file://{tmp_path}/mesh.stl"')
    assert 'type="floating"' not in built.partition('name="swing"')[0].partition("<joint")[2]
    assert nodes == {"/rover/tfcompose_static"}
    lines = [line for line in up.lines + up.errors if "error" in line]
    assert not [line for line in lines if "error[TF804]" not in line], (
        "a busy machine is late in truth"
    )


def description() -> tuple[str, set[str]]:
    """Return what is heard on the topic, and who sends it."""
    topic = "/rover/robot_description"
    with open_node("listener", "/strange") as node:
        subscription = Subscription(node, String, topic, LATCHED)
        received: list[Any] = []

        def comes() -> bool:
            received.extend(subscription.take())
            return bool(received)

        assert until(comes)
        assert until(lambda: all(writer.node != UNKNOWN_NODE for writer in writers(node, topic)))
        time.sleep(1.0)  # somebody else might be found later
        text = deserialize_message(received[0].data, String).data
        return text, {writer.node for writer in writers(node, topic)}
