"""Turns what robots are described and started by into the text of a robot file, for ``tfcompose import``.

Of a URDF, ``sensors`` recognises presets, ``omitted`` lists what a robot file cannot hold, and ``robot_file`` writes
the text. Readers of what starts processes (``shell``) fill a ``draft``, in which ``programs`` have their entries.
Must not import ``cli``, ``emit``, ``plan``.
"""
