"""Import of URDF, launch files, scripts and running robots as robot files.

For a URDF, ``sensors`` recognises presets, ``unsupported`` lists the parts that a robot file
cannot express, and ``robot_file`` writes the text. The readers of launch files and scripts,
``launch`` and ``shell``, add entries to a ``draft``; ``executables`` makes these entries.

A separate process, ``launch_process``, reads launch files. For ROS 2, it runs ROS's own launch,
and ``launch_recorder`` records the actions. For ROS 1, it runs ``launch_ros1``. Both write the
same records. A ``texts.Text`` is a text with parts that are known only when the robot is built.
"""
