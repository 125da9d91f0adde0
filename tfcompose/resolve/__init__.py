"""Stage ``resolve``: a RobotSpec becomes a Robot with presets expanded, poses solved and owners given."""

from tfcompose.resolve.library import Library
from tfcompose.resolve.resolve import Resolved, resolve
from tfcompose.resolve.whole import Whole
from tfcompose.urdf.packages import Disk

__all__ = ["Disk", "Library", "Resolved", "Whole", "resolve"]
