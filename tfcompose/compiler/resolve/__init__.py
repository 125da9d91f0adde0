"""Resolution of a ``RobotSpec`` into a ``Robot``.

Expand presets, include parts, solve poses, assign owners. Anything that cannot be resolved is a
finding, and the robot continues without it.
"""

from tfcompose.compiler.resolve.presets import Library
from tfcompose.compiler.resolve.resolve import resolve
from tfcompose.compiler.urdf.packages import Disk

__all__ = ["Disk", "Library", "resolve"]
