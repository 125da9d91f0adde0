"""Rules about bodies: inertia, materials, and which description holds them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tfcompose.check.rule import rule
from tfcompose.findings import Finding, Note, did_you_mean, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Material, Robot


@rule("TF709", of_urdf=True)
def inertia_missing(robot: Robot) -> Iterator[Finding]:
    """A part that moves has no mass, though others have.

    Simulators drop a link without inertia, with everything on it, or refuse the robot; dynamics treat it as nothing.
    Give the link ``inertial: {mass: 0.5 kg}``: the tensor is computed from its shape. What is fixed together counts as
    one part, and a robot in which no moving part has a mass, but for that of sensors on it, is a robot for TF only, and
    is left alone.
    """
    fixed: dict[str, list[str]] = {}
    for edge in robot.edges:
        if edge.kind == "static":
            fixed.setdefault(edge.parent, []).append(edge.child)
    moving = [edge for edge in robot.edges if (edge.joint or edge.free) and edge.child in robot.links]
    masses = {name for name, link in robot.links.items() if link.inertial}
    own = masses - {frame for sensor in robot.sensors for frame in (sensor.mount, *sensor.frames)}
    other = next((edge.child for edge in moving if _has_one(own, fixed, edge.child)), None)
    for edge in moving if other else ():
        if not _has_one(masses, fixed, edge.child):
            message = f"{edge.child} moves by {edge.joint_name} and has no mass, while {other} has"
            link = robot.links[edge.child]
            yield finding("TF709", message, link.at, help="inertial: {mass: 0.5 kg}")


def _has_one(names: set[str], fixed: dict[str, list[str]], link: str) -> bool:
    """Whether the link, or anything that is fixed to it, is one of these."""
    waiting, seen = [link], set[str]()
    while waiting:
        name = waiting.pop()
        if name in names:
            return True
        if name not in seen:
            seen.add(name)
            waiting += fixed.get(name, ())
    return False


#: What rounding to three digits may be off.
_ROUNDING = 0.01


@rule("TF710", of_urdf=True)
def impossible_inertia(robot: Robot) -> Iterator[Finding]:
    """No body has such an inertia: it is not positive definite, or one moment exceeds the sum of the others.

    Simulators refuse it (MuJoCo, Gazebo), or the joint explodes. Usually a sign was lost, moments were exchanged with
    products, or all are 0. Leave ``inertia`` out, and it is computed from mass and shape; or take the values from CAD,
    about the centre of mass.
    """
    for link in robot.links.values():
        inertial = link.inertial
        if inertial is None or inertial.at is None:
            continue
        low, middle, high = _principal(inertial.tensor)
        why = ""
        if low <= 0:
            why = f"its least principal moment is {low:.3g}"
        elif high > (low + middle) * (1 + _ROUNDING):
            why = f"{high:.3g} is more than {low:.3g} + {middle:.3g}"
        if why:
            message = f"no body has the inertia of {link.name}: {why} kg m²"
            advice = "leave inertia out: it is computed from mass and shape"
            yield finding("TF710", message, inertial.at, help=advice)


def _principal(tensor: tuple[float, float, float, float, float, float]) -> tuple[float, float, float]:
    """Return the eigenvalues of the symmetric tensor xx, xy, xz, yy, yz, zz, least first (Smith, 1961)."""
    scale = max(map(abs, tensor)) or 1.0  # squares of what a foreign file holds may leave the range of floats
    xx, xy, xz, yy, yz, zz = (value / scale for value in tensor)
    mean = (xx + yy + zz) / 3
    spread = math.sqrt(((xx - mean) ** 2 + (yy - mean) ** 2 + (zz - mean) ** 2 + 2 * (xy**2 + xz**2 + yz**2)) / 6)
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
    high, low = mean + 2 * spread * math.cos(angle), mean + 2 * spread * math.cos(angle + math.tau / 3)
    return (low * scale, (3 * mean - high - low) * scale, high * scale)


_TIMES = 10


@rule("TF711", of_urdf=True)
def inertia_off_from_shape(robot: Robot) -> Iterator[Finding]:
    """A link's inertia is ten times, or a tenth of, what its mass and shape give.

    Usually it is in g mm² or kg cm², about another point than the centre of mass, or copied from another link: arms
    swing wildly in simulation or hardly move. Leave ``inertia`` out, and it is computed. Compared are the sums of the
    principal moments, with the visual and the collision shapes at one density; the nearer one counts.
    """
    for link in robot.links.values():
        inertial = link.inertial
        if inertial is None or not inertial.of_shapes:
            continue
        trace = inertial.tensor[0] + inertial.tensor[3] + inertial.tensor[5]
        ratios = [trace / of_shape for of_shape in inertial.of_shapes if of_shape > 0]
        if not ratios or trace <= 0 or any(1 / _TIMES < ratio < _TIMES for ratio in ratios):
            continue
        ratio = min(ratios, key=lambda one: abs(math.log(one)))
        message = f"the inertia of {link.name} is {ratio:.3g} times what its mass and shape give"
        advice = "leave inertia out: it is computed; or give it in kg m², about the centre of mass"
        yield finding("TF711", message, inertial.at or link.at, help=advice)


#: Programs that read the description with KDL.
_KDL_READERS = frozenset({"robot_state_publisher", "moveit_ros_move_group"})


@rule("TF712")
def root_link_with_inertia(robot: Robot) -> Iterator[Finding]:
    """The root link has an inertia, and a program of the plan reads the robot with KDL.

    KDL takes no inertia for a tree's root: it warns at each start, and leaves the mass out of dynamics. Put a bodiless
    root above: ``base: base_footprint`` with ``base_link: {parent: base_footprint}``. Where nothing uses KDL (tfcompose
    itself does not) the inertia of the root is right, and is left alone; ``robot.urdf``, which is for a stock
    robot_state_publisher, is written without it.
    """
    root = robot.links.get(robot.base or "")
    if root is None or root.inertial is None:
        return
    for process in robot.processes:
        if process.package in _KDL_READERS and not process.describes:  # what tfcompose starts gets a root without one
            message = f"the root link {root.name} has an inertia, which {process.package} leaves out"
            notes = [Note(f"{process.name} is started here", process.at)]
            advice = f"a fixed frame above {root.name}, without a body"
            yield finding("TF712", message, root.at, help=advice, notes=notes)
            return


@rule("TF713", of_urdf=True)
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
            if _appearance(other) != _appearance(material):
                message = f"the material {material.name} of {link.name} has another colour than the one before"
                notes = [Note("that one stands here", other.at)]
                advice = "another name, or none; a name alone repeats the other's colour"
                yield finding("TF713", message, material.at, help=advice, notes=notes)


def _appearance(material: Material) -> tuple[object, ...]:
    return (material.rgba, material.texture.uri if material.texture else "")


@rule("TF714")
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


_MOST_LISTED = 5


@rule("TF730")
def body_in_no_urdf(robot: Robot) -> Iterator[Finding]:
    """A link has a body, and is not below the base.

    The URDF holds what hangs below ``base``, so nobody draws this body or collides with it; the frame is published all
    the same. Name a base above it, ``base: map``, or make what stands beside the robot a robot of its own: a part with
    a ``namespace`` has its own description. All such links are one finding.
    """
    if robot.base is None:
        return
    drawn = robot.below(robot.base) | {frame for sensor in robot.sensors for frame in sensor.frames}
    drawn |= {f"{part.prefix}{name}" for part in robot.parts for name in part.robot.links}
    bodies = (link for link in robot.links.values() if link.visuals or link.collisions or link.inertial)
    outside = {link.name: link.at for link in bodies if link.name not in drawn}
    tree = next((robot.below(root) for root in robot.roots() if robot.base in robot.below(root)), set[str]())
    first, *others = [name for name in outside if name in tree] or [""]  # other trees are another rule's
    if first:
        more = f", and so {'are' if others[1:] else 'is'} {len(others)} more" if others else ""
        notes = [Note(f"{name} is another", outside[name]) for name in others[:_MOST_LISTED]]
        message = f"the body of {first} is in no URDF: it is not below the base {robot.base}{more}"
        advice = f"base: a frame above {first} and {robot.base}; or a part with a namespace"
        yield finding("TF730", message, outside[first], help=advice, notes=notes)
