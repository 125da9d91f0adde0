"""sensor_msgs/JointState as bytes, read and written in part, without ROS's typed messages.

Layout (OMG CDR; sizes count from the end of the four bytes of header): int32 seconds, uint32
nanoseconds, the frame as uint32 length, bytes and a NUL that the length counts; uint32 number of
names, each written like the frame; uint32 number of positions, padding to a multiple of 8, the
doubles; velocities and efforts in the same form. Lengths are aligned to 4 bytes.
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
    #: The byte order, as struct's prefix.
    order: str
    #: The bytes after the stamp, up to the number of positions.
    raw: bytes

    def fit(self, data: bytes) -> bool:
        """Return whether the message has exactly these names.

        In the other byte order its lengths read differently.
        """
        return data.startswith(self.raw, _FRAME_AT)

    def stamp_ns(self, data: bytes) -> int:
        """Return the message's time in nanoseconds."""
        seconds, nanoseconds = struct.unpack_from(f"{self.order}iI", data, _STAMP_AT)
        return int(seconds) * _SECOND_NS + int(nanoseconds)

    def positions_at(self, data: bytes) -> int:
        """Return the byte offset of the positions, as doubles, in a message with these names.

        Raises:
            ValueError: if it has another number of positions; the same fault has the same
                sentence.
        """
        at = _FRAME_AT + len(self.raw)
        count = struct.unpack_from(f"{self.order}I", data, at)[0] if at + 4 <= len(data) else -1
        if count != len(self.names):
            raise ValueError(
                "it has names and no positions"
                if count == 0
                else "it has another number of positions than of names"
            )
        at += 4
        at += (_HEADER - at) % _DOUBLE if count else 0
        if at + count * _DOUBLE > len(data):
            raise ValueError("it ends inside its positions")
        return at


def read_names(data: bytes) -> JointNames:
    """Return the names of a message. Work and memory are bounded by its length.

    Raises:
        ValueError: if it is not a JointState; the same fault has the same sentence.
    """
    if data[:2] not in (LITTLE_ENDIAN[:2], BIG_ENDIAN[:2]) or len(data) < _FRAME_AT:
        raise ValueError("its bytes are not one")
    order = "<" if data[1] else ">"
    try:
        _, at = _text(data, _FRAME_AT, order)
        count, at = _count(data, at, order)
        names = []
        for _ in range(count):
            name, at = _text(data, at, order)
            names.append(name)
        _, end = _count(data, at, order)
    except (struct.error, UnicodeDecodeError, IndexError):
        raise ValueError("its bytes are not one") from None
    return JointNames(tuple(names), order, data[_FRAME_AT : end - 4])


def encode_names(names: Sequence[str]) -> bytearray:
    """Return a message with these names and positions of 0, little-endian.

    ``fill`` sets its values.
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


def _count(data: bytes, at: int, order: str) -> tuple[int, int]:
    at += -at % 4
    return int(struct.unpack_from(f"{order}I", data, at)[0]), at + 4


def _text(data: bytes, at: int, order: str) -> tuple[str, int]:
    length, at = _count(data, at, order)
    end = at + length
    if end > len(data):
        raise IndexError
    return data[at:end].removesuffix(b"\0").decode(), end
