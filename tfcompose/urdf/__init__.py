"""URDF and xacro, both ways: text to elements to a ``Robot``, a ``Robot`` to text.

``read`` gives elements with places, ``convert`` makes a robot of them, ``lint`` judges a file; ``write`` and ``macro``
write a robot, ``read_back`` compares what was written with it, ``expand`` runs xacro. Nothing here knows the robot
file's own language, nor what resolves it: ``resolve`` and ``importing`` import this folder, never the other way round.
"""
