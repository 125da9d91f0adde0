"""Materials of a URDF under names that a robot file can have."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.model import materials

if TYPE_CHECKING:
    from tfcompose.model import Link, Material, Robot, Shape

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def with_material_names(robot: Robot) -> tuple[Robot, list[str]]:
    """Return the robot whose materials have names of letters, digits and _, with what each was called before.

    Parts of colours beyond 0 to 1 are taken as the nearest that there is, and that is said too.
    """
    names: dict[str, str] = {}
    notes: list[str] = []
    for material in materials(robot.links):
        if material.name not in names:
            names[material.name] = name = _free(material.name, {*names.values()})
            if name != material.name:
                notes.append(f"the material {name} is called {material.name!r} there")
        if material.rgba and _within(material) != material.rgba:
            colour = ", ".join(f"{part:g}" for part in material.rgba)
            notes.append(f"the colour {material.name} is {colour} there, which is none: parts are 0 to 1")

    def shape(one: Shape) -> Shape:
        if one.material is None:
            return one
        renamed = replace(one.material, name=names.get(one.material.name, one.material.name))
        return replace(one, material=replace(renamed, rgba=_within(one.material)))

    def link(one: Link) -> Link:
        return replace(one, visuals=tuple(map(shape, one.visuals)))

    links = {name: link(one) for name, one in robot.links.items()}
    return replace(robot, links=links), list(dict.fromkeys(notes))


def _free(said: str, taken: set[str]) -> str:
    name = said if _NAME.fullmatch(said) else re.sub(r"[^A-Za-z0-9_]+", "_", said).strip("_") or "material"
    name = name if name[0].isalpha() else f"m_{name}"
    while name in taken:
        name += "_"
    return name


def _within(material: Material) -> tuple[float, float, float, float] | None:
    if material.rgba is None:
        return None
    red, green, blue, opacity = (min(max(part, 0.0), 1.0) for part in material.rgba)
    return (red, green, blue, opacity)
