"""The bodies of a URDF: shapes, masses, tensors, and the files of its meshes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.model import Asset, Inertial, Link, Material, Shape
from tfcompose.resolve.bodies import name_of_colour, traces

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.catalogue import Severity
    from tfcompose.findings import Finding, Span
    from tfcompose.load.urdf import Element
    from tfcompose.resolve.urdf_values import Values

    #: Takes the address of a file and its place; returns the file, and what is wrong with the address, if anything is.
    Finder = Callable[[str, Span], tuple[Asset, Finding | None]]

_FORMS: dict[str, tuple[tuple[str, int], ...]] = {
    "box": (("size", 3),),
    "cylinder": (("radius", 1), ("length", 1)),
    "sphere": (("radius", 1),),
    "capsule": (("radius", 1), ("length", 1)),
}
_HUGE = 1e30  # products of three smaller ones stay numbers
_TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


@dataclass(slots=True)
class Bodies:
    """Reads the links of a document; ``found`` holds what is wrong with their files."""

    values: Values
    finder: Finder
    root: Element
    found: list[Finding] = field(default_factory=list)
    _materials: dict[str, Material | None] = field(default_factory=dict)

    def link(self, name: str, element: Element) -> Link:
        """Return the body."""
        visuals = tuple(shape for one in element.all("visual") for shape in self._shapes(one))
        collisions = tuple(shape for one in element.all("collision") for shape in self._shapes(one))
        inertial = element.first("inertial")
        body = self._inertial(name, inertial, visuals, collisions) if inertial is not None else None
        return Link(name, element.place("name"), visuals, collisions, body)

    def _shapes(self, element: Element) -> list[Shape]:
        geometry = element.first("geometry")
        if geometry is None or not geometry.children:
            advice = '<geometry><box size="1 1 1"/></geometry>'
            self.values.refuse(f"a {element.tag} without a geometry", (geometry or element).at, advice)
            return []
        shapes = []
        for form in geometry.children:
            if form.tag == "mesh":
                shapes += self._mesh(element, form)
            elif form.tag in _FORMS:
                shapes += self._primitive(element, form)
        return shapes

    def _primitive(self, element: Element, form: Element) -> list[Shape]:
        size: list[float] = []
        before = self.values.refused
        for key, count in _FORMS[form.tag]:
            if key not in form.attributes:
                self.values.refuse(f"<{form.tag}> has no {key}", form.at)
                return []
            size += self.values.numbers(form, key, (0.0,) * count)
        if self.values.refused > before:
            return []
        if not all(0 < value < _HUGE for value in size):
            at = form.place(_FORMS[form.tag][0][0])
            flat: Severity = "warning" if min(size) == 0 and max(size) < _HUGE else "error"
            advice = "give it a size, or remove it: some readers see nothing, others refuse the robot"
            self.values.refuse(f"a {form.tag} of size {' '.join(f'{value:g}' for value in size)}", at, advice, flat)
            return []
        if form.tag == "capsule":
            message, advice = "readers of ROS 2 Jazzy refuse a robot with a <capsule>", "a cylinder and two spheres"
            self.values.refuse(message, form.at, advice, "warning")
        kind: Any = form.tag
        return [Shape(kind, tuple(size), self.values.pose(element), self._material(element))]

    def _mesh(self, element: Element, form: Element) -> list[Shape]:
        name = self.values.text(form, "filename", '<mesh filename="package://…"/>')
        if not name:
            return []
        x, y, z = self.values.numbers(form, "scale", (1.0, 1.0, 1.0))
        asset = self._asset(name, form.place("filename"))
        return [Shape("mesh", (x, y, z), self.values.pose(element), self._material(element), asset)]

    def _asset(self, name: str, at: Span) -> Asset:
        asset, wrong = self.finder(name, at)
        if wrong:
            self.found.append(wrong)
        return asset

    def _material(self, element: Element) -> Material | None:
        """Return the colour or texture of a visual; one that is only named is described elsewhere in the document."""
        said = element.first("material")
        if said is None:
            return None
        name = said.attributes.get("name", "")
        return self._described(name, said) or (self._named(name) if name else None)

    def _named(self, name: str) -> Material | None:
        if name not in self._materials:
            visuals = [one for link in self.root.all("link") for one in link.all("visual")]
            everywhere = [said for around in (self.root, *visuals) for said in around.all("material")]
            described = (self._described(name, said) for said in everywhere if said.attributes.get("name") == name)
            self._materials[name] = next((one for one in described if one), None)
        return self._materials[name]

    def _described(self, name: str, said: Element) -> Material | None:
        colour, texture = said.first("color"), said.first("texture")
        if colour is None and texture is None:
            return None
        red, green, blue, opacity = self.values.numbers(colour, "rgba", (0.5, 0.5, 0.5, 1.0))
        file = texture.attributes.get("filename") if texture is not None else None
        image = self._asset(file, texture.place("filename")) if texture is not None and file else None
        rgba = (red, green, blue, opacity) if colour is not None else None
        return Material(name or name_of_colour(rgba or ()), rgba, image, said.at)

    def _inertial(
        self, name: str, element: Element, visuals: tuple[Shape, ...], collisions: tuple[Shape, ...]
    ) -> Inertial | None:
        said, tensor = element.first("mass"), element.first("inertia")
        if said is None or tensor is None:
            missing = "mass" if said is None else "inertia"
            self.values.refuse(f"the inertial of {name} has no {missing}", element.at, f"<{missing} …/>")
            return None
        self.values.text(said, "value", '<mass value="1.5"/>')
        mass = self.values.number(said, "value", 0.0)
        if not 0 < mass < _HUGE:
            level: Severity = "warning" if mass == 0 else "error"
            advice = "in kg, greater than 0; a link without a body has no inertial"
            self.values.refuse(f"the mass of {name} is {mass:g} kg", said.place("value"), advice, level)
            return None
        xx, xy, xz, yy, yz, zz = (self.values.number(tensor, key, 0.0) for key in _TENSOR)
        of_shapes = traces(mass, visuals, collisions)
        return Inertial(mass, self.values.pose(element), (xx, xy, xz, yy, yz, zz), of_shapes, tensor.at)
