"""A node whose timer sends a base that drives in a circle of 1 m."""

from __future__ import annotations

import math

import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from tf2_ros import TransformBroadcaster


class Circle(Node):
    def __init__(self) -> None:
        super().__init__("circle")
        self.broadcaster = TransformBroadcaster(self)
        self.timer = self.create_timer(0.05, self.on_timer)
        self.angle = 0.0

    def on_timer(self) -> None:
        self.angle += 0.025
        t = TransformStamped()
        t.header.stamp = self.get_clock().now().to_msg()
        t.header.frame_id = "odom"
        t.child_frame_id = "base_link"
        t.transform.translation.x = math.cos(self.angle)
        t.transform.translation.y = math.sin(self.angle)
        heading = self.angle + math.pi / 2
        t.transform.rotation.z = math.sin(heading / 2)
        t.transform.rotation.w = math.cos(heading / 2)
        self.broadcaster.sendTransform(t)


def main() -> None:
    rclpy.init()
    rclpy.spin(Circle())
    rclpy.shutdown()


if __name__ == "__main__":
    main()
