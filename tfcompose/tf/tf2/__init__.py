"""tf2's buffer and listener in Python, to be used on their own.

The names are those of tf2_ros and tf2_py, called as theirs are: a program that listens to TF needs
other imports and nothing else. The buffer needs only Python; arrays of poses and points need
numpy, and the listener needs rclpy. ::

    from tfcompose.foundation.geometry import Pose
    from tfcompose.tf.tf2 import Buffer, TransformException, TransformListener

    buffer = Buffer()
    # or: listener = TransformListener(buffer)
    buffer.set("base_link", "laser", Pose((0.2, 0.0, 0.3)), 0, static=True)
    try:
        # the newest; or lookup_transform for a message
        pose, stamp_ns = buffer.lookup("base_link", "laser")
    except TransformException as error:
        print(error)  # which edge is missing, or how many milliseconds too early or too late

- ``buffer``: ``Buffer``, which waits; ``core``: ``BufferCore``, which takes and gives messages
  without waiting; both extend ``pose_buffer``'s ``PoseBuffer``, which has numbers in and out
- ``cache``, ``poses``, ``velocity``: samples of an edge, the chain between two frames, and the
  arithmetic
- ``messages``: times, TransformStamped, the functions of tf2_geometry_msgs and
  tf2_sensor_msgs, and your own types
- ``arrays``: trajectories, points and clouds; ``transformations``: the functions of
  tf_transformations; need numpy
- ``listener``, ``broadcasters``, ``buffer_client``: ``TransformListener``,
  ``TransformBroadcaster``, ``StaticTransformBroadcaster``, ``BufferClient``; need rclpy
- ``exceptions``: reasons for a missing or a rejected transform

This package imports ``tfcompose.foundation.geometry`` and, for a listener or a node,
``tfcompose.tf.ros``; nothing else of tfcompose.
"""

from tfcompose.tf.tf2.broadcasters import StaticTransformBroadcaster, TransformBroadcaster
from tfcompose.tf.tf2.buffer import Buffer, BufferInterface
from tfcompose.tf.tf2.buffer_client import BufferClient
from tfcompose.tf.tf2.core import BufferCore
from tfcompose.tf.tf2.exceptions import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    NotImplementedException,
    TimeoutException,
    TransformException,
    TypeException,
)
from tfcompose.tf.tf2.listener import TransformListener
from tfcompose.tf.tf2.messages import (
    ConvertRegistration,
    Stamped,
    TransformRegistration,
    complete_rclpy,
    convert,
)

__all__ = ["Buffer", "BufferClient", "BufferCore", "BufferInterface"]
__all__ += ["StaticTransformBroadcaster", "TransformBroadcaster", "TransformListener"]
__all__ += [
    "ConnectivityException",
    "ExtrapolationException",
    "InvalidArgumentException",
    "LookupException",
]
__all__ += ["NotImplementedException", "TimeoutException", "TransformException", "TypeException"]
__all__ += ["ConvertRegistration", "Stamped", "TransformRegistration", "convert"]

complete_rclpy()
