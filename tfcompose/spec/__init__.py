"""The robot file as the user wrote it.

``load`` reads YAML with the place of every value. ``language`` has the pydantic models.

Must not import ``compiler``, ``tf``, ``guard``, ``launcher``, ``cli``, ``tools``, ``rclpy``.
"""
