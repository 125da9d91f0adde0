"""Notes about parts of a URDF that the import omits or changes."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.compiler.urdf.blocks import read_block, unknown_references
from tfcompose.compiler.urdf.schema import OPAQUE
from tfcompose.foundation.geometry import normalise, quat_from_rpy
from tfcompose.model.robot import BOUNDED, materials

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.urdf.lint import Document
    from tfcompose.compiler.urdf.read import Element
    from tfcompose.foundation.findings import Span
    from tfcompose.foundation.geometry import Quaternion, Vector
    from tfcompose.model.robot import Link, Material, Robot, Shape

    #: A section of the robot file and the name of an entry in it; both are empty for the file
    #: itself.
    Entry = tuple[str, str]
    Notes = dict[Entry, list[str]]

#: Known attributes that a robot file cannot express.
_NOT_HELD = {
    "link": ("type",),
    "visual": ("name",),
    "collision": ("name",),
    "limit": ("acceleration", "jerk", "deceleration"),
    "calibration": ("reference_position",),
}
#: Elements without an effect in a fixed joint.
_OF_MOTION = ("axis", "limit", "mimic", "dynamics", "calibration", "safety_controller")
#: Blocks that programs ignore if they refer to a missing link or joint. ros2_control is not in
#: this list, because it does not start with an unknown joint.
_UNUSED = ("<gazebo", "<transmission")
_MATERIAL = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def omitted_notes(document: Document) -> Notes:
    """Return notes about omitted parts of the source, by link and joint.

    The key of notes about the whole robot is an empty name.
    """
    notes: Notes = {}
    entries: list[tuple[Span, Entry]] = []
    colours = _described_materials(document.root)
    for element in document.root.children:
        if element.tag not in {"link", "joint"}:
            continue
        path = (f"{element.tag}s", element.attributes.get("name", ""))
        entries.append((element.span, path))
        left_out = list(dict.fromkeys(_in_element(element, colours)))
        if left_out:
            notes.setdefault(path, []).append(f"left out: {', '.join(left_out)}")
        if _has_no_ends(element):
            notes.setdefault(path, []).append(
                "the source gives no lower and upper limit, which parsers read as 0"
            )
    for (
        finding
    ) in document.converted.of_elements:  # findings about blocks and files omit no link or joint
        if finding.span:
            notes.setdefault(_entry_at(finding.span, entries), []).append(
                f"{finding.code} in the source: {finding.message}"
            )
    of_robot = list(_in_robot(document.root, document.robot))
    if of_robot:
        notes.setdefault(("", ""), []).append(f"left out: {', '.join(of_robot)}")
    return notes


def _has_no_ends(element: Element) -> bool:
    limit = element.first("limit") if element.attributes.get("type") in BOUNDED else None
    return limit is not None and not limit.attributes.keys() & {"lower", "upper"}


def _entry_at(span: Span, entries: list[tuple[Span, Entry]]) -> Entry:
    before = [
        entry for path, entry in entries if (path.line, path.column) <= (span.line, span.column)
    ]
    return before[-1] if before else ("", "")


def _in_robot(root: Element, robot: Robot) -> Iterator[str]:
    for name in root.attributes:
        if name != "name" and not name.startswith("xmlns"):
            yield f'{name}="{root.attributes[name]}"'
    names = {material.name for material in materials(robot.links)}
    unused = [
        name
        for element in root.all("material")
        if (name := element.attributes.get("name", "")) not in names
    ]
    if unused:
        yield f"the unused material{'s' if unused[1:] else ''} {', '.join(unused)}"


def _in_element(element: Element, colours: frozenset[str]) -> Iterator[str]:
    """Yield notes about parts of a link or joint that a robot file cannot express."""
    if element.tag == "joint" and element.attributes.get("type") == "fixed":
        tags = [child.tag for child in element.children if child.tag in _OF_MOTION]
        yield from (f"the {tag} of a fixed joint" for tag in tags)
    for inner in _elements_in(element):
        for name, value in inner.attributes.items():
            if ":" in name or name in _NOT_HELD.get(inner.tag, ()):
                yield f'{inner.tag} {name}="{value}"'
        yield from (f"<{child.tag}>" for child in inner.children if ":" in child.tag)
        if (
            inner.tag == "material"
            and inner.attributes.get("name") not in colours
            and not inner.children
        ):
            yield f"the undefined material {inner.attributes.get('name', '')}"


def _described_materials(root: Element) -> frozenset[str]:
    """Return the names of the materials that have a colour or a texture somewhere."""
    visuals = [visual for link in root.all("link") for visual in link.all("visual")]
    described = [material for around in (root, *visuals) for material in around.all("material")]
    return frozenset(
        material.attributes.get("name", "") for material in described if material.children
    )


def _elements_in(element: Element) -> Iterator[Element]:
    """Yield the element and its descendants, without elements for other programs."""
    waiting = [element]
    while waiting:
        inner = waiting.pop()
        yield inner
        waiting += [
            child for child in inner.children if child.tag not in OPAQUE and ":" not in child.tag
        ]


def angles(root: Element) -> dict[Quaternion, Vector]:
    """Return the roll, pitch and yaw (rad) of each ``origin`` in the source, by rotation."""
    rpy: dict[Quaternion, Vector] = {}
    for top in root.children:
        for element in _elements_in(top) if top.tag in {"link", "joint"} else ():
            angles_text = (
                element.attributes.get("rpy", "").split() if element.tag == "origin" else []
            )
            try:
                roll, pitch, yaw = map(float, angles_text)
            except ValueError:
                continue
            if max(map(abs, (roll, pitch, yaw))) < 1e9:  # noqa: PLR2004 (as where poses are read)
                rpy.setdefault(normalise(quat_from_rpy(roll, pitch, yaw)), (roll, pitch, yaw))
    return rpy


def without_unused_blocks(robot: Robot) -> tuple[Robot, list[str]]:
    """Return the robot without blocks about missing links and joints, and notes about them."""
    joints = {edge.joint_name: None for edge in robot.edges}
    blocks, notes = [], []
    for block in robot.blocks:
        (element,) = read_block(block.text, robot.file).children
        unknown = (
            list(unknown_references(element, robot.frames, joints))
            if block.text.startswith(_UNUSED)
            else []
        )
        if unknown:
            notes.append(f"left out: {_name(element)}: {unknown[0].message}")
        else:
            blocks.append(block)
    return replace(robot, blocks=tuple(blocks)), notes


def _name(element: Element) -> str:
    name = next((key for key in ("name", "reference") if key in element.attributes), None)
    return f'<{element.tag} {name}="{element.attributes[name]}">' if name else f"<{element.tag}>"


def with_material_names(robot: Robot) -> tuple[Robot, list[str]]:
    """Return the robot with plain material names, and the original name of each.

    Colour components outside 0 to 1 are clamped, with a note.
    """
    names: dict[str, str] = {}
    notes: list[str] = []
    for material in materials(robot.links):
        if material.name not in names:
            names[material.name] = name = _material_name(material.name, {*names.values()})
            if name != material.name:
                notes.append(f"the material {name} is called {material.name!r} in the source")
        if material.rgba and _clamp_colour(material) != material.rgba:
            colour = ", ".join(f"{part:g}" for part in material.rgba)
            notes.append(f"the colour {material.name} is {colour} in the source: parts are 0 to 1")

    def shape(drawn: Shape) -> Shape:
        if drawn.material is None:
            return drawn
        name = names.get(drawn.material.name, drawn.material.name)
        return replace(
            drawn, material=replace(drawn.material, name=name, rgba=_clamp_colour(drawn.material))
        )

    def link(body: Link) -> Link:
        return replace(body, visuals=tuple(map(shape, body.visuals)))

    links = {name: link(body) for name, body in robot.links.items()}
    return replace(robot, links=links), list(dict.fromkeys(notes))


def _material_name(name: str, used_names: set[str]) -> str:
    free = (
        name
        if _MATERIAL.fullmatch(name)
        else re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_") or "material"
    )
    free = free if free[0].isalpha() else f"m_{free}"
    while free in used_names:
        free += "_"
    return free


def _clamp_colour(material: Material) -> tuple[float, float, float, float] | None:
    """Return the colour with each component limited to 0 to 1; None if there is no colour."""
    if material.rgba is None:
        return None
    red, green, blue, opacity = (min(max(part, 0.0), 1.0) for part in material.rgba)
    return (red, green, blue, opacity)
