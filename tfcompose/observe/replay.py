"""The pose of one frame in another, in a bag."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.observe.asked import Asked, Missed
from tfcompose.observe.bag import Recording
from tfcompose.observe.census import topics_below
from tfcompose.tf2 import Buffer, TransformException
from tfcompose.tf2.core import CACHE_NS

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.geometry import Pose

_SECOND_NS = 1_000_000_000


def echo_bag(asked: Asked, path: str, say: Callable[[Pose, int | None], None]) -> Missed | None:
    """Give poses, with their times in nanoseconds (None: all edges are fixed), to ``say``, as they were recorded.

    That is the first one with ``once``, the one at ``at_ns`` where that is not 0, else ``rate`` of them for each
    second of the recording. Return None if there was one, else why there was none.

    Raises:
        BagError: if the bag cannot be read.
    """
    replay = _Replay(asked, say)
    for each in Recording(path).messages(topics_below(asked.namespace)):
        if each.rows is None:
            continue
        replay.buffer.insert(each.rows, static=each.static)
        if not each.static:
            replay.newest_ns = max(replay.newest_ns, *(row[2] * _SECOND_NS + row[3] for row in each.rows), 0)
        if replay.is_done(each.received_ns):
            return None
        # The buffer forgets: later on it could only say that this was too long ago.
        if 0 < asked.at_ns < replay.newest_ns - CACHE_NS // 2:
            break
    return replay.ended()


class _Replay:
    """The buffer as it was at a time of the recording, and what was said until then."""

    def __init__(self, asked: Asked, say: Callable[[Pose, int | None], None]) -> None:
        self.buffer = Buffer()
        self.newest_ns = 0
        self._asked = asked
        self._say = say
        self._next_ns = 0
        self._said_ns: int | None = None
        self._said = False

    def is_done(self, now_ns: int) -> bool:
        """Say the pose where it is time, and return whether that was the last one."""
        asked = self._asked
        if asked.at_ns < 0 or now_ns < self._next_ns:
            return False
        try:
            pose, stamp_ns = self._pose()
        except TransformException:
            return False
        if self._said and stamp_ns == self._said_ns:
            return False
        self._tell(pose, stamp_ns)
        self._next_ns = now_ns + int(_SECOND_NS / asked.rate)
        return asked.once or asked.at_ns > 0

    def ended(self) -> Missed | None:
        """Return None if there was a pose until the end, else why there was none."""
        if self._said:
            return None
        try:
            self._tell(*self._pose())
        except TransformException as error:
            return Missed(str(error))
        return None

    def _tell(self, pose: Pose, stamp_ns: int | None) -> None:
        self._said, self._said_ns = True, stamp_ns
        self._say(pose, stamp_ns)

    def _pose(self) -> tuple[Pose, int | None]:
        a, b, at_ns = self._asked.a, self._asked.b, self._asked.at_ns
        if at_ns > 0:
            return self.buffer.lookup(a, b, at_ns)
        pose, stamp_ns = self.buffer.latest(a, b)
        return self.buffer.lookup(a, b, stamp_ns + at_ns) if stamp_ns and at_ns else (pose, stamp_ns)
