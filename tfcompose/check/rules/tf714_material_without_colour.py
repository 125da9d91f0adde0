"""TF714: material without colour."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, did_you_mean, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def material_without_colour(robot: Robot) -> Iterator[Finding]:
    """A material is a name that no material with a colour or a texture has.

    URDF readers say so in their log, and draw the body in a colour of their own. Give it an rgba, or the name of one
    that has.
    """
    shapes = [shape for link in robot.links.values() for shape in link.visuals]
    used = [shape.material for shape in shapes if shape.material]
    known = [material.name for material in used if material.rgba or material.texture]
    for material in dict.fromkeys(used):
        if not (material.rgba or material.texture) and material.name not in known:
            advice = did_you_mean(material.name, known, "rgba: [0.5, 0.5, 0.5, 1]")
            yield finding("TF714", f"the material {material.name} has no colour", material.at, help=advice)
