"""A plain rclpy node /rover/plain that answers each joint state: ``plain_joints.py JOINTS``.

The answer is ready as bytes: the node reads and computes nothing.
"""

from __future__ import annotations

import contextlib
import sys

import rclpy
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import JointState

from tfcompose.tf.ros.tf_codec import Template
from tfcompose.tf.ros.typesupport import tf_message_type


def main(joints: int) -> None:
    """Answer until the process is stopped."""
    rclpy.init()
    node = rclpy.create_node("plain", namespace="/rover")
    data = Template([(f"link_{n}", f"link_{n + 1}") for n in range(joints)]).data
    publisher = node.create_publisher(tf_message_type(), "/tf", 100)
    node.create_subscription(
        JointState, "joint_states", lambda _: publisher.publish(data), 10, raw=True
    )
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == "__main__":
    main(int(sys.argv[1]))
