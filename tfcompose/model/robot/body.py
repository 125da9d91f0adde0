"""Body of a link: shapes, materials and mass."""

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
    """A file of triangles or an image, as it was addressed and where it is.

    ``path`` is where it was found, or where it has to be: absolute, or relative like the robot's
    own file; empty where nobody here can say. ``package`` and ``inside`` are the package that it
    is in and the path there, if it is in one.
    """

    uri: str
    span: Span | None = None
    path: str = ""
    package: str = ""
    inside: str = ""


@dataclass(frozen=True, slots=True)
class Material:
    """A colour (red, green, blue and opacity from 0 to 1) or a texture, with a name."""

    name: str
    rgba: tuple[float, float, float, float] | None = None
    texture: Asset | None = None
    span: Span | None = None


def colour_name(rgba: Sequence[float]) -> str:
    """Return a name for a colour that has none, so that URDF keeps colours apart."""
    return "_".join(["rgba", *(f"{part:g}".replace(".", "p").replace("-", "m") for part in rgba)])


@dataclass(frozen=True, slots=True)
class Shape:
    """A body's shape and its pose in the link.

    ``size``: box x, y, z · cylinder and capsule radius, length (a capsule's without its ends) ·
    sphere radius · mesh its scale along x, y, z.
    """

    kind: Literal["box", "cylinder", "sphere", "capsule", "mesh"]
    size: tuple[float, ...]
    pose: Pose
    material: Material | None = None
    mesh: Asset | None = None

    @property
    def radius(self) -> float:
        """The radius of the sphere around the shape, in metres.

        Endless for a mesh, whose extent its file knows.
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
    """Mass in kg, pose of the centre of mass in the link, and tensor about it.

    The tensor is (xx, xy, xz, yy, yz, zz).

    ``of_shapes`` holds, where the tensor was given, the traces of those that the visual and the
    collision shapes would have at one density. The trace is the same in all axes. ``mass_at`` is
    the place of the mass, or of the density that it follows from.
    """

    mass: float
    pose: Pose
    tensor: tuple[float, float, float, float, float, float]
    of_shapes: tuple[float, ...] = ()
    span: Span | None = None
    mass_at: Span | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Link:
    """The body on a frame. ``has_mass``: a mass was given, even without an inertia."""

    name: str
    span: Span
    visuals: tuple[Shape, ...] = ()
    collisions: tuple[Shape, ...] = ()
    inertial: Inertial | None = None
    has_mass: bool = False


def materials(links: Mapping[str, Link]) -> list[Material]:
    """Return the materials of all visuals, in the order of declaration."""
    return [shape.material for link in links.values() for shape in link.visuals if shape.material]
