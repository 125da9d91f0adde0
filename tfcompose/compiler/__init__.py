"""Compilation of a robot file.

Resolve the spec into a robot, check it, and emit URDF, plan and pictures. ``compile`` has the
whole sequence. Must not import ``tf``, ``guard``, ``launcher``, ``cli``, ``tools``, ``rclpy``.
"""
