"""Stage ``resolve``: a RobotSpec becomes a Robot with presets expanded, poses solved and owners given.

``tfcompose.resolve.urdf`` makes one of a URDF that somebody else wrote.
"""

from tfcompose.resolve.library import Library
from tfcompose.resolve.packages import Disk
from tfcompose.resolve.resolve import Resolved, resolve
from tfcompose.resolve.whole import Whole

__all__ = ["Disk", "Library", "Resolved", "Whole", "resolve"]
