"""Turns descriptions and launch files into the text of a robot file.

Of a URDF, ``sensors`` recognises presets, ``omitted`` lists what a robot file cannot hold, and
``robot_file`` writes the text. Readers of what starts processes (``shell``, ``launch``) fill a
``draft``, in which ``programs`` have their entries. Launch files are read in a process of its own
(``launch_process``): by ROS's launch, whose actions ``launch_recorder`` records, and those of
ROS 1 by ``launch_ros1``. Both give the same records. A text of which parts are known only at the
build is a ``texts.Text``.
"""
