"""tf2_py's ``BufferCore``: a buffer that accepts and returns messages, without waiting.

Frames, times and durations have the types that tf2 accepts; see ``messages`` for times. All
lookups raise

- ``InvalidArgumentException`` if a name is empty or starts with a slash,
- ``LookupException`` if a frame is unknown, or the frames above it form a loop,
- ``ConnectivityException`` if two frames are in two trees,
- ``ExtrapolationException`` if an edge between them has no samples around that time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.tf.tf2.exceptions import TransformException
from tfcompose.tf.tf2.messages import complete_rclpy, nanoseconds, time_of, transform_stamped
from tfcompose.tf.tf2.pose_buffer import CACHE_NS, FrameInfo, PoseBuffer, Row
from tfcompose.tf.tf2.velocity import Velocity, VelocityQuery, mean_velocity

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from tfcompose.tf.tf2.poses import PoseTuple

_SECOND_NS = 1_000_000_000
# tf2 divides by at least this, in seconds, so that a frame with a single sample has a rate of
# 10,000.
_SHORTEST_S = 100e-6


class BufferCore(PoseBuffer):
    """tf2_py's ``BufferCore``.

    Args:
        cache_time: how long samples are kept before the newest of their edge, a duration; default
            10 s.
    """

    def __init__(self, cache_time: Any = None) -> None:
        complete_rclpy()
        super().__init__(CACHE_NS if cache_time is None else nanoseconds(cache_time))

    # Transforms in.

    def set_transform(self, transform: Any, authority: str = "default_authority") -> None:
        """Insert a TransformStamped of a moving edge. Drop it if tf2 would reject it.

        ``set`` returns whether it was rejected.
        """
        self.insert([_row(transform)], static=False, authority=authority)

    def set_transform_static(self, transform: Any, authority: str = "default_authority") -> None:
        """Insert a TransformStamped of a fixed edge. Drop it if tf2 would reject it."""
        self.insert([_row(transform)], static=True, authority=authority)

    # Lookups.

    def lookup_transform_core(self, target_frame: str, source_frame: str, time: Any) -> Any:
        """Return the pose of ``source_frame`` in ``target_frame`` as a TransformStamped.

        The pose maps coordinates in the source frame to the target frame. The stamp is the given
        time, or the time that 0 resolves to.
        """
        pose, stamp_ns = self._pose(target_frame, source_frame, nanoseconds(time))
        return transform_stamped(target_frame, source_frame, stamp_ns, pose)

    def lookup_transform_full_core(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
    ) -> Any:
        """Return the pose of the source frame at a time in the target frame at another time.

        ``fixed_frame`` is assumed not to move between the times. The stamp is the target's time.
        """
        target_ns, source_ns = nanoseconds(target_time), nanoseconds(source_time)
        pose, stamp_ns = self._full_pose(
            target_frame, target_ns, source_frame, source_ns, fixed_frame
        )
        return transform_stamped(target_frame, source_frame, stamp_ns, pose)

    def can_transform_core(
        self, target_frame: str, source_frame: str, time: Any
    ) -> tuple[bool, str]:
        """Return whether ``lookup_transform_core`` would succeed, and the reason if not."""
        return _possible(lambda: self.lookup_transform_core(target_frame, source_frame, time))

    def can_transform_full_core(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
    ) -> tuple[bool, str]:
        """Return whether ``lookup_transform_full_core`` would succeed, and the reason if not."""
        query = target_frame, target_time, source_frame, source_time, fixed_frame
        return _possible(lambda: self.lookup_transform_full_core(*query))

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> Any:
        """Return the newest time that all moving edges between the frames have reached.

        0 if no edge moves.
        """
        with self._lock:
            if target_frame == source_frame:
                self._require(target_frame, "target_frame")
                return time_of(self._newest_ns(target_frame))
            return time_of(self._chain_between(target_frame, source_frame).common_ns())

    # Velocities.

    def lookup_velocity(  # noqa: PLR0913, PLR0917 (tf2's arguments)
        self,
        tracking_frame: str,
        observation_frame: str,
        time: Any,
        averaging_interval: Any,
        reference_frame: str = "",
        reference_point: Sequence[float] = (0.0, 0.0, 0.0),
        reference_point_frame: str = "",
    ) -> Velocity:
        """Return the velocity of a frame in another frame (``linear`` m/s, ``angular`` rad/s).

        It is the mean over ``averaging_interval`` around a time (0: up to the newest), limited to
        the available samples. Its axes are those of ``reference_frame``, by default the
        observation frame. The linear velocity is that of the tracking frame's origin, or of
        another point that moves with it. tf2's ``lookupVelocity`` returns the same if nothing
        rotates and the axes agree. If something rotates, it mixes up the axes. An interval that
        would begin before the epoch begins 10 µs after it, as in tf2.

        Raises:
            ValueError: if the interval is not positive.
        """
        moving = VelocityQuery(
            tracking_frame,
            observation_frame,
            reference_frame,
            reference_point,
            reference_point_frame,
        )
        return self._velocity(
            moving, nanoseconds(time), averaging_interval, up_to_newest=not nanoseconds(time)
        )

    def lookupVelocityCore(  # noqa: N802 (tf2_py's name)
        self, tracking_frame: str, observation_frame: str, time: Any, averaging_interval: Any
    ) -> Velocity:
        """Return the same as ``lookup_velocity``, but time 0 is the epoch, as in tf2."""
        return self._velocity(
            VelocityQuery(tracking_frame, observation_frame), nanoseconds(time), averaging_interval
        )

    def lookupVelocityFullCore(  # noqa: N802, PLR0913, PLR0917 (tf2_py's name and arguments)
        self,
        tracking_frame: str,
        observation_frame: str,
        reference_frame: str,
        reference_point: Sequence[float],
        reference_point_frame: str,
        time: Any,
        averaging_interval: Any,
    ) -> Velocity:
        """Return the same as ``lookup_velocity``, but time 0 is the epoch, as in tf2."""
        moving = VelocityQuery(
            tracking_frame,
            observation_frame,
            reference_frame,
            reference_point,
            reference_point_frame,
        )
        return self._velocity(moving, nanoseconds(time), averaging_interval)

    def _velocity(
        self, moving: VelocityQuery, time_ns: int, interval: Any, *, up_to_newest: bool = False
    ) -> Velocity:
        interval_ns = nanoseconds(interval)
        if interval_ns <= 0:
            raise ValueError(f"a velocity is a mean over some time, not over {interval_ns} ns")

        def pose_of(target: str, source: str, stamp_ns: int) -> PoseTuple:
            return self._pose(target, source, stamp_ns)[0]

        with self._lock:
            _, newest_ns = self._pose(moving.observation_frame, moving.tracking_frame, 0)
            end_ns = newest_ns if up_to_newest else time_ns + interval_ns // 2
            end_ns = min(end_ns, newest_ns) if newest_ns else end_ns
            return mean_velocity(pose_of, moving, end_ns - interval_ns, end_ns, time_ns)

    # The buffer's content, as tf2's tools print it.

    def all_frames_as_string(self) -> str:
        """Return a line for each edge, in tf2's words."""
        return "".join(
            f"Frame {frame.name} exists with parent {frame.parent}.\n"
            for frame in _edges(self.all_frames())
        )

    def all_frames_as_yaml(self) -> str:
        """Return each edge's rate and times, as tf2's ``tf2_frames`` service does."""
        return "".join(map(_yaml, _edges(self.all_frames()))) or "[]"

    def _allFramesAsDot(self, time: Any = 0) -> str:  # noqa: ARG002, N802 (tf2_py's name)
        """Return the edges as graphviz text with sender, rate and times."""
        return f"digraph G {{\n{''.join(map(_dot, _edges(self.all_frames())))}}}"

    def _frameExists(self, frame_id: str) -> bool:  # noqa: N802 (tf2_py's name)
        """Return whether the frame is known."""
        return frame_id in self.frames

    def _getFrameStrings(self) -> list[str]:  # noqa: N802 (tf2_py's name)
        """Return every known frame, in the order of their first appearance."""
        return [frame.name for frame in self.all_frames()]

    def _chain(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
    ) -> list[str]:
        """Return the child frames of edges from the source to the fixed frame and the target.

        If both times are equal, the path ends at the fixed frame, as in tf2.
        """
        times = nanoseconds(source_time), nanoseconds(target_time)
        with self._lock:
            children = self._chain_between(fixed_frame, source_frame, times[0]).children
            if times[0] == times[1]:
                return list(children)
            return [*children, *self._chain_between(target_frame, fixed_frame, times[1]).children]


def _row(transform: Any) -> Row:
    sec, nanosec = divmod(nanoseconds(transform.header.stamp), _SECOND_NS)
    to, rotation = transform.transform.translation, transform.transform.rotation
    names = transform.header.frame_id, transform.child_frame_id
    return (*names, sec, nanosec, to.x, to.y, to.z, rotation.x, rotation.y, rotation.z, rotation.w)


def _possible(lookup: Callable[[], object]) -> tuple[bool, str]:
    try:
        lookup()
    except TransformException as error:
        return False, str(error)
    return True, ""


def _edges(frames: Iterable[FrameInfo]) -> Iterable[FrameInfo]:
    return (frame for frame in frames if frame.parent)


def _dot(frame: FrameInfo) -> str:
    length_s = (frame.newest_ns - frame.oldest_ns) / 1e9
    label = (
        f"Broadcaster: {frame.authority or 'default_authority'}\\n"
        f"Average rate: {_rate(frame, length_s):.3f} Hz\\n"
        f"Most recent transform: {frame.newest_ns / 1e9:.6f} \\n"
        f"Buffer length: {length_s:.3f} sec\\n"
    )
    ends = " -> ".join(f'"{name}"' for name in (frame.parent, frame.name))
    return f'{ends}[label="{label}"];\n'


def _rate(frame: FrameInfo, length_s: float) -> float:
    return frame.samples / max(length_s, _SHORTEST_S)


def _yaml(frame: FrameInfo) -> str:
    length_s = (frame.newest_ns - frame.oldest_ns) / 1e9
    return (
        f"{frame.name}: \n"
        f"  parent: '{frame.parent}'\n"
        f"  broadcaster: '{frame.authority or 'default_authority'}'\n"
        f"  rate: {_rate(frame, length_s):.3f}\n"
        f"  most_recent_transform: {frame.newest_ns / 1e9:.6f}\n"
        f"  oldest_transform: {frame.oldest_ns / 1e9:.6f}\n"
        f"  buffer_length: {length_s:.3f}\n"
    )
