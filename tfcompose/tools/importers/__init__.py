"""Import of descriptions and launch files: the text of a robot file.

For a URDF, ``sensors`` recognises presets, ``omitted`` lists what a robot file cannot hold, and
``robot_file`` writes the text. Readers of launch files and scripts (``launch``, ``shell``) fill a
``draft`` with the entries that ``programs`` makes. Launch files are read in a separate process
(``launch_process``): by ROS's launch, whose actions ``launch_recorder`` records, and those of ROS
1 by ``launch_ros1``. Both give the same records. A text with parts that are known only at build
time is a ``texts.Text``.
"""
