"""Bodies in the language: shapes, colours, masses, and links."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.validate.edges import MountKeys
from tfcompose.validate.fields import DENSITY_, INERTIA_, MASS_, NAME, RGBA, SCALE, SIZE, SIZES, TEXT, XYZ
from tfcompose.validate.posed import Posed, Turned
from tfcompose.validate.schema import Model, Problems, Type, key, listing, record

if TYPE_CHECKING:
    from tfcompose.geometry import Vector
    from tfcompose.load import Path


class Cylinder(Model):
    """A cylinder along z, its middle at the origin."""

    radius: float = key(SIZE)
    length: float = key(SIZE)


class Capsule(Model):
    """A cylinder along z with a half sphere on either end, its middle at the origin."""

    radius: float = key(SIZE)
    length: float = key(SIZE, about="of the cylinder alone: from end to end it is 2 radii longer")


class Sphere(Model):
    """A sphere around the origin."""

    radius: float = key(SIZE)


class Mesh(Model):
    """A file with triangles."""

    uri: str = key(
        TEXT,
        about="package://…, file://…, or a path relative to the file that writes it",
        examples=("package://my_robot/meshes/base.stl", "meshes/base.stl"),
    )
    scale: Vector = key(SCALE, (1.0, 1.0, 1.0), "metres in one unit of the file; or x, y, z", (0.001,))


class Material(Model):
    """A colour or a texture, and a name for it. With the name alone it is the one that has that name elsewhere."""

    name: str | None = key(NAME, None, "left out: named after the colour", ("blue",))
    rgba: tuple[float, float, float, float] | None = key(RGBA, None, "red, green, blue, opacity: 0 to 1")
    texture: str | None = key(TEXT, None, "an image: package://…, file://…, or a relative path")


class Shape(Posed):
    """One shape and where it is in its link; one of box, cylinder, sphere, capsule and mesh."""

    box: Vector | None = key(SIZES, None, "lengths along x, y, z", ([0.5, 0.4, 0.15],))
    cylinder: Cylinder | None = key(record(Cylinder), None)
    sphere: Sphere | None = key(record(Sphere), None)
    capsule: Capsule | None = key(record(Capsule), None, "in URDF a cylinder and two spheres: every reader has those")
    mesh: Mesh | None = key(
        record(Mesh, lambda value: {"uri": value} if isinstance(value, str) else value, {"type": "string"}),
        None,
        "a file, or {uri, scale}",
    )
    material: Material | None = key(record(Material), None)


class Tensor(Model):
    """A moment of inertia about the centre of mass, in kg m²."""

    ixx: float = key(INERTIA_)
    iyy: float = key(INERTIA_)
    izz: float = key(INERTIA_)
    ixy: float = key(INERTIA_, 0.0)
    ixz: float = key(INERTIA_, 0.0)
    iyz: float = key(INERTIA_, 0.0)


class Inertial(Turned):
    """Mass and its distribution; the pose is that of the centre of mass, and left out it is that of the shapes."""

    xyz: Vector | None = key(XYZ, None, "the centre of mass")
    mass: float | None = key(MASS_, None, "of the whole link", ("10 kg",))
    density: float | None = key(DENSITY_, None, "instead of mass: of the link's shapes", ("1 g/cm^3", 2700))
    inertia: Tensor | None = key(record(Tensor), None, "about the centre of mass; computed from the shapes if left out")


def _shape(value: Any, path: Path, problems: Problems) -> Any:
    """Read a shape, and refuse one that has no form."""
    if isinstance(value, dict) and not FORMS & set(value) and set(value) <= set(Shape.KEYS):
        advice = f"give one of {', '.join(sorted(FORMS))}"
        problems.refuse("TF102", path, "a shape without a form", advice, on_key=True)
    return record(Shape).read(value, path, problems)


FORMS = frozenset({"box", "cylinder", "sphere", "capsule", "mesh"})
SHAPE = Type(_shape, Shape)
SHAPES = listing(SHAPE, single=True)


class LinkSpec(MountKeys):
    """A body, in URDF's words. With a parent it has a fixed edge."""

    visual: tuple[Shape, ...] = key(SHAPES, (), "one shape, or a list")
    collision: tuple[Shape, ...] = key(
        Type(SHAPES.read, {"anyOf": [{"const": "same"}, *SHAPES.schema["anyOf"]]}),
        (),
        "one shape, or a list; same: those of visual",
        ("same",),
    )
    inertial: Inertial | None = key(record(Inertial), None)


def _link(value: Any, path: Path, problems: Problems) -> Any:
    """Read a body; its collision can be that of its visual, and its inertia follows from its shapes."""
    if not isinstance(value, dict):
        return record(LinkSpec).read(value, path, problems)
    if value.get("collision") == "same":
        value = value | {"collision": value.get("visual", [])}
    inertial = value.get("inertial")
    if isinstance(inertial, dict):
        shapes = value.get("visual") or value.get("collision")
        _complete(inertial, (*path, "inertial"), problems, has_shapes=bool(shapes))
    return record(LinkSpec).read(value, path, problems)


def _complete(inertial: dict[str, Any], at: Path, problems: Problems, *, has_shapes: bool) -> None:
    """Refuse an inertia from which no mass, or no distribution of it, follows."""
    if "mass" not in inertial and "density" not in inertial:
        problems.refuse("TF102", at, "mass is missing", "for example mass: 10 kg, or density: 1 g/cm^3", on_key=True)
    elif not has_shapes and ("inertia" not in inertial or "density" in inertial):
        advice = "give a visual or a collision shape, or mass and inertia: {ixx, iyy, izz}"
        problems.refuse("TF102", at, "no shape and no inertia: the mass has no distribution", advice, on_key=True)


LINK = Type(_link, LinkSpec)
