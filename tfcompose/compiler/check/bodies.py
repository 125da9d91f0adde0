"""Rules about bodies: inertia, materials, and bodies that no URDF contains."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.compiler.check.rule import rule
from tfcompose.compiler.mesh_box import size_of
from tfcompose.compiler.urdf.inertia import of_primitive
from tfcompose.foundation.findings import Finding, Note, did_you_mean, finding
from tfcompose.foundation.text import with_more

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model.robot import Inertial, Link, Material, Robot, Shape


@rule("TF709", of_urdf=True)
def inertia_missing(robot: Robot) -> Iterator[Finding]:
    fixed: dict[str, list[str]] = {}
    for edge in robot.edges:
        if edge.kind == "static":
            fixed.setdefault(edge.parent, []).append(edge.child)
    moving = [
        edge for edge in robot.edges if (edge.joint or edge.free) and edge.child in robot.links
    ]
    masses = {name for name, link in robot.links.items() if link.inertial or link.has_mass}
    frames = masses - {
        frame for sensor in robot.sensors for frame in (sensor.mount, *sensor.frames)
    }
    link_with_mass = next(
        (edge.child for edge in moving if _has_one(frames, fixed, edge.child)), None
    )
    for edge in moving if link_with_mass else ():
        if not _has_one(masses, fixed, edge.child):
            span = robot.links[edge.child].span
            message = (
                f"{edge.child}, moved by {edge.joint_name}, has no mass; {link_with_mass} has one"
            )
            advice = '<inertial> with <mass value="…"/> and <inertia …/>'
            if not robot.is_foreign(span):
                link = robot.links[edge.child]
                shape = (
                    "" if link.visuals or link.collisions else ", visual: {box: [0.1, 0.1, 0.1]}"
                )
                advice = f"inertial: {{mass: 0.5 kg}}{shape}"
            yield finding("TF709", message, span, help=f"add {advice}")


def _has_one(names: set[str], fixed: dict[str, list[str]], link: str) -> bool:
    """Return whether ``names`` contains the link or a link fixed to it."""
    waiting, passed = [link], set[str]()
    while waiting:
        name = waiting.pop()
        if name in names:
            return True
        if name not in passed:
            passed.add(name)
            waiting += fixed.get(name, ())
    return False


#: The error of rounding to three digits.
_ROUNDING = 0.01


@rule("TF710", of_urdf=True)
def impossible_inertia(robot: Robot) -> Iterator[Finding]:
    for link in robot.links.values():
        inertial = link.inertial
        if inertial is None or inertial.span is None:
            continue
        if why := _impossible(inertial.tensor):
            advice = "remove inertia: it is computed from mass and shape"
            if robot.is_foreign(inertial.span):
                advice = "take the tensor from CAD, in kg m² and about the centre of mass"
            yield finding(
                "TF710", f"impossible inertia of {link.name}: {why}", inertial.span, help=advice
            )


def _impossible(tensor: tuple[float, float, float, float, float, float]) -> str:
    """Return why no rigid body can have this inertia; empty if a body can."""
    low, middle, high = _principal(tensor)
    if low <= 0:
        return f"smallest principal moment is {low:.3g} kg m²"
    if high > (low + middle) * (1 + _ROUNDING):
        return f"principal moment {high:.3g} exceeds {low:.3g} + {middle:.3g} kg m²"
    return ""


def _principal(
    tensor: tuple[float, float, float, float, float, float],
) -> tuple[float, float, float]:
    """Return the eigenvalues of a symmetric tensor, smallest first (Smith, 1961).

    The tensor is (xx, xy, xz, yy, yz, zz).
    """
    scale = (
        max(map(abs, tensor)) or 1.0
    )  # scaled, because squares of values from a URDF may overflow a float
    xx, xy, xz, yy, yz, zz = (value / scale for value in tensor)
    mean = (xx + yy + zz) / 3
    spread = math.sqrt(
        ((xx - mean) ** 2 + (yy - mean) ** 2 + (zz - mean) ** 2 + 2 * (xy**2 + xz**2 + yz**2)) / 6
    )
    if spread <= abs(mean) * 1e-12:
        return (mean * scale, mean * scale, mean * scale)
    a, b, c, d, e, f = (
        (xx - mean) / spread,
        xy / spread,
        xz / spread,
        (yy - mean) / spread,
        yz / spread,
        (zz - mean) / spread,
    )
    half = (a * (d * f - e * e) - b * (b * f - e * c) + c * (b * e - d * c)) / 2
    angle = math.acos(max(-1.0, min(1.0, half))) / 3
    high, low = (
        mean + 2 * spread * math.cos(angle),
        mean + 2 * spread * math.cos(angle + math.tau / 3),
    )
    return (low * scale, (3 * mean - high - low) * scale, high * scale)


#: A mesh at most this long only marks a frame. It does not show the frame's body.
_MARK_M = 1e-3
#: Largest allowed ratio between an inertia and the inertia computed from the link's shapes, or
#: from boxes around the link's meshes.
_TIMES, _TIMES_OF_BOX = 10, 100


@rule("TF711", of_urdf=True)
def inertia_off_from_shape(robot: Robot) -> Iterator[Finding]:
    for link in robot.links.values():
        inertial = link.inertial
        if inertial is None or _density(link) > _DENSEST or _impossible(inertial.tensor):
            continue  # TF732, TF710
        of_shapes, times = inertial.of_shapes, _TIMES
        if not of_shapes:
            of_shapes, times = _of_boxes(inertial.mass, link), _TIMES_OF_BOX
        trace = inertial.tensor[0] + inertial.tensor[3] + inertial.tensor[5]
        ratios = [trace / of_shape for of_shape in of_shapes if of_shape > 0]
        if not ratios or trace <= 0 or any(1 / times < ratio < times for ratio in ratios):
            continue
        ratio = min(ratios, key=lambda candidate: abs(math.log(candidate)))
        span = inertial.span or link.span
        message = f"inertia of {link.name} is {ratio:.3g} times what its mass and shape give"
        advice = "give it in kg m², about the centre of mass"
        if not robot.is_foreign(span):
            advice += ", or remove inertia: it is computed"
        yield finding("TF711", message, span, help=advice)


def _of_boxes(mass: float, link: Link) -> tuple[float, ...]:
    """Return the traces of the inertias of the boxes around the link's shapes.

    Each box has the full ``mass`` in kg.
    """
    sizes = map(size_of, (*link.visuals, *link.collisions))
    return tuple(
        mass / 6 * math.hypot(*size) ** 2 for size in sizes if size and max(size) > _MARK_M
    )


#: In kg/m³. The densest element, osmium, has 22,600 kg/m³.
_DENSEST = 25_000.0
#: Density in kg/m³ from which the mass is probably in grams. A hollow body whose mass in grams was
#: read as kilograms has at least this density.
_DENSE_IN_GRAMS = 100_000.0
#: A smaller body only marks a frame. It has a mass because simulators require a mass.
_LEAST_BODY_M3 = 1e-5


@rule("TF732", of_urdf=True, follows="pose")
def density_of_no_material(robot: Robot) -> Iterator[Finding]:
    for link in robot.links.values():
        density = _density(link)
        if density > _DENSEST and (inertial := link.inertial):
            message = (
                f"{link.name} has {inertial.mass:g} kg in {inertial.mass / density:.3g} m³:"
                f" {density:.2g} kg/m³, and the densest metal has 22600"
            )
            grams = f"{inertial.mass / 1000:g}"
            if not robot.is_foreign(link.span):
                grams = f"mass: {inertial.mass:g} g"
            advice = "check its mass, in kg, and the sizes of its shapes, in m"
            if density > _DENSE_IN_GRAMS:
                advice = f"if grams are meant, write {grams}; otherwise check its sizes, in m"
            yield finding("TF732", message, inertial.mass_at or link.span, help=advice)
        elif inertial := _lighter_than_air(link):
            volume = _most_volume((*link.visuals, *link.collisions))
            message = (
                f"{link.name} has {inertial.mass:g} kg in {volume:.3g} m³, and air of that volume"
                f" has {volume * _AIR:.2g} kg"
            )
            advice = "check its mass, in kg, and the sizes of its shapes, in m"
            yield finding("TF732", message, inertial.mass_at or link.span, help=advice)


#: Density of air at sea level, in kg/m³.
_AIR = 1.2
#: Range of volumes to check. A smaller body has a mass only because simulators require a mass. The
#: sizes of a larger body are not in metres (TF414).
_LEAST_LIGHT_M3, _MOST_LIGHT_M3 = 1e-3, 1e3


def _lighter_than_air(link: Link) -> Inertial | None:
    """Return the link's inertial if the link is lighter than air of the same volume.

    Only primitive shapes count. A box around a mesh of an open frame is mostly empty.
    """
    lists = [shapes for shapes in (link.visuals, link.collisions) if shapes]
    if link.inertial is None or any(shape.mesh for shapes in lists for shape in shapes):
        return None
    least = min(map(_most_volume, lists), default=0.0)
    is_light = 0 < link.inertial.mass < _AIR * least
    is_light = is_light and _LEAST_LIGHT_M3 < least < _MOST_LIGHT_M3
    return link.inertial if is_light else None


def _density(link: Link) -> float:
    """Return the link's mass divided by the volume of its shapes, in kg/m³; 0 if unknown."""
    volume = max(_most_volume(link.visuals), _most_volume(link.collisions))
    if link.inertial is None or not _LEAST_BODY_M3 < volume < math.inf:
        return 0.0
    return link.inertial.mass / volume


def _most_volume(shapes: tuple[Shape, ...]) -> float:
    """Return the total volume of the shapes in m³.

    A mesh counts with the volume of its bounding box. If a box is unknown, the volume is infinite.
    """
    volume = 0.0
    for shape in shapes:
        if shape.mesh is None:
            volume += of_primitive(shape).volume
            continue
        size = size_of(shape)
        volume += math.prod(size) if size else math.inf
    return volume


#: Programs that read the description with KDL.
_KDL_READERS = frozenset({"robot_state_publisher", "moveit_ros_move_group"})


@rule("TF712", of_urdf=True)
def root_link_with_inertia(robot: Robot) -> Iterator[Finding]:
    root = robot.links.get(robot.base or "")
    if root is None or root.inertial is None:
        return
    if robot.is_foreign(root.span):
        message = f"root link {root.name} has an inertia, which robot_state_publisher ignores"
        advice = (
            "add a root without a body: a link such as base_footprint, and a fixed joint from it"
            f" to {root.name}"
        )
        yield finding("TF712", message, root.span, help=advice)
        return
    for process in robot.processes:
        if (
            process.package in _KDL_READERS and not process.describes
        ):  # tfcompose's own publishers get a root link without inertia
            message = f"root link {root.name} has an inertia, which {process.package} ignores"
            notes = [Note(f"{process.name} is defined here", process.span)]
            advice = f"give {root.name} a parent without a body, such as base_footprint"
            yield finding("TF712", message, root.span, help=advice, notes=notes)
            return


@rule("TF713", of_urdf=True)
def material_with_two_colours(robot: Robot) -> Iterator[Finding]:
    first: dict[str, Material] = {}
    variants: dict[tuple[str, object], dict[str, Material]] = {}
    for link in robot.links.values():
        for shape in link.visuals:
            material = shape.material
            if material is None or not (material.rgba or material.texture):
                continue
            appearance = _appearance(material)
            if _appearance(first.setdefault(material.name, material)) != appearance:
                variants.setdefault((material.name, appearance), {}).setdefault(
                    link.name, material
                )
    for (name, _), links in variants.items():
        link_name, material = next(iter(links.items()))
        them = with_more(link_name, len(links) - 1, "link")
        message = f"material {name} has another colour in {them} than in its definition"
        notes = [Note(f"{name} is first defined here", first[name].span)]
        advice = "rename one of them"
        if not robot.is_foreign(material.span):
            advice += ", or give the name only: it then has the colour of the first"
        yield finding("TF713", message, material.span, help=advice, notes=notes)


def _appearance(material: Material) -> tuple[object, ...]:
    return (material.rgba, material.texture.uri if material.texture else "")


@rule("TF714")
def material_without_colour(robot: Robot) -> Iterator[Finding]:
    shapes = [shape for link in robot.links.values() for shape in link.visuals]
    used = [shape.material for shape in shapes if shape.material]
    names = [material.name for material in used if material.rgba or material.texture]
    for material in dict.fromkeys(used):
        if not (material.rgba or material.texture) and material.name not in names:
            advice = did_you_mean(material.name, names, "add rgba: [0.5, 0.5, 0.5, 1]")
            yield finding(
                "TF714", f"material {material.name} has no colour", material.span, help=advice
            )


_MOST_LISTED = 5


@rule("TF730")
def body_in_no_urdf(robot: Robot) -> Iterator[Finding]:
    if robot.base is None:
        return
    described = robot.below(robot.base) | {
        frame for sensor in robot.sensors for frame in sensor.frames
    }
    described |= {f"{part.prefix}{name}" for part in robot.parts for name in part.robot.links}
    bodies = (
        link for link in robot.links.values() if link.visuals or link.collisions or link.inertial
    )
    outside = {link.name: link.span for link in bodies if link.name not in described}
    tree = next(
        (robot.below(root) for root in robot.roots() if robot.base in robot.below(root)),
        set[str](),
    )
    first, *further = [name for name in outside if name in tree] or [
        ""
    ]  # TF204 reports other trees
    if first:
        more = f" (nor {'are' if further[1:] else 'is'} {len(further)} more)" if further else ""
        notes = [Note(f"{name} is not either", outside[name]) for name in further[:_MOST_LISTED]]
        message = (
            f"no URDF has the body of {first}: {first} is not below the base {robot.base}{more}"
        )
        advice = (
            f"set base to a frame above both {first} and {robot.base}, or make {first} a part with"
            " a namespace"
        )
        yield finding("TF730", message, outside[first], help=advice, notes=notes)
