"""A program without a class that looks up a camera's pose once a second.

Its listener has its own thread.
"""

from __future__ import annotations

import rclpy
import tf2_ros
from rclpy.duration import Duration
from rclpy.time import Time


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("camera_in_base")
    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer, node, spin_thread=True)
    while True:
        buffer.can_transform("base_link", "camera_link", Time(), Duration(seconds=1.0))
        try:
            stamped = buffer.lookup_transform("base_link", "camera_link", Time())
        except (
            tf2_ros.LookupException,
            tf2_ros.ConnectivityException,
            tf2_ros.ExtrapolationException,
        ):
            continue
        to, rotation = stamped.transform.translation, stamped.transform.rotation
        print(
            f"at ({to.x:.3f}, {to.y:.3f}, {to.z:.3f}) turned ({rotation.y:.3f}, {rotation.w:.3f})",
            flush=True,
        )
        break
    listener.unregister()
    rclpy.shutdown()
    print("end", flush=True)


if __name__ == "__main__":
    main()
