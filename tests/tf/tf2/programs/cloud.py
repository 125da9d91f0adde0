"""A node that looks up where each point cloud was taken, and moves the cloud.

Its waits are in the callback.
"""

from __future__ import annotations

import sys

import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2, PointField
from tf2_ros import (
    Buffer,
    ConnectivityException,
    ExtrapolationException,
    LookupException,
    TransformListener,
)


class CloudMover(Node):
    def __init__(self) -> None:
        super().__init__("cloud_mover")
        self.tf_buffer = Buffer()
        self.tf_listener = TransformListener(
            self.tf_buffer, self, spin_thread="--thread" in sys.argv
        )
        self.subscription = self.create_subscription(PointCloud2, "points", self.on_cloud, 10)
        self.publisher = self.create_publisher(PointCloud2, "points", 10)
        self.timer = self.create_timer(0.1, self.send)
        self.done = False

    def send(self) -> None:
        cloud = PointCloud2(height=1, width=1, point_step=16, row_step=16, is_dense=True)
        cloud.header.frame_id = "laser_link"
        cloud.header.stamp = self.get_clock().now().to_msg()
        cloud.fields = [
            PointField(name=name, offset=4 * index, datatype=PointField.FLOAT32, count=1)
            for index, name in enumerate("xyz")
        ]
        cloud.data = bytes((0, 0, 0, 64)) + bytes(8) + b"keep"
        self.publisher.publish(cloud)

    def on_cloud(self, cloud: PointCloud2) -> None:
        if self.done:
            return
        try:
            t = self.tf_buffer.lookup_transform(
                "odom", cloud.header.frame_id, cloud.header.stamp, timeout=Duration(seconds=3.0)
            )
        except (LookupException, ConnectivityException, ExtrapolationException) as error:
            print(f"not yet: {error}", flush=True)
            return
        moved = self.tf_buffer.transform(cloud, "odom")
        print(
            f"cloud in {moved.header.frame_id}: {t.transform.translation.x:.3f}"
            f" {bytes(moved.data)[-4:].decode()}"
        )
        print(
            f"same time: {moved.header.stamp == cloud.header.stamp == t.header.stamp}", flush=True
        )
        self.done = True


def main() -> None:
    rclpy.init()
    node = CloudMover()
    while not node.done:
        if "--thread" in sys.argv:
            node.get_clock().sleep_for(Duration(seconds=0.05))
        else:
            rclpy.spin_once(node, timeout_sec=1.0)
    node.tf_listener.unregister()
    rclpy.shutdown()
    print("end", flush=True)


if __name__ == "__main__":
    main()
