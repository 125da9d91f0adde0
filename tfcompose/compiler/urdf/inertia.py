"""Volumes, centres and moments of inertia of solids, their sums, and other densities.

Moments about the centre of mass, V the volume: box V/12 (b² + c²); cylinder along z V/12 (3r² +
l²) and V r²/2; sphere 2/5 V r². A capsule is a cylinder C and two half spheres S whose centres of
mass are 3/8 r outside its ends: along z C r²/2 + 2/5 S r², across C (r²/4 + l²/12) + S (2/5 r² +
l²/4 + 3/8 l r). Sums follow the parallel axis theorem.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.foundation.geometry import Pose, matrix_from_quat, normalise, rotate
from tfcompose.model.robot import Inertial

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.robot import Shape

Tensor = tuple[float, float, float, float, float, float]

_UNMOVED = Pose()
#: Rounding error of a product of inertia that is 0, relative to the trace.
_NOISE = 1e-15


class UnmeasurableError(Exception):
    """A mesh has no volume, or it cannot be read: code, message and help of the finding."""

    def __init__(self, code: str, message: str, advice: str) -> None:
        self.code, self.advice = code, advice
        super().__init__(message)


@dataclass(frozen=True, slots=True)
class Moments:
    """Volume in m³, centre in m, and the tensor about it (xx, xy, xz, yy, yz, zz) in m⁵.

    The tensor is also in kg m² at 1 kg/m³.
    """

    volume: float
    centre: Vector
    tensor: Tensor

    def at(self, pose: Pose) -> Moments:
        """Return the same solid moved by the pose, in the axes of the pose's parent: R I R^T."""
        if pose == _UNMOVED:
            return self
        rows = matrix_from_quat(normalise(pose.quat_xyzw))
        xx, xy, xz, yy, yz, zz = self.tensor
        own = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        x, y, z = (
            tuple(math.fsum(row[k] * own[k][j] for k in range(3)) for j in range(3))
            for row in rows
        )
        turned = [
            [math.fsum(half[k] * row[k] for k in range(3)) for row in rows] for half in (x, y, z)
        ]
        dx, dy, dz = rotate(normalise(pose.quat_xyzw), self.centre)
        centre = (pose.xyz[0] + dx, pose.xyz[1] + dy, pose.xyz[2] + dz)
        tensor = (
            turned[0][0],
            turned[0][1],
            turned[0][2],
            turned[1][1],
            turned[1][2],
            turned[2][2],
        )
        return Moments(self.volume, centre, tensor)

    def about(self, point: Vector) -> Tensor:
        """Return the tensor about another point: I + V (d·d 1 − d d^T)."""
        dx, dy, dz = (c - p for c, p in zip(self.centre, point, strict=True))
        xx, xy, xz, yy, yz, zz = self.tensor
        v = self.volume
        return (
            xx + v * (dy * dy + dz * dz),
            xy - v * dx * dy,
            xz - v * dx * dz,
            yy + v * (dx * dx + dz * dz),
            yz - v * dy * dz,
            zz + v * (dx * dx + dy * dy),
        )


def join_moments(parts: Sequence[Moments]) -> Moments:
    """Return the sum of the moments; overlapping volumes count twice."""
    if len(parts) == 1:
        return parts[0]
    volume = math.fsum(part.volume for part in parts)
    x, y, z = (
        math.fsum(part.volume / volume * part.centre[axis] for part in parts) for axis in range(3)
    )
    tensors = [part.about((x, y, z)) for part in parts]
    xx, xy, xz, yy, yz, zz = (math.fsum(values) for values in zip(*tensors, strict=True))
    return Moments(volume, (x, y, z), (xx, xy, xz, yy, yz, zz))


def of_primitive(shape: Shape) -> Moments:
    """Return the moments of a primitive in the axes that its pose is given in.

    Raises:
        ValueError: for a mesh, whose file would have to be read.
    """
    if shape.kind == "mesh":
        raise ValueError("a mesh is not a primitive")
    volume, (x, y, z) = _SOLIDS[shape.kind](*shape.size)
    return Moments(volume, (0.0, 0.0, 0.0), (x, 0.0, 0.0, y, 0.0, z)).at(shape.pose)


def inertial(moments: Moments, density: float, mass: float | None = None) -> Inertial:
    """Return the inertia of a solid of this density (kg/m³), in the axes of its moments.

    ``mass`` (kg) is the exact mass if the density was derived from it. Recomputing it would add a
    rounding error.
    """
    noise = density * _NOISE * trace(moments.tensor)
    xx, xy, xz, yy, yz, zz = (density * value for value in moments.tensor)
    products = [xy, xz, yz]
    for index, product in enumerate(products):
        if abs(product) <= noise:
            products[index] = 0.0
    xy, xz, yz = products
    tensor = (xx, xy, xz, yy, yz, zz)
    return Inertial(mass or density * moments.volume, Pose(moments.centre), tensor)


def of_primitives(mass: float, shapes: Sequence[Shape]) -> Inertial:
    """Return the inertia of a body of this mass (kg) and uniform density, in its shapes' axes."""
    moments = join_moments([of_primitive(shape) for shape in shapes])
    return inertial(moments, mass / moments.volume, mass)


def trace(tensor: Tensor) -> float:
    """Return the sum of the principal moments, which is the same in all axes."""
    return tensor[0] + tensor[3] + tensor[5]


def traces(mass: float, *bodies: tuple[Shape, ...]) -> tuple[float, ...]:
    """Return the tensor's trace at this mass and uniform density for each primitive body."""
    primitives = [
        shapes for shapes in bodies if shapes and not any(shape.mesh for shape in shapes)
    ]
    return tuple(trace(of_primitives(mass, shapes).tensor) for shapes in primitives)


def _box(x: float, y: float, z: float) -> tuple[float, Vector]:
    v = x * y * z
    return v, (v / 12 * (y * y + z * z), v / 12 * (x * x + z * z), v / 12 * (x * x + y * y))


def _cylinder(r: float, length: float) -> tuple[float, Vector]:
    v = math.pi * r * r * length
    across = v / 12 * (3 * r * r + length * length)
    return v, (across, across, v * r * r / 2)


def _sphere(r: float) -> tuple[float, Vector]:
    v = 4 / 3 * math.pi * r**3
    each = 2 / 5 * v * r * r
    return v, (each, each, each)


def _capsule(r: float, length: float) -> tuple[float, Vector]:
    (c, (c_across, _, c_along)), (s, (s_own, _, _)) = _cylinder(r, length), _sphere(r)
    across = c_across + s_own + s * (length * length / 4 + 3 / 8 * length * r)
    return c + s, (across, across, c_along + s_own)


_SOLIDS: dict[str, Callable[..., tuple[float, Vector]]] = {
    "box": _box,
    "cylinder": _cylinder,
    "sphere": _sphere,
    "capsule": _capsule,
}
