"""Rules about poses: units, conventions of REP-103, and likely typing errors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.compiler.check.rule import rule
from tfcompose.compiler.mesh_box import size_of
from tfcompose.compiler.rays import Surroundings, sphere_around
from tfcompose.foundation.findings import Finding, finding
from tfcompose.foundation.geometry import Pose, norm, rotate
from tfcompose.model.robot import is_optical

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.foundation.findings import Span
    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.robot import Edge, Link, MountedSensor, Robot


#: Typical angles in degrees. Read as radians, all but 5 exceed a full turn, so the user cannot
#: have intended radians.
_ROUND_DEG = frozenset(
    {
        5.0,
        10.0,
        15.0,
        20.0,
        30.0,
        40.0,
        45.0,
        50.0,
        60.0,
        70.0,
        75.0,
        80.0,
        90.0,
        100.0,
        120.0,
        135.0,
    }
)
#: Limits from -5 to 5 or from -10 to 10 are radians: two or three turns, or no real limit.
_ROUND_LIMITS_DEG = _ROUND_DEG - {5.0, 10.0}
#: No joint with limits turns farther than the first value, except a reel. The limits of a reel are
#: not round numbers. Limits beyond the second value mean that the joint has no limit.
_FARTHEST_RAD, _MOST_LIMIT_DEG = 20.0, 720.0
#: Maximum velocity of any joint with limits.
_FASTEST_RAD_S = 45.0
#: A full turn, with a margin for rounding.
_FULL_CIRCLE_RAD = 6.29


@rule("TF410", of_urdf=True)
def degrees_as_radians(robot: Robot) -> Iterator[Finding]:
    types = {edge.joint.name: edge.joint.type for edge in robot.edges if edge.joint}
    angles = {"limit": {"revolute"}, "offset": {"revolute", "continuous"}}
    for value in robot.source_numbers:
        if value.key not in {"rpy", "look", "axis_angle", *angles} or (
            value.key in angles and types.get(value.name) not in angles[value.key]
        ):
            continue
        for index, (number, with_unit) in enumerate(
            zip(value.numbers, value.with_unit, strict=True)
        ):
            step = dict(enumerate(value.steps)).get(index, "")
            if with_unit or not _is_in_degrees(value.key, step, abs(number)):
                continue
            per_s = "/s" * (step == "velocity")
            message = (
                f"{value.entry}: {value.key} is {number:g} rad{per_s},"
                f" {number / math.tau:.3g} turns{per_s}"
            )
            span = value.locate(index)
            advice_value = f"{number:g} deg{per_s}"
            if robot.is_foreign(span):
                advice_value = f"{math.radians(number):.17g}"
            yield finding(
                "TF410", message, span, help=f"if degrees are meant, write {advice_value}"
            )


def _is_in_degrees(key: str, step: str | int, size: float) -> bool:
    """Return whether a number without a unit is probably in degrees.

    ``key`` names the value that contains the number, and ``step`` the number in that value.
    """
    if step == "velocity":
        return size >= _FASTEST_RAD_S
    if key == "limit":
        return size in _ROUND_LIMITS_DEG or (
            size.is_integer() and _FARTHEST_RAD < size <= _MOST_LIMIT_DEG
        )
    return size in _ROUND_DEG or size > _FULL_CIRCLE_RAD


#: The rule accepts 1.5708. It is 0.0002 degrees off, and no mount is that accurate.
_EXACT_RAD, _ROUNDED_RAD, _NOISE = 5e-6, 2e-3, 2e-9
_QUARTERS = {1: "pi/2", 2: "pi", 3: "3*pi/2", 4: "2*pi"}
_MOST_DECIMALS = 6


@rule("TF411", of_urdf=True)
def rounded_right_angle(robot: Robot) -> Iterator[Finding]:
    for value in robot.source_numbers:
        if value.key not in {"rpy", "look", "axis_angle"}:
            continue
        rounded = [(n, index) for index, n in enumerate(value.numbers) if _is_rounded(n)]
        if rounded:
            number, first = rounded[0]
            quarters = round(number / (math.pi / 2))
            sign = "-" if number < 0 else ""
            off = math.degrees(abs(number - quarters * math.pi / 2))
            listed = ", ".join(dict.fromkeys(f"{n:g}" for n, _ in rounded))
            message = (
                f"{value.entry}: {value.key} has {listed}, {off:.2g} deg off {quarters * 90} deg"
            )
            span = value.locate(first)
            advice = f'write {quarters * 90} deg, or "${{{sign}{_QUARTERS[abs(quarters)]}}}"'
            if robot.is_foreign(span):
                advice = f"write {quarters * math.pi / 2!r}"
            yield finding("TF411", message, span, help=advice)


def _is_rounded(number: float) -> bool:
    """Return whether the number is a rounded multiple of π/2 instead of the exact multiple."""
    quarters = round(number / (math.pi / 2))
    exact = quarters * math.pi / 2
    if (
        abs(quarters) not in _QUARTERS
        or not _EXACT_RAD < abs(number - exact) / max(1, abs(quarters)) < _ROUNDED_RAD
    ):
        return False
    return any(
        abs(number * 10**decimals - rounding(exact * 10**decimals)) < _NOISE
        for decimals in range(2, _MOST_DECIMALS)
        for rounding in (math.floor, math.ceil)
    )


#: Rotations by less than 64 degrees have at least this w.
_SMALL_ROTATION_W = 0.85


@rule("TF412")
def quaternion_w_first(robot: Robot) -> Iterator[Finding]:
    for value in robot.source_numbers:
        if value.key != "quat_xyzw" or len(value.numbers) != 4:  # noqa: PLR2004 (x, y, z, w)
            continue
        first, second, third, fourth = value.numbers
        identity = abs(first) == 1 and not (second or third or fourth)
        small = (
            _SMALL_ROTATION_W < abs(first) < 1 and second == 0 and (third == 0) != (fourth == 0)
        )
        if identity or small:
            rotations = (
                f"rotates by {_degrees(fourth)} deg, and by {_degrees(first)} deg if w is first"
            )
            message = f"{value.entry}: quat_xyzw {_list_numbers(value.numbers)} {rotations}"
            advice = f"if w is first, write {_list_numbers((second, third, fourth, first))}"
            if identity:
                advice += "; if the half turn is meant, rpy: [180 deg, 0, 0]"
            yield finding("TF412", message, value.locate(0), help=advice)


def _degrees(w: float) -> str:
    return f"{math.degrees(2 * math.acos(min(1.0, abs(w)))):.0f}"


def _list_numbers(numbers: tuple[float, ...]) -> str:
    return f"[{', '.join(f'{number:g}' for number in numbers)}]"


_X, _Z = 0, 2
#: For each word in a sensor's name: the axis of the base and the sign that the word implies, and
#: the sine by which the view may contradict the word. "up" and "down" may also mean the upper and
#: the lower camera, and "front" and "rear" the position of the mount. For these words the
#: contradiction must be clear.
_VIEWS = {
    "floor": (_Z, -1, 0.1),
    "ground": (_Z, -1, 0.1),
    "downward": (_Z, -1, 0.1),
    "downwards": (_Z, -1, 0.1),
    "down": (_Z, -1, 0.5),
    "ceiling": (_Z, 1, 0.1),
    "upward": (_Z, 1, 0.1),
    "upwards": (_Z, 1, 0.1),
    "up": (_Z, 1, 0.5),
    "front": (_X, 1, 0.8),
    "rear": (_X, -1, 0.8),
    "back": (_X, -1, 0.8),
}
#: A camera's viewing directions by axis and sign.
_DIRECTIONS = {
    (_X, 1): "front",
    (_X, -1): "rear",
    (_Z, 1): "up",
    (_Z, -1): "down",
}
#: Above this height, a camera with "ceiling" in its name is probably mounted on the ceiling.
_OVERHEAD_M = 1.5


@rule("TF413", follows="pose")
def camera_looks_away(robot: Robot) -> Iterator[Finding]:
    base = (robot.base or "").rpartition("/")[2]
    poses = poses_in_base(robot) if base.startswith("base") and robot.sensors else {}
    for sensor in robot.sensors:
        view = next(
            (_VIEWS[token] for token in reversed(sensor.name.split("_")) if token in _VIEWS), None
        )
        if view is None or sensor.kind not in CAMERAS or sensor.mount not in poses:
            continue
        optical = next(
            (frame for frame in sensor.frames if is_optical(frame) and frame in poses), None
        )
        pose = poses[optical or sensor.mount]
        axis = rotate(pose.quat_xyzw, (0.0, 0.0, 1.0) if optical else (1.0, 0.0, 0.0))
        index, sign, tolerance = view
        overhead = "ceiling" in sensor.name and pose.xyz[2] > _OVERHEAD_M
        if axis[index] * sign >= -tolerance or overhead:
            continue
        actual, named = _DIRECTIONS[index, -sign], _DIRECTIONS[index, sign]
        direction = f"to the {actual}"
        advice = "turn it by left: 180 deg under look, or by rpy: [0, 0, 180 deg]"
        if index == _Z:
            angle = math.degrees(math.asin(min(1.0, abs(axis[_Z]))))
            direction = f"{actual} by {angle:.0f} deg"
            advice = f"write look: {{{named}: {angle:.0f} deg}}; looking down is positive pitch"
        message = f"{sensor.name} looks {direction}, but its name says {named}"
        yield finding("TF413", message, _rotation_at(robot, sensor), help=advice)


def _rotation_at(robot: Robot, sensor: MountedSensor) -> Span:
    """Return the span of the rotation of a sensor's mount.

    If the mount has no rotation, return the span of the sensor.
    """
    places = (
        value.locate(0)
        for value in robot.source_numbers
        if value.path[:-1] == ("sensors", sensor.name) and value.key != "xyz"
    )
    return next(places, sensor.span)


_ROUNDING_RAD = 1e-6


@rule("TF415")
def tilted_past_vertical(robot: Robot) -> Iterator[Finding]:
    for value in robot.source_numbers:
        for index, step in enumerate(value.steps if value.key == "look" else ()):
            angle = value.numbers[index]
            if step not in {"up", "down"} or not value.with_unit[index]:
                continue  # without a unit the angle may be in degrees: TF410
            if abs(angle) <= math.pi / 2 + _ROUNDING_RAD:
                continue
            degrees = math.degrees(angle)
            message = f"{value.entry} looks {step} by {degrees:g} deg, past the vertical"
            advice = (
                "it looks back, upside down; if it is to be upright, write left: 180 deg and at"
                f" most 90 deg {step}"
            )
            yield finding("TF415", message, value.locate(index), help=advice)


#: In an ordinary robot, no part is farther from its mount. Larger robots have larger bodies and
#: mounts, from which the rule derives a larger limit.
_USUAL_M = 5.0
#: No robot is larger, unless one of its bodies is.
_LARGEST_M = 100.0
_TIMES = 3


@rule("TF414", of_urdf=True, follows="pose")
def far_from_the_robot(robot: Robot) -> Iterator[Finding]:
    yield from _meshes_in_other_units(robot)
    sizes = {link.name: _sizes(link) for link in robot.links.values()}
    for link in robot.links.values():
        largest = max(sizes[link.name], default=0.0)
        if largest > _LARGEST_M:
            message = f"the body of {link.name} is {largest:g} m long"
            advice_value = (
                f"{largest / 1000:g}" if robot.is_foreign(link.span) else f"{largest:g} mm"
            )
            yield finding(
                "TF414", message, link.span, help=f"if millimetres are meant, write {advice_value}"
            )
    body = max(
        (size for extent in sizes.values() for size in extent if size <= _LARGEST_M), default=0.0
    )
    below = poses_in_base(robot, moving=True)
    mounts = [
        norm(edge.pose.xyz)
        for edge in robot.edges
        if edge.declared and edge.child in below and any(edge.pose.xyz)
    ]
    limit = min(
        max(_USUAL_M, _TIMES * body, _TIMES * sorted(mounts)[len(mounts) // 2] if mounts else 0.0),
        max(_LARGEST_M, _TIMES * body),
    )
    for link in robot.links.values():
        inertial = link.inertial
        if inertial and (distance := norm(inertial.pose.xyz)) > limit:
            message = f"the centre of mass of {link.name} is {distance:g} m away from it"
            advice = "check its unit: a bare number is in metres"
            yield finding("TF414", message, inertial.span or link.span, help=advice)
    near = sorted(distance for distance in mounts if distance <= limit)
    usual = near[len(near) // 2] if near else 0.0
    moved = {edge.joint_name: edge.child for edge in robot.edges if edge.joint_name}
    mounted = {sensor.name: sensor.mount for sensor in robot.sensors}
    named: dict[str | int, dict[str, str]] = {
        "joints": moved,
        "sensors": mounted,
        "parts": robot.mounted,
    }
    for value in robot.source_numbers:
        if (
            value.path[2:] != ("xyz",)
            or norm(value.numbers) <= limit
            or value.path[0] == "processes"
        ):
            continue
        child = named.get(value.path[0], {}).get(value.name, value.name)
        distance = norm(
            tuple(n for n, unit in zip(value.numbers, value.with_unit, strict=True) if not unit)
        )
        if child in below and distance > limit:
            message = (
                f"{value.entry} is {distance:g} m away; the rest of the robot is within"
                f" {limit:.3g} m"
            )
            farthest = max(range(len(value.numbers)), key=lambda index: abs(value.numbers[index]))
            span, number = value.locate(farthest), value.numbers[farthest]
            unit, divisor = _unit_meant(distance, usual)
            advice_value = f"{number / divisor:g}"
            if not robot.is_foreign(span):
                advice_value = f"{number:g} {unit}"
            name = "centimetres" if unit == "cm" else "millimetres"
            advice = f"a bare number is in metres; if {name} are meant, write {advice_value}"
            yield finding("TF414", message, span, help=advice)


def _unit_meant(distance: float, usual: float) -> tuple[str, float]:
    """Return the unit in which the distance comes nearest to the usual distance.

    The second value is the number of these units in a metre. If ``usual`` is 0, the unit is
    millimetres, as in drawings.
    """
    units = (("mm", 1000.0), ("cm", 100.0))
    if not usual:
        return units[0]
    return min(units, key=lambda unit: abs(math.log(distance / unit[1] / usual)))


def _sizes(link: Link) -> list[float]:
    """Return the longest side in metres of each of the link's shapes, except meshes."""
    shapes = (shape for shape in (*link.visuals, *link.collisions) if shape.kind != "mesh")
    return [max(size) for shape in shapes if (size := size_of(shape))]


#: If a mesh is longer than the robot's longest edge by this factor, its unit is not metres. Meshes
#: up to the second length are always accepted.
_MESH_TIMES, _LARGE_MESH_M = 20, 5.0
#: Limit for a robot without edges: a hall or a field may be this long.
_LONE_MESH_M = 50.0
#: Minimum length of a mesh with a scale below 1, and of any other mesh.
_SMALL_MESH_M, _TINY_MESH_M = 0.005, 0.0005
#: A mesh marks a frame if its shortest side is longer than this fraction of its longest side.
_CUBE = 0.99
#: A ground plane is thinner than this fraction of its length.
_FLAT = 1e-3


def _meshes_in_other_units(robot: Robot) -> Iterator[Finding]:
    reach = max((norm(edge.pose.xyz) for edge in robot.edges if edge.pose_known), default=0.0)
    limit = max(_LARGE_MESH_M, _MESH_TIMES * reach) if reach else _LONE_MESH_M
    done: set[Span | None] = set()
    for link in robot.links.values():
        for shape in (*link.visuals, *link.collisions):
            mesh = shape.mesh
            size = size_of(shape) if mesh else None
            if mesh is None or size is None or mesh.span in done:
                continue
            done.add(mesh.span)
            largest, scale = max(size), max(map(abs, shape.size))
            is_small = 0 < largest < (_SMALL_MESH_M if scale < 1 else _TINY_MESH_M)
            is_mark = scale >= 1 and min(size) > _CUBE * largest
            if is_small and is_mark:
                continue
            if not is_small and (largest <= limit or min(size) < _FLAT * largest):
                continue
            factor = 1000 if is_small else 0.001
            why = "is in metres" if is_small else "is in millimetres"
            if is_small and scale >= 1:
                why = "was scaled down already"
            right = " ".join(f"{abs(part) * factor:g}" for part in shape.size)
            advice = f'scale="{right}"'
            if not robot.is_foreign(mesh.span):
                advice = f"scale: [{right.replace(' ', ', ')}]"
            message = f"the mesh of {link.name} is {largest:.3g} m long at its scale of {scale:g}"
            yield finding("TF414", message, mesh.span, help=f"if the file {why}, write {advice}")


#: The minimum and maximum of x, y and z.
Box = tuple[list[float], list[float]]

#: Kinds of sensors that take images.
CAMERAS = frozenset({"camera", "mono", "stereo", "rgbd", "tof"})

#: Distance from the bodies, in metres, within which a point counts as on the robot. It allows for
#: the arm of a mount.
_REACH_M = 0.2

#: Pairs of words for opposite sides, and the axis on which these sides differ (0: x, 1: y). The
#: first word of a pair is on the positive side (REP-103).
_SIDES = (
    ("left", "right", 1),
    ("front", "rear", 0),
    ("front", "back", 0),
    ("l", "r", 1),
    ("fl", "fr", 1),
    ("rl", "rr", 1),
    ("bl", "br", 1),
    ("fl", "rl", 0),
    ("fr", "rr", 0),
    ("fl", "bl", 0),
    ("fr", "br", 0),
)
#: These words also count at the beginning of a longer word, such as leftfinger.
_LONG_SIDES = ("left", "right")
_SIDE_WORDS = {token for pair in _SIDES for token in pair[:2]}
_NEAR_M = 1e-6
#: Distance from the robot's middle, in metres, below which the left and right frame may share a
#: place.
_MIDDLE_M = 0.01
#: Two frames are a pair if each is this close to the other frame's mirror image.
_MIRRORED_M = 0.001


def poses_in_base(robot: Robot, *, moving: bool = False) -> dict[str, Pose]:
    """Return the pose in the robot's base of each frame fixed to it.

    ``moving``: include frames behind joints, at position zero.
    """
    poses = {robot.base: Pose()} if robot.base else {}
    children = robot.children() if poses else {}
    waiting = list(poses)
    while waiting:
        parent = waiting.pop()
        for edge in children.get(parent, ()):
            is_placed = edge.pose_known and (edge.kind == "static" or (moving and edge.joint))
            if edge.child not in poses and is_placed:
                poses[edge.child] = poses[parent] @ edge.pose
                waiting.append(edge.child)
    return poses


def twins(frame: str) -> Iterator[str]:
    """Yield possible names of the mirrored frame: left_wheel_link → right_wheel_link."""
    tokens = frame.split("_")
    for index, token in enumerate(tokens):
        side, rest = _side_in(token)
        for first, second, _ in _SIDES:
            if side.lower() in {first, second}:
                opposite = second if side.lower() == first else first
                opposite = opposite.upper() if side.isupper() else opposite
                yield "_".join([*tokens[:index], opposite + rest, *tokens[index + 1 :]])


def _side_in(token: str) -> tuple[str, str]:
    """Return the side that a word of a name begins with, and the rest of the word.

    The side is empty if the word begins with no side.
    """
    side = next((side for side in _LONG_SIDES if token.startswith(side)), token)
    return (side, token[len(side) :]) if side.lower() in _SIDE_WORDS else ("", token)


def without_side(frame: str) -> str:
    """Return the name with each side replaced by a star: left_wheel_link → ``*_wheel_link``."""
    tokens = map(_side_in, frame.split("_"))
    return "_".join(f"{'*' * bool(side)}{rest}" for side, rest in tokens)


def are_swapped(edge: Edge, twin: Edge) -> bool:
    """Return whether each of two frames is on the side that the other frame's name states."""
    axis, sign = side_of(edge.child, twin.child)
    xyz, twin_xyz = edge.pose.xyz, twin.pose.xyz
    mirrored = list(twin_xyz)
    mirrored[axis] = -mirrored[axis]
    return sign * xyz[axis] < -_MIDDLE_M and math.dist(xyz, mirrored) < _MIRRORED_M


def side_of(frame: str, twin: str) -> tuple[int, int]:
    """Return the axis on which frame and twin differ, and the sign that its name implies."""
    pairs = zip(frame.split("_"), twin.split("_"), strict=True)
    side, twin_side = next((_side_in(a)[0], _side_in(b)[0]) for a, b in pairs if a != b)
    sides = {side.lower(), twin_side.lower()}
    first, axis = next((pair[0], pair[2]) for pair in _SIDES if sides == {*pair[:2]})
    return axis, 1 if side.lower() == first else -1


def are_mirrored(edge: Edge, twin: Edge) -> bool:
    """Return whether two frames named after two sides are at the same place."""
    if edge.parent != twin.parent or twin.child not in twins(edge.child):
        return False
    axis, _ = side_of(edge.child, twin.child)
    apart = math.dist(edge.pose.xyz, twin.pose.xyz)
    return apart < _NEAR_M and abs(edge.pose.xyz[axis]) > _MIDDLE_M


def envelope(robot: Robot, frame: str, without: str | None = None) -> Box | None:
    """Return the minimum and maximum of x, y and z of the bodies fixed to ``frame``.

    Values are in metres, in ``frame``. Each shape counts with its bounding sphere. ``without``
    names a sensor whose bodies are ignored. None if there are no bodies or a mesh is unreadable.
    """
    inside = {edge.child for edge in robot.edges if edge.sensor == without} if without else set()
    least, most = [math.inf] * 3, [-math.inf] * 3
    for name, pose in Surroundings(robot, only_static=True).poses(frame).items():
        if name not in robot.links or name in inside:
            continue
        for shape in (*robot.links[name].visuals, *robot.links[name].collisions):
            sphere = sphere_around(shape)
            if sphere is None:
                return None
            middle = (pose @ shape.pose @ Pose(sphere[0])).xyz
            least = [min(low, value - sphere[1]) for low, value in zip(least, middle, strict=True)]
            most = [max(high, value + sphere[1]) for high, value in zip(most, middle, strict=True)]
    return (least, most) if least[0] < math.inf else None


def is_near(box: Box, xyz: Vector) -> bool:
    """Return whether the point is in the box or within ``reach`` of it."""
    return all(
        low - _REACH_M <= value <= high + _REACH_M
        for low, value, high in zip(box[0], xyz, box[1], strict=True)
    )
