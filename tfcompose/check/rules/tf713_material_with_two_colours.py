"""TF713: material with two colours."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Material, Robot


def material_with_two_colours(robot: Robot) -> Iterator[Finding]:
    """Two materials have one name and different colours.

    URDF readers keep one material of a name, mostly the first, and draw both bodies with it. Give one of them another
    name, or leave the name out: then it is named after its colour.
    """
    first: dict[str, Material] = {}
    for link in robot.links.values():
        for shape in link.visuals:
            material = shape.material
            if material is None or not (material.rgba or material.texture):
                continue
            other = first.setdefault(material.name, material)
            if _look(other) != _look(material):
                message = f"the material {material.name} of {link.name} has another colour than the one before"
                notes = [Note("that one stands here", other.at)]
                advice = "another name, or none; a name alone repeats the other's colour"
                yield finding("TF713", message, material.at, help=advice, notes=notes, severity="warning")


def _look(material: Material) -> tuple[object, ...]:
    return (material.rgba, material.texture.uri if material.texture else "")
