"""Mean velocity of a frame relative to another frame.

The velocity follows from the poses at the start and the end of an interval.
"""

from __future__ import annotations

from math import atan2, sqrt
from typing import TYPE_CHECKING, NamedTuple

from tfcompose.tf.tf2.poses import PoseTuple, product

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    #: Maps (target, source, time) to the pose of ``source`` in ``target``. The time is in
    #: nanoseconds; 0 means the newest pose.
    PoseOf = Callable[[str, str, int], PoseTuple]

Three = tuple[float, float, float]

#: Earliest start of an interval, in nanoseconds since the epoch, as in tf2. It is not 0, because
#: time 0 means the newest pose.
_EARLIEST_NS = 10_000


class Velocity(NamedTuple):
    """Velocity of a frame, each part as x y z."""

    #: In m/s.
    linear: Three
    #: In rad/s.
    angular: Three


class VelocityQuery(NamedTuple):
    """The velocity to compute, in the terms of tf2's ``lookupVelocity``."""

    #: The moving frame.
    tracking_frame: str
    #: The frame in which it moves.
    observation_frame: str
    #: The frame that determines the axes of the result; empty for ``observation_frame``.
    reference_frame: str = ""
    #: The point whose velocity is computed, attached to the moving frame: x y z in metres.
    reference_point: Sequence[float] = (0.0, 0.0, 0.0)
    #: The frame of ``reference_point``; empty for ``tracking_frame``.
    reference_point_frame: str = ""


def mean_velocity(
    pose_of: PoseOf, moving: VelocityQuery, begin_ns: int, end_ns: int, at_ns: int
) -> Velocity:
    """Return the mean velocity from ``begin_ns`` to ``end_ns``.

    The axes and the reference point are those at ``at_ns`` (0: newest). An interval never begins
    earlier than 10 µs after the epoch. An earlier ``begin_ns`` shortens the interval.
    """
    tracking, observation = moving.tracking_frame, moving.observation_frame
    begin_ns = max(begin_ns, _EARLIEST_NS)
    first, last = pose_of(observation, tracking, begin_ns), pose_of(observation, tracking, end_ns)
    axes = pose_of(moving.reference_frame or observation, observation, at_ns)
    point = pose_of(observation, moving.reference_point_frame or tracking, at_ns)
    origin = pose_of(observation, tracking, at_ns)
    seconds = (end_ns - begin_ns or 1) / 1e9
    x, y, z = moving.reference_point
    angular = _angular_velocity(first, last, seconds)
    arm = [
        a - b for a, b in zip(product(point, (x, y, z, 0.0, 0.0, 0.0, 1.0)), origin, strict=True)
    ]
    carried = _cross(angular, (arm[0], arm[1], arm[2]))
    linear = [(b - a) / seconds + c for a, b, c in zip(first[:3], last[:3], carried, strict=True)]
    return Velocity(_rotate(axes, (linear[0], linear[1], linear[2])), _rotate(axes, angular))


def _angular_velocity(first: PoseTuple, last: PoseTuple, seconds: float) -> Three:
    """Return the angular velocity of the shortest rotation, in the parent's axes."""
    ax, ay, az, aw = first[3:]
    *_, x, y, z, w = product((0.0, 0.0, 0.0, *last[3:]), (0.0, 0.0, 0.0, -ax, -ay, -az, aw))
    length = sqrt(x * x + y * y + z * z)
    if not length:
        return 0.0, 0.0, 0.0
    rate = 2 * atan2(length, abs(w)) / (length * seconds) * (1 if w >= 0 else -1)
    return x * rate, y * rate, z * rate


def _rotate(pose: PoseTuple, vector: Three) -> Three:
    return product((0.0, 0.0, 0.0, *pose[3:]), (*vector, 0.0, 0.0, 0.0, 1.0))[:3]


def _cross(a: Three, b: Three) -> Three:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
