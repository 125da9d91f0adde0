"""Bodies: shapes, and the inertia that follows from them.

Moments of solid primitives about their centre of mass: box m/12 (b² + c²), cylinder along z m/12 (3r² + l²) and
m r²/2, sphere 2/5 m r². Several shapes share the mass by volume and are added with the parallel axis theorem.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.model import Inertial, Link, Material, Shape
from tfcompose.pose import Pose, matrix_from_quat, normalised
from tfcompose.resolve.poses import pose_of

if TYPE_CHECKING:
    from tfcompose.diagnostic import Span
    from tfcompose.pose import Matrix, Vector
    from tfcompose.validate import spec

Tensor = tuple[float, float, float, float, float, float]


def link_of(name: str, body: spec.LinkSpec, at: Span) -> Link:
    """Return the link with its shapes and, where it has a mass, its inertia."""
    visuals = tuple(shape_of(shape) for shape in body.visual if kind_of(shape))
    collisions = tuple(shape_of(shape) for shape in body.collision if kind_of(shape))
    inertial = _inertial(body.inertial, visuals, collisions, at) if body.inertial else None
    return Link(name, at, visuals, collisions, inertial)


def kind_of(shape: spec.Shape) -> str | None:
    """Return which shape is given, or None."""
    return next((kind for kind in ("box", "cylinder", "sphere") if getattr(shape, kind)), None)


def shape_of(shape: spec.Shape) -> Shape:
    """Return the primitive; the shape must have one."""
    material = material_of(shape.material) if shape.material else None
    pose = pose_of(shape)
    if shape.box:
        return Shape("box", shape.box, pose, material)
    if shape.cylinder:
        return Shape("cylinder", (shape.cylinder.radius, shape.cylinder.length), pose, material)
    if shape.sphere:
        return Shape("sphere", (shape.sphere.radius,), pose, material)
    raise ValueError("a shape without a shape")


def material_of(given: spec.Material) -> Material:
    """Return the colour with its name; one without a name is named after its parts, so that URDF keeps them apart."""
    name = given.name or "rgba_" + "_".join(f"{part:g}".replace(".", "p").replace("-", "m") for part in given.rgba)
    return Material(name, given.rgba)


def _inertial(given: spec.Inertial, visuals: tuple[Shape, ...], collisions: tuple[Shape, ...], at: Span) -> Inertial:
    pose, shapes = pose_of(given), collisions or visuals
    if given.inertia:
        i = given.inertia
        of_shapes = tuple(_trace(inertial_of(given.mass, some).tensor) for some in (visuals, collisions) if some)
        return Inertial(given.mass, pose, (i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz), of_shapes, at)
    if not shapes:
        return Inertial(given.mass, pose, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    return inertial_of(given.mass, shapes)


def inertial_of(mass: float, shapes: tuple[Shape, ...]) -> Inertial:
    """Return centre of mass and tensor (xx, xy, xz, yy, yz, zz, in the link's axes) of shapes of one density."""
    volumes = [_volume(shape) for shape in shapes]
    masses = [mass * volume / math.fsum(volumes) for volume in volumes]
    centre: Vector = (
        math.fsum(m * shape.pose.xyz[0] for m, shape in zip(masses, shapes, strict=True)) / mass,
        math.fsum(m * shape.pose.xyz[1] for m, shape in zip(masses, shapes, strict=True)) / mass,
        math.fsum(m * shape.pose.xyz[2] for m, shape in zip(masses, shapes, strict=True)) / mass,
    )
    parts = [_about(m, shape, centre) for m, shape in zip(masses, shapes, strict=True)]
    xx, xy, xz, yy, yz, zz = (math.fsum(values) for values in zip(*parts, strict=True))
    return Inertial(mass, Pose(centre), (xx, xy, xz, yy, yz, zz))


def _trace(tensor: Tensor) -> float:
    return tensor[0] + tensor[3] + tensor[5]


def _volume(shape: Shape) -> float:
    if shape.kind == "box":
        return math.prod(shape.size)
    if shape.kind == "cylinder":
        return math.pi * shape.size[0] ** 2 * shape.size[1]
    return 4 / 3 * math.pi * shape.size[0] ** 3


def _principal(mass: float, shape: Shape) -> Vector:
    if shape.kind == "box":
        x, y, z = (length * length for length in shape.size)
        return (mass / 12 * (y + z), mass / 12 * (x + z), mass / 12 * (x + y))
    if shape.kind == "cylinder":
        radius, length = shape.size
        across = mass / 12 * (3 * radius**2 + length**2)
        return (across, across, mass * radius**2 / 2)
    each = 2 / 5 * mass * shape.size[0] ** 2
    return (each, each, each)


def _about(mass: float, shape: Shape, point: Vector) -> Tensor:
    """Return the shape's tensor about ``point``, in the link's axes: R diag R^T + m (d·d 1 − d d^T)."""
    rows: Matrix = matrix_from_quat(normalised(shape.pose.quat_xyzw))
    principal = _principal(mass, shape)
    dx, dy, dz = (c - p for c, p in zip(shape.pose.xyz, point, strict=True))
    turned = [[math.fsum(rows[i][k] * principal[k] * rows[j][k] for k in range(3)) for j in range(3)] for i in range(3)]
    return (
        turned[0][0] + mass * (dy * dy + dz * dz),
        turned[0][1] - mass * dx * dy,
        turned[0][2] - mass * dx * dz,
        turned[1][1] + mass * (dx * dx + dz * dz),
        turned[1][2] - mass * dy * dz,
        turned[2][2] + mass * (dx * dx + dy * dy),
    )
