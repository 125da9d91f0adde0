"""Browser view of a robot, and editing of its mounts.

``scene`` and ``panel`` draw the robot and its controls with viser. ``session`` turns moved poses
into edits of the robot file. The command reads, compiles and writes the files.
"""
