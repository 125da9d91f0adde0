"""Imports of ``rclpy.time`` and ``rclpy.duration``, which tf2_ros also imports.

Programs rely on this, because they use ``rclpy.time.Time`` after only ``import rclpy``.
"""

import rclpy.duration
import rclpy.time

__all__ = ["rclpy"]
