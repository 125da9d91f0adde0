"""The live tree: a buffer with tf2's semantics, its listener, and the commands that look at the tree.

The names are those of tf2_ros and tf2_py, and called as theirs are, so that a Python program that listens to TF needs
other imports and nothing else. What tf2_geometry_msgs and tf2_sensor_msgs offer is in ``transforms``.
"""

from tfcompose.observe.buffer import (
    Buffer,
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)
from tfcompose.observe.core import BufferCore
from tfcompose.observe.exceptions import NotImplementedException, TypeException
from tfcompose.observe.interface import BufferInterface
from tfcompose.observe.listener import Listener, TransformListener
from tfcompose.observe.registration import ConvertRegistration, Stamped, TransformRegistration, convert

__all__ = ["Buffer", "BufferCore", "BufferInterface", "Listener", "TransformListener"]
__all__ += ["ConnectivityException", "ExtrapolationException", "InvalidArgumentException", "LookupException"]
__all__ += ["NotImplementedException", "TimeoutException", "TransformException", "TypeException"]
__all__ += ["ConvertRegistration", "Stamped", "TransformRegistration", "convert"]
