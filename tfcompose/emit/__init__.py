"""Turns a ``Robot`` without errors into files, as text: plan.json, URDF, xacro, parameters and pictures.

The same robot gives the same bytes. Must not import ``language``, ``resolve``, ``check``, ``cli``: it writes nothing to
disk and judges nothing.
"""

from tfcompose.emit.emit import described, emit

__all__ = ["described", "emit"]
