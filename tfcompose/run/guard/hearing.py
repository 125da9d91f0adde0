"""What a received TF message says, read fast where a publisher sends the same edges again and again."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.geometry import Pose
from tfcompose.ros.message import Layout, decode
from tfcompose.run.guard.senders import Message

if TYPE_CHECKING:
    from tfcompose.ros.tf import Received

#: A longer frame name is cut; no planned one is that long.
LONGEST_NAME = 1024
#: What is remembered: so many layouts of one publisher with one length and first edge, and so many in all.
_LIKE, _MOST = 8, 1024
#: A message with more transforms is read anew each time.
_LONGEST = 2000

_Edges = tuple[tuple[str, str], ...]
_Key = tuple[bytes | None, int, bytes]


class Hearing:
    """The layouts of the messages that were heard; of new ones that hold one of ``frames`` the poses are read too."""

    def __init__(self, frames: frozenset[str] = frozenset()) -> None:
        self._frames = frames
        self._known: dict[_Key, list[tuple[Layout, _Edges]]] = {}
        self._count = 0

    def message(self, received: Received, *, static: bool) -> Message:
        """Return the message, with frames named as tf2 takes them.

        Raises:
            ValueError: with one sentence, if it is no TFMessage.
        """
        data = received.data
        key = (received.gid, len(data), _first_names(data))
        like = self._known.get(key, ())
        for layout, edges in like:
            stamps = layout.stamps(data)
            if stamps is not None:
                return _message(received, edges, stamps, static=static)
        layout = Layout(data)
        edges = tuple((_plain(parent), _plain(child)) for parent, child in layout.edges)
        message = _message(received, edges, layout.stamps(data) or [], static=static)
        if len(edges) > _LONGEST:
            return message
        self._remember(key, (layout, edges))
        if not any(child in self._frames for _, child in edges):
            return message
        return replace(message, poses=[Pose(one.xyz, one.quat_xyzw) for one in decode(data)])

    def _remember(self, key: _Key, one: tuple[Layout, _Edges]) -> None:
        if self._count >= _MOST:
            self._known.clear()
            self._count = 0
        like = self._known.setdefault(key, [])
        if len(like) >= _LIKE:
            self._count -= len(like)
            like.clear()
        like.append(one)
        self._count += 1


def _first_names(data: bytes) -> bytes:
    """Return the names of the first transform, where the bytes are little-endian; others are slower to read."""
    begin = 20 + int.from_bytes(data[16:20], "little")
    at = begin + -begin % 4
    return data[20:begin] + data[at + 4 : at + 4 + int.from_bytes(data[at : at + 4], "little")]


def _message(received: Received, edges: _Edges, stamps: list[int], *, static: bool) -> Message:
    return Message(edges, static, received.gid, received.source_ns, received.sequence, stamps, received.received_ns)


def _plain(frame: str) -> str:
    """Return the frame's name as tf2 takes it, without a leading slash, and as it can be shown."""
    name = frame.removeprefix("/")
    if not name.isprintable():
        name = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in name)
    return name if len(name) <= LONGEST_NAME else f"{name[:LONGEST_NAME]}…"
