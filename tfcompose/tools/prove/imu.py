"""Checks of an IMU's mount: gravity, yaw rate and acceleration.

An accelerometer at rest measures +9.81 m/s² along the axis that points up (REP-145). If gravity
and yaw rate both point along the same other axis, the mount differs from the robot file. If they
contradict each other, no mount fits, and the driver has a wrong sign.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tfcompose.tools.prove.motion import STEADY, Estimate
from tfcompose.tools.prove.rotations import UP, angle_of, frame_of, level, quat_of, snap
from tfcompose.tools.prove.verdict import CheckResult

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from tfcompose.foundation.geometry import Quaternion
    from tfcompose.tools.prove.motion import Motion

    Array = NDArray[np.float64]

G = 9.80665
#: The accepted range of measured gravity, as a factor of g. It allows for an accelerometer's scale
#: error and for the motion of the base.
_G_RANGE = (0.93, 1.07)
#: The accepted range of the measured yaw rate, as a factor of odometry's yaw rate. It allows for
#: slipping wheels.
_RATE_RANGE = (0.75, 1.33)
#: Two axes agree below the first angle, and are opposite above the second, in radians.
_SAME_RAD, _OPPOSITE_RAD = math.radians(20), math.radians(160)
#: The accuracy of a yaw that is measured by accelerations, in radians. Only larger differences are
#: reported.
_YAW_RAD = math.radians(20)
#: A constant bias of the accelerometer looks like a tilt, for every motion on a level floor. This
#: is the tilt in radians for a bias of 15 mg, which is typical of data sheets of MEMS
#: accelerometers.
_BIAS_RAD = 0.015
#: The largest standard error of a usable estimate, in radians.
_VAGUE_RAD = math.radians(5)
#: The tilt in radians above which gravity alone cannot distinguish a wrong mount from a wrong
#: sign.
_UPSIDE_DOWN_RAD = math.radians(150)
#: A measurement differs only if it exceeds its limit by this many standard errors.
_SIGMAS = 3.0


@dataclass(frozen=True, slots=True)
class ImuCheck:
    """Compares an IMU's measurements with the declared rotation of its frame in the base."""

    motion: Motion
    base_from_frame: Array
    #: The largest accepted tilt of gravity, in radians.
    limit_rad: float

    def judge(self) -> Iterator[CheckResult]:
        """Yield the results of the checks of gravity, yaw rate and heading."""
        yield self._judge_gravity()
        yield from self._judge_yaw_rate()
        yield from self._judge_heading()

    def _judge_gravity(self) -> CheckResult:
        up, check = self.motion.up, "gravity"
        if isinstance(up, str):
            return CheckResult(check, "cannot tell", up)
        if not _within(up.length / G, _G_RANGE):
            return self._judge_force(up)
        tilt = self._tilt_rad(up)
        error = math.hypot(up.error_rad, _BIAS_RAD)
        values = {"tilt_rad": tilt, "error_rad": error}
        measured = f"{math.degrees(tilt):.1f} ± {math.degrees(error):.1f} deg from up"
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
        if isinstance(forward, str) or forward.error_rad > _VAGUE_RAD:
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
        """Yield the result for the gyroscope.

        Yield nothing if gravity already shows the same other mount.
        """
        axis, check = self.motion.yaw_axis, "yaw rate"
        if isinstance(axis, str):
            yield CheckResult(check, "cannot tell", axis)
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
        if isinstance(up, str) or not _within(up.length / G, _G_RANGE):
            text = f"measures the base's yaw {_axis_name(self.base_from_frame, axis)}"
            advice = "gravity is not measured, so the mount is not known"
            yield CheckResult(check, "differs", text, "TF651", advice, values=values)
            return
        apart = angle_of(axis.direction, up.direction)
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

    def _judge_heading(self) -> Iterator[CheckResult]:
        """Yield the result for the direction of accelerations.

        Yield nothing if gravity already shows another mount.
        """
        forward, up = self.motion.forward, self.motion.up
        if isinstance(up, str):
            yield CheckResult("heading", "cannot tell", up)
            return
        if self._is_beyond(self._tilt_rad(up), up):
            return
        if isinstance(forward, str) or forward.error_rad > _VAGUE_RAD:
            reason = forward if isinstance(forward, str) else STEADY
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

    def _fit(self, up: Estimate) -> tuple[Quaternion | None, str]:
        """Return the fitting rotation of the frame in the base, or why there is none."""
        declared, forward = self.base_from_frame, self.motion.forward
        tilt, axis = self._tilt_rad(up), self.motion.yaw_axis
        if isinstance(axis, Estimate) and angle_of(axis.direction, up.direction) > _SAME_RAD:
            return None, "gravity and yaw rate do not fit one mount: check the driver's axes"
        if tilt > _UPSIDE_DOWN_RAD and isinstance(axis, str):
            return None, "it is upside down, or the driver has the wrong sign: drive curves"
        if tilt > _UPSIDE_DOWN_RAD:
            # A half turn about any horizontal axis fits; x is the usual axis.
            declared = np.diag([1.0, -1.0, -1.0]) @ declared
        leveled = level(declared, up.direction)
        if isinstance(forward, Estimate) and forward.error_rad <= _VAGUE_RAD:
            x, y, _ = leveled @ forward.direction
            if abs(math.atan2(y, x)) > _YAW_RAD + _SIGMAS * forward.error_rad:
                leveled = frame_of(forward.direction, up.direction)
        return quat_of(snap(leveled, self.base_from_frame, up.direction, self.limit_rad)), ""

    def _tilt_rad(self, estimate: Estimate) -> float:
        return angle_of(self.base_from_frame @ estimate.direction, UP)

    def _is_beyond(self, tilt_rad: float, estimate: Estimate) -> bool:
        return tilt_rad > self.limit_rad + _SIGMAS * estimate.error_rad

    def _is_vague(self, estimate: Estimate) -> bool:
        return estimate.error_rad > _VAGUE_RAD

    def _signs_differ(self) -> bool:
        up, axis = self.motion.up, self.motion.yaw_axis
        if isinstance(up, str) or isinstance(axis, str):
            return False
        return angle_of(up.direction, axis.direction) >= _OPPOSITE_RAD


def _within(value: float, bounds: tuple[float, float]) -> bool:
    return bounds[0] <= value <= bounds[1]


def _axis_name(base_from_frame: Array, estimate: Estimate) -> str:
    """Return the axis of the base that is nearest to a direction, such as ``about -z``."""
    direction = base_from_frame @ estimate.direction
    index = int(np.argmax(np.abs(direction)))
    sign = "-" if direction[index] < 0 else ""
    return f"about {sign}{'xyz'[index]}"
