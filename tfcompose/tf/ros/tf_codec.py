"""TFMessage as bytes (OMG CDR), written and read without ROS.

Layout, with sizes counted from the end of the header of four bytes: uint32 number of transforms;
then for each transform int32 seconds, uint32 nanoseconds, and the parent and the child, each as
uint32 length, bytes and a NUL, which the length includes; then padding to a multiple of 8; then
seven doubles: x y z in metres, the quaternion x y z w. The next transform starts at a multiple of
4.

``encode`` and ``decode`` handle any message. Usually a publisher's messages differ only in stamps
and poses. A ``Template``, or with numpy an ``ArrayTemplate``, is such a message to send
repeatedly. A ``Decoder`` reads further messages of a known layout in a twentieth of the time.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from tfcompose.foundation.geometry import Pose, Quaternion, Vector
from tfcompose.foundation.text import visible

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    import numpy as np
    from numpy.typing import NDArray

    Edges = tuple[tuple[str, str], ...]
    Order = Literal["little", "big"]

TF_MESSAGE = "tf2_msgs/msg/TFMessage"
#: REP 2011's hash of its definition, including the types that it contains.
TF_MESSAGE_HASH = "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"

#: The header. Only its first two bytes matter.
LITTLE_ENDIAN = b"\x00\x01\x00\x00"
BIG_ENDIAN = b"\x00\x00\x00\x00"

#: A transform as sent: parent, child, seconds, nanoseconds, x y z in metres, quaternion x y z w.
Row = tuple[str, str, int, int, float, float, float, float, float, float, float]

_HEADER = 4
_SECOND_NS = 1_000_000_000
_POSE = struct.Struct("<7d")
_STAMP = 8
_IDENTITY = _POSE.pack(*Pose().xyz, *Pose().quat_xyzw)
# Size of the shortest transform: stamp, two empty names of 5 bytes, 56 bytes of doubles, no
# padding.
_SHORTEST = 8 + 5 + 5 + 56
# Offset of the first transform's parent: after the header, the number of transforms and a stamp.
_FIRST_PARENT = 16
# Limits for remembered layouts: the total size of their messages, and the number for the same
# length and beginning.
_MOST_BYTES = 1 << 22
_MOST_ALIKE = 8
# Size of a name's prefix, and the handler for bytes in it that are not UTF-8.
_LENGTH = 4
_REPLACED = "\ufffd"
#: Maximum length of a displayed name. Planned frames have shorter names.
LONGEST_NAME = 1024


@dataclass(frozen=True, slots=True)
class SentTransform:
    """A transform of a TFMessage as sent, without normalisation."""

    #: Stamp in nanoseconds since the epoch.
    stamp_ns: int
    parent: str
    child: str
    #: Translation in metres.
    xyz: Vector
    quat_xyzw: Quaternion


# Writing.


def encode(transforms: Sequence[SentTransform]) -> bytes:
    """Return the transforms as a TFMessage, including the header.

    Raises:
        ValueError: if a name contains a NUL or a lone surrogate, or a stamp does not fit.
    """
    out = bytearray(LITTLE_ENDIAN + struct.pack("<I", len(transforms)))
    for transform in transforms:
        out += _stamp(transform.stamp_ns)
        body = _body(len(out), transform.parent, transform.child)
        _POSE.pack_into(body, len(body) - _POSE.size, *transform.xyz, *transform.quat_xyzw)
        out += body
    return bytes(out)


class Template:
    """A TFMessage with constant names, whose time and poses are set before each use.

    Initially, the time is 0 and poses are the identity. All transforms have the same time. The
    bytes between two stamps are kept as a piece, and the message consists of the pieces joined by
    the stamp.
    """

    def __init__(self, edges: Sequence[tuple[str, str]]) -> None:
        self._head = LITTLE_ENDIAN + struct.pack("<I", len(edges))
        self._bodies: list[bytearray] = []
        self._stamp = _stamp(0)
        offset = len(self._head)
        for parent, child in edges:
            self._bodies.append(_body(offset + _STAMP, parent, child))
            offset += _STAMP + len(self._bodies[-1])

    def __len__(self) -> int:
        return len(self._bodies)

    @property
    def data(self) -> bytes:
        """The message with its current values."""
        return self._stamp.join([self._head, *self._bodies])

    def set_stamp(self, stamp_ns: int) -> None:
        """Set the time of every transform, in nanoseconds since the epoch.

        Raises:
            ValueError: if a message cannot hold it.
        """
        self._stamp = _stamp(stamp_ns)

    def set_pose(self, index: int, pose: Pose) -> None:
        """Set the pose of the child in the parent for the transform at ``index``.

        Raises:
            IndexError: if there is no such edge.
        """
        body = self._bodies[index]
        _POSE.pack_into(body, len(body) - _POSE.size, *pose.xyz, *pose.quat_xyzw)

    def offsets(self) -> list[tuple[int, int]]:
        """Return the byte offsets of each transform's stamp and seven doubles."""
        places = []
        offset = len(self._head)
        for body in self._bodies:
            end = offset + _STAMP + len(body)
            places.append((offset, end - _POSE.size))
            offset = end
        return places


class ArrayTemplate:
    """A TFMessage with constant names, whose poses are written as numpy arrays.

    Nothing is converted one by one. All transforms have the same time. ``doubles`` are all double
    slots in the message. ``xyz_at`` and ``quat_at``, of shapes (n, 3) and (n, 4), are the indices
    of each transform's translation in metres and its quaternion x y z w.
    """

    def __init__(self, edges: Sequence[tuple[str, str]], poses: Sequence[Pose]) -> None:
        import numpy as np  # noqa: PLC0415 (a fifth of the memory of processes that send no arrays)

        template = Template(edges)
        for index, pose in enumerate(poses):
            template.set_pose(index, pose)
        data = template.data
        # Doubles are aligned relative to the end of the header. The buffer begins so that they are
        # also aligned in memory.
        raw = np.zeros(_HEADER + len(data) + -(len(data) - _HEADER) % 8, np.uint8)
        raw[_HEADER : _HEADER + len(data)] = np.frombuffer(data, np.uint8)
        self._message = raw[_HEADER : _HEADER + len(data)]
        self.doubles: NDArray[np.float64] = raw[2 * _HEADER :].view("<f8")
        self._words: NDArray[np.uint32] = raw[2 * _HEADER :].view("<u4")
        gaps = np.array(template.offsets(), np.intp).reshape(-1, 2) - _HEADER
        self._stamp_at = (gaps[:, :1] // 4 + np.arange(2)).ravel()
        start = gaps[:, 1:] // 8
        self.xyz_at: NDArray[np.intp] = start + np.arange(3)
        self.quat_at: NDArray[np.intp] = start + np.arange(3, 7)

    def data(self, stamp_ns: int) -> bytes:
        """Return the message with its current poses and a time in nanoseconds since the epoch.

        Raises:
            ValueError: if a message cannot hold the time.
        """
        self._words.put(self._stamp_at, struct.unpack("<II", _stamp(stamp_ns)))
        return self._message.tobytes()


def _body(offset: int, parent: str, child: str) -> bytearray:
    """Return the bytes after a stamp at ``offset``; the last seven doubles are the identity."""
    out = bytearray()
    for name in (parent, child):
        out += bytes(_gap(offset + len(out), 4))
        raw = _name(name)
        out += struct.pack("<I", len(raw)) + raw
    out += bytes(_gap(offset + len(out), 8))
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


def _gap(offset: int, alignment: int) -> int:
    return (_HEADER - offset) % alignment


# Reading.


def decode(data: bytes) -> list[SentTransform]:
    """Return the transforms of a TFMessage in order.

    Both byte orders are supported, and bytes after the last transform are ignored. Work and memory
    are limited by the length of ``data``, even if it claims to contain more.

    Raises:
        ValueError: with a sentence, if it is not a TFMessage.
    """
    return list(transforms(data))


def transforms(data: bytes) -> Iterator[SentTransform]:
    """Yield the transforms of a TFMessage one by one, as ``decode`` returns them.

    Raises:
        ValueError: with a sentence, if it is not a TFMessage.
    """
    reader = _MessageReader(data)
    for _ in range(reader.begin()):
        yield reader.transform()


def number_of_transforms(data: bytes) -> int:
    """Return the number of transforms that a message claims, at most as many as fit in it.

    Nothing else is read.
    """
    claimed = int.from_bytes(
        data[_HEADER : 2 * _HEADER], "big" if data[:2] == BIG_ENDIAN[:2] else "little"
    )
    return min(claimed, len(data) // _SHORTEST)


class MessageLayout:
    """The constant part of a publisher's messages: the names, and the offsets of the numbers.

    ``edges`` holds parent and child of each transform in order, as sent. ``exact``: the names have
    no further bytes.
    """

    __slots__ = ("_fixed", "_plain", "_rows", "_stamps", "edges", "exact")

    def __init__(self, data: bytes) -> None:
        """Create the layout of a message.

        Raises:
            ValueError: as in ``decode``.
        """
        edges, self._stamps = _unpacking(data, f"{_POSE.size}x")
        self.edges: Edges = tuple(edges)
        self._plain: Edges | None = None
        self._rows: tuple[struct.Struct, list[str], list[str]] | None = None
        values = self._stamps.unpack_from(data)
        self._fixed = (values[:2], values[4::4], values[5::4])
        self.exact = all(
            raw.find(b"\0", _LENGTH) == len(raw) - 1 for raw in values[4::4] + values[5::4]
        )
        self.exact = self.exact and not any(
            _REPLACED in parent or _REPLACED in child for parent, child in edges
        )

    @property
    def plain_edges(self) -> Edges:
        """The edges as tf2 reads them, without a leading slash, and printable."""
        if self._plain is None:
            self._plain = tuple(
                (plain_name(parent), plain_name(child)) for parent, child in self.edges
            )
        return self._plain

    def stamps(self, data: bytes) -> list[int] | None:
        """Return each transform's stamp in nanoseconds, None for a message of another layout."""
        try:
            values = self._stamps.unpack_from(data)
        except struct.error:
            return None
        if self._fixed != (values[:2], values[4::4], values[5::4]):
            return None
        return [s * _SECOND_NS + ns for s, ns in zip(values[2::4], values[3::4], strict=True)]

    def rows(self, data: bytes) -> Iterable[Row] | None:
        """Return the transforms, None for a message of another layout."""
        if self._rows is None:  # created on demand: some callers need only stamps
            if self.stamps(data) is None:
                return None
            self._rows = (
                _unpacking(data, "7d")[1],
                [edge for edge, _ in self.edges],
                [edge for _, edge in self.edges],
            )
        layout, parents, children = self._rows
        try:
            values = layout.unpack_from(data)
        except struct.error:
            return None
        if self._fixed != (values[:2], values[4::11], values[5::11]):
            return None
        numbers = (values[offset::11] for offset in (2, 3, 6, 7, 8, 9, 10, 11, 12))
        return zip(parents, children, *numbers, strict=True)


class Decoder:
    """Reads messages as ``decode`` does, twenty times faster for known layouts.

    A message of a known length and beginning is unpacked with a single call. If then the number of
    transforms and all names with their lengths are at the same offsets, the message has the same
    layout, so its numbers are at the same offsets, too. Padding is ignored.
    """

    def __init__(self) -> None:
        self._layouts: dict[tuple[int, bytes, bytes], list[MessageLayout]] = {}
        self._bytes = 0
        #: Number of messages with a new layout.
        self.read_anew = 0

    def knows(self, data: bytes) -> bool:
        """Return whether the message has a known layout, which makes it fast to read."""
        return any(layout.stamps(data) is not None for layout in self._layouts.get(_key(data), ()))

    def rows(self, data: bytes) -> Iterable[Row]:
        """Return the transforms of a TFMessage in order.

        Raises:
            ValueError: with a sentence, if it is not a TFMessage.
        """
        key = _key(data)
        for layout in self._layouts.get(key, ()):
            rows = layout.rows(data)
            if rows is not None:
                return rows
        return self._remember(key, data).rows(data) or ()

    def stamps(self, data: bytes) -> tuple[MessageLayout, Sequence[int]]:
        """Return a TFMessage's layout with its names, and its stamps in nanoseconds.

        Raises:
            ValueError: with a sentence, if it is not a TFMessage.
        """
        key = _key(data)
        for layout in self._layouts.get(key, ()):
            stamps = layout.stamps(data)
            if stamps is not None:
                return layout, stamps
        layout = self._remember(key, data)
        return layout, layout.stamps(data) or ()

    def _remember(self, key: tuple[int, bytes, bytes], data: bytes) -> MessageLayout:
        layout = MessageLayout(data)
        self.read_anew += 1
        if len(data) > _MOST_BYTES:
            return layout
        self._bytes += len(data)
        if self._bytes > _MOST_BYTES:
            self._layouts.clear()
            self._bytes = len(data)
        alike = self._layouts.setdefault(key, [])
        if len(alike) >= _MOST_ALIKE:
            self._bytes -= len(data) * len(alike)
            alike.clear()
        alike.append(layout)
        return layout


def _unpacking(data: bytes, pose: str) -> tuple[list[tuple[str, str]], struct.Struct]:
    """Return a message's edges, and the struct that unpacks the message.

    The struct covers the header, the count, and for each transform stamp, names and ``pose``.
    """
    reader = _MessageReader(data)
    edges: list[tuple[str, str]] = []
    layout = "".join(reader.skip(edges) + pose for _ in range(reader.begin()))
    return edges, struct.Struct(f"{reader.order}2s2xI{layout}")


def _as_taken(raw: bytes) -> str:
    """Return a name as rclpy reads it: up to the first NUL, with U+FFFD for invalid UTF-8."""
    return raw.partition(b"\0")[0].decode(errors="replace")


def plain_name(frame: str) -> str:
    """Return a frame's name as tf2 reads it, without a leading slash, printable and shortened."""
    name = frame.removeprefix("/")
    if not name.isprintable():
        name = visible(name)
    return name if len(name) <= LONGEST_NAME else f"{name[:LONGEST_NAME]}…"


def _key(data: bytes) -> tuple[int, bytes, bytes]:
    """Return a key that differs for most layouts: the length, and the first two names."""
    order: Order = "big" if data[:2] == BIG_ENDIAN[:2] else "little"
    parent = _raw_name(data, _FIRST_PARENT, order)
    offset = _FIRST_PARENT + len(parent)
    return len(data), parent, _raw_name(data, offset + _gap(offset, 4), order)


def _raw_name(data: bytes, offset: int, order: Order) -> bytes:
    """Return a name with its length before it, truncated at the end of the data."""
    return data[offset : offset + 4 + int.from_bytes(data[offset : offset + 4], order)]


class _MessageReader:
    """Reads a message from start to end.

    Raises:
        ValueError: with a sentence, if it is not a TFMessage.
    """

    def __init__(self, data: bytes) -> None:
        if data[:2] not in (LITTLE_ENDIAN[:2], BIG_ENDIAN[:2]) or len(data) < _HEADER:
            raise ValueError(
                f"the message starts with {data[:_HEADER].hex(' ') or 'nothing'}: that is not"
                " plain CDR"
            )
        self.order = "<" if data[1] else ">"
        self._data = data
        self._at = _HEADER

    def begin(self) -> int:
        """Return the number of transforms."""
        count = self.count()
        if count * _SHORTEST > len(self._data) - _HEADER:
            raise ValueError(
                f"the message claims {count} transforms and has {len(self._data)} bytes"
            )
        return count

    def skip(self, edges: list[tuple[str, str]]) -> str:
        """Skip a transform and record its parent and child.

        Return the struct format of its stamp and its names, with their lengths, up to the doubles.
        """
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
        padding = _gap(self._at, 8)
        self.numbers("7d", 8)
        return f"{layout}{padding}x"

    def numbers(self, kinds: str, alignment: int) -> tuple[int | float, ...]:
        start = self._at + _gap(self._at, alignment)
        kinds = self.order + kinds
        self._at = start + struct.calcsize(kinds)
        if self._at > len(self._data):
            raise ValueError(f"the message ends at byte {len(self._data)}, inside a number")
        return struct.unpack_from(kinds, self._data, start)

    def count(self) -> int:
        return int(self.numbers("I", 4)[0])

    def text(self) -> str:
        length = self.count()
        end = self._at + length
        if end > len(self._data):
            raise ValueError(
                f"the message ends at byte {len(self._data)}, inside a name of {length} bytes"
            )
        raw = self._data[self._at : end]
        self._at = end
        return _as_taken(raw)

    def transform(self) -> SentTransform:
        seconds, nanoseconds = self.numbers("iI", 4)
        parent, child = self.text(), self.text()
        x, y, z, qx, qy, qz, qw = self.numbers("7d", 8)
        stamp_ns = int(seconds) * _SECOND_NS + int(nanoseconds)
        return SentTransform(stamp_ns, parent, child, (x, y, z), (qx, qy, qz, qw))
