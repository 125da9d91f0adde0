"""Stage ``resolve``: a RobotSpec becomes a Robot with presets expanded, poses solved and owners given."""

from tfcompose.resolve.parts import Collected
from tfcompose.resolve.presets import Library
from tfcompose.resolve.resolve import Resolved, resolve
from tfcompose.urdf.packages import Disk

__all__ = ["Collected", "Disk", "Library", "Resolved", "resolve"]
