"""The live tree: nodes, graph, TF messages, observers, bags, and the tf2 stand-in.

Must not import ``spec``, ``compiler``, ``guard``, ``launcher``, ``cli``, ``tools``, ``pydantic``,
``yaml``.
"""
