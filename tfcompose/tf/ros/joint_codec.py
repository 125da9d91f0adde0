"""sensor_msgs/JointState as bytes, read and written in part, without ROS's message classes.

Layout (OMG CDR, after a header of four bytes): int32 seconds; uint32 nanoseconds; the frame as a
uint32 length, the bytes and a NUL, which the length includes; uint32 number of names, and each
name like the frame; uint32 number of positions, and the positions as doubles; velocities and
efforts like the positions. Lengths are aligned to 4 bytes and doubles to 8, counted from the end
of the header.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.tf.ros.tf_codec import BIG_ENDIAN, LITTLE_ENDIAN

if TYPE_CHECKING:
    from collections.abc import Sequence


JOINT_STATE_TYPE = "sensor_msgs/msg/JointState"
_HEADER = 4
_STAMP_AT = 4
_FRAME_AT = 12
_SECOND_NS = 1_000_000_000
_DOUBLE = 8


@dataclass(frozen=True, slots=True, eq=False)
class JointNames:
    """The constant part of a sender's messages: the frame and the names, as sent."""

    names: tuple[str, ...]
    #: The byte order as a prefix for struct.
    order: str
    #: The bytes from the frame to the last name, without the number of positions.
    raw: bytes

    def fit(self, data: bytes) -> bool:
        """Return whether the message has exactly these names.

        A message in the other byte order does not fit, because its lengths differ.
        """
        return data.startswith(self.raw, _FRAME_AT)

    def stamp_ns(self, data: bytes) -> int:
        """Return the message's time in nanoseconds."""
        seconds, nanoseconds = struct.unpack_from(f"{self.order}iI", data, _STAMP_AT)
        return int(seconds) * _SECOND_NS + int(nanoseconds)

    def positions_at(self, data: bytes) -> int:
        """Return the byte offset of the positions, as doubles, in a message with these names.

        Raises:
            ValueError: if it has a different number of positions. The text depends only on the
                kind of fault, so that repeated faults can be reported once.
        """
        offset = _FRAME_AT + len(self.raw)
        count = (
            struct.unpack_from(f"{self.order}I", data, offset)[0]
            if offset + 4 <= len(data)
            else -1
        )
        if count != len(self.names):
            raise ValueError(
                "it has names and no positions"
                if count == 0
                else "it has a different number of positions than of names"
            )
        offset += 4
        offset += (_HEADER - offset) % _DOUBLE if count else 0
        if offset + count * _DOUBLE > len(data):
            raise ValueError("it ends inside its positions")
        return offset


def read_names(data: bytes) -> JointNames:
    """Return the names of a message. Time and memory are bounded by the length of the data.

    Raises:
        ValueError: if it is not a JointState. The text depends only on the kind of fault.
    """
    if data[:2] not in (LITTLE_ENDIAN[:2], BIG_ENDIAN[:2]) or len(data) < _FRAME_AT:
        raise ValueError("its bytes are not a JointState")
    order = "<" if data[1] else ">"
    try:
        _, offset = _text(data, _FRAME_AT, order)
        count, offset = _count(data, offset, order)
        names = []
        for _ in range(count):
            name, offset = _text(data, offset, order)
            names.append(name)
        _, end = _count(data, offset, order)
    except (struct.error, UnicodeDecodeError, IndexError):
        raise ValueError("its bytes are not a JointState") from None
    return JointNames(tuple(names), order, data[_FRAME_AT : end - 4])


def encode_names(names: Sequence[str]) -> bytearray:
    """Return a message with these names and positions of 0, little-endian.

    ``fill`` then sets the time and the positions.
    """
    out = bytearray(LITTLE_ENDIAN + bytes(_FRAME_AT - _HEADER))
    out += struct.pack("<I", 1) + b"\0"
    _append_number(out, len(names))
    for name in names:
        raw = name.encode() + b"\0"
        _append_number(out, len(raw))
        out += raw
    _append_number(out, len(names))
    if names:
        out += bytes((_HEADER - len(out)) % _DOUBLE + len(names) * _DOUBLE)
    return out + bytes(8)  # no velocities, no efforts


def fill(message: bytearray, stamp_ns: int, positions: Sequence[float]) -> None:
    """Set the time in ns and the positions (rad or m) of a message from ``encode_names``."""
    struct.pack_into("<iI", message, _STAMP_AT, *divmod(stamp_ns, _SECOND_NS))
    struct.pack_into(
        f"<{len(positions)}d", message, len(message) - 8 - len(positions) * _DOUBLE, *positions
    )


def _append_number(out: bytearray, number: int) -> None:
    out += bytes(-len(out) % 4) + struct.pack("<I", number)


def _count(data: bytes, offset: int, order: str) -> tuple[int, int]:
    offset += -offset % 4
    return int(struct.unpack_from(f"{order}I", data, offset)[0]), offset + 4


def _text(data: bytes, offset: int, order: str) -> tuple[str, int]:
    length, offset = _count(data, offset, order)
    end = offset + length
    if end > len(data):
        raise IndexError
    return data[offset:end].removesuffix(b"\0").decode(), end
