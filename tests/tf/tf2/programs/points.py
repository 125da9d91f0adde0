"""A node that looks up where each cloud was taken, with a wait, and moves it by numpy."""

from __future__ import annotations

import numpy as np
import rclpy
import tf2_py as tf2
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2, PointField
from tf2_ros import Buffer, TransformListener
from tf2_sensor_msgs import do_transform_cloud, transform_points


class PointsInBase(Node):
    def __init__(self) -> None:
        super().__init__("points_in_base")
        self.tf_buffer = Buffer()
        self.tf_listener = TransformListener(self.tf_buffer, self)
        self.subscription = self.create_subscription(
            PointCloud2, "/camera/depth/points", self.on_cloud, 10
        )
        self.publisher = self.create_publisher(PointCloud2, "/camera/depth/points", 10)
        self.timer = self.create_timer(0.1, self.send)
        self.done = False

    def send(self) -> None:
        cloud = PointCloud2(height=1, width=1, point_step=12, row_step=12, is_dense=True)
        cloud.header.frame_id = "camera_depth_optical_frame"
        cloud.header.stamp = self.get_clock().now().to_msg()
        cloud.fields = [
            PointField(name=name, offset=4 * i, datatype=7, count=1)
            for i, name in enumerate("xyz")
        ]
        cloud.data = np.array([0, 0, 2], np.float32).tobytes()
        self.publisher.publish(cloud)

    def on_cloud(self, msg: PointCloud2) -> None:
        try:
            transform = self.tf_buffer.lookup_transform(
                "base_link",
                msg.header.frame_id,
                msg.header.stamp,
                timeout=rclpy.duration.Duration(seconds=0.1),
            )
        except tf2.TransformException:
            return
        moved = np.frombuffer(do_transform_cloud(msg, transform).data, np.float32)
        same = transform_points(np.array([[0.0, 0.0, 2.0]]), transform.transform)
        print([round(float(number), 3) for number in moved], np.allclose(moved, same), flush=True)
        self.done = True


def main() -> None:
    rclpy.init()
    node = PointsInBase()
    while not node.done:
        rclpy.spin_once(node, timeout_sec=1.0)
    rclpy.shutdown()
    print("end", flush=True)


if __name__ == "__main__":
    main()
