"""Lookups as tf2_ros's ``Buffer`` takes them: frames by name, times and durations as objects, and waiting."""

from __future__ import annotations

from time import monotonic_ns
from typing import TYPE_CHECKING, Any, TypeVar

from tfcompose.observe.core import BufferCore
from tfcompose.observe.exceptions import InvalidArgumentException, TransformException
from tfcompose.observe.rotation import Seven, product, unit
from tfcompose.observe.stamped import nanoseconds, time_of, transform_stamped

if TYPE_CHECKING:
    from collections.abc import Callable

_Answer = TypeVar("_Answer")

# How often a waiting buffer looks for messages itself, in seconds.
_POLL_S = 0.005


class Lookups(BufferCore):
    """A buffer that answers in messages, and waits. What is raised is what ``Buffer`` says."""

    def __init__(self, cache_ns: int) -> None:
        super().__init__(cache_ns)
        #: Called while a lookup waits, to take messages that nobody else takes meanwhile.
        self.pollers: list[Callable[[], object]] = []

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
        error = self._error(lambda: self._pose(target_frame, source_frame, time_ns), timeout)
        return (error is None, str(error or "")) if return_debug_tuple else error is None

    def can_transform_full(  # noqa: PLR0913, PLR0917 (tf2's arguments)
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str,
        timeout: Any = 0, return_debug_tuple: bool = False,  # noqa: FBT001, FBT002 (the same)
    ) -> Any:  # fmt: skip
        """Return whether ``lookup_transform_full`` would answer; with ``return_debug_tuple`` also why not."""
        times = nanoseconds(target_time), nanoseconds(source_time)
        error = self._error(
            lambda: self._full_pose(target_frame, times[0], source_frame, times[1], fixed_frame), timeout
        )
        return (error is None, str(error or "")) if return_debug_tuple else error is None

    def lookup_transform_core(self, target_frame: str, source_frame: str, time: Any) -> Any:
        """Return what ``lookup_transform`` does, without waiting."""
        return self.lookup_transform(target_frame, source_frame, time)

    def lookup_transform_full_core(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> Any:
        """Return what ``lookup_transform_full`` does, without waiting."""
        return self.lookup_transform_full(target_frame, target_time, source_frame, source_time, fixed_frame)

    def can_transform_core(self, target_frame: str, source_frame: str, time: Any) -> tuple[bool, str]:
        """Return whether ``lookup_transform`` would answer, and why not."""
        found: tuple[bool, str] = self.can_transform(target_frame, source_frame, time, 0, return_debug_tuple=True)
        return found

    def can_transform_full_core(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> tuple[bool, str]:
        """Return whether ``lookup_transform_full`` would answer, and why not."""
        asked = target_frame, target_time, source_frame, source_time, fixed_frame
        found: tuple[bool, str] = self.can_transform_full(*asked, 0, return_debug_tuple=True)
        return found

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> Any:
        """Return the newest time that all moving edges between the two have reached; 0 where none moves."""
        if target_frame == source_frame:
            return time_of(self._newest_ns(target_frame))
        with self._lock:
            return time_of(self._chain(target_frame, source_frame).common_ns())

    def _full_pose(self, target: str, target_ns: int, source: str, source_ns: int, fixed: str) -> tuple[Seven, int]:
        with self._lock:
            for frame in (target, source, fixed):
                self._require(frame)
            first, _ = self._pose(fixed, source, source_ns)
            second, stamp_ns = self._pose(target, fixed, target_ns)
        return unit(product(second, first)), stamp_ns

    def _error(self, attempt: Callable[[], object], timeout: Any) -> TransformException | None:
        try:
            self._wait(attempt, timeout)
        except TransformException as error:
            return error
        return None

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
                self._news.wait(min(left_s, _POLL_S) if self.pollers else left_s)
                self._waiting -= 1
            for poll in tuple(self.pollers):
                poll()
