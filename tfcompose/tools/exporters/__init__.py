"""Exports of a plan for other launchers: systemd units, a compose file, a ROS 2 launch file.

Each module is one format. It returns the files, and a sentence for each property of the plan that
they lose. Must not import ``model``, ``resolve``, ``launcher``: exports know the plan, not the
robot.
"""
