"""Access to ROS: nodes, QoS, the bytes of TFMessage, the graph, and services.

The only importer of rclpy. Stamps are nanoseconds; poses are metres and quaternions x, y, z, w.
Must not import ``live``, ``model``, ``tf2``, ``verdict``: it makes no observations itself.
"""
