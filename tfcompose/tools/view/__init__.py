"""Browser view of a robot, and editing of its mounts.

A new pose becomes edits of the robot file. ``edit`` is pure functions over the file's text;
``scene`` and ``panel`` use viser. The caller reads, compiles and writes files.
"""
