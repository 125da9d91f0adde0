"""Pictures of a TF tree, from a plain description of frames and edges: SVG, PDF, PNG, DOT and Mermaid."""

from tfcompose.draw.graph import Arrow, Graph, Group

__all__ = ["Arrow", "Graph", "Group"]
