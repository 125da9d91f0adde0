"""``rclpy.time`` and ``rclpy.duration``, which tf2_ros loads.

Programs rely on that: they use ``rclpy.time.Time`` after ``import rclpy`` alone.
"""

import rclpy.duration
import rclpy.time

__all__ = ["rclpy"]
