"""Rules about sensor placement: views that the robot blocks, and zones that sensors must cover."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.compiler.check.rule import rule
from tfcompose.compiler.rays import (
    Surroundings,
    cast,
    contains,
    different_streams,
    is_plane,
    reach_of,
    view_of,
)
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.findings import Finding, Note, did_you_mean, finding
from tfcompose.foundation.geometry import Pose, rotate

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from tfcompose.compiler.rays import View
    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.robot import Edge, MountedSensor, Optics, Robot, Zone

KINDS = ("camera", "lidar", "radar", "ultrasonic")


def _limit(robot: Robot, code: str) -> float:
    limit = CATALOGUE[code].limit
    return robot.limits.get(code, limit[0] if limit else 0.0)


@dataclass(slots=True)
class _Views:
    """The surroundings and edges of a robot's frames, and the views of its sensors."""

    robot: Robot
    around: Surroundings
    edges: dict[str, Edge]
    of_sensors: dict[str, list[View]] = field(default_factory=dict)

    def of(self, sensor: MountedSensor) -> list[View]:
        if sensor.name not in self.of_sensors:
            is_placed = self.robot.links and self._is_placed(sensor)
            streams = different_streams(sensor) if is_placed else ()
            self.of_sensors[sensor.name] = [
                view_of(self.around, sensor, stream) for stream in streams
            ]
        return self.of_sensors[sensor.name]

    def _is_placed(self, sensor: MountedSensor) -> bool:
        """Return whether the sensor has a pose. At the base's origin it counts as not placed."""
        edge = self.edges.get(sensor.mount)
        if edge is None or not edge.pose_known:
            return False
        return edge.pose != Pose() or not (
            edge.parent == self.robot.base or edge.parent.endswith("base_link")
        )


#: Views of the last robot. Several rules use them in sequence.
_LAST: list[_Views] = []


def _views_of(robot: Robot) -> _Views:
    if not _LAST or _LAST[0].robot is not robot:
        edges = {edge.child: edge for edge in reversed(robot.edges)}  # a child's first edge wins
        _LAST[:] = [_Views(robot, Surroundings(robot), edges)]
    return _LAST[0]


def _views(robot: Robot, sensor: MountedSensor) -> list[View]:
    return _views_of(robot).of(sensor)


def _percent(part: float) -> str:
    return f"{100 * part:.0f} %"


def _some(links: Sequence[str]) -> str:
    return ", ".join(links[:3]) + (" and others" if len(links) > 3 else "")  # noqa: PLR2004 (as many as one line takes)


@rule("TF640")
def sensor_inside_body(robot: Robot) -> Iterator[Finding]:
    limit = _limit(robot, "TF640")
    for sensor in robot.sensors:
        deepest: dict[str, tuple[float, str]] = {}
        for view in _views(robot, sensor):
            for link, depth in view.inside.items():
                deepest[link] = max(deepest.get(link, (0.0, "")), (depth, view.optics.frame))
        for link, (depth, frame) in deepest.items():
            if depth > limit:
                message = (
                    f"{sensor.name} is inside {link}: {frame} is {100 * depth:.1f} cm below its"
                    " surface"
                )
                message += f"; the limit is {100 * limit:g} cm"
                advice = f"correct the pose, or give {link} a shape with an opening"
                yield finding(
                    "TF640", message, sensor.span, help=advice, notes=_note_link(robot, link)
                )


def _note_link(robot: Robot, link: str) -> list[Note]:
    return [Note(f"{link} is defined here", robot.links[link].span)]


@rule("TF641")
def view_blocked(robot: Robot) -> Iterator[Finding]:
    limit = _limit(robot, "TF641")
    for sensor in robot.sensors:
        views = [
            view
            for view in _views(robot, sensor)
            if not is_plane(view.optics) and not _sees_only_robot(robot, view)
        ]
        worst = max(views, key=lambda view: view.blocked, default=None)
        if worst and worst.blocked > limit:
            message = (
                f"{_percent(worst.blocked)} of the view of {sensor.name} ({worst.optics.stream})"
                " is blocked by "
            )
            message += f"{_some(worst.blocking)}; the limit is {_percent(limit)}"
            advice = "move or turn the sensor, or raise the limit under rules"
            yield finding(
                "TF641",
                message,
                sensor.span,
                help=advice,
                notes=_note_link(robot, worst.blocking[0]),
            )


@rule("TF642")
def blind_sector(robot: Robot) -> Iterator[Finding]:
    limit = _limit(robot, "TF642")
    for sensor in robot.sensors:
        for view in _views(robot, sensor):
            sector = _largest_blind(view) if is_plane(view.optics) else None
            if sector and sector[1] - sector[0] > limit:
                start, end = (f"{math.degrees(angle):.0f}" for angle in sector)
                message = (
                    f"{sensor.name} is blind for {math.degrees(sector[1] - sector[0]):.0f} deg,"
                    f" from {start} to "
                )
                message += (
                    f"{end} deg: {_some(view.blocking)} is in the way; the limit is"
                    f" {math.degrees(limit):.0f} deg"
                )
                advice = "move the scanner, or raise the limit under rules"
                yield finding(
                    "TF642",
                    message,
                    sensor.span,
                    help=advice,
                    notes=_note_link(robot, view.blocking[0]),
                )


def _largest_blind(view: View) -> tuple[float, float] | None:
    """Return the largest sector in which a body blocks every ray, None without such a sector.

    The sector may cross the angle where a full turn starts and ends.
    """
    if view.optics.horizontal is None or not view.directions:
        return None
    start, end = view.optics.horizontal
    count = len(view.directions)
    step = (end - start) / count
    blocked = [index in view.hits for index in range(count)]
    is_circle = end - start > math.tau - step / 2
    if all(blocked):
        return start, end
    best, run = (0, 0), 0
    for index in range(2 * count if is_circle else count):
        run = run + 1 if blocked[index % count] else 0
        if run > best[1]:
            best = (index - run + 1, run)
    return (start + best[0] * step, start + sum(best) * step) if best[1] else None


def _sees_only_robot(robot: Robot, view: View) -> bool:
    if view.optics.kind != "camera" or not view.directions:
        return False
    return view.blocked >= _limit(robot, "TF643")


@rule("TF643")
def camera_sees_only_robot(robot: Robot) -> Iterator[Finding]:
    for sensor in robot.sensors:
        for view in _views(robot, sensor):
            if _sees_only_robot(robot, view):
                message = (
                    f"{sensor.name} ({view.optics.stream}) sees only the robot:"
                    f" {_percent(view.blocked)} of its "
                )
                message += (
                    f"image is {_some(view.blocking)}; the limit is"
                    f" {_percent(_limit(robot, 'TF643'))}"
                )
                advice = "correct the pose: x of the body frame points where it looks"
                yield finding(
                    "TF643",
                    message,
                    sensor.span,
                    help=advice,
                    notes=_note_link(robot, view.blocking[0]),
                )
                break


#: Names of cameras that are intended to look at the floor.
_AT_THE_FLOOR = re.compile(
    r"(^|_)(down|downward|floor|ground|bottom|belly|line|dock|flow|landing)(_|\d|$)"
)


@rule("TF644")
def camera_sees_only_floor(robot: Robot) -> Iterator[Finding]:
    limit = _limit(robot, "TF644")
    for sensor in robot.sensors:
        if _AT_THE_FLOOR.search(sensor.name.rpartition("/")[2]):
            continue
        for view in _views(robot, sensor):
            far = _reach_on_floor(robot, view)
            if far is not None and far < limit:
                message = (
                    f"{sensor.name} ({view.optics.stream}) sees only the floor, no farther than"
                    f" {far:.2g} m"
                )
                advice = "correct the pose: a positive pitch looks down"
                yield finding(
                    "TF644", f"{message}; the limit is {limit:g} m", sensor.span, help=advice
                )
                break


def _reach_on_floor(robot: Robot, view: View) -> float | None:
    """Return the largest distance in metres at which an unblocked ray hits the floor.

    None if a ray misses the floor, or the floor's height is unknown.
    """
    if view.optics.kind != "camera" or not view.directions:
        return None
    wheels = [edge.child for edge in robot.edges if edge.joint and edge.joint.type == "continuous"]
    if not wheels:
        return None
    poses = _views_of(robot).around.poses(view.optics.frame)
    wheels = [wheel for wheel in wheels if wheel in poses]
    base = robot.ground if robot.ground in poses else robot.base
    if not wheels or base not in poses:
        return None
    up = rotate(poses[base].quat_xyzw, (0.0, 0.0, 1.0))
    floor = min((_lowest(robot, wheel, poses[wheel], up) for wheel in wheels), default=math.inf)
    if not math.isfinite(floor) or floor >= 0:
        return None
    free = [
        sum(a * b for a, b in zip(direction, up, strict=True))
        for index, direction in enumerate(view.directions)
        if index not in view.hits
    ]
    if not free or max(free) >= 0:
        return None
    return max(floor / down for down in free)


def _lowest(robot: Robot, name: str, pose: Pose, up: Vector) -> float:
    """Return the height of the wheel's lowest point above the sensor's frame, in metres."""
    link = robot.links.get(name)
    shapes = (link.collisions or link.visuals) if link else ()
    radii = [shape.size[0] for shape in shapes if shape.kind in {"cylinder", "sphere"}]
    return (
        sum(a * b for a, b in zip(pose.xyz, up, strict=True)) - max(radii) if radii else math.inf
    )


@rule("TF645")
def sensors_dazzle_each_other(robot: Robot) -> Iterator[Finding]:
    limit = _limit(robot, "TF645")
    active = [
        (sensor, stream)
        for sensor in robot.sensors
        for stream in sensor.optics
        if stream.active and _is_light(stream)
    ]
    around = _views_of(robot).around
    reported = set()
    for viewer, viewed in itertools.combinations(active, 2):
        (sensor_a, optics_a), (sensor_b, optics_b) = viewer, viewed
        if (
            sensor_a is sensor_b
            or optics_a.kind != optics_b.kind
            or (sensor_a.name, sensor_b.name) in reported
        ):
            continue
        forth, back = _sight(around, optics_a, optics_b), _sight(around, optics_b, optics_a)
        if forth is None or back is None:
            continue
        far = math.hypot(*forth)
        if (
            far <= limit
            and _is_open(around, viewer, viewed, forth)
            and _is_open(around, viewed, viewer, back)
        ):
            reported.add((sensor_a.name, sensor_b.name))
            message = (
                f"{sensor_a.name} and {sensor_b.name} look into each other, {far:.2g} m apart; the"
                f" limit is {limit:g} m"
            )
            notes = [Note(f"{sensor_a.name} is defined here", sensor_a.span)]
            advice = "turn one away, or mount them at different heights"
            yield finding("TF645", message, sensor_b.span, help=advice, notes=notes)


def _is_light(optics: Optics) -> bool:
    return optics.kind in {"camera", "lidar"}


#: Height of a scanner's window. Another scanner dazzles it if its scan plane meets the window.
_WINDOW_M = 0.03


def _sight(around: Surroundings, optics: Optics, target: Optics) -> Vector | None:
    """Return the other stream's origin in this stream's frame, None outside its field of view."""
    pose = around.pose(optics.frame, target.frame)
    if pose is None or math.hypot(*pose.xyz) < _WINDOW_M:
        return None
    x, y, z = pose.xyz
    aim = (x, y, 0.0) if is_plane(optics) and abs(z) <= _WINDOW_M else pose.xyz
    return pose.xyz if contains(optics, aim) else None


def _is_open(
    around: Surroundings,
    viewer: tuple[MountedSensor, Optics],
    viewed: tuple[MountedSensor, Optics],
    origin: Vector,
) -> bool:
    """Return whether no body blocks the line between two streams.

    ``origin`` is the viewed stream's origin.
    """
    (sensor, optics), (of_other, _) = viewer, viewed
    (x, y, z), far = origin, math.hypot(*origin)
    into = ((x / far, y / far, z / far),)
    frames = (of_other.mount, *of_other.frames)
    bodies = around.bodies(sensor, optics.frame, into, min(far, reach_of(optics)), frames)
    return cast(sensor.name, optics, into, bodies).rays[0].distance >= far


@rule("TF646")
def zone_not_covered(robot: Robot) -> Iterator[Finding]:
    for zone in robot.zones:
        if zone.frame not in robot.frames:
            if not robot.tolerates(zone.frame):
                advice = did_you_mean(zone.frame, robot.frames)
                yield finding(
                    "TF646",
                    f"the zone {zone.name}: unknown frame {zone.frame}",
                    zone.span,
                    help=advice,
                )
            continue
        names = [sensor.name for sensor in robot.sensors]
        wrong = [name for name in zone.by if name not in KINDS and name not in names]
        if wrong:
            advice = did_you_mean(wrong[0], [*KINDS, *names])
            yield finding(
                "TF646", f"the zone {zone.name}: unknown sensor {wrong[0]}", zone.span, help=advice
            )
            continue
        part, unknown = _coverage_of(robot, zone)
        if part < zone.least - 1e-9:
            by = f" by {', '.join(zone.by)}" if zone.by else ""
            message = (
                f"{_percent(part)} of the zone {zone.name} is seen{by}; at least"
                f" {_percent(zone.least)} is required"
            )
            advice = (
                f"no field of view is known of {', '.join(unknown)}: give optics"
                if unknown
                else ""
            )
            yield finding(
                "TF646",
                message,
                zone.span,
                help=advice or "move or add a sensor, or make the zone smaller",
            )


#: Number of sample points in a zone along x, y and z.
_GRID = (10, 10, 4)


def _coverage_of(robot: Robot, zone: Zone) -> tuple[float, list[str]]:
    """Return the covered fraction of the zone's points, and the streams with unknown optics."""
    points = [
        tuple(
            middle + extent * ((index + 0.5) / count - 0.5)
            for middle, extent, index, count in zip(
                zone.center, zone.size, indices, _GRID, strict=True
            )
        )
        for indices in itertools.product(*map(range, _GRID))
    ]
    around = _views_of(robot).around
    visible, unknown = [False] * len(points), []
    for sensor in robot.sensors:
        for optics in different_streams(sensor):
            if zone.by and optics.kind not in zone.by and sensor.name not in zone.by:
                continue
            pose = around.pose(optics.frame, zone.frame)
            if pose is None:
                continue
            if optics.projection == "pinhole" and (
                optics.horizontal is None or optics.vertical is None
            ):
                unknown.append(f"{sensor.name} {optics.stream}")
                continue
            open_ = [index for index, is_visible in enumerate(visible) if not is_visible]
            aims = {index: _aim(optics, zone, points[index], pose) for index in open_}
            into = {index: aim for index, aim in aims.items() if aim and _is_in_reach(optics, aim)}
            lengths = {index: math.hypot(*aim) for index, aim in into.items()}
            rays = tuple(
                (x / lengths[i], y / lengths[i], z / lengths[i]) for i, (x, y, z) in into.items()
            )
            bodies = around.bodies(sensor, optics.frame, rays, reach_of(optics))
            for index, ray in zip(into, cast(sensor.name, optics, rays, bodies).rays, strict=True):
                visible[index] = ray.distance >= lengths[index] - 1e-6
    return sum(visible) / len(visible), unknown


def _aim(optics: Optics, zone: Zone, point: Sequence[float], pose: Pose) -> Vector | None:
    """Return the point in the stream's frame.

    For a scanner, return the point above or below it where the scan plane meets the zone.
    """
    x, y, z = point
    bx, by, bz = rotate(pose.quat_xyzw, (x, y, z))
    here = (pose.xyz[0] + bx, pose.xyz[1] + by, pose.xyz[2] + bz)
    if not is_plane(optics):
        return here
    up = rotate(pose.quat_xyzw, (0.0, 0.0, 1.0))
    if abs(up[2]) < 1e-6:  # noqa: PLR2004 (the plane stands upright)
        return None
    climb = -here[2] / up[2]
    if abs(z + climb - zone.center[2]) > zone.size[2] / 2 + 1e-9:
        return None
    return (here[0] + climb * up[0], here[1] + climb * up[1], here[2] + climb * up[2])


def _is_in_reach(optics: Optics, point: Vector) -> bool:
    """Return whether the point is in the stream's field of view and range.

    A camera's range is the depth along z.
    """
    far = abs(point[2]) if optics.kind == "camera" else math.hypot(*point)
    return (
        far > 0
        and (optics.near or 0.0) <= far <= (optics.far or math.inf)
        and contains(optics, point)
    )
