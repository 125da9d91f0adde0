"""Export of a plan for other launchers: systemd, Docker Compose, Kubernetes and ROS 2 launch.

The exporting function of each format returns the files to write. It also returns a sentence for
each property of the plan that the files do not keep. Exports read the plan and not the robot file.
Only ``launch_arguments`` reads the robot file, to find its arguments.
"""
