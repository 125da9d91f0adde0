"""Volumes, centres and moments of inertia of solids and of their sums.

Moments are about the centre of mass. V is the volume. Box: V/12 (b² + c²). Cylinder along z: V/12
(3r² + l²) and V r²/2. Sphere: 2/5 V r². A capsule is a cylinder C and two half spheres S whose
centres of mass are 3/8 r outside its ends. Its moments are C r²/2 + 2/5 S r² along z, and C (r²/4
+ l²/12) + S (2/5 r² + l²/4 + 3/8 l r) across. Sums follow the parallel axis theorem.
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
#: Relative to the trace, a smaller product of inertia is the rounding error of 0.
_NOISE = 1e-15


class UnmeasurableError(Exception):
    """A mesh has no volume or cannot be read; has code, message and help for a finding."""

    def __init__(self, code: str, message: str, advice: str) -> None:
        self.code, self.advice = code, advice
        super().__init__(message)


@dataclass(frozen=True, slots=True)
class Moments:
    """Volume in m³, centre in m, and the tensor (xx, xy, xz, yy, yz, zz) about the centre in m⁵.

    At a density of 1 kg/m³, the tensor has the same values in kg m².
    """

    volume: float
    centre: Vector
    tensor: Tensor

    def moved(self, pose: Pose) -> Moments:
        """Return the moments of the solid moved by the pose, in the pose's parent: R I R^T."""
        if pose == _UNMOVED:
            return self
        rows = matrix_from_quat(normalise(pose.quat_xyzw))
        xx, xy, xz, yy, yz, zz = self.tensor
        matrix = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        x, y, z = (
            tuple(math.fsum(row[k] * matrix[k][j] for k in range(3)) for j in range(3))
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
    """Return the moments of a primitive shape, in the frame of the shape's pose.

    Raises:
        ValueError: for a mesh, because that requires the mesh's file.
    """
    if shape.kind == "mesh":
        raise ValueError("a mesh is not a primitive")
    volume, (x, y, z) = _SOLIDS[shape.kind](*shape.size)
    return Moments(volume, (0.0, 0.0, 0.0), (x, 0.0, 0.0, y, 0.0, z)).moved(shape.pose)


def inertial(moments: Moments, density: float, mass: float | None = None) -> Inertial:
    """Return the inertia of a solid with this density in kg/m³, in the axes of its moments.

    ``mass`` is the exact mass in kg, if the density was derived from the mass. Computing the mass
    from the density would add a rounding error.
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
    """Return the inertia of a body of ``mass`` kg and uniform density, in its shapes' axes."""
    moments = join_moments([of_primitive(shape) for shape in shapes])
    return inertial(moments, mass / moments.volume, mass)


def trace(tensor: Tensor) -> float:
    """Return the sum of the principal moments, which does not depend on the axes."""
    return tensor[0] + tensor[3] + tensor[5]


def traces(mass: float, *bodies: tuple[Shape, ...]) -> tuple[float, ...]:
    """Return the trace of the tensor for each body of primitives, at this mass in kg.

    The density of a body is uniform.
    """
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
