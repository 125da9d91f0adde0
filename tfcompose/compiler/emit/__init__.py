"""Built files, as text, of a ``Robot`` without errors.

These are plan.json, URDF, xacro, parameter files and pictures. The same robot always gives the
same bytes.
"""

from tfcompose.compiler.emit.emit import descriptions_of, emit

__all__ = ["descriptions_of", "emit"]
