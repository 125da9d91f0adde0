"""Turns a URDF into the text of a robot file, for ``tfcompose import``.

``convert`` recognises sensors by their presets and lists what a robot file cannot hold; ``robot_file`` writes the text.
Must not import ``cli``, ``emit``, ``plan``.
"""
