"""URDF and xacro, both ways: text to a ``Robot``, a ``Robot`` to text.

``read`` returns elements with their spans, ``convert`` makes a robot of them, ``lint`` reports on
a file; ``write`` and ``macro`` write a robot, ``read_back`` compares the result with it.
``expand`` runs xacro in a separate process, ``xacro_process``.
"""
