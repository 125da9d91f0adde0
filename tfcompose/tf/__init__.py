"""The live tree: nodes, graph, TF messages, observers, bags, and tf2's buffer in Python.

Must not import ``spec``, ``compiler``, ``guard``, ``launcher``, ``cli``, ``tools``, ``pydantic``,
``yaml``.
"""
