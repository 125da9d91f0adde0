"""The ROS tool: tfcompose as a colcon package, a verb of ``ros2``, and a part of launch files."""
