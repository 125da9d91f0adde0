"""Access to ROS: nodes, QoS, the bytes of TFMessage, the graph, and services.

Only this package imports rclpy. Stamps are in nanoseconds. Poses are metres and quaternions x, y,
z, w. Must not import ``live``, ``model``, ``tf2``, ``verdict``: it makes no observations itself.
"""
