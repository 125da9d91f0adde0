"""What is known of the live tree: tf2's buffer, in Python, with tf2's names and calling conventions, without ROS.

``Buffer`` answers as tf2's does (geometry2 for ROS 2 Jazzy, ``tf2_ros.Buffer``): a frame has one parent at a time, that
of its newest sample; samples are kept for 10 s before the newest of their edge; between two samples positions go
straight and rotations on the great circle; time 0 asks for the newest time that all moving edges have reached; fixed
edges hold at any time. Where it differs, on purpose:

- what it raises says which edge is missing, or how many milliseconds too early or too late the time is;
- an infinite value is refused like NaN, and a quaternion that is off unit length is refused as tf2's log says (Jazzy's
  ``BufferCore`` normalises before it looks, so that only a quaternion of zeros is);
- of the two quaternions for a rotation the one with w ≥ 0 comes back;
- a chain of more than 1,000 edges is no loop.

Times are integer nanoseconds throughout.
"""

from __future__ import annotations

from time import monotonic_ns
from typing import TYPE_CHECKING, Any, TypeVar

from tfcompose.observe.core import CACHE_NS, BufferCore, Refusal, Row
from tfcompose.observe.exceptions import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)
from tfcompose.observe.frames import FrameInfo, as_string, as_yaml, frame_info
from tfcompose.observe.rotation import Seven, product, unit
from tfcompose.observe.stamped import nanoseconds, time_of, transform_stamped

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["CACHE_NS", "Buffer", "BufferCore", "FrameInfo", "Refusal", "Row"]
__all__ += ["ConnectivityException", "ExtrapolationException", "InvalidArgumentException", "LookupException"]
__all__ += ["TimeoutException", "TransformException"]

_Answer = TypeVar("_Answer")

# How often a waiting buffer looks for messages itself, in seconds.
_POLL_S = 0.005


class Buffer(BufferCore):
    """tf2_ros's ``Buffer``: takes and gives messages, and waits.

    Args:
        cache_time: how long samples are kept, a duration; default 10 s.

    Frames, times and durations are given as to tf2; see ``stamped`` for what a time may be. All lookups raise

    - ``InvalidArgumentException`` if a name is empty or starts with a slash,
    - ``LookupException`` if a frame is not known, or the frames above it lead back to it,
    - ``ConnectivityException`` if two frames are in two trees,
    - ``ExtrapolationException`` if an edge between them has no samples around that time.
    """

    def __init__(self, cache_time: Any = None) -> None:
        super().__init__(CACHE_NS if cache_time is None else nanoseconds(cache_time))
        self._pollers: list[Callable[[], object]] = []

    def set_transform(self, transform: Any, authority: str = "default_authority") -> bool:
        """Take a TransformStamped of a moving edge; return False if it was refused."""
        return not self.insert([_row(transform)], static=False, authority=authority)

    def set_transform_static(self, transform: Any, authority: str = "default_authority") -> bool:
        """Take a TransformStamped of a fixed edge; return False if it was refused."""
        return not self.insert([_row(transform)], static=True, authority=authority)

    def lookup_transform(self, target_frame: str, source_frame: str, time: Any, timeout: Any = 0) -> Any:
        """Return the pose of ``source_frame`` in ``target_frame`` at a time as a TransformStamped.

        It takes coordinates in the source frame to the target frame. The stamp is the time asked for, or what time 0
        stands for. With a ``timeout`` it waits so long for the transform to come.
        """
        time_ns = nanoseconds(time)
        if timeout == 0:
            pose, stamp_ns = self._pose(target_frame, source_frame, time_ns)
        else:
            pose, stamp_ns = self._wait(lambda: self._pose(target_frame, source_frame, time_ns), timeout)
        return transform_stamped(target_frame, source_frame, stamp_ns, pose)

    def lookup_transform_full(  # noqa: PLR0913, PLR0917 (tf2's arguments)
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str,
        timeout: Any = 0,
    ) -> Any:  # fmt: skip
        """Return the pose of the source frame at one time in the target frame at another.

        Between the times ``fixed_frame`` is taken to stand still. The stamp is that of the target.
        """
        times = nanoseconds(target_time), nanoseconds(source_time)
        pose, stamp_ns = self._wait(
            lambda: self._full_pose(target_frame, times[0], source_frame, times[1], fixed_frame), timeout
        )
        return transform_stamped(target_frame, source_frame, stamp_ns, pose)

    def can_transform(
        self, target_frame: str, source_frame: str, time: Any, timeout: Any = 0, return_debug_tuple: bool = False  # noqa: FBT001, FBT002 (tf2's)
    ) -> Any:  # fmt: skip
        """Return whether ``lookup_transform`` would answer; with ``return_debug_tuple`` also why not."""
        time_ns = nanoseconds(time)
        reason = self._reason(lambda: self._pose(target_frame, source_frame, time_ns), timeout)
        return (not reason, reason) if return_debug_tuple else not reason

    def can_transform_full(  # noqa: PLR0913, PLR0917 (tf2's arguments)
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str,
        timeout: Any = 0, return_debug_tuple: bool = False,  # noqa: FBT001, FBT002 (the same)
    ) -> Any:  # fmt: skip
        """Return whether ``lookup_transform_full`` would answer; with ``return_debug_tuple`` also why not."""
        times = nanoseconds(target_time), nanoseconds(source_time)
        reason = self._reason(
            lambda: self._full_pose(target_frame, times[0], source_frame, times[1], fixed_frame), timeout
        )
        return (not reason, reason) if return_debug_tuple else not reason

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> Any:
        """Return the newest time that all moving edges between the two have reached; 0 where none moves."""
        if target_frame == source_frame:
            return time_of(self._newest_ns(target_frame))
        with self._lock:
            return time_of(self._chain(target_frame, source_frame).common_ns())

    def all_frames(self) -> list[FrameInfo]:
        """Return what is known of each frame, in the order in which they were first heard of."""
        with self._lock:
            return [frame_info(name, self._histories.get(name)) for name in self._names]

    def all_frames_as_string(self) -> str:
        """Return a line for each edge, in tf2's words."""
        return as_string(self.all_frames())

    def all_frames_as_yaml(self) -> str:
        """Return each edge with its rate and times, as tf2's ``tf2_frames`` service does."""
        return as_yaml(self.all_frames())

    def time_jump_callback(self, time_jump: object = None) -> None:  # noqa: ARG002 (what rclpy's clock gives)
        """Forget all samples of moving edges, since the clock went back."""
        self.clear()

    def _full_pose(self, target: str, target_ns: int, source: str, source_ns: int, fixed: str) -> tuple[Seven, int]:
        with self._lock:
            for frame in (target, source, fixed):
                self._require(frame)
            first, _ = self._pose(fixed, source, source_ns)
            second, stamp_ns = self._pose(target, fixed, target_ns)
        return unit(product(second, first)), stamp_ns

    def _reason(self, attempt: Callable[[], object], timeout: Any) -> str:
        try:
            self._wait(attempt, timeout)
        except TransformException as error:
            return str(error)
        return ""

    def _wait(self, attempt: Callable[[], _Answer], timeout: Any) -> _Answer:
        """Return the answer as soon as there is one; raise what it raised last when the time is over.

        Where a listener has no thread of its own the caller may be the one who would take its messages, so they are
        taken here.
        """
        end_ns = monotonic_ns() + nanoseconds(timeout)
        while True:
            with self._news:
                try:
                    return attempt()
                except InvalidArgumentException:
                    raise
                except TransformException:
                    left_s = (end_ns - monotonic_ns()) / 1e9
                    if left_s <= 0:
                        raise
                self._waiting += 1
                self._news.wait(min(left_s, _POLL_S) if self._pollers else left_s)
                self._waiting -= 1
            for poll in tuple(self._pollers):
                poll()


def _row(transform: Any) -> Row:
    header, to, turn = transform.header, transform.transform.translation, transform.transform.rotation
    stamp = header.stamp
    return (
        header.frame_id, transform.child_frame_id, stamp.sec, stamp.nanosec, to.x, to.y, to.z,
        turn.x, turn.y, turn.z, turn.w,
    )  # fmt: skip
