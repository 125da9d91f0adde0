"""Against ROS's own serialisation."""

import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from tfcompose.launcher.publishers.joint_mover import positions_of
from tfcompose.tf.ros.joint_codec import encode_names, fill, read_names

NAMES = [[], ["a"], ["left", "grippér"], [f"joint_{n}" for n in range(11)]]


@pytest.mark.parametrize("names", NAMES, ids=len)
@pytest.mark.parametrize("frame", ["", "b", "base_link"])
def test_what_ros_writes_is_read(names: list[str], frame: str) -> None:
    positions = [0.5 * n for n in range(len(names))]
    message = JointState(name=names, position=positions, velocity=[3.0] * len(names))
    message.header.frame_id, message.header.stamp.sec, message.header.stamp.nanosec = frame, 7, 9
    data = serialize_message(message)
    joint_names = read_names(data)
    assert (joint_names.names, joint_names.stamp_ns(data)) == (tuple(names), 7_000_000_009)
    assert joint_names.fit(data)
    assert list(positions_of(joint_names, data)) == positions


@pytest.mark.parametrize("names", NAMES, ids=len)
def test_what_is_encoded_ros_reads(names: list[str]) -> None:
    positions = [0.5 * n for n in range(len(names))]
    data = encode_names(names)
    fill(data, 7_000_000_009, positions)
    message = deserialize_message(bytes(data), JointState)
    assert (message.name, list(message.position)) == (names, positions)
    assert (message.header.stamp.sec, message.header.stamp.nanosec, message.header.frame_id) == (
        7,
        9,
        "",
    )
    assert len(message.velocity) == len(message.effort) == 0
