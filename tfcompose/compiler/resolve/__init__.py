"""Resolution of a ``RobotSpec`` into a ``Robot``.

Resolution expands presets, includes parts, solves poses and assigns owners. An entry that cannot
be resolved is reported as a finding, and the robot is built without this entry.
"""

from tfcompose.compiler.resolve.presets import Library
from tfcompose.compiler.resolve.resolve import resolve
from tfcompose.compiler.urdf.packages import Disk

__all__ = ["Disk", "Library", "resolve"]
