"""Turns a ``RobotSpec`` into a ``Robot``.

Presets expanded, parts included, poses solved, owners given.

What cannot be resolved is a finding, and the robot goes on without it.
"""

from tfcompose.compiler.resolve.presets import Library
from tfcompose.compiler.resolve.resolve import resolve
from tfcompose.compiler.urdf.packages import Disk

__all__ = ["Disk", "Library", "resolve"]
