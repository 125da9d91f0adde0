"""A node whose callback awaits a transform, with tf2's exceptions from tf2_py."""

from __future__ import annotations

import rclpy
import tf2_py as tf2
import tf2_ros
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time


class Approach(Node):
    def __init__(self) -> None:
        super().__init__("approach")
        self.buffer = tf2_ros.Buffer(node=self)
        self.listener = tf2_ros.TransformListener(self.buffer, self, spin_thread=False)
        self.timer = self.create_timer(0.05, self.on_timer)
        self.requested = self.done = False

    async def on_timer(self) -> None:
        if self.requested:
            return
        self.requested = True
        try:
            self.buffer.lookup_transform("odom", "no_such_frame", Time())
        except (tf2.LookupException, tf2.ExtrapolationException) as error:
            print(type(error).__name__)
        soon = self.get_clock().now() + Duration(seconds=0.2)
        t = await self.buffer.lookup_transform_async("odom", "laser_link", soon)
        print(
            f"then laser_link is at {t.transform.translation.x:.3f} in {t.header.frame_id}",
            flush=True,
        )
        self.done = True


def main() -> None:
    rclpy.init()
    node = Approach()
    future = node.buffer.wait_for_transform_async("odom", "laser_link", Time())
    rclpy.spin_until_future_complete(node, future)
    print(f"now laser_link is at {future.result().transform.translation.x:.3f}", flush=True)
    while not node.done:
        rclpy.spin_once(node, timeout_sec=1.0)
    rclpy.shutdown()
    print("end", flush=True)


if __name__ == "__main__":
    main()
