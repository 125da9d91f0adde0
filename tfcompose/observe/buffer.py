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

from tfcompose.observe.core import CACHE_NS, BufferCore, Row
from tfcompose.observe.exceptions import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)
from tfcompose.observe.frames import FrameInfo, as_string, as_yaml, frame_info
from tfcompose.observe.lookups import Lookups
from tfcompose.observe.refusal import Refusal
from tfcompose.observe.stamped import nanoseconds
from tfcompose.observe.transforms import arrays, transform_for

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tfcompose.observe.trajectory import Trajectory

__all__ = ["CACHE_NS", "Buffer", "BufferCore", "FrameInfo", "Refusal", "Row"]
__all__ += ["ConnectivityException", "ExtrapolationException", "InvalidArgumentException", "LookupException"]
__all__ += ["TimeoutException", "TransformException"]


class Buffer(Lookups):
    """tf2_ros's ``Buffer``: takes and gives messages, and waits.

    Args:
        cache_time: how long samples are kept, a duration; default 10 s.
        node: an rclpy node; when its clock goes back, all moving edges are forgotten. (A listener sees to that, too.)

    Frames, times and durations are given as to tf2; see ``stamped`` for what a time may be. All lookups raise

    - ``InvalidArgumentException`` if a name is empty or starts with a slash,
    - ``LookupException`` if a frame is not known, or the frames above it lead back to it,
    - ``ConnectivityException`` if two frames are in two trees,
    - ``ExtrapolationException`` if an edge between them has no samples around that time.
    """

    def __init__(self, cache_time: Any = None, node: Any = None) -> None:
        super().__init__(CACHE_NS if cache_time is None else nanoseconds(cache_time))
        if node is not None:
            self._jump = import_module("tfcompose.ros.listening").on_clock_jump(node, self.time_jump_callback)

    def set_transform(self, transform: Any, authority: str = "default_authority") -> bool:
        """Take a TransformStamped of a moving edge; return False if it was refused."""
        return not self.insert([_row(transform)], static=False, authority=authority)

    def set_transform_static(self, transform: Any, authority: str = "default_authority") -> bool:
        """Take a TransformStamped of a fixed edge; return False if it was refused."""
        return not self.insert([_row(transform)], static=True, authority=authority)

    def transform(self, object_stamped: Any, target_frame: str, timeout: Any = 0) -> Any:
        """Return a message of the same type in another frame, at the time of its own stamp.

        Known are PointStamped, Vector3Stamped, PoseStamped, PoseWithCovarianceStamped and PointCloud2 (needs numpy).

        Raises:
            TypeException: if it is of another type.
        """
        move = transform_for(object_stamped)
        header = object_stamped.header
        return move(object_stamped, self.lookup_transform(target_frame, header.frame_id, header.stamp, timeout))

    def transform_full(
        self, object_stamped: Any, target_frame: str, target_time: Any, fixed_frame: str, timeout: Any = 0
    ) -> Any:
        """Return a message in another frame at another time, between which ``fixed_frame`` stands still.

        Raises:
            TypeException: if it is of a type that ``transform`` does not know.
        """
        move = transform_for(object_stamped)
        header = object_stamped.header
        return move(
            object_stamped,
            self.lookup_transform_full(target_frame, target_time, header.frame_id, header.stamp, fixed_frame, timeout),
        )

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


def _row(transform: Any) -> Row:
    header, to, turn = transform.header, transform.transform.translation, transform.transform.rotation
    stamp = header.stamp
    return (
        header.frame_id, transform.child_frame_id, stamp.sec, stamp.nanosec, to.x, to.y, to.z,
        turn.x, turn.y, turn.z, turn.w,
    )  # fmt: skip
