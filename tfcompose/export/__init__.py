"""A built plan for other launchers, one format a file: systemd units, a compose file, a ROS 2 launch file.

Each returns the files and sentences about what of the plan they do not keep. Exports know the plan, not the robot.
"""
