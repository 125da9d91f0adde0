"""Draws a TF tree from a plain description of frames and edges: SVG, PNG, DOT and Mermaid.

Lengths are CSS's px of 1/96 inch.
"""

from tfcompose.compiler.draw.graph import Arrow, Graph, Group

__all__ = ["Arrow", "Graph", "Group"]
