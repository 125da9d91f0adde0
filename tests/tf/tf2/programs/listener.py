"""A listener as tutorials of tf2 teach it.

A node, a timer, a lookup, a wait in the callback, a point.
"""

from __future__ import annotations

import rclpy
import tf2_geometry_msgs
from geometry_msgs.msg import PointStamped
from rclpy.duration import Duration
from rclpy.node import Node
from tf2_ros import Buffer, TransformException, TransformListener


class LaserInBase(Node):
    def __init__(self) -> None:
        super().__init__("laser_in_base")
        self.tf_buffer = Buffer(cache_time=Duration(seconds=30.0))
        self.tf_listener = TransformListener(self.tf_buffer, self)
        self.timer = self.create_timer(0.05, self.on_timer)
        self.done = False

    def on_timer(self) -> None:
        now = rclpy.time.Time()
        try:
            t = self.tf_buffer.lookup_transform("base_link", "laser_link", now)
        except TransformException as error:
            print(f"not yet: {error}", flush=True)
            return
        position = t.transform.translation
        print(
            f"laser_link in base_link: ({position.x:.3f}, {position.y:.3f}, {position.z:.3f})"
            f" {t.header.frame_id} {t.child_frame_id}"
        )
        if not self.tf_buffer.can_transform(
            "odom", "laser_link", self.get_clock().now(), timeout=Duration(seconds=5.0)
        ):
            print("odom is not there", flush=True)
            return
        point = PointStamped()
        point.header.frame_id = "laser_link"
        point.header.stamp = rclpy.time.Time().to_msg()
        point.point.x = 2.0
        moved = self.tf_buffer.transform(point, "odom", timeout=Duration(seconds=1.0))
        print(
            f"point in {moved.header.frame_id}: ({moved.point.x:.3f}, {moved.point.y:.3f},"
            f" {moved.point.z:.3f})"
        )
        by_hand = tf2_geometry_msgs.do_transform_point(
            point, self.tf_buffer.lookup_transform("base_link", "laser_link", now)
        )
        print(
            f"point in {by_hand.header.frame_id}: ({by_hand.point.x:.3f}, {by_hand.point.y:.3f},"
            f" {by_hand.point.z:.3f})"
        )
        self.done = True


def main() -> None:
    rclpy.init()
    node = LaserInBase()
    while not node.done:
        rclpy.spin_once(node, timeout_sec=1.0)
    rclpy.shutdown()
    print("end", flush=True)


if __name__ == "__main__":
    main()
