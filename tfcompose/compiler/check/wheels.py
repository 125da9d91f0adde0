"""Rules about wheels: their axes, the ground under them, and the frames that turn with them."""

from __future__ import annotations

import itertools
import math
import re
from typing import TYPE_CHECKING

from tfcompose.compiler.check.poses import (
    are_mirrored,
    poses_in_base,
    side_of,
    twins,
    without_side,
)
from tfcompose.compiler.check.rule import rule
from tfcompose.foundation.findings import Finding, Note, finding
from tfcompose.foundation.geometry import Pose, norm, rotate
from tfcompose.foundation.numbers import numbers

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from tfcompose.foundation.findings import Span
    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.robot import Edge, Link, MountedSensor, Robot, Shape

_WHEEL = re.compile(r"wheel|tyre|(?<![a-z])tire")
#: Names of bodies that turn about a vertical axis and may carry a wheel.
_SWIVEL = re.compile(r"caster|castor|swivel|steer|pivot|fork")
#: The cosine of 10 degrees. Axes within this angle count as parallel.
_PARALLEL = math.cos(math.radians(10))
_Z = (0.0, 0.0, 1.0)
#: Kinds of sensors that measure how a wheel turns.
_ODOMETRY_KINDS = frozenset({"imu"})
#: A sensor may be this far below the ground because the wheel's radius is rounded.
_UNDER_M = 0.01


def is_wheel(robot: Robot, edge: Edge) -> bool:
    """Return whether the edge turns a wheel, by its name or by a flat cylinder around its axis."""
    if edge.joint is None or edge.joint.type != "continuous":
        return False
    names = f"{edge.child} {edge.joint.name}".lower()
    if _SWIVEL.search(names) and not _WHEEL.search(names):
        return False
    return _WHEEL.search(names) is not None or _disc(robot.links.get(edge.child)) is not None


def _cylinder(link: Link | None) -> Shape | None:
    """Return the cylinder that is the link's only visual shape or only collision shape."""
    for shapes in (link.visuals, link.collisions) if link else ():
        if len(shapes) == 1 and shapes[0].kind == "cylinder":
            return shapes[0]
    return None


def _disc(link: Link | None) -> Shape | None:
    """Return the link's only cylinder if it is flat and centred on the link's origin."""
    shape = _cylinder(link)
    if shape is None:
        return None
    radius, length = shape.size
    return shape if length < 2 * radius and norm(shape.pose.xyz) < radius / 2 else None


def _are_parallel(a: Vector, b: Vector) -> bool:
    return abs(sum(x * y for x, y in zip(a, b, strict=True))) > _PARALLEL


def _list_axis(axis: Sequence[float]) -> str:
    return f"[{', '.join(f'{part:.3g}' for part in (round(part, 6) + 0.0 for part in axis))}]"


@rule("TF733", of_urdf=True)
def wheel_axis(robot: Robot) -> Iterator[Finding]:
    wheels = [edge for edge in robot.edges if is_wheel(robot, edge)]
    odd = _odd_axes(robot, wheels)
    for edge in wheels:
        joint, shape = edge.joint, _cylinder(robot.links.get(edge.child))
        if joint is None or joint.axis_at is None:
            continue  # TF736
        axis, span = _list_axis(joint.axis), joint.axis_at
        if edge.child in odd:
            sibling, right = odd[edge.child]
            message = f"{edge.child} turns about {axis}, across the axis of {sibling.child}"
            notes = [Note(f"{sibling.child} is mounted here", sibling.span)]
            advice = f"write {_axis(robot, edge, right)}"
            if max(map(abs, right)) < _PARALLEL:
                advice = "correct its rotation, or its axis"
            yield finding("TF733", message, span, help=advice, notes=notes)
        elif shape and not _SWIVEL.search(f"{edge.child} {joint.name}".lower()):
            along = rotate(shape.pose.quat_xyzw, _Z)
            if not _are_parallel(along, joint.axis):
                yield _lying(robot, edge, shape, along)


def _lying(robot: Robot, edge: Edge, shape: Shape, along: Vector) -> Finding:
    """Return the finding that a wheel's cylinder does not lie along its joint's axis.

    The finding is about the cylinder if the cylinder is not rotated, otherwise about the axis.
    """
    joint, link = edge.joint, robot.links[edge.child]
    axis = joint.axis if joint else along
    span, note_span = joint.axis_at or joint.span if joint else edge.span, link.span
    message = (
        f"{edge.child} turns about {_list_axis(axis)}; its cylinder lies along {_list_axis(along)}"
    )
    key = _axis(robot, edge, along)
    advice, what = f"write {key}, or turn the cylinder", f"{edge.child} is defined here"
    if shape.pose.quat_xyzw == Pose().quat_xyzw:
        span, note_span, what = note_span, span, "it turns here"
        advice = f"a cylinder is made along z: turn it by {_quarter(robot, edge, axis)} beside it"
        advice += f", or write {key}"
    return finding("TF733", message, span, help=advice, notes=[Note(what, note_span)])


def _quarter(robot: Robot, edge: Edge, axis: Vector) -> str:
    """Return the text of a quarter turn that rotates z to ``axis``, which is along x or y."""
    index = 0 if abs(axis[1]) > abs(axis[0]) else 1
    angles = ["0", "0", "0"]
    if robot.is_foreign(edge.span):
        angles[index] = f"{math.pi / 2:.17g}"
        return f'<origin rpy="{" ".join(angles)}"/>'
    angles[index] = "90 deg"
    return f"rpy: [{', '.join(angles)}]"


def _axis(robot: Robot, edge: Edge, axis: Vector) -> str:
    listed = _list_axis(axis)
    if edge.joint and robot.is_foreign(edge.joint.span):
        return f'<axis xyz="{listed[1:-1].replace(",", "")}"/>'
    return f"axis: {listed}"


def _odd_axes(robot: Robot, wheels: list[Edge]) -> dict[str, tuple[Edge, Vector]]:
    """Return wheels whose axis differs from their siblings' axes.

    Each comes with a sibling and the sibling's axis in the odd wheel's frame. The names of
    siblings differ only in the side. If only two wheels are siblings, the odd wheel is the one
    whose axis does not point to the other wheel.
    """
    poses = poses_in_base(robot, moving=True)
    groups: dict[str, list[Edge]] = {}
    for edge in wheels:
        if edge.joint and edge.child in poses and _WHEEL.search(edge.child.lower()):
            groups.setdefault(without_side(edge.child), []).append(edge)
    odd = {}
    for group in groups.values():
        axes = [
            rotate(poses[edge.child].quat_xyzw, edge.joint.axis) for edge in group if edge.joint
        ]
        for index, edge in enumerate(group):
            other_axes = axes[:index] + axes[index + 1 :]
            if len(other_axes) == 1:
                ends = (poses[wheel.child].xyz for wheel in group)
                between = [a - b for a, b in zip(*ends, strict=True)]
                length = norm(tuple(between))
                other_axes += [tuple(part / length for part in between)] if length else []
            alike = all(_are_parallel(a, b) for a, b in itertools.combinations(other_axes, 2))
            if len(other_axes) > 1 and alike and not _are_parallel(axes[index], other_axes[0]):
                back = poses[edge.child].inverse().quat_xyzw
                odd[edge.child] = (group[index - 1], rotate(back, other_axes[0]))
    return odd


#: Tolerance for the mirrored positions of a pair of wheels.
_MIRRORED_M = 1e-3


@rule("TF738", of_urdf=True, follows="pose")
def wheels_not_mirrored(robot: Robot) -> Iterator[Finding]:
    wheels = {edge.child: edge for edge in robot.edges if is_wheel(robot, edge)}
    done: set[str] = set()
    for edge in wheels.values():
        done.add(edge.child)
        for twin in (wheels[name] for name in twins(edge.child) if name in done):
            (x, y, z), (twin_x, twin_y, twin_z) = edge.pose.xyz, twin.pose.xyz
            axis, _ = side_of(edge.child, twin.child)
            off = [abs(x - twin_x), abs(z - twin_z), abs(y + twin_y) if y * twin_y < 0 else 0.0]
            if edge.parent != twin.parent or axis != 1 or max(off) <= _MIRRORED_M:
                continue
            remaining = [wheel for wheel in wheels.values() if wheel not in (edge, twin)]
            if any(are_mirrored(side, wheel) for side in (edge, twin) for wheel in remaining):
                continue  # TF622
            odd, pattern = edge, twin
            if _is_alike(edge, remaining) and not _is_alike(twin, remaining):
                odd, pattern = twin, edge
            right = (pattern.pose.xyz[0], -pattern.pose.xyz[1], pattern.pose.xyz[2])
            message = f"{odd.child} is not at the mirrored position of {pattern.child}"
            message += f": [{numbers(odd.pose.xyz)}], and [{numbers(pattern.pose.xyz)}]"
            advice = f"if {pattern.child} is right, write {_origin(robot, odd, right)}"
            notes = [Note(f"{pattern.child} is mounted here", pattern.xyz_at or pattern.span)]
            yield finding("TF738", message, odd.xyz_at or odd.span, help=advice, notes=notes)


def _is_alike(wheel: Edge, wheels: Sequence[Edge]) -> bool:
    """Return whether another wheel has the same height and distance from the middle."""
    _, y, z = wheel.pose.xyz
    places = (candidate.pose.xyz for candidate in wheels)
    return any(
        abs(abs(y) - abs(place[1])) <= _MIRRORED_M and abs(z - place[2]) <= _MIRRORED_M
        for place in places
    )


def _origin(robot: Robot, edge: Edge, xyz: Vector) -> str:
    if robot.is_foreign(edge.span):
        return f'xyz="{numbers(xyz)}"'
    return f"xyz: [{numbers(xyz).replace(' ', ', ')}]"


@rule("TF626", follows="pose")
def sensor_below_ground(robot: Robot) -> Iterator[Finding]:
    poses = poses_in_base(robot, moving=True)
    bottoms = {
        edge.child: bottom
        for edge in robot.edges
        if edge.child in poses and is_wheel(robot, edge)
        if (bottom := _bottom(robot.links.get(edge.child), poses[edge.child])) is not None
    }
    if not bottoms:
        return
    wheel = min(bottoms, key=lambda name: bottoms[name])
    for sensor in robot.sensors:
        edge = robot.parent_edge(sensor.mount)
        if edge is None or sensor.mount not in poses:
            continue
        below = bottoms[wheel] - poses[sensor.mount].xyz[2]
        if below > _UNDER_M:
            message = f"{sensor.name} is {below:.3g} m below the ground under {wheel}"
            advice = "z is positive upwards: check its sign and unit, and those of its parent"
            notes = [Note(f"{wheel} is defined here", robot.links[wheel].span)]
            yield finding(
                "TF626", message, _height_at(robot, sensor, edge), help=advice, notes=notes
            )


def _height_at(robot: Robot, sensor: MountedSensor, edge: Edge) -> Span:
    """Return the span of the z coordinate of a sensor's mount."""
    places = (
        value.locate(2)
        for value in robot.source_numbers
        if (value.path[0], *value.path[2:]) == ("sensors", "xyz") and value.name == sensor.name
    )
    return next(places, edge.span)


def _bottom(link: Link | None, pose: Pose) -> float | None:
    """Return the lowest z of a wheel at a pose, None if the wheel has no round shape."""
    heights = []
    for shape in (*link.visuals, *link.collisions) if link else ():
        here = pose @ shape.pose
        if shape.kind in {"cylinder", "sphere"}:
            upright = rotate(here.quat_xyzw, _Z)[2] if shape.kind == "cylinder" else 0.0
            half = shape.size[1] / 2 * abs(upright) if shape.kind == "cylinder" else 0.0
            heights.append(here.xyz[2] - shape.size[0] * math.sqrt(1 - min(1, upright**2)) - half)
    return min(heights, default=None)


@rule("TF627")
def sensor_on_wheel(robot: Robot) -> Iterator[Finding]:
    wheels = {
        edge.child: edge
        for edge in robot.edges
        if is_wheel(robot, edge) and edge is robot.parent_edge(edge.child)
    }
    turned = {frame: edge for edge in wheels.values() for frame in robot.below(edge.child)}
    for sensor in robot.sensors:
        wheel = turned.get(sensor.mount)
        edge = robot.parent_edge(sensor.mount)
        if wheel and edge and wheel.joint and sensor.kind not in _ODOMETRY_KINDS:
            message = (
                f"{sensor.name} turns with {wheel.child}, about {_list_axis(wheel.joint.axis)}"
            )
            advice = f"mount it on {wheel.parent}, which does not turn"
            notes = [Note(f"{wheel.joint.name} is defined here", wheel.joint.span)]
            yield finding("TF627", message, edge.span, help=advice, notes=notes)
