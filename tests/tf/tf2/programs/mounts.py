"""A node that sends two sensors' mounts, one tilted, and spins for late listeners."""

from __future__ import annotations

import math

import rclpy
import tf_transformations
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from tf2_ros.static_transform_broadcaster import StaticTransformBroadcaster


class Mounts(Node):
    def __init__(self) -> None:
        super().__init__("mounts")
        self.broadcaster = StaticTransformBroadcaster(self)
        laser, camera = self.mount("laser_link", 0.0, 0.3), self.mount("camera_link", 0.1, 0.2)
        tilt = tf_transformations.quaternion_from_euler(0, math.pi / 12, 0)
        camera.transform.rotation.x = tilt[0]
        camera.transform.rotation.y = tilt[1]
        camera.transform.rotation.z = tilt[2]
        camera.transform.rotation.w = tilt[3]
        self.broadcaster.sendTransform([laser, camera])

    def mount(self, child: str, x: float, z: float) -> TransformStamped:
        t = TransformStamped()
        t.header.stamp = self.get_clock().now().to_msg()
        t.header.frame_id = "base_link"
        t.child_frame_id = child
        t.transform.translation.x = x
        t.transform.translation.z = z
        t.transform.rotation.w = 1.0
        return t


def main() -> None:
    rclpy.init()
    rclpy.spin(Mounts())
    rclpy.shutdown()


if __name__ == "__main__":
    main()
