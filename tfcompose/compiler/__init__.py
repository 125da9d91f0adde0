"""From a robot file to what is built.

Resolve the spec into a robot, check it, and emit URDF, plan and pictures.

``compile`` shows the whole way. Must not import ``tf``, ``guard``, ``launcher``, ``cli``,
``tools``, ``rclpy``.
"""
