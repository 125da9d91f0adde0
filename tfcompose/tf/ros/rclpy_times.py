"""``rclpy.time`` and ``rclpy.duration``, which tf2_ros loads.

So programs say ``rclpy.time.Time`` after ``import rclpy`` alone.
"""

import rclpy.duration
import rclpy.time

__all__ = ["rclpy"]
