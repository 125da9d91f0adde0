"""TFMessage as bytes: little-endian CDR with its four bytes of header, written and read without ROS.

Layout (OMG CDR; sizes count from the end of the header): uint32 number of transforms; each one int32 seconds,
uint32 nanoseconds, the parent and the child as uint32 length, bytes and a NUL that the length counts, then padding
to a multiple of 8 and seven doubles: x y z in metres, the quaternion x y z w. The next one starts at a multiple of 4.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.geometry import Pose, Quaternion, Vector

if TYPE_CHECKING:
    from collections.abc import Sequence

TF_MESSAGE = "tf2_msgs/msg/TFMessage"
#: REP 2011's hash of its definition, and of what it is made of.
TF_MESSAGE_HASH = "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"

LITTLE_ENDIAN = b"\x00\x01\x00\x00"
BIG_ENDIAN = b"\x00\x00\x00\x00"

_HEADER = 4
_SECOND_NS = 1_000_000_000
_POSE = struct.Struct("<7d")
_STAMP = 8
_IDENTITY = _POSE.pack(*Pose().xyz, *Pose().quat_xyzw)
# Stamp, two empty names of 5 bytes, 56 bytes of doubles, and no padding: no transform is shorter.
_SHORTEST = 8 + 5 + 5 + 56


@dataclass(frozen=True, slots=True)
class Transform:
    """One transform of a TFMessage, as it was sent: nothing is normalised. ``stamp_ns`` counts from the epoch."""

    stamp_ns: int
    parent: str
    child: str
    xyz: Vector
    quat_xyzw: Quaternion


class Template:
    """A TFMessage whose names stay, while its time and its poses are set anew.

    Until they are set, the time is 0 and poses are the identity. All transforms have the same time: what stands between
    two stamps is kept as one piece, and the message is the pieces joined by the stamp.
    """

    def __init__(self, edges: Sequence[tuple[str, str]]) -> None:
        self._head = LITTLE_ENDIAN + struct.pack("<I", len(edges))
        self._bodies: list[bytearray] = []
        self._stamp = _stamp(0)
        at = len(self._head)
        for parent, child in edges:
            self._bodies.append(_body(at + len(self._stamp), parent, child))
            at += len(self._stamp) + len(self._bodies[-1])

    def __len__(self) -> int:
        return len(self._bodies)

    @property
    def data(self) -> bytes:
        """The message as it stands now."""
        return self._stamp.join([self._head, *self._bodies])

    def set_stamp(self, stamp_ns: int) -> None:
        """Give every transform this time, in nanoseconds since the epoch.

        Raises:
            ValueError: if a message cannot hold it.
        """
        self._stamp = _stamp(stamp_ns)

    def set_pose(self, index: int, pose: Pose) -> None:
        """Give the transform of that edge this pose of the child in the parent.

        Raises:
            IndexError: if there is no such edge.
        """
        body = self._bodies[index]
        _POSE.pack_into(body, len(body) - _POSE.size, *pose.xyz, *pose.quat_xyzw)


def encode(transforms: Sequence[Transform]) -> bytes:
    """Return the transforms as one TFMessage, header included.

    Raises:
        ValueError: if a name holds a NUL or a lone surrogate, or a stamp does not fit.
    """
    out = bytearray(LITTLE_ENDIAN + struct.pack("<I", len(transforms)))
    for transform in transforms:
        out += _stamp(transform.stamp_ns)
        body = _body(len(out), transform.parent, transform.child)
        _POSE.pack_into(body, len(body) - _POSE.size, *transform.xyz, *transform.quat_xyzw)
        out += body
    return bytes(out)


def places(transforms: Sequence[Transform]) -> list[tuple[int, int]]:
    """Return where the encoded message holds each transform's stamp and its seven doubles, in bytes."""
    found = []
    at = len(LITTLE_ENDIAN) + 4
    for transform in transforms:
        stamp_at, at = at, at + _STAMP
        at += len(_body(at, transform.parent, transform.child))
        found.append((stamp_at, at - _POSE.size))
    return found


def decode(data: bytes) -> list[Transform]:
    """Return the transforms of a TFMessage, in order; either byte order is read, and bytes after the last are ignored.

    Work and memory are bounded by the length of ``data``, whatever it claims to hold.

    Raises:
        ValueError: with one sentence, if it is not one.
    """
    reader = _Reader(data, _order(data))
    return [reader.transform() for _ in range(reader.begin())]


class Layout:
    """What does not change from one message of a publisher to the next: the names, and where the stamps are.

    ``edges`` holds each transform's parent and child, in order.
    """

    def __init__(self, data: bytes) -> None:
        """Take the layout of a message.

        Raises:
            ValueError: as ``decode`` does.
        """
        reader = _Reader(data, _order(data))
        count, layout = reader.begin(), ""
        edges: list[tuple[str, str]] = []
        for _ in range(count):
            layout += reader.names(edges)
        self.edges: tuple[tuple[str, str], ...] = tuple(edges)
        self._layout = struct.Struct(f"{_order(data)}4sI{layout}")
        values = self._layout.unpack_from(data)
        self._fixed = (values[:2], values[4::4], values[5::4])

    def stamps(self, data: bytes) -> list[int] | None:
        """Return each transform's stamp in nanoseconds, or None for a message of another layout."""
        try:
            values = self._layout.unpack_from(data)
        except struct.error:
            return None
        if self._fixed != (values[:2], values[4::4], values[5::4]):
            return None
        seconds, nanoseconds = values[2::4], values[3::4]
        return [s * _SECOND_NS + ns for s, ns in zip(seconds, nanoseconds, strict=True)]


def _order(data: bytes) -> str:
    if data[:2] not in (LITTLE_ENDIAN[:2], BIG_ENDIAN[:2]) or len(data) < _HEADER:
        raise ValueError(f"the message starts with {data[:_HEADER].hex(' ') or 'nothing'}: that is not plain CDR")
    return "<" if data[1] else ">"


class _Reader:
    def __init__(self, data: bytes, order: str) -> None:
        self._data = data
        self._order = order
        self._at = _HEADER

    def begin(self) -> int:
        """Return the number of transforms."""
        count = self.count()
        if count * _SHORTEST > len(self._data) - _HEADER:
            raise ValueError(f"the message claims {count} transforms and has {len(self._data)} bytes")
        return count

    def names(self, edges: list[tuple[str, str]]) -> str:
        """Pass over a transform, note its parent and child, and return its layout: stamp, names, and gaps."""
        start = self._at
        self.numbers("iI", 4)
        layout = f"{_gap(start, 4)}xiI"
        names = []
        for _ in range(2):
            start = self._at
            names.append(self.text())
            begin = start + _gap(start, 4)
            layout += f"{begin - start}x{self._at - begin}s"
        edges.append((names[0], names[1]))
        start = self._at
        self.numbers("7d", 8)
        return f"{layout}{self._at - start}x"

    def numbers(self, kinds: str, alignment: int) -> tuple[int | float, ...]:
        start = self._at + _gap(self._at, alignment)
        layout = struct.Struct(self._order + kinds)
        self._at = start + layout.size
        if self._at > len(self._data):
            raise ValueError(f"the message ends at byte {len(self._data)}, inside a number")
        return layout.unpack_from(self._data, start)

    def count(self) -> int:
        return int(self.numbers("I", 4)[0])

    def text(self) -> str:
        length = self.count()
        end = self._at + length
        if end > len(self._data):
            raise ValueError(f"the message ends at byte {len(self._data)}, inside a name of {length} bytes")
        raw = self._data[self._at : end]
        self._at = end
        try:
            return raw.removesuffix(b"\0").decode()
        except UnicodeDecodeError as error:
            raise ValueError(f"a name in the message is not UTF-8: {error.reason}") from None

    def transform(self) -> Transform:
        seconds, nanoseconds = self.numbers("iI", 4)
        parent, child = self.text(), self.text()
        x, y, z, qx, qy, qz, qw = self.numbers("7d", 8)
        stamp_ns = int(seconds) * _SECOND_NS + int(nanoseconds)
        return Transform(stamp_ns, parent, child, (x, y, z), (qx, qy, qz, qw))


def _body(at: int, parent: str, child: str) -> bytearray:
    """Return what follows a stamp, for byte ``at`` of a message, with the identity as the last seven doubles."""
    out = bytearray()
    for name in (parent, child):
        out += bytes(_gap(at + len(out), 4))
        raw = _name(name)
        out += struct.pack("<I", len(raw)) + raw
    out += bytes(_gap(at + len(out), 8))
    return out + _IDENTITY


def _name(name: str) -> bytes:
    if "\0" in name:
        raise ValueError(f"the name {name!r} holds a NUL")
    return name.encode() + b"\0"


def _stamp(stamp_ns: int) -> bytes:
    seconds, nanoseconds = divmod(stamp_ns, _SECOND_NS)
    try:
        return struct.pack("<iI", seconds, nanoseconds)
    except struct.error:
        raise ValueError(f"the time {stamp_ns} ns does not fit into a message") from None


def _gap(at: int, alignment: int) -> int:
    return (_HEADER - at) % alignment
