"""Pictures of a TF tree as SVG, PNG, DOT and Mermaid, drawn from a ``Graph``.

Lengths are CSS px (1/96 inch).
"""

from tfcompose.compiler.draw.graph import Arrow, Graph, Group

__all__ = ["Arrow", "Graph", "Group"]
