"""How fast one frame moves as seen from another: tf2's ``lookupVelocity``, from the ends of a stretch of time."""

from __future__ import annotations

from math import atan2, sqrt
from typing import TYPE_CHECKING, NamedTuple

from tfcompose.observe.rotation import product

if TYPE_CHECKING:
    from tfcompose.observe.core import BufferCore
    from tfcompose.observe.rotation import Seven

Three = tuple[float, float, float]


class Velocity(NamedTuple):
    """``linear`` in m/s and ``angular`` in rad/s, each x y z."""

    linear: Three
    angular: Three


class Asked(NamedTuple):
    """The velocity of ``tracking`` seen from ``observation``, with the axes of ``reference``.

    ``linear`` is that of ``point`` (metres, in ``point_frame``), which moves along with ``tracking``.
    """

    tracking: str
    observation: str
    reference: str
    point: Three
    point_frame: str


def lookup_velocity(buffer: BufferCore, asked: Asked, time_ns: int, interval_ns: int) -> Velocity:
    """Return the mean velocity over ``interval_ns`` around a time (0: up to the newest), as far as samples go.

    Raises:
        ValueError: if the interval is not positive.
        TransformException: as ``lookup`` does, if a frame is missing or a time is outside the samples.
    """
    if interval_ns <= 0:
        raise ValueError(f"a velocity is a mean over some time, not over {interval_ns} ns")
    with buffer.at_rest():
        _, newest_ns = buffer.lookup(asked.observation, asked.tracking)
        if not newest_ns and not time_ns:
            return Velocity((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))  # only fixed edges
        end_ns = min(time_ns + interval_ns // 2, newest_ns) if time_ns and newest_ns else time_ns or newest_ns
        first, last = (
            _seven(buffer, asked.observation, asked.tracking, stamp_ns) for stamp_ns in (end_ns - interval_ns, end_ns)
        )
        at_ns = time_ns or end_ns
        turned = _seven(buffer, asked.reference, asked.observation, at_ns)
        point = _seven(buffer, asked.observation, asked.point_frame, at_ns)
        origin = _seven(buffer, asked.observation, asked.tracking, at_ns)
    seconds = interval_ns / 1e9
    angular = _turn(first, last, seconds)
    arm = [a - b for a, b in zip(product(point, (*asked.point, 0.0, 0.0, 0.0, 1.0)), origin, strict=False)][:3]
    carried = _cross(angular, (arm[0], arm[1], arm[2]))
    linear = [(b - a) / seconds + c for a, b, c in zip(first, last, carried, strict=False)]
    return Velocity(_turned(turned, (linear[0], linear[1], linear[2])), _turned(turned, angular))


def _seven(buffer: BufferCore, target: str, source: str, stamp_ns: int) -> Seven:
    pose, _ = buffer.lookup(target, source, stamp_ns)
    return (*pose.xyz, *pose.quat_xyzw)


def _turn(first: Seven, last: Seven, seconds: float) -> Three:
    """Return the angular velocity that turns the first into the last the short way, in their parent's axes."""
    ax, ay, az, aw = first[3:]
    *_, x, y, z, w = product((0.0, 0.0, 0.0, *last[3:]), (0.0, 0.0, 0.0, -ax, -ay, -az, aw))
    length = sqrt(x * x + y * y + z * z)
    if not length:
        return 0.0, 0.0, 0.0
    rate = 2 * atan2(length, abs(w)) / (length * seconds) * (1 if w >= 0 else -1)
    return x * rate, y * rate, z * rate


def _turned(pose: Seven, vector: Three) -> Three:
    return product((0.0, 0.0, 0.0, *pose[3:]), (*vector, 0.0, 0.0, 0.0, 1.0))[:3]


def _cross(a: Three, b: Three) -> Three:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
