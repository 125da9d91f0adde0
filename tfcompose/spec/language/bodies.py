"""Bodies as users write them: shapes, colours, masses and links."""

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Discriminator, Tag
from pydantic_core import PydanticCustomError

from tfcompose.foundation.units import Density, Inertia, Mass, Size, invalid
from tfcompose.spec.language.pose import MountKeys, Posed, Rotated
from tfcompose.spec.language.spec import Spec, key
from tfcompose.spec.language.values import Colour, Name, Scale, Sizes, Text, Xyz, as_list, short
from tfcompose.spec.load import Path


class Cylinder(Spec):
    """A cylinder along z, centred at the origin."""

    radius: Size = key(..., "the radius")
    length: Size = key(..., "the length along z")


class Capsule(Spec):
    """A cylinder along z with a half sphere at each end, centred at the origin."""

    radius: Size = key(..., "the radius of the cylinder and of its ends")
    length: Size = key(..., "the length of the cylinder only; the capsule is two radii longer")


class Sphere(Spec):
    """A sphere around the origin."""

    radius: Size = key(..., "the radius")


class Mesh(Spec):
    """A file of triangles."""

    uri: Text = key(
        ...,
        "package://…, file://…, or a path relative to this file",
        "package://my_robot/meshes/base.stl",
        "meshes/base.stl",
    )
    scale: Scale = key(
        (1.0, 1.0, 1.0), "metres per unit of the file; or one value each for x, y and z", 0.001
    )


class MaterialSpec(Spec):
    """A colour or a texture, and its name.

    A name without a colour refers to a material defined elsewhere.
    """

    name: Name | None = key(None, "its name; default: named after the colour", "blue")
    rgba: Colour | None = key(
        None, "red, green, blue and opacity, from 0 to 1; or a name", [0.2, 0.4, 0.8, 1], "blue"
    )
    texture: Text | None = key(
        None, "an image: package://…, file://…, or a relative path", "textures/wood.png"
    )


SHAPES = frozenset({"box", "cylinder", "sphere", "capsule", "mesh"})


class ShapeSpec(Posed):
    """One shape and its pose in the link: a box, cylinder, sphere, capsule or mesh."""

    EXCLUSIVE: ClassVar[tuple[frozenset[str], ...]] = (
        *Posed.EXCLUSIVE,
        SHAPES,
        frozenset({"color", "material"}),
    )

    box: Sizes | None = key(
        None, "a box of these lengths along x, y and z, centred at the origin", [0.5, 0.4, 0.15]
    )
    cylinder: Cylinder | None = key(None, "a cylinder along z", {"radius": 0.1, "length": "5 cm"})
    sphere: Sphere | None = key(None, "a sphere", {"radius": 0.1})
    capsule: Capsule | None = key(
        None,
        "a cylinder along z with round ends; written to URDF as a cylinder and two spheres",
        {"radius": 0.1, "length": 0.3},
    )
    mesh: Annotated[Mesh, short("uri", Mesh)] | None = key(
        None, "a file, or {uri, scale}", "meshes/base.stl"
    )
    color: Colour | None = key(
        None,
        "red, green, blue and optionally opacity, from 0 to 1; or a name",
        [0, 0, 1],
        "blue",
    )
    material: Annotated[MaterialSpec, short("name", MaterialSpec)] | None = key(
        None,
        "a colour or texture, or the name of a material or colour",
        {"rgba": [0.2, 0.4, 0.8, 1]},
        "blue",
    )

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[Path, PydanticCustomError]]:
        """Also yield a fault if no shape is given."""
        yield from super().check(data)
        if not SHAPES & data.keys() and data.keys() <= cls.model_fields.keys():
            advice = f"one of {', '.join(sorted(SHAPES))}"
            yield (), invalid("TF102", "no shape is given", advice, on_key=True, keeps=True)


class Tensor(Spec):
    """The inertia tensor about the centre of mass."""

    ixx: Inertia = key(..., "the moment about x", 0.01)
    iyy: Inertia = key(..., "the moment about y", 0.01)
    izz: Inertia = key(..., "the moment about z", 0.02)
    ixy: Inertia = key(0.0, "the product of x and y")
    ixz: Inertia = key(0.0, "the product of x and z")
    iyz: Inertia = key(0.0, "the product of y and z")


MASSES = frozenset({"mass", "density"})


class InertialSpec(Rotated):
    """A link's mass and its distribution.

    The pose is that of the centre of mass; by default the centre of the shapes.
    """

    EXCLUSIVE: ClassVar[tuple[frozenset[str], ...]] = (*Rotated.EXCLUSIVE, MASSES)

    xyz: Xyz | None = key(
        None, "position of the centre of mass; default: the centre of the shapes", [0, 0, 0.05]
    )
    mass: Mass | None = key(None, "the mass of the whole link", "10 kg")
    density: Density | None = key(
        None, "the density of the link's shapes, instead of the mass", "1 g/cm^3", 2700
    )
    inertia: Tensor | None = key(
        None,
        "the tensor about the centre of mass; default: computed from the shapes",
        {"ixx": 0.01, "iyy": 0.01, "izz": 0.02},
    )

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[Path, PydanticCustomError]]:
        """Also yield a fault if no mass is given."""
        yield from super().check(data)
        if not MASSES & data.keys():
            advice = "for example mass: 10 kg, or density: 1 g/cm^3"
            yield (), invalid("TF102", "mass is missing", advice, on_key=True, keeps=True)


#: A list of shapes, or a single shape instead of a list.
Shapes = Annotated[
    tuple[ShapeSpec, ...], BeforeValidator(as_list, ShapeSpec | tuple[ShapeSpec, ...])
]
Collision = Annotated[
    Annotated[Literal["same"], Tag("[same]")] | Annotated[Shapes, Tag("[shapes]")],
    Discriminator(lambda value: "[same]" if isinstance(value, str) else "[shapes]"),
]


class LinkSpec(MountKeys):
    """A body, with URDF's terms. With a parent, it has a fixed edge."""

    visual: Shapes = key((), "the visible shape, or a list of shapes", {"box": [0.5, 0.4, 0.15]})
    collision: Collision = key(
        (), "the shape for collisions, or a list of shapes; same: those of visual", "same"
    )
    inertial: InertialSpec | None = key(None, "the mass and its distribution", {"mass": "10 kg"})

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[Path, PydanticCustomError]]:
        """Also yield a mass from which no inertia can be derived."""
        yield from super().check(data)
        inertial = data.get("inertial")
        if not isinstance(inertial, dict) or not MASSES & inertial.keys():
            return
        shapes = [data[key] for key in ("visual", "collision") if key in data]
        if all(shape in ([], "same") for shape in shapes) and (
            "inertia" not in inertial or "density" in inertial
        ):
            advice = "give a visual or a collision shape, or mass and inertia: {ixx, iyy, izz}"
            message = "no shape and no inertia: the mass has no distribution"
            yield ("inertial",), invalid("TF102", message, advice, on_key=True, keeps=True)
