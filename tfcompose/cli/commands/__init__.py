"""Commands: each module is one, with ``arguments`` and ``run``; its docstring is the help."""
