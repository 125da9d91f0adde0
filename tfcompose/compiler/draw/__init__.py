"""Draws a TF tree from a plain description of frames and edges: SVG, PDF, PNG, DOT and Mermaid.

Lengths are points of 1/72 inch.
"""

from tfcompose.compiler.draw.graph import Arrow, Graph, Group

__all__ = ["Arrow", "Graph", "Group"]
