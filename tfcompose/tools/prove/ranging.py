"""Checks of a lidar's or depth camera's mount: floor, height and heading.

The floor shows roll, pitch and height. A straight drive shows the heading. Curves show if left and
right are swapped.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from tfcompose.tools.prove.floors import Plane, planes_of
from tfcompose.tools.prove.rotations import UP, angle_of, frame_of, level, quat_of, snap
from tfcompose.tools.prove.travel import BasePath, MeasuredHeading, Travel
from tfcompose.tools.prove.verdict import CheckResult

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from tfcompose.tools.prove.clouds import Cloud

    Array = NDArray[np.float64]

#: The height above the floor below which points belong to the floor, in metres.
_ABOVE_FLOOR_M = 0.15
#: The largest angle in radians between the floor and the declared floor, if the robot has not
#: moved enough to exclude walls.
_LIKELY_RAD = math.radians(30)
#: The same angle if the robot has moved enough. Walls are then excluded, and only a ceiling could
#: be mistaken for the floor.
_EXPLORED_RAD = math.radians(60)
#: The largest difference from the declared height, in metres, at which a plane outside these
#: angles can be the floor.
_SAME_HEIGHT_M = 0.25
#: The largest accepted difference of the heading, in radians. It allows for wheels that slip
#: sideways.
_HEADING_RAD = math.radians(5)
#: The largest tilt of the floor, in radians, at which a rotation by quarter turns fits.
_SNAP_RAD = math.radians(1)
#: The largest standard error of a usable estimate, in radians.
_VAGUE_RAD = math.radians(3)
#: A measurement differs only if it exceeds its limit by this many standard errors.
_SIGMAS = 3.0


@dataclass(slots=True)
class RangingCheck:
    """Compares a lidar's or depth camera's points with the declared pose of its frame."""

    clouds: Sequence[Cloud]
    #: The path of the base; None without odometry.
    track: BasePath | None
    #: The declared rotation of the frame in the base, shape (3, 3).
    base_from_frame: Array
    #: The declared position of the frame in the base, in metres, shape (3,).
    xyz: Array
    #: The declared height of the ground in the base, in metres; None if not declared.
    ground_z: float | None
    #: The largest accepted tilt of the floor in radians, and the largest accepted difference of
    #: its height in metres.
    limit_rad: float
    limit_m: float
    #: The floor and the heading, each or the reason why it is unknown.
    floor: Plane | str = field(init=False)
    heading: MeasuredHeading | str = field(init=False)
    _travel: Travel | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        self.floor = self._find_floor()
        self.heading = "no usable odometry of the base came"
        if self.track is not None:
            self._travel = self._travel_of(self.track)
            self.heading = self._travel.heading()

    def judge(self) -> Iterator[CheckResult]:
        """Yield the results for floor, height, heading, and left and right."""
        mirrored = self._is_mirrored()
        is_scan = all(cloud.is_scan for cloud in self.clouds)
        if mirrored is True and is_scan:
            # All points of a scan are in a plane, so a scanner upside down looks mirrored.
            text = "sees the scene move to the left while the base rotates to the left"
            yield CheckResult(
                "left and right", "differs", text, "TF650",
                base_from_frame_xyzw=quat_of(self._fit(-self._up())),
                help="; or the driver sends its ranges in the opposite order",
            )  # fmt: skip
            return
        yield self._judge_floor()
        yield from self._judge_height()
        yield from self._judge_heading()
        yield self._judge_sides(mirrored)

    def _find_floor(self) -> Plane | str:
        """Return the floor, or the reason why it is unknown."""
        if all(cloud.is_scan for cloud in self.clouds):
            return "a scan in one plane does not see the floor"
        planes = planes_of(self.clouds)
        height = None if self.ground_z is None else float(self.xyz[2]) - self.ground_z
        explores = self.track is not None and self.track.explores
        if explores and height is not None:
            near = [plane for plane in planes if abs(plane.distance_m - height) <= _SAME_HEIGHT_M]
            if near:
                return min(near, key=lambda plane: abs(plane.distance_m - height))
        limit = _EXPLORED_RAD if explores else _LIKELY_RAD
        for plane in planes:
            if angle_of(self.base_from_frame @ plane.normal, UP) <= limit:
                return plane
        return "no plane is near the declared floor" + ("" if explores else ": drive curves")

    def _up(self) -> Array:
        """Return the direction up in the frame: the measured or, if unknown, the declared one."""
        if isinstance(self.floor, Plane):
            return self.floor.normal
        up: Array = self.base_from_frame.T @ UP
        return up

    def _leveled(self) -> Array:
        """Return the declared rotation, changed so that the floor is level."""
        return level(self.base_from_frame, self._up())

    def _travel_of(self, track: BasePath) -> Travel:
        leveled, begin, end = self._leveled(), track.stamps_s[0], track.stamps_s[-1]
        within = [cloud for cloud in self.clouds if begin <= cloud.stamp_s <= end]
        clouds = []
        for cloud in within:
            points = cloud.points @ leveled.T
            if isinstance(self.floor, Plane):
                points = points[points[:, 2] > _ABOVE_FLOOR_M - self.floor.distance_m]
            clouds.append(points[:, :2])
        return Travel(track, np.array([cloud.stamp_s for cloud in within]), clouds)

    def _is_mirrored(self) -> bool | str:
        if self._travel is None or isinstance(self.heading, str):
            return "the heading is not known"
        return self._travel.is_mirrored(self.heading.yaw_rad, self.xyz[:2])

    def _judge_floor(self) -> CheckResult:
        floor, check = self.floor, "floor"
        if isinstance(floor, str):
            return CheckResult(check, "cannot tell", floor)
        tilt = angle_of(self.base_from_frame @ floor.normal, UP)
        values = {"tilt_rad": tilt, "error_rad": floor.error_rad}
        error = max(0.01, math.degrees(floor.error_rad))
        measured = f"{math.degrees(tilt):.1f} ± {error:.1g} deg from level"
        if tilt <= self.limit_rad + _SIGMAS * floor.error_rad:
            return CheckResult(check, "agrees", measured, values=values)
        return CheckResult(
            check,
            "differs",
            f"sees the floor {measured} in the declared mount",
            "TF650",
            base_from_frame_xyzw=quat_of(self._fit(self._up())),
            values=values,
        )

    def _judge_height(self) -> Iterator[CheckResult]:
        """Yield the result for the height; yield nothing if the floor is unknown."""
        floor, check = self.floor, "height"
        if isinstance(floor, str):
            return
        if self.ground_z is None:
            reason = "no frame on the floor is fixed to the base; write ground: FRAME"
            yield CheckResult(check, "cannot tell", reason)
            return
        off = floor.distance_m - (float(self.xyz[2]) - self.ground_z)
        values = {"height_m": floor.distance_m, "off_m": off, "error_m": floor.error_m}
        error = max(1.0, 1e3 * floor.error_m)
        measured = f"{1e3 * floor.distance_m:.0f} ± {error:.0f} mm above the floor"
        if abs(off) <= self.limit_m + _SIGMAS * floor.error_m:
            yield CheckResult(check, "agrees", measured, values=values)
            return
        side = "higher" if off > 0 else "lower"
        text = f"is {measured}, {1e3 * abs(off):.0f} mm {side} than declared"
        x, y, z = map(float, self.xyz)
        yield CheckResult(
            check, "differs", text, "TF653", base_from_frame_xyz=(x, y, z + off), values=values
        )

    def _judge_heading(self) -> Iterator[CheckResult]:
        """Yield the result for the heading; yield nothing if the floor shows another mount."""
        heading, check = self.heading, "forward"
        if isinstance(self.floor, Plane):
            tilt = angle_of(self.base_from_frame @ self.floor.normal, UP)
            if tilt > self.limit_rad + _SIGMAS * self.floor.error_rad:
                return
        if isinstance(heading, str):
            yield CheckResult(check, "cannot tell", heading)
            return
        if heading.error_rad > _VAGUE_RAD:
            reason = f"the heading scatters by {math.degrees(heading.error_rad):.0f} deg"
            yield CheckResult(check, "cannot tell", reason)
            return
        values = {"yaw_rad": heading.yaw_rad, "error_rad": heading.error_rad}
        error = max(0.1, math.degrees(heading.error_rad))
        text = f"{math.degrees(heading.yaw_rad):.1f} ± {error:.1f} deg from forward"
        if not self._is_rotated(heading):
            yield CheckResult(check, "agrees", text, values=values)
            return
        text = f"moves {text} in the declared mount while the base drives straight"
        yield CheckResult(
            check, "differs", text, "TF650",
            base_from_frame_xyzw=quat_of(self._fit(self._up())), values=values,
        )  # fmt: skip

    def _judge_sides(self, mirrored: bool | str) -> CheckResult:  # noqa: FBT001 (an answer)
        check = "left and right"
        if isinstance(mirrored, str):
            return CheckResult(check, "cannot tell", mirrored)
        if not mirrored:
            return CheckResult(check, "agrees", "what it sees rotates against the base")
        text = "sees the scene move to the left while the base rotates to the left"
        advice = "the driver swaps left and right: angles are positive counter-clockwise (REP-103)"
        return CheckResult(check, "differs", text, "TF651", advice)

    def _is_rotated(self, heading: MeasuredHeading) -> bool:
        limit = max(self.limit_rad, _HEADING_RAD) + _SIGMAS * heading.error_rad
        return abs(heading.yaw_rad) > limit

    def _fit(self, up: Array) -> Array:
        """Return the rotation that maps ``up`` to z, and the heading to x."""
        leveled, heading = self._leveled(), self.heading
        if isinstance(heading, MeasuredHeading) and heading.error_rad <= _VAGUE_RAD:
            forward = [math.cos(heading.yaw_rad), math.sin(heading.yaw_rad), 0.0]
            if self._is_rotated(heading) or float(up @ self._up()) < 0:
                leveled = frame_of(leveled.T @ np.array(forward), up)
        limit = self.limit_rad
        if isinstance(self.floor, Plane):
            limit = min(limit, _SNAP_RAD)
        return snap(leveled, self.base_from_frame, up, limit)
