"""Conversion of URDF elements to a robot, with spans in the URDF file.

Errors in the file become findings.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, TypeVar
from xml.sax.saxutils import quoteattr

from tfcompose.compiler.urdf.blocks import REFERRING, unknown_references
from tfcompose.compiler.urdf.inertia import traces
from tfcompose.compiler.urdf.schema import (
    HUGE,
    JOINT_TYPES,
    MOMENTS,
    SIZES,
    AttributeReader,
    unknown_words,
    version_of,
)
from tfcompose.foundation.findings import (
    Finding,
    Note,
    RejectedError,
    did_you_mean,
    finding,
    nearest,
)
from tfcompose.foundation.geometry import norm
from tfcompose.model.robot import (
    FREE,
    JOINTS,
    MOVING,
    STATIC,
    Asset,
    Dynamics,
    Edge,
    Inertial,
    Joint,
    Limit,
    Link,
    Material,
    ReferencePositions,
    Robot,
    SafetyController,
    Shape,
    SourceNumbers,
    colour_name,
)
from tfcompose.model.robot.hardware import Block

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator

    from tfcompose.compiler.urdf.read import Element
    from tfcompose.foundation.catalogue import Severity
    from tfcompose.foundation.findings import Span
    from tfcompose.foundation.geometry import Vector

    #: Takes the address of a file, its span, and the file of the document. Returns the file, and a
    #: finding if the address is wrong.
    Finder = Callable[[str, Span, str], tuple[Asset, Finding | None]]

_MOST_OF_A_BYTE = 255

#: Elements that become links, joints and materials. All other elements below <robot> are kept
#: verbatim.
_CONVERTED = frozenset({"link", "joint", "material"})

T = TypeVar("T", Dynamics, Limit, ReferencePositions, SafetyController)
#: Classes whose numbers are upper or lower bounds. An infinite bound is valid and means no limit.
_BOUNDS = (Limit, SafetyController)


@dataclass(frozen=True, slots=True)
class Converted:
    """The robot that a URDF describes, valid or not, and the findings of the conversion."""

    robot: Robot
    #: Findings about links and joints.
    of_elements: tuple[Finding, ...]
    #: Findings about elements that are kept verbatim.
    of_blocks: tuple[Finding, ...]
    #: Findings about meshes and textures. A missing file may exist on another computer.
    of_files: tuple[Finding, ...]

    @property
    def findings(self) -> tuple[Finding, ...]:
        """All findings."""
        return (*self.of_elements, *self.of_blocks, *self.of_files)


def robot_of(root: Element, file: str, find: Finder, included: Collection[str] = ()) -> Converted:
    """Return the robot that the URDF describes.

    ``find`` looks up the files of meshes and textures. ``included`` are further files that contain
    elements of the URDF.

    Raises:
        RejectedError: if the document is not a URDF.
    """
    if root.tag != "robot":
        message = f"the root element is <{root.tag}>, not <robot>"
        raise RejectedError(
            [finding("TF018", message, root.span, help="a URDF begins with <robot name=…>")]
        )
    values = AttributeReader()
    values.has_quaternions = version_of(root, values) >= (1, 1)
    bodies = _Bodies(values, lambda address, span: find(address, span, file), root)
    name = values.text(root, "name", '<robot name="rover">')
    links = _by_name(root.all("link"), values)
    joints = root.all("joint")
    _by_name(joints, values)
    _by_name(
        [element for element in root.all("material") if element.attributes.get("name")],
        values,
        "warning",
    )
    edges = [edge for element in joints if (edge := _edge(element, values))]
    frames = {link: element.value_span("name") for link, element in links.items()}
    names = {edge.joint_name: None for edge in edges}
    referring = (element for element in root.children if element.tag in REFERRING)
    unknown = (
        reference
        for element in referring
        for reference in unknown_references(element, frames, names)
    )
    robot = Robot(
        name=name,
        file=file,
        frames=frames,
        edges=tuple(edges),
        links={link: bodies.link(link, element) for link, element in links.items()},
        processes=(),
        base=None,
        blocks=tuple(_blocks(root)),
        foreign=frozenset({file, *included}),
        source_numbers=tuple(_source_numbers(root)),
    )
    of_blocks = tuple(replace(finding, severity="warning") for finding in unknown)
    return Converted(
        robot, (*values.findings, *unknown_words(root)), of_blocks, tuple(bodies.findings)
    )


def _source_numbers(root: Element) -> Iterator[SourceNumbers]:
    """Yield the numbers of the origins of joints and bodies, and of the joints' limits."""
    for joint in root.all("joint"):
        path = ("joints", joint.attributes.get("name", ""))
        yield from _numbers_of(joint.first("origin"), path, ("xyz", "rpy"))
        for number in _numbers_of(joint.first("limit"), path, ("lower", "upper")):
            yield replace(number, path=(*path, "limit"))
    for link in root.all("link"):
        for body in link.children:
            path = ("links", link.attributes.get("name", ""))
            for number in _numbers_of(body.first("origin"), path, ("xyz", "rpy")):
                yield replace(number, path=(*path, body.tag, number.key))


def _numbers_of(
    element: Element | None, path: tuple[str, str], names: tuple[str, ...]
) -> Iterator[SourceNumbers]:
    """Yield the numbers of an element's attributes. Invalid values are already findings."""
    if element is None:
        return
    for name in names:
        tokens = element.attributes.get(name, "").split()
        try:
            numbers = tuple(map(float, tokens))
        except ValueError:
            continue
        if numbers and all(abs(number) <= HUGE for number in numbers):
            place = partial(_value_place, element, name)
            yield SourceNumbers((*path, name), numbers, (False,) * len(numbers), place)


def _value_place(element: Element, name: str, _index: int) -> Span:
    """Return the span of an attribute's value. With xacro, its numbers may be in no file."""
    return element.value_span(name)


def _by_name(
    elements: list[Element], values: AttributeReader, severity: Severity = "error"
) -> dict[str, Element]:
    """Return the elements by name. A repeated name is a finding."""
    by_name: dict[str, Element] = {}
    for element in elements:
        name = values.text(element, "name", f'<{element.tag} name="…">')
        if name in by_name:
            note = Note("first defined here", by_name[name].value_span("name"))
            message = f"duplicate {element.tag} name {name}"
            advice = "remove it: ROS parsers reject the robot"
            advice = "rename one of them" if severity == "error" else advice
            span = element.value_span("name")
            values.findings.append(
                finding("TF722", message, span, notes=[note], help=advice, severity=severity)
            )
        elif name:
            by_name[name] = element
    return by_name


def _blocks(root: Element) -> Iterator[Block]:
    """Yield the elements that are kept verbatim, named by tag and number."""
    counts: dict[str, int] = {}
    for element in root.children:
        if element.tag not in _CONVERTED:
            counts[element.tag] = counts.get(element.tag, 0) + 1
            name = f"{element.tag.replace(':', '_')}_{counts[element.tag]}"
            places = (
                tuple(node.span for node in element.walk())
                if element.tag == "ros2_control"
                else ()
            )
            yield Block(name, element.span, _with_namespaces(element, root), places)


def _with_namespaces(element: Element, root: Element) -> str:
    """Return the source text of the element, with namespace declarations from the root."""
    raw = element.raw
    spaces = {name: value for name, value in root.attributes.items() if name.startswith("xmlns:")}
    used = [name for name in spaces if re.search(rf"[<\s]{re.escape(name[6:])}:", raw)]
    more = "".join(
        f" {name}={quoteattr(spaces[name])}" for name in used if name not in element.attributes
    )
    begin = 1 + len(element.tag)
    return raw[:begin] + more + raw[begin:]


def _edge(element: Element, values: AttributeReader) -> Edge | None:
    """Return the edge of a joint, None for a joint without parent or child."""
    name, kind = element.attributes.get("name", ""), values.text(element, "type", 'type="fixed"')
    if kind and kind not in JOINT_TYPES:
        advice = did_you_mean(kind, JOINT_TYPES, f"one of: {', '.join(JOINT_TYPES)}")
        values.refuse(f"unknown joint type {kind}", element.value_span("type"), advice)
        # Later checks use the nearest valid type.
        kind = nearest(kind, JOINT_TYPES) or kind
    ends = {}
    for tag in ("parent", "child"):
        end = element.first(tag)
        if end is None:
            values.refuse(f"the joint {name} has no {tag}", element.span, f'<{tag} link="…"/>')
        elif values.text(end, "link", f'<{tag} link="…"/>'):
            ends[tag] = end
    joint = _joint(name, kind, element, values) if kind in MOVING or kind in FREE else None
    if len(ends) < 2:  # noqa: PLR2004 (parent and child)
        return None
    free = kind in FREE
    return Edge(
        parent=ends["parent"].attributes["link"],
        child=ends["child"].attributes["link"],
        kind="dynamic" if free else "joint" if joint else "static",
        pose=values.pose(element),
        owner=JOINTS if joint and not free else STATIC,
        span=ends["parent"].value_span("link"),
        joint=None if free else joint,
        free=joint if free else None,
        joint_name=name,
        joint_at=element.value_span("name"),
        child_at=ends["child"].value_span("link"),
        xyz_at=_xyz_at(element),
    )


def _xyz_at(element: Element) -> Span | None:
    """Return the span of a joint's position, None without a position."""
    origin = element.first("origin")
    if origin is None or "xyz" not in origin.attributes:
        return None
    return origin.value_span("xyz")


def _joint(name: str, kind: Any, element: Element, values: AttributeReader) -> Joint:
    axis_element, bounds = element.first("axis"), element.first("limit")
    x, y, z = values.numbers(axis_element, "xyz", (1.0, 0.0, 0.0))
    length = norm((x, y, z))
    if not 0 < length < math.inf:
        span = (axis_element or element).value_span("xyz")
        values.refuse(f"the axis of {name} has no direction", span, '<axis xyz="0 0 1"/>')
        x, y, z, length = 1.0, 0.0, 0.0, 1.0
    axis: Vector = (x / length, y / length, z / length)
    mimic = element.first("mimic")
    joint = Joint(name, kind, axis, span=element.value_span("name"), axis_length=length)
    if axis_element is not None and "xyz" in axis_element.attributes:
        joint = replace(joint, axis_at=axis_element.value_span("xyz"))
    if mimic is not None:
        master = values.text(mimic, "joint", '<mimic joint="…"/>')
        multiplier, offset = (
            values.number(mimic, "multiplier", 1.0),
            values.number(mimic, "offset", 0.0),
        )
        span = mimic.value_span("joint") if master else mimic.span
        joint = replace(
            joint, mimic=master or None, multiplier=multiplier, offset=offset, mimic_at=span
        )
    return replace(
        joint,
        limit=_limit(name, bounds, values),
        limit_at=bounds.span if bounds is not None else None,
        dynamics=_numbers(Dynamics, element.first("dynamics"), values),
        safety=_safety(name, element.first("safety_controller"), values),
        reference=_numbers(ReferencePositions, element.first("calibration"), values),
    )


def _limit(name: str, element: Element | None, values: AttributeReader) -> Limit | None:
    for key in ("effort", "velocity"):
        if element is not None and key not in element.attributes:
            values.refuse(
                f"the limit of {name} has no {key}", element.span, f'URDF requires it: {key}="1"'
            )
    return _numbers(Limit, element, values)


def _safety(
    name: str, element: Element | None, values: AttributeReader
) -> SafetyController | None:
    if element is not None and "k_velocity" not in element.attributes:
        message = f"the safety_controller of {name} has no k_velocity"
        values.refuse(message, element.span, 'URDF requires it: k_velocity="10"')
    return _numbers(SafetyController, element, values, k_velocity=0.0)


def _numbers(
    cls: type[T], element: Element | None, values: AttributeReader, **defaults: float
) -> T | None:
    """Return an object whose fields are the element's attributes.

    Missing attributes have their defaults.
    """
    if element is None:
        return None
    read = values.read_bound if cls in _BOUNDS else values.number
    values_read = {name: read(element, name) for name in cls.__slots__}
    return cls(
        **defaults | {name: value for name, value in values_read.items() if value is not None}
    )


@dataclass
class _Bodies:
    """Reads the links of a document."""

    values: AttributeReader
    find: Callable[[str, Span], tuple[Asset, Finding | None]]
    root: Element
    #: Findings about mesh and texture files.
    findings: list[Finding] = field(default_factory=list)
    _materials: dict[str, Material | None] = field(default_factory=dict)
    _elements: dict[str, list[Element]] = field(default_factory=dict)
    _undescribed: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        visuals = [element for link in self.root.all("link") for element in link.all("visual")]
        for around in (self.root, *visuals):
            for material in around.all("material"):
                self._elements.setdefault(material.attributes.get("name", ""), []).append(material)

    def link(self, name: str, element: Element) -> Link:
        """Return the link of the element."""
        visuals = tuple(shape for child in element.all("visual") for shape in self._shapes(child))
        collisions = tuple(
            shape for child in element.all("collision") for shape in self._shapes(child)
        )
        inertial = element.first("inertial")
        body = (
            self._inertial(name, inertial, visuals, collisions) if inertial is not None else None
        )
        return Link(name, element.value_span("name"), visuals, collisions, body)

    def _shapes(self, element: Element) -> list[Shape]:
        geometry = element.first("geometry")
        if geometry is None or not geometry.children:
            advice = '<geometry><box size="1 1 1"/></geometry>'
            self.values.refuse(
                f"the {element.tag} has no geometry", (geometry or element).span, advice
            )
            return []
        shapes = []
        for form in geometry.children:
            if form.tag == "mesh":
                shapes += self._mesh(element, form)
            elif form.tag in SIZES:
                shapes += self._primitive(element, form)
        return shapes

    def _primitive(self, element: Element, form: Element) -> list[Shape]:
        size: list[float] = []
        before = self.values.refused
        for key, count in SIZES[form.tag]:
            if key not in form.attributes:
                self.values.refuse(f"<{form.tag}> has no {key}", form.span)
                return []
            size += self.values.numbers(form, key, (0.0,) * count)
        if self.values.refused > before:
            return []
        if not all(0 < value < HUGE for value in size):
            span = form.value_span(SIZES[form.tag][0][0])
            severity: Severity = "warning" if min(size) == 0 and max(size) < HUGE else "error"
            advice = "give it a size or remove it: some parsers ignore it, others reject the robot"
            message = f"<{form.tag}> has the size {' '.join(f'{value:g}' for value in size)}"
            self.values.refuse(message, span, advice, severity)
            return []
        if form.tag == "capsule":
            message, advice = (
                "parsers of ROS 2 Jazzy reject <capsule>",
                "use a cylinder and two spheres",
            )
            self.values.refuse(message, form.span, advice, "warning")
        kind: Any = form.tag
        return [Shape(kind, tuple(size), self.values.pose(element), self._material(element))]

    def _mesh(self, element: Element, form: Element) -> list[Shape]:
        name = self.values.text(form, "filename", '<mesh filename="package://…"/>')
        if not name:
            return []
        x, y, z = self.values.numbers(form, "scale", (1.0, 1.0, 1.0))
        asset = self._asset(name, form.value_span("filename"))
        return [
            Shape("mesh", (x, y, z), self.values.pose(element), self._material(element), asset)
        ]

    def _asset(self, name: str, span: Span) -> Asset:
        asset, wrong = self.find(name, span)
        if wrong:
            self.findings.append(wrong)
        return asset

    def _material(self, element: Element) -> Material | None:
        """Return the colour or texture of a visual.

        If the visual only names a material, another element of the document describes the
        material.
        """
        material = element.first("material")
        if material is None:
            return None
        name = material.attributes.get("name", "")
        material_of_visual = self._describe_material(name, material) or (
            self._find_material(name) if name else None
        )
        if (
            material_of_visual is None
            and name
            and element.tag == "visual"
            and name not in self._undescribed
        ):
            self._undescribed.add(name)
            advice = did_you_mean(name, self._described_names, 'describe it: <color rgba="…"/>')
            message = f"no material {name} with a color or texture"
            self.values.refuse(message, material.value_span("name"), advice, "warning")
        return material_of_visual

    @cached_property
    def _described_names(self) -> list[str]:
        return [name for name, (element, *_) in self._elements.items() if element.children]

    def _find_material(self, name: str) -> Material | None:
        if name not in self._materials:
            described = (
                self._describe_material(name, element) for element in self._elements.get(name, ())
            )
            self._materials[name] = next((material for material in described if material), None)
        return self._materials[name]

    def _describe_material(self, name: str, material: Element) -> Material | None:
        colour, texture = material.first("color"), material.first("texture")
        if colour is None and texture is None:
            return None
        red, green, blue, opacity = self.values.numbers(colour, "rgba", (0.5, 0.5, 0.5, 1.0))
        if colour is not None:
            self._check_range(colour, (red, green, blue, opacity))
        file = texture.attributes.get("filename") if texture is not None else None
        image = (
            self._asset(file, texture.value_span("filename"))
            if texture is not None and file
            else None
        )
        rgba = (red, green, blue, opacity) if colour is not None else None
        return Material(name or colour_name(rgba or ()), rgba, image, material.span)

    def _check_range(self, colour: Element, rgba: tuple[float, ...]) -> None:
        if all(0 <= part <= 1 for part in rgba):
            return
        advice = "red, green, blue and opacity are numbers from 0 to 1"
        if min(rgba) >= 0 and max(rgba) <= _MOST_OF_A_BYTE:
            parts = [*(part / _MOST_OF_A_BYTE for part in rgba[:3]), min(rgba[3], 1.0)]
            listed = " ".join(f"{part:.3g}" for part in parts)
            advice = f'they are from 0 to 1, not to 255: rgba="{listed}"'
        text = colour.attributes["rgba"]
        self.values.refuse(
            f"rgba={text!r} is out of range", colour.value_span("rgba"), advice, "warning"
        )

    def _inertial(
        self,
        name: str,
        element: Element,
        visuals: tuple[Shape, ...],
        collisions: tuple[Shape, ...],
    ) -> Inertial | None:
        weight, tensor = element.first("mass"), element.first("inertia")
        if weight is None or tensor is None:
            missing = "mass" if weight is None else "inertia"
            self.values.refuse(
                f"the inertial of {name} has no {missing}", element.span, f"<{missing} …/>"
            )
            return None
        self.values.text(weight, "value", '<mass value="1.5"/>')
        mass = self.values.number(weight, "value", 0.0)
        if not 0 < mass < HUGE:
            severity: Severity = "warning" if mass == 0 else "error"
            advice = "give a mass in kg, greater than 0, or remove <inertial>"
            self.values.refuse(
                f"the mass of {name} is {mass:g} kg",
                weight.value_span("value"),
                advice,
                severity,
            )
            return None
        xx, xy, xz, yy, yz, zz = (self.values.number(tensor, key, 0.0) for key in MOMENTS)
        of_shapes = traces(mass, visuals, collisions)
        return Inertial(
            mass,
            self.values.pose(element),
            (xx, xy, xz, yy, yz, zz),
            of_shapes,
            span=tensor.span,
            mass_at=weight.value_span("value"),
        )
