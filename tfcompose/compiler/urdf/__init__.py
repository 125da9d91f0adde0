"""URDF and xacro: text to a ``Robot``, and a ``Robot`` to text.

``read`` returns XML elements with their spans, ``convert`` turns them into a robot, and ``lint``
reports on a file. ``write`` and ``macro`` write a robot, and ``read_back`` compares the written
text with the robot. ``expand`` runs xacro in a separate process, ``xacro_process``.
"""
