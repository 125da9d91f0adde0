"""Turns a ``Robot`` without errors into files, as text.

Plan.json, URDF, xacro, parameters and pictures.

The same robot gives the same bytes.
"""

from tfcompose.compiler.emit.emit import descriptions_of, emit

__all__ = ["descriptions_of", "emit"]
