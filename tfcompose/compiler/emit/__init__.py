"""Files, as text, from a ``Robot`` without errors.

plan.json, URDF, xacro, parameters and pictures. The same robot gives the same bytes.
"""

from tfcompose.compiler.emit.emit import descriptions_of, emit

__all__ = ["descriptions_of", "emit"]
