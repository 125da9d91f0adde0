"""The live tree: a buffer with tf2's semantics, its listener, and the commands that look at the tree.

``Buffer``, ``TransformListener`` and the exceptions are called as tf2_ros's are, so that a Python program that listens
to TF needs other imports and nothing else.
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
from tfcompose.observe.listener import Listener, TransformListener

__all__ = ["Buffer", "Listener", "TransformListener"]
__all__ += ["ConnectivityException", "ExtrapolationException", "InvalidArgumentException", "LookupException"]
__all__ += ["TimeoutException", "TransformException"]
