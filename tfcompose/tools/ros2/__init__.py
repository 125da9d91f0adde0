"""Integration with ROS: the verb ``ros2 tfcompose``, colcon packages, and launch actions."""
