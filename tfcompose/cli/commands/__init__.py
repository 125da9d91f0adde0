"""The commands: each module is one, with ``arguments`` and ``run``, and its docstring is the help."""
