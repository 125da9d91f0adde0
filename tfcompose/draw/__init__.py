"""Draws a TF tree from a plain description of frames and edges: SVG, PDF, PNG, DOT and Mermaid.

Lengths are points of 1/72 inch. Must not import ``model``, ``plan``, ``render``: a graph comes from whoever has one.
"""

from tfcompose.draw.graph import Arrow, Graph, Group

__all__ = ["Arrow", "Graph", "Group"]
