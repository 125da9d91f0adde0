"""The robot file as the user wrote it.

YAML with the place of every value, and the language as pydantic models.

Must not import ``compiler``, ``tf``, ``guard``, ``launcher``, ``cli``, ``tools``, ``rclpy``.
"""
