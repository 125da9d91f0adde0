"""The bodies of a URDF: shapes, masses, tensors, and the files of its meshes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from tfcompose.diagnostic import Diagnostic, finding
from tfcompose.model import Inertial, Link, Shape
from tfcompose.resolve.bodies import traces

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.load.urdf import Element
    from tfcompose.resolve.urdf import Values

    #: Takes a mesh's file name; returns a code with what is wrong and where it looked, or None.
    Finder = Callable[[str], tuple[str, str, str] | None]

_FORMS: dict[str, tuple[tuple[str, int], ...]] = {
    "box": (("size", 3),),
    "cylinder": (("radius", 1), ("length", 1)),
    "sphere": (("radius", 1),),
}
_TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


@dataclass(slots=True)
class Bodies:
    """Reads links; ``found`` holds what is wrong with their meshes."""

    values: Values
    finder: Finder
    found: list[Diagnostic] = field(default_factory=list)

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
                self._mesh(form)
            elif form.tag in _FORMS:
                shapes += self._primitive(element, form)
        return shapes

    def _primitive(self, element: Element, form: Element) -> list[Shape]:
        size: list[float] = []
        for key, count in _FORMS[form.tag]:
            if key not in form.attributes:
                self.values.refuse(f"<{form.tag}> has no {key}", form.at)
                return []
            size += self.values.numbers(form, key, (0.0,) * count)
        if not all(0 < value < 1e30 for value in size):  # noqa: PLR2004 (products of three stay numbers)
            at = form.place(_FORMS[form.tag][0][0])
            self.values.refuse(f"a {form.tag} of size {' '.join(f'{value:g}' for value in size)}", at)
            return []
        kind: Literal["box", "cylinder", "sphere"] = "sphere"
        kind = "box" if form.tag == "box" else "cylinder" if form.tag == "cylinder" else kind
        return [Shape(kind, tuple(size), self.values.pose(element))]

    def _mesh(self, form: Element) -> None:
        name = self.values.text(form, "filename", '<mesh filename="package://…"/>')
        wrong = self.finder(name) if name else None
        if wrong:
            code, message, advice = wrong
            severity: Literal["error", "warning"] = "error" if code == "TF723" else "warning"
            place = form.place("filename")
            self.found.append(finding(code, message, place, help=advice, severity=severity))

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
        if not 0 < mass < 1e30:  # noqa: PLR2004 (as above)
            level: Literal["error", "warning"] = "warning" if mass == 0 else "error"
            advice = "in kg, greater than 0; a link without a body has no inertial"
            self.values.refuse(f"the mass of {name} is {mass:g} kg", said.place("value"), advice, level)
            return None
        xx, xy, xz, yy, yz, zz = (self.values.number(tensor, key, 0.0) for key in _TENSOR)
        of_shapes = traces(mass, visuals, collisions)
        return Inertial(mass, self.values.pose(element), (xx, xy, xz, yy, yz, zz), of_shapes, tensor.at)
