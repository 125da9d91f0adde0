"""A TFMessage whose poses are written as arrays: names stay, and nothing is converted one by one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tfcompose.ros.message import Transform, encode, places

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from tfcompose.geometry import Pose

_SECOND_NS = 1_000_000_000
_HEADER = 4
_SECONDS_MOST = 2**31
_XYZ = np.arange(3)
_QUAT = np.arange(3, 7)


class TFArray:
    """A TFMessage that is filled again and again; all transforms have the same time.

    ``doubles`` are all of the message's places for a double; ``xyz_at`` and ``quat_at``, of shapes (n, 3) and (n, 4),
    say which of them hold each transform's translation (m) and its quaternion x y z w.
    """

    def __init__(self, edges: Sequence[tuple[str, str]], poses: Sequence[Pose]) -> None:
        transforms = [Transform(0, *edge, pose.xyz, pose.quat_xyzw) for edge, pose in zip(edges, poses, strict=True)]
        data = encode(transforms)
        # Doubles are aligned from the end of the header: the buffer begins so that they are aligned in memory, too.
        raw = np.zeros(_HEADER + len(data) + -(len(data) - _HEADER) % 8, np.uint8)
        raw[_HEADER : _HEADER + len(data)] = np.frombuffer(data, np.uint8)
        self._message = raw[_HEADER : _HEADER + len(data)]
        self.doubles: NDArray[np.float64] = raw[2 * _HEADER :].view("<f8")
        self._words: NDArray[np.uint32] = raw[2 * _HEADER :].view("<u4")
        found = np.array(places(transforms), np.intp).reshape(-1, 2) - _HEADER
        self._stamp_at = found[:, 0] // 4
        start = found[:, 1:] // 8
        self.xyz_at: NDArray[np.intp] = start + _XYZ
        self.quat_at: NDArray[np.intp] = start + _QUAT

    def data(self, stamp_ns: int) -> bytes:
        """Return the message as it stands now, with this time in nanoseconds since the epoch.

        Raises:
            ValueError: if a message cannot hold it.
        """
        seconds, nanoseconds = divmod(stamp_ns, _SECOND_NS)
        if not -_SECONDS_MOST <= seconds < _SECONDS_MOST:
            raise ValueError(f"the time {stamp_ns} ns does not fit into a message")
        self._words[self._stamp_at] = seconds % (2 * _SECONDS_MOST)
        self._words[self._stamp_at + 1] = nanoseconds
        return self._message.tobytes()
