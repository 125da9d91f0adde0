"""The body of a link: shapes, materials and mass."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tfcompose.foundation.findings import Span
    from tfcompose.foundation.geometry import Pose


@dataclass(frozen=True, slots=True)
class Asset:
    """A mesh or an image, with its address and its file."""

    uri: str
    span: Span | None = None
    #: The path of the file: absolute, or relative like the path of the robot file; empty if
    #: unknown.
    path: str = ""
    #: The package that contains the file, if there is one.
    package: str = ""
    #: The path in the package.
    inside: str = ""


@dataclass(frozen=True, slots=True)
class Material:
    """A colour (red, green, blue and opacity from 0 to 1) or a texture, with a name."""

    name: str
    rgba: tuple[float, float, float, float] | None = None
    texture: Asset | None = None
    span: Span | None = None


def colour_name(rgba: Sequence[float]) -> str:
    """Return a name for an unnamed colour, so that URDF keeps different colours apart."""
    return "_".join(["rgba", *(f"{part:g}".replace(".", "p").replace("-", "m") for part in rgba)])


@dataclass(frozen=True, slots=True)
class Shape:
    """A body's shape and its pose in the link."""

    kind: Literal["box", "cylinder", "sphere", "capsule", "mesh"]
    #: In metres. Box: x, y, z. Cylinder and capsule: radius, length, which excludes the ends of a
    #: capsule. Sphere: radius. Mesh: its scale along x, y, z.
    size: tuple[float, ...]
    pose: Pose
    material: Material | None = None
    mesh: Asset | None = None

    @property
    def radius(self) -> float:
        """The radius of the bounding sphere, in metres.

        Infinite for a mesh, because its size is only in its file.
        """
        match self.kind:
            case "sphere":
                return self.size[0]
            case "cylinder":
                return math.hypot(self.size[0], self.size[1] / 2)
            case "capsule":
                return self.size[0] + self.size[1] / 2
            case "mesh":
                return math.inf
        return math.hypot(*self.size) / 2


@dataclass(frozen=True, slots=True)
class Inertial:
    """Mass, centre of mass and inertia of a link."""

    #: Mass in kg.
    mass: float
    #: The pose of the centre of mass in the link.
    pose: Pose
    #: Tensor about the centre of mass in kg m²: xx, xy, xz, yy, yz, zz.
    tensor: tuple[float, float, float, float, float, float]
    #: For a given tensor: the traces that the visual and the collision shapes would have at
    #: uniform density. A trace does not depend on the axes.
    of_shapes: tuple[float, ...] = ()
    span: Span | None = None
    #: The span of the mass, or of the density that determines the mass.
    mass_at: Span | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Link:
    """The body on a frame."""

    name: str
    span: Span
    visuals: tuple[Shape, ...] = ()
    collisions: tuple[Shape, ...] = ()
    inertial: Inertial | None = None
    #: Whether the file states a mass, even without an inertia.
    has_mass: bool = False


def materials(links: Mapping[str, Link]) -> list[Material]:
    """Return the materials of all visuals, in the order of declaration."""
    return [shape.material for link in links.values() for shape in link.visuals if shape.material]
