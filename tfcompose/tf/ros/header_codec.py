"""std_msgs/Header at the start of a message, read from its bytes, without ROS.

After CDR's four bytes come int32 seconds, uint32 nanoseconds, and the frame. The frame is a uint32
length, the bytes and a NUL, which the length includes.
"""

from __future__ import annotations

import struct

from tfcompose.tf.ros.tf_codec import BIG_ENDIAN, LITTLE_ENDIAN

_SECOND_NS = 1_000_000_000
_NAME_AT = 16
_LONGEST = 1024


def read_header(data: bytes) -> tuple[str, int] | None:
    """Return a message's frame and stamp in nanoseconds, None without a header."""
    if len(data) < _NAME_AT or data[:2] not in {LITTLE_ENDIAN[:2], BIG_ENDIAN[:2]}:
        return None
    seconds, nanoseconds, length = struct.unpack_from("<iII" if data[1] else ">iII", data, 4)
    raw = data[_NAME_AT : _NAME_AT + min(length, _LONGEST)]
    if length > _LONGEST or len(raw) < length:
        return None
    frame = raw.removesuffix(b"\0").decode(errors="replace")
    return frame, seconds * _SECOND_NS + nanoseconds
