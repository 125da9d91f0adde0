"""Turns a ``RobotSpec`` into a ``Robot``: presets expanded, parts included, poses solved, owners given.

What cannot be resolved is a finding, and the robot goes on without it. Must not import ``check``, ``emit``, ``cli``: a
robot is judged when it is there.
"""

from tfcompose.resolve.presets import Library
from tfcompose.resolve.resolve import resolve
from tfcompose.resolve.resolved import Collected, Resolved
from tfcompose.urdf.packages import Disk

__all__ = ["Collected", "Disk", "Library", "Resolved", "resolve"]
