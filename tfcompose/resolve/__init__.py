"""Stage ``resolve``: a RobotSpec becomes a Robot with presets expanded, poses solved and owners given."""

from tfcompose.resolve.presets import Library
from tfcompose.resolve.resolve import Resolved, resolve
from tfcompose.resolve.urdf import robot_of_urdf

__all__ = ["Library", "Resolved", "resolve", "robot_of_urdf"]
