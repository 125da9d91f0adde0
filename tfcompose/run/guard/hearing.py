"""What a received TF message says, read fast where a publisher sends the same edges again and again."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.geometry import Pose
from tfcompose.ros.tf_codec import Decoder, decode
from tfcompose.run.guard.senders import Message

if TYPE_CHECKING:
    from tfcompose.ros.node import Received
    from tfcompose.ros.tf_codec import Layout

#: So many layouts of publishers are remembered whose poses were read.
_MOST = 1024


class Hearing:
    """Reads messages; the poses too in a publisher's first ones with edges that hold one of ``frames``."""

    def __init__(self, frames: frozenset[str] = frozenset()) -> None:
        self._frames = frames
        self._decoder = Decoder()
        self._posed: set[tuple[bytes | None, Layout]] = set()

    def message(self, received: Received, *, static: bool) -> Message:
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
