"""tf2_ros's ``Buffer`` in Python, with tf2's names and calling conventions, without ROS.

``Buffer`` answers like tf2's (geometry2 for ROS 2 Jazzy). A frame has one parent at a time, the
parent of its newest sample. Samples are kept for 10 s before the newest of their edge. Between two
samples, positions are interpolated linearly and rotations on the great circle. Time 0 means the
newest time that all moving edges have reached. Fixed edges are valid at any time. There are
intended differences:

- Exceptions name the missing edge, or tell by how many milliseconds the time is too early or too
  late.
- An infinite value is rejected like NaN. A quaternion without unit length is rejected, as tf2's
  log claims. Jazzy's ``BufferCore`` normalises before it checks, so it rejects only a quaternion
  of zeros.
- Of the two quaternions for a rotation, the buffer returns the one with w ≥ 0.
- A chain of more than 1,000 edges does not count as a loop.

Times are integer nanoseconds throughout.
"""

from __future__ import annotations

import sys
from time import monotonic_ns
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from tfcompose.tf.tf2.core import BufferCore
from tfcompose.tf.tf2.exceptions import (
    InvalidArgumentException,
    NotImplementedException,
    TransformException,
)
from tfcompose.tf.tf2.messages import (
    TransformRegistration,
    convert,
    nanoseconds,
    require_numpy,
    transform_stamped,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from tfcompose.tf.tf2.arrays import Trajectory

_Answer = TypeVar("_Answer")

# Interval at which a waiting buffer takes messages itself, in seconds.
_POLL_S = 0.005


class BufferInterface:
    """tf2_ros's ``BufferInterface``: transforms objects with a header, with a subclass's lookups.

    ``registration`` maps types to functions. Initially it has PointStamped, Vector3Stamped,
    PoseStamped, PoseWithCovarianceStamped, PolygonStamped and PointCloud2, which requires numpy.
    """

    def __init__(self) -> None:
        self.registration = TransformRegistration()

    def transform(
        self,
        object_stamped: Any,
        target_frame: str,
        timeout: Any = 0,
        new_type: type | None = None,
    ) -> Any:
        """Return an object in another frame, with the same type or as a ``new_type``.

        The time is the object's own stamp.

        Raises:
            TypeException: if its type is unknown, or no conversion to the new type is registered.
        """
        move = self.registration.get(type(object_stamped))
        header = object_stamped.header
        moved = move(
            object_stamped,
            self.lookup_transform(target_frame, header.frame_id, header.stamp, timeout),
        )
        return moved if new_type is None else convert(moved, new_type)

    def transform_full(  # noqa: PLR0913, PLR0917 (tf2's arguments)
        self,
        object_stamped: Any,
        target_frame: str,
        target_time: Any,
        fixed_frame: str,
        timeout: Any = 0,
        new_type: type | None = None,
    ) -> Any:
        """Return an object in another frame at another time, through ``fixed_frame``.

        Raises:
            TypeException: as in ``transform``.
        """
        move = self.registration.get(type(object_stamped))
        header = object_stamped.header
        transform = self.lookup_transform_full(
            target_frame, target_time, header.frame_id, header.stamp, fixed_frame, timeout
        )
        moved = move(object_stamped, transform)
        return moved if new_type is None else convert(moved, new_type)

    def lookup_transform(
        self,
        target_frame: str,
        source_frame: str,
        time: Any,
        timeout: Any = 0,
    ) -> Any:
        """Return the pose of the source frame in the target frame. Subclasses define this.

        Raises:
            NotImplementedException: always.
        """
        raise NotImplementedException

    def lookup_transform_full(  # noqa: PLR0913, PLR0917 (tf2's arguments)
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = 0,
    ) -> Any:
        """Return the pose of the source frame at a time in the target frame at another time.

        Subclasses define this.

        Raises:
            NotImplementedException: always.
        """
        raise NotImplementedException

    def can_transform(
        self,
        target_frame: str,
        source_frame: str,
        time: Any,
        timeout: Any = 0,
    ) -> Any:
        """Return whether ``lookup_transform`` would succeed. Subclasses define this.

        Raises:
            NotImplementedException: always.
        """
        raise NotImplementedException

    def can_transform_full(  # noqa: PLR0913, PLR0917 (tf2's arguments)
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = 0,
    ) -> Any:
        """Return whether ``lookup_transform_full`` would succeed. Subclasses define this."""
        raise NotImplementedException


class Buffer(BufferCore, BufferInterface):
    """tf2_ros's ``Buffer``: accepts and returns messages, and can wait.

    Args:
        cache_time: how long samples are kept, a duration; default 10 s.
        node: an rclpy node. When its clock goes back, the buffer drops all moving edges. (A
            listener drops them, too.) If tf2_msgs is installed, the node offers the service
            ``tf2_frames``, which view_frames calls.

    Lookups have the arguments and exceptions of ``BufferCore`` (module ``core``). They can wait
    for transforms that have not arrived yet.

    A program that has loaded rclpy gets rclpy's ``Future``, for ``spin_until_future_complete`` and
    for coroutines that an executor runs. Any other program gets the ``Future`` of
    ``concurrent.futures``, and coroutines for asyncio.
    """

    def __init__(self, cache_time: Any = None, node: Any = None) -> None:
        BufferCore.__init__(self, cache_time)
        BufferInterface.__init__(self)
        #: Called while a lookup waits, to take messages that no executor takes.
        self.pollers: list[Callable[[], object]] = []
        self._jumps: dict[int, Any] = {}
        if node is not None:
            self.follow_clock(node)
            # A program with a node has ROS.
            from tfcompose.tf.ros.tf_listener import offer_frames  # noqa: PLC0415

            self.srv = offer_frames(node, self.all_frames_as_yaml)

    # Transforms in.

    def follow_clock(self, node: Any) -> None:
        """Drop moving edges whenever the node's clock jumps back or changes its source."""
        # A program with a node has ROS.
        from tfcompose.tf.ros.tf_listener import on_clock_jump  # noqa: PLC0415

        clock = node.get_clock()
        if id(clock) not in self._jumps:
            self._jumps[id(clock)] = (clock, on_clock_jump(node, self.time_jump_callback))

    def time_jump_callback(self, time_jump: object = None) -> None:
        """Drop all samples of moving edges, because the clock went back."""
        self.clear()

    # Lookups.

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Any, timeout: Any = 0
    ) -> Any:
        """Return the pose of ``source_frame`` in ``target_frame`` as a TransformStamped.

        The pose maps coordinates in the source frame to the target frame. The stamp is the given
        time, or the time that 0 resolves to. ``timeout`` is the maximum wait for the transform.
        """
        time_ns = nanoseconds(time)
        if timeout == 0:
            pose, stamp_ns = self._pose(target_frame, source_frame, time_ns)
        else:
            pose, stamp_ns = self._wait(
                lambda: self._pose(target_frame, source_frame, time_ns), timeout
            )
        return transform_stamped(target_frame, source_frame, stamp_ns, pose)

    def lookup_transform_full(  # noqa: PLR0913, PLR0917 (tf2's arguments)
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = 0,
    ) -> Any:
        """Return the pose of the source frame at a time in the target frame at another time.

        ``fixed_frame`` is assumed not to move between the times. The stamp is the target's time.
        """
        times = nanoseconds(target_time), nanoseconds(source_time)
        pose, stamp_ns = self._wait(
            lambda: self._full_pose(target_frame, times[0], source_frame, times[1], fixed_frame),
            timeout,
        )
        return transform_stamped(target_frame, source_frame, stamp_ns, pose)

    def can_transform(
        self,
        target_frame: str,
        source_frame: str,
        time: Any,
        timeout: Any = 0,
        return_debug_tuple: bool = False,  # noqa: FBT001, FBT002 (tf2's)
    ) -> Any:
        """Return whether ``lookup_transform`` would succeed.

        ``return_debug_tuple`` adds the reason.
        """
        time_ns = nanoseconds(time)
        error = self._error(lambda: self._pose(target_frame, source_frame, time_ns), timeout)
        return (error is None, str(error or "")) if return_debug_tuple else error is None

    def can_transform_full(  # noqa: PLR0913, PLR0917 (tf2's arguments)
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = 0,
        return_debug_tuple: bool = False,  # noqa: FBT001, FBT002 (the same)
    ) -> Any:
        """Return whether ``lookup_transform_full`` would succeed.

        ``return_debug_tuple`` adds the reason.
        """
        times = nanoseconds(target_time), nanoseconds(source_time)
        error = self._error(
            lambda: self._full_pose(target_frame, times[0], source_frame, times[1], fixed_frame),
            timeout,
        )
        return (error is None, str(error or "")) if return_debug_tuple else error is None

    # Futures and coroutines.

    def wait_for_transform_async(self, target_frame: str, source_frame: str, time: Any) -> Any:
        """Return a future with the result of ``lookup_transform``."""
        return self._future(lambda: self.lookup_transform(target_frame, source_frame, time))

    def wait_for_transform_full_async(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
    ) -> Any:
        """Return a future with the result of ``lookup_transform_full``."""
        query = target_frame, target_time, source_frame, source_time, fixed_frame
        return self._future(lambda: self.lookup_transform_full(*query))

    async def lookup_transform_async(self, target_frame: str, source_frame: str, time: Any) -> Any:
        """Wait until the transform is available, and return it."""
        return await _awaitable(self.wait_for_transform_async(target_frame, source_frame, time))

    async def lookup_transform_full_async(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
    ) -> Any:
        """Wait until the transform is available, and return it."""
        query = target_frame, target_time, source_frame, source_time, fixed_frame
        return await _awaitable(self.wait_for_transform_full_async(*query))

    # Many poses and points at once.

    def transform_points(
        self, cloud: ArrayLike, target: str, source: str, stamp: Any = 0
    ) -> NDArray[Any]:
        """Return points given in ``source`` in ``target`` at a time (0: the newest common time).

        This requires numpy. ``cloud`` has the shape N×3, or any shape (…, 3), in metres, and so
        has the result. float32 stays float32.

        Raises:
            InvalidArgumentException: if the last dimension is not 3.
            ImportError: if numpy is not installed.
        """
        require_numpy()
        from tfcompose.tf.tf2.arrays import transform_points_array  # noqa: PLC0415 (numpy is optional)

        pose, _ = self._pose(target, source, nanoseconds(stamp))
        return transform_points_array(cloud, pose)

    def lookup_many(
        self,
        target: str,
        source: str,
        stamps: ArrayLike,
        outside: Literal["raise", "nan"] = "raise",
    ) -> Trajectory:
        """Return the poses of ``source`` in ``target`` at many times at once. Requires numpy.

        ``stamps`` are N integers in nanoseconds; 0 means the newest common time. The result has
        ``xyz`` (N×3 in metres), ``quat_xyzw`` (N×4) and ``matrices()`` (N×4×4). Each row is the
        result of ``lookup``. ``outside`` determines the result for a time outside an edge's
        samples: an ``ExtrapolationException``, or a row of NaN.

        Raises:
            ImportError: if numpy is not installed.
        """
        require_numpy()
        from tfcompose.tf.tf2.arrays import lookup_many  # noqa: PLC0415 (numpy is optional)

        return lookup_many(self, target, source, stamps, outside)

    # Waiting.

    def _error(self, attempt: Callable[[], object], timeout: Any) -> TransformException | None:
        try:
            self._wait(attempt, timeout)
        except TransformException as error:
            return error
        return None

    def _wait(self, attempt: Callable[[], _Answer], timeout: Any) -> _Answer:
        """Return the answer as soon as there is one. After the timeout, raise the last exception.

        If a listener has no thread, the waiting caller may be the program's only spinner of the
        node. So this method takes the messages.
        """
        end_ns = monotonic_ns() + nanoseconds(timeout)
        while True:
            with self._inserted:
                try:
                    return attempt()
                except InvalidArgumentException:
                    raise
                except TransformException:
                    left_s = (end_ns - monotonic_ns()) / 1e9
                    if left_s <= 0:
                        raise
                self._waiting += 1
                self._inserted.wait(min(left_s, _POLL_S) if self.pollers else left_s)
                self._waiting -= 1
            for poll in tuple(self.pollers):
                poll()

    def _future(self, attempt: Callable[[], Any]) -> Any:
        """Return a future that completes when the attempt succeeds, now or after a new transform.

        An invalid frame name completes it with the exception.
        """
        if "rclpy.task" in sys.modules:
            future = sys.modules["rclpy.task"].Future()
        else:
            # A program that only does lookups does not need it.
            from concurrent.futures import Future  # noqa: PLC0415

            future = Future()

        def check() -> None:
            with self._lock:
                if check not in self.on_insert:
                    return  # another thread has set it, or it was cancelled
                try:
                    answer, error = attempt(), None
                except InvalidArgumentException as wrong:
                    answer, error = None, wrong
                except TransformException:
                    return
                self.on_insert.remove(check)
            if error:
                future.set_exception(error)
            else:
                future.set_result(answer)

        def forget(_: object) -> None:
            with self._lock:
                if check in self.on_insert:
                    self.on_insert.remove(check)

        with self._lock:
            self.on_insert.append(check)
        future.add_done_callback(forget)
        check()
        return future


def _awaitable(future: Any) -> Any:
    if hasattr(future, "__await__"):
        return future
    import asyncio  # noqa: PLC0415 (with rclpy nobody needs it)

    return asyncio.wrap_future(future)
