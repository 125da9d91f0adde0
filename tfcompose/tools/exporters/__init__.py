"""Turns a plan into files for other launchers: systemd units, a compose file, a ROS 2 launch file.

Each module is one format. It returns the files, and sentences about what of the plan they do not
keep. Must not import ``model``, ``resolve``, ``launcher``: exports know the plan, not the robot.
"""
