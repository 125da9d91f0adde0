"""A node that sends a camera's frames from parameters, with Euler angles."""

from __future__ import annotations

import math

import rclpy
import tf_transformations
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from tf2_ros.static_transform_broadcaster import StaticTransformBroadcaster


class Camera(Node):
    def __init__(self) -> None:
        super().__init__("camera")
        defaults = {
            "camera_x": 0.1,
            "camera_y": 0.0,
            "camera_z": 0.2,
            "camera_pitch": 0.0,
            "base_frame": "base_link",
        }
        for name, default in defaults.items():
            self.declare_parameter(name, default)
        x, y, z, pitch, base = (self.get_parameter(name).value for name in defaults)
        self.static_broadcaster = StaticTransformBroadcaster(self)
        optical = tf_transformations.quaternion_from_euler(-math.pi / 2, 0, -math.pi / 2)
        self.static_broadcaster.sendTransform(
            self.transform(
                base,
                "camera_link",
                (x, y, z),
                tf_transformations.quaternion_from_euler(0.0, pitch, 0.0),
            )
        )
        for kind in ("color", "depth"):
            child = f"camera_{kind}_optical_frame"
            self.static_broadcaster.sendTransform(
                self.transform("camera_link", child, (0.0, 0.0, 0.0), optical)
            )

    def transform(
        self, parent: str, child: str, xyz: tuple[float, ...], quat: tuple[float, ...]
    ) -> TransformStamped:
        t = TransformStamped()
        t.header.stamp = self.get_clock().now().to_msg()
        t.header.frame_id, t.child_frame_id = parent, child
        to, rotation = t.transform.translation, t.transform.rotation
        to.x, to.y, to.z = xyz
        rotation.x, rotation.y, rotation.z, rotation.w = quat
        return t


def main() -> None:
    rclpy.init()
    rclpy.spin(Camera())
    rclpy.shutdown()


if __name__ == "__main__":
    main()
