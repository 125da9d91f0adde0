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

from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal

from tfcompose.observe.awaiting import Awaits
from tfcompose.observe.core import CACHE_NS, BufferCore, Row
from tfcompose.observe.exceptions import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)
from tfcompose.observe.frames import FrameInfo, as_dot, as_string, as_yaml, frame_info
from tfcompose.observe.interface import BufferInterface
from tfcompose.observe.refusal import Refusal
from tfcompose.observe.stamped import nanoseconds
from tfcompose.observe.transforms import arrays
from tfcompose.observe.velocity import Asked, Velocity, lookup_velocity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from tfcompose.geometry import Pose
    from tfcompose.observe.trajectory import Trajectory

__all__ = ["CACHE_NS", "Buffer", "BufferCore", "FrameInfo", "Refusal", "Row"]
__all__ += ["ConnectivityException", "ExtrapolationException", "InvalidArgumentException", "LookupException"]
__all__ += ["TimeoutException", "TransformException"]


class Buffer(Awaits, BufferInterface):
    """tf2_ros's ``Buffer``: takes and gives messages, and waits.

    Args:
        cache_time: how long samples are kept, a duration; default 10 s.
        node: an rclpy node; when its clock goes back, all moving edges are forgotten. (A listener sees to that, too.)
            Where tf2_msgs is installed it offers the service ``tf2_frames``, which view_frames asks.

    Frames, times and durations are given as to tf2; see ``stamped`` for what a time may be. All lookups raise

    - ``InvalidArgumentException`` if a name is empty or starts with a slash,
    - ``LookupException`` if a frame is not known, or the frames above it lead back to it,
    - ``ConnectivityException`` if two frames are in two trees,
    - ``ExtrapolationException`` if an edge between them has no samples around that time.
    """

    def __init__(self, cache_time: Any = None, node: Any = None) -> None:
        Awaits.__init__(self, CACHE_NS if cache_time is None else nanoseconds(cache_time))
        BufferInterface.__init__(self)
        self._jumps: dict[int, Any] = {}
        if node is not None:
            self.follow_clock(node)
            self.srv = import_module("tfcompose.ros.listening").offer_frames(node, self.all_frames_as_yaml)

    def follow_clock(self, node: Any) -> None:
        """Forget all moving edges whenever the node's clock goes back, or changes between the system's and another."""
        clock = node.get_clock()
        if id(clock) not in self._jumps:
            jump = import_module("tfcompose.ros.listening").on_clock_jump(node, self.time_jump_callback)
            self._jumps[id(clock)] = (clock, jump)

    def set_transform(self, transform: Any, authority: str = "default_authority") -> bool:
        """Take a TransformStamped of a moving edge; return False if it was refused."""
        return not self.insert([_row(transform)], static=False, authority=authority)

    def set_transform_static(self, transform: Any, authority: str = "default_authority") -> bool:
        """Take a TransformStamped of a fixed edge; return False if it was refused."""
        return not self.insert([_row(transform)], static=True, authority=authority)

    def latest(self, target: str, source: str) -> tuple[Pose, int | None]:
        """Return what ``lookup`` does for time 0; the time is None where only fixed edges are on the way."""
        pose, stamp_ns = self.lookup(target, source)
        return pose, stamp_ns or None

    def behind(self, target: str, source: str) -> str | None:
        """Return the moving edge between the two whose newest sample is the oldest, as "parent → child", or None.

        Raises:
            LookupException: if a frame is not known.
            ConnectivityException: if they are in two trees.
        """
        with self._lock:
            moving = self._chain(target, source).moving if target != source else []
            if not moving:
                return None
            last = min(moving, key=lambda history: history.newest_ns)
            return f"{last.parent} → {last.child}"

    def transform_points(self, cloud: ArrayLike, target: str, source: str, stamp: Any = 0) -> NDArray[Any]:
        """Return points given in ``source`` in ``target``, at a time (0: the newest common one). Needs numpy.

        ``cloud`` is N×3, or of any shape (…, 3), in metres; so is the result. float32 stays float32.

        Raises:
            InvalidArgumentException: if the last dimension is not 3.
        """
        pose, _ = self._pose(target, source, nanoseconds(stamp))
        moved: NDArray[Any] = arrays("points").moved_points(cloud, pose)
        return moved

    def lookup_many(
        self, target: str, source: str, stamps: ArrayLike, outside: Literal["raise", "nan"] = "raise"
    ) -> Trajectory:
        """Return the poses of ``source`` in ``target`` at many times at once. Needs numpy.

        ``stamps`` are N integers, nanoseconds; 0 is the newest common time. What comes back is (``xyz`` N×3 in metres,
        ``quat_xyzw`` N×4), and has ``matrices()`` (N×4×4): row by row what ``lookup`` returns. For a time that an edge
        does not know, ``outside`` decides: raise ``ExtrapolationException``, or give a row of NaN.
        """
        found: Trajectory = arrays("trajectory").lookup_many(self, target, source, stamps, outside)
        return found

    def lookup_velocity(  # noqa: PLR0913, PLR0917 (tf2's arguments)
        self, tracking_frame: str, observation_frame: str, time: Any, averaging_interval: Any,
        reference_frame: str = "", reference_point: Sequence[float] = (0.0, 0.0, 0.0), reference_point_frame: str = "",
    ) -> Velocity:  # fmt: skip
        """Return how fast one frame moves as seen from another: (``linear`` m/s, ``angular`` rad/s).

        It is the mean over ``averaging_interval`` around a time (0: up to the newest), with the axes of
        ``reference_frame``, default the observation frame. Linear is the velocity of the tracking frame's origin, or of
        another point that moves along with it. (tf2's ``lookupVelocity`` says the same of what does not turn and stands
        like the reference frame; of what turns it mixes up the axes.)
        """
        x, y, z = reference_point
        asked = Asked(
            tracking_frame, observation_frame, reference_frame or observation_frame, (x, y, z),
            reference_point_frame or tracking_frame,
        )  # fmt: skip
        return lookup_velocity(self, asked, nanoseconds(time), nanoseconds(averaging_interval))

    def lookupVelocityCore(  # noqa: N802 (tf2_py's name)
        self, tracking_frame: str, observation_frame: str, time: Any, averaging_interval: Any
    ) -> Velocity:
        """Return what ``lookup_velocity`` does."""
        return self.lookup_velocity(tracking_frame, observation_frame, time, averaging_interval)

    def lookupVelocityFullCore(  # noqa: N802, PLR0913, PLR0917 (tf2_py's name and arguments)
        self, tracking_frame: str, observation_frame: str, reference_frame: str, reference_point: Sequence[float],
        reference_point_frame: str, time: Any, averaging_interval: Any,
    ) -> Velocity:  # fmt: skip
        """Return what ``lookup_velocity`` does."""
        return self.lookup_velocity(
            tracking_frame, observation_frame, time, averaging_interval,
            reference_frame, reference_point, reference_point_frame,
        )  # fmt: skip

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

    def _allFramesAsDot(self, time: Any = 0) -> str:  # noqa: ARG002, N802 (tf2_py's name)
        """Return the edges as a graph for graphviz."""
        return as_dot(self.all_frames())

    def _frameExists(self, frame_id: str) -> bool:  # noqa: N802 (tf2_py's name)
        """Return whether the frame was heard of."""
        return frame_id in self.frames

    def _getFrameStrings(self) -> list[str]:  # noqa: N802 (tf2_py's name)
        """Return every frame that was heard of, in the order in which they were."""
        return [frame.name for frame in self.all_frames()]

    def time_jump_callback(self, time_jump: object = None) -> None:  # noqa: ARG002 (what rclpy's clock gives)
        """Forget all samples of moving edges, since the clock went back."""
        self.clear()


def _row(transform: Any) -> Row:
    header, to, turn = transform.header, transform.transform.translation, transform.transform.rotation
    stamp = header.stamp
    return (
        header.frame_id, transform.child_frame_id, stamp.sec, stamp.nanosec, to.x, to.y, to.z,
        turn.x, turn.y, turn.z, turn.w,
    )  # fmt: skip
