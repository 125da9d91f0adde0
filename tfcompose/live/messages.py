"""What a TF message says, as the guard needs it: fast where a publisher sends the same edges again and again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.geometry import Pose
from tfcompose.ros.tf_codec import Decoder, decode

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.ros.node import Received
    from tfcompose.ros.tf_codec import Layout

#: So many layouts of publishers are remembered whose poses were read.
_MOST = 1024


@dataclass(frozen=True, slots=True)
class Message:
    """One TFMessage: its (parent, child) pairs, the topic's kind, who sent it, and when.

    ``gid`` is the publisher's id, or None where the rmw gives none; ``sequence`` counts its messages from 1.
    ``stamps_ns`` are the transforms' stamps; ``received_ns`` is when it came, by this machine's system clock.
    ``poses`` are there where frames are compared with presets, in the first message of a publisher with these edges.
    """

    edges: tuple[tuple[str, str], ...]
    static: bool
    gid: bytes | None
    source_ns: int
    sequence: int
    stamps_ns: Sequence[int] = ()
    received_ns: int = 0
    poses: Sequence[Pose] = ()


class MessageReader:
    """Reads messages; the poses too in a publisher's first ones with edges that hold one of ``frames``."""

    def __init__(self, frames: frozenset[str] = frozenset()) -> None:
        self._frames = frames
        self._decoder = Decoder()
        self._posed: set[tuple[bytes | None, Layout]] = set()

    def read(self, received: Received, *, static: bool) -> Message:
        """Return the message, with frames named as tf2 takes them.

        Raises:
            ValueError: with one sentence, if it is no TFMessage.
        """
        layout, stamps = self._decoder.stamps(received.data)
        edges = layout.plain_edges
        poses: tuple[Pose, ...] = ()
        if self._frames and (received.gid, layout) not in self._posed:
            poses = self._poses(received, layout)
        return Message(
            edges, static, received.gid, received.source_ns, received.sequence, stamps, received.received_ns, poses
        )

    def _poses(self, received: Received, layout: Layout) -> tuple[Pose, ...]:
        if len(self._posed) >= _MOST:
            self._posed.clear()
        self._posed.add((received.gid, layout))
        if not any(child in self._frames for _, child in layout.plain_edges):
            return ()
        return tuple(Pose(one.xyz, one.quat_xyzw) for one in decode(received.data))
