"""Moves what is mounted: a new pose becomes edits of the robot file, by pure functions over its text.

Files are read, compiled and written by whoever calls it. Must not import ``cli``, ``guard``, ``launcher``, ``rclpy``,
``yaml``.
"""
