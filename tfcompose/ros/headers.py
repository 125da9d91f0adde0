"""What stands in the header of sensor messages: their frame and their time, read from the bytes of any such type.

std_msgs/Header is the first member of each: int32 seconds, uint32 nanoseconds, and the frame as uint32 length, bytes
and a NUL that the length counts, after CDR's four bytes of header.
"""

from __future__ import annotations

import struct
from importlib import import_module
from typing import TYPE_CHECKING

from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from tfcompose.ros.node import Subscription, qos
from tfcompose.ros.tf_codec import BIG_ENDIAN, LITTLE_ENDIAN

if TYPE_CHECKING:
    from rclpy.node import Node

#: Messages that have a header, and are looked up in TF. Images are left out: their CameraInfo has the same header.
HEADED = (
    "sensor_msgs/msg/LaserScan",
    "sensor_msgs/msg/PointCloud2",
    "sensor_msgs/msg/CameraInfo",
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/Range",
    "nav_msgs/msg/Odometry",
)
#: Matches any publisher.
_QOS = qos(5, DurabilityPolicy.VOLATILE, ReliabilityPolicy.BEST_EFFORT)
_SECOND_NS = 1_000_000_000
_NAME_AT = 16
_LONGEST = 1024


class HeaderSubscription(Subscription):
    """A subscription to a topic of one of the types ``HEADED``, or of another that begins with a header.

    Raises:
        ImportError: if the type is not installed.
    """

    def __init__(self, node: Node, topic: str, type_: str) -> None:
        package, _, name = type_.split("/")
        super().__init__(node, getattr(import_module(f"{package}.msg"), name), topic, _QOS)

    def take_headers(self) -> list[tuple[str, int, int]]:
        """Return frame, stamp and time of arrival in nanoseconds of what has come; what is no header is left out."""
        found = []
        for received in self.take():
            header = read_header(received.data)
            if header is not None:
                found.append((*header, received.received_ns))
        return found


def read_header(data: bytes) -> tuple[str, int] | None:
    """Return the frame and the stamp in nanoseconds with which a message begins, or None if it does not."""
    if len(data) < _NAME_AT or data[:2] not in {LITTLE_ENDIAN[:2], BIG_ENDIAN[:2]}:
        return None
    seconds, nanoseconds, length = struct.unpack_from("<iII" if data[1] else ">iII", data, 4)
    raw = data[_NAME_AT : _NAME_AT + min(length, _LONGEST)]
    if length > _LONGEST or len(raw) < length:
        return None
    frame = raw.removesuffix(b"\0").decode(errors="replace")
    return frame, seconds * _SECOND_NS + nanoseconds
