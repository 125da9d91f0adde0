"""IMU checks: gravity, yaw rate and acceleration against the declared mount.

Where gravity and yaw rate point along one other axis, the IMU is mounted another way than the
file declares. Where they contradict each other, no mount fits: the driver has a sign wrong. An
accelerometer at rest measures +9.81 m/s² along the axis that points up (REP-145).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import permutations, product
from typing import TYPE_CHECKING

import numpy as np

from tfcompose.foundation.geometry import matrix_from_quat, quat_from_matrix, rpy_from_quat
from tfcompose.tools.prove.verdict import CheckResult

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from tfcompose.foundation.geometry import Quaternion
    from tfcompose.tools.prove.motion import Estimate, Motion

    Array = NDArray[np.float64]

G = 9.80665
_UP = np.array([0.0, 0.0, 1.0])
#: An accelerometer's scale, and a driving base, may be off by this factor.
_G_RANGE = (0.93, 1.07)
#: Odometry's yaw rate may be off by this factor: wheels slip.
_RATE_RANGE = (0.75, 1.33)
#: Between these angles two axes neither agree nor are opposite.
_SAME_RAD, _OPPOSITE_RAD = math.radians(20), math.radians(160)
#: Yaw from accelerations is known only this well, in radians; larger errors are found.
_YAW_RAD = math.radians(20)
#: An estimate whose standard error is larger says nothing, in radians.
_VAGUE_RAD = math.radians(5)
#: Beyond this tilt gravity alone does not tell a mount from a sign.
_UPSIDE_DOWN_RAD = math.radians(150)
#: Standard errors by which a measurement has to be beyond its limit.
_SIGMAS = 3.0


@dataclass(frozen=True, slots=True)
class ImuCheck:
    """What an IMU measures, against the declared rotation of its frame in the base."""

    motion: Motion
    base_from_frame: Array
    #: By how much gravity may be tilted, in radians.
    limit_rad: float

    def judge(self) -> Iterator[CheckResult]:
        """Yield the judgements on gravity, yaw rate and heading."""
        yield self._judge_gravity()
        yield from self._judge_yaw_rate()
        yield from self._judge_heading()

    def _judge_gravity(self) -> CheckResult:
        up, check = self.motion.up, "gravity"
        if up is None:
            return CheckResult(check, "cannot tell", "too few messages came")
        if not _within(up.length / G, _G_RANGE):
            return self._judge_force(up)
        tilt = self._tilt_rad(up)
        values = {"tilt_rad": tilt, "error_rad": up.error_rad}
        measured = (
            f"{math.degrees(tilt):.1f} ± {max(0.01, math.degrees(up.error_rad)):.1g} deg from up"
        )
        if not self._is_beyond(tilt, up):
            if self._is_vague(up):
                reason = f"gravity scatters by {math.degrees(up.error_rad):.0f} deg"
                return CheckResult(check, "cannot tell", reason, values=values)
            return CheckResult(check, "agrees", measured, values=values)
        if self._signs_differ() and tilt > _UPSIDE_DOWN_RAD:
            text = "measures gravity downward while its yaw rate agrees"
            advice = (
                "the driver reports gravity instead of the force against it (REP-145):"
                " change the sign of linear_acceleration"
            )
            return CheckResult(check, "differs", text, "TF651", advice, values=values)
        text = f"measures gravity {measured} in the declared mount"
        rotation, why_not = self._fit(up)
        if rotation is None:
            return CheckResult(check, "differs", text, "TF650", why_not, values=values)
        forward = self.motion.forward
        advice = ""
        if forward is None or forward.error_rad > _VAGUE_RAD:
            advice = "; its heading is not measured: speed up and brake while prove listens"
        return CheckResult(
            check,
            "differs",
            text,
            code="TF650",
            help=advice,
            base_from_frame_xyzw=rotation,
            values=values,
        )

    def _judge_force(self, up: Estimate) -> CheckResult:
        values = {"force_m_s2": up.length}
        text = f"measures gravity as {up.length:.2f} m/s²"
        advice = "check the driver's scale; REP-145 has m/s²"
        if _within(up.length, _G_RANGE):
            advice = "the driver reports g: multiply linear_acceleration by 9.81"
        elif up.length < 1.0:
            text = f"measures no gravity: {up.length:.2f} m/s²"
            advice = "the driver removes gravity: linear_acceleration has to contain it (REP-145)"
        return CheckResult("gravity", "differs", text, "TF651", advice, values=values)

    def _judge_yaw_rate(self) -> Iterator[CheckResult]:
        """Yield the judgement on the gyroscope; none if gravity shows the same other mount."""
        axis, check = self.motion.yaw_axis, "yaw rate"
        if axis is None:
            degrees = math.degrees(self.motion.yaw_rate_std)
            reason = f"the base hardly rotates by odometry ({degrees:.1f} deg/s): drive curves"
            yield CheckResult(check, "cannot tell", reason)
            return
        if self._is_vague(axis):
            degrees = math.degrees(axis.error_rad)
            reason = f"the axis of its rates scatters by {degrees:.0f} deg"
            yield CheckResult(check, "cannot tell", reason)
            return
        tilt = self._tilt_rad(axis)
        values = {"scale": axis.length, "tilt_rad": tilt, "error_rad": axis.error_rad}
        measured = f"{axis.length:.3g} of odometry's, {_axis_name(self.base_from_frame, axis)}"
        if not _within(axis.length, _RATE_RANGE):
            text = f"measures a yaw rate {axis.length:.3g} times odometry's"
            advice = "check the scales of the IMU's driver and of the odometry"
            if _within(axis.length / math.degrees(1), _RATE_RANGE):
                text += ": degrees per second"
                advice = "the driver has to report rad/s (REP-103)"
            elif _within(axis.length * math.degrees(1), _RATE_RANGE):
                advice = "the driver converts to radians twice"
            yield CheckResult(check, "differs", text, "TF651", advice, values=values)
            return
        if tilt <= _SAME_RAD:
            yield CheckResult(check, "agrees", measured, values=values)
            return
        up = self.motion.up
        if up is None or not _within(up.length / G, _G_RANGE):
            text = f"measures the base's yaw {_axis_name(self.base_from_frame, axis)}"
            advice = "gravity is not measured, so the mount is not known"
            yield CheckResult(check, "differs", text, "TF651", advice, values=values)
            return
        apart = _angle(axis.direction, up.direction)
        if apart <= _SAME_RAD:
            return
        text = f"measures the base's yaw {_axis_name(self.base_from_frame, axis)}"
        advice = "the driver swaps axes of angular_velocity: gravity does not fit them"
        if apart >= _OPPOSITE_RAD:
            text = "measures a negative yaw rate while the base rotates to the left by odometry"
            advice = (
                "the driver, or the odometry, has the wrong sign: z is positive counter-clockwise"
                " (REP-103)"
            )
        yield CheckResult(check, "differs", text, "TF651", advice, values=values)
        return

    def _judge_heading(self) -> Iterator[CheckResult]:
        """Yield whether accelerations point forward; nothing if gravity shows another mount."""
        forward, up = self.motion.forward, self.motion.up
        if up is None or self._is_beyond(self._tilt_rad(up), up):
            return
        if forward is None or forward.error_rad > _VAGUE_RAD:
            reason = "the base hardly accelerates by odometry: speed up and brake"
            yield CheckResult("heading", "cannot tell", reason)
            return
        if not _within(forward.length, (0.5, 2.0)):
            reason = "accelerations do not follow odometry's"
            yield CheckResult("heading", "cannot tell", reason)
            return
        x, y, _ = self.base_from_frame @ forward.direction
        yaw = math.atan2(y, x)
        error = math.degrees(forward.error_rad)
        values = {"yaw_rad": yaw, "error_rad": forward.error_rad}
        text = f"{math.degrees(yaw):.1f} ± {error:.1f} deg from forward"
        if abs(yaw) <= _YAW_RAD + _SIGMAS * forward.error_rad:
            yield CheckResult("heading", "agrees", text, values=values)
            return
        rotation, _ = self._fit(up)
        text = f"measures forward accelerations {text} in the declared mount"
        yield CheckResult(
            "heading", "differs", text, "TF650", base_from_frame_xyzw=rotation, values=values
        )
        return

    def _fit(self, up: Estimate) -> tuple[Quaternion | None, str]:
        """Return the rotation of the frame in the base that fits, else why there is none."""
        declared, forward = self.base_from_frame, self.motion.forward
        tilt, axis = self._tilt_rad(up), self.motion.yaw_axis
        if axis is not None and _angle(axis.direction, up.direction) > _SAME_RAD:
            return None, "gravity and yaw rate do not fit one mount: check the driver's axes"
        if tilt > _UPSIDE_DOWN_RAD and axis is None:
            return None, "it is upside down, or the driver has the wrong sign: drive curves"
        if tilt > _UPSIDE_DOWN_RAD:
            # Any horizontal axis would do, so the usual one: it is upside down about x.
            declared = np.diag([1.0, -1.0, -1.0]) @ declared
        level = _level(declared, up.direction)
        if forward is not None and forward.error_rad <= _VAGUE_RAD:
            x, y, _ = level @ forward.direction
            if abs(math.atan2(y, x)) > _YAW_RAD + _SIGMAS * forward.error_rad:
                level = _frame_of(forward.direction, up.direction)
        return _quat(self._snap(up, level)), ""

    def _snap(self, up: Estimate, rotation: Array) -> Array:
        """Return quarter rotations of the declared mount if they fit as well, else this."""
        near = min(
            (
                candidate
                for quarter in _quarter_rotations()
                for candidate in (quarter @ self.base_from_frame, quarter)
            ),
            key=lambda candidate: _apart(candidate, rotation),
        )
        limit = max(self.limit_rad, _YAW_RAD / 2)
        if _apart(near, rotation) > limit or _angle(near @ up.direction, _UP) > self.limit_rad:
            return rotation
        return near

    def _tilt_rad(self, estimate: Estimate) -> float:
        return _angle(self.base_from_frame @ estimate.direction, _UP)

    def _is_beyond(self, tilt_rad: float, estimate: Estimate) -> bool:
        return tilt_rad > self.limit_rad + _SIGMAS * estimate.error_rad

    def _is_vague(self, estimate: Estimate) -> bool:
        return estimate.error_rad > _VAGUE_RAD

    def _signs_differ(self) -> bool:
        up, axis = self.motion.up, self.motion.yaw_axis
        if up is None or axis is None:
            return False
        return _angle(up.direction, axis.direction) >= _OPPOSITE_RAD


def describe_rotation(quat_xyzw: Quaternion) -> str:
    """Return a rotation as roll, pitch and yaw in degrees."""
    angles = (round(math.degrees(angle), 1) + 0.0 for angle in rpy_from_quat(quat_xyzw))
    return f"rpy: [{', '.join(f'{angle:g} deg' for angle in angles)}]"


def matrix_of(quat_xyzw: Quaternion) -> Array:
    """Return the rotation matrix, shape (3, 3)."""
    return np.array(matrix_from_quat(quat_xyzw))


def _quat(rotation: Array) -> Quaternion:
    rows = tuple((float(row[0]), float(row[1]), float(row[2])) for row in rotation)
    return quat_from_matrix((rows[0], rows[1], rows[2]))


def _within(value: float, bounds: tuple[float, float]) -> bool:
    return bounds[0] <= value <= bounds[1]


def _angle(a: Array, b: Array) -> float:
    return math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b))


def _apart(a: Array, b: Array) -> float:
    return math.acos(float(np.clip((np.trace(a.T @ b) - 1) / 2, -1, 1)))


def _frame_of(forward: Array, up: Array) -> Array:
    """Return the rotation that maps these directions of a frame to x and z of the base."""
    left = np.cross(up, forward)
    left /= np.linalg.norm(left)
    return np.vstack([np.cross(left, up), left, up])


def _level(rotation: Array, up: Array) -> Array:
    """Return the smallest change of a rotation that maps ``up`` to z."""
    begin = rotation @ up
    axis = np.cross(begin, _UP)
    sine, cosine = float(np.linalg.norm(axis)), float(begin @ _UP)
    if sine < 1e-9:  # noqa: PLR2004 (rounding: there is nothing to change)
        return rotation
    x, y, z = axis / sine
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    change: Array = np.identity(3) + sine * skew + (1 - cosine) * skew @ skew
    return change @ rotation


def _quarter_rotations() -> Iterator[Array]:
    """Yield the 24 rotations by quarter turns about the axes."""
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0:
                yield matrix


def _axis_name(base_from_frame: Array, estimate: Estimate) -> str:
    """Return the nearest axis of the base to a direction: ``about -z``."""
    direction = base_from_frame @ estimate.direction
    index = int(np.argmax(np.abs(direction)))
    sign = "-" if direction[index] < 0 else ""
    return f"about {sign}{'xyz'[index]}"
