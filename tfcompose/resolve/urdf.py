"""From a URDF that somebody else wrote to a robot, with the places of that file."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.diagnostic import Diagnostic, Note, RejectedError, Severity, Span, did_you_mean, finding
from tfcompose.model import JOINTS, STATIC, Edge, Joint, Limit, Robot
from tfcompose.pose import Pose, norm, normalised, quat_from_rpy
from tfcompose.resolve.urdf_bodies import Bodies
from tfcompose.resolve.urdf_words import unknown_words

if TYPE_CHECKING:
    from tfcompose.load.urdf import Element
    from tfcompose.pose import Vector
    from tfcompose.resolve.urdf_bodies import Finder

MOVING = ("revolute", "continuous", "prismatic")
TYPES = (*MOVING, "fixed", "floating", "planar")


@dataclass(slots=True)
class Values:
    """Reads attributes; ``found`` is what was wrong with them."""

    found: list[Diagnostic] = field(default_factory=list)

    def refuse(self, message: str, at: Span, advice: str = "", severity: Severity = "error") -> None:
        """Note that a value is wrong."""
        self.found.append(finding("TF721", message, at, help=advice, severity=severity))

    def text(self, element: Element, name: str, sample: str) -> str:
        """Return an attribute that must be there, or an empty text."""
        value = element.attributes.get(name, "")
        if not value:
            self.refuse(f"<{element.tag}> has no {name}", element.at, f"for example {sample}")
        return value

    def numbers(self, element: Element | None, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return an attribute's numbers, as many as ``default`` has; that is taken where there are none."""
        if element is None or name not in element.attributes:
            return default
        words = element.attributes[name].split()
        try:
            values = tuple(map(float, words))
        except ValueError:
            values = ()
        if len(values) != len(default) or not all(map(math.isfinite, values)):
            count = "a number" if len(default) == 1 else f"{len(default)} numbers"
            self.refuse(f"{name}={element.attributes[name]!r} is not {count}", element.place(name))
            return default
        return values

    def number(self, element: Element | None, name: str, default: Any = None) -> Any:
        """Return an attribute's number; ``default`` is taken where there is none."""
        if element is None or name not in element.attributes:
            return default
        return self.numbers(element, name, (0.0,))[0]

    def pose(self, parent: Element) -> Pose:
        """Return what the element's origin says."""
        origin = parent.first("origin")
        x, y, z = self.numbers(origin, "xyz", (0.0, 0.0, 0.0))
        roll, pitch, yaw = self.numbers(origin, "rpy", (0.0, 0.0, 0.0))
        if max(map(abs, (roll, pitch, yaw))) > 1e9:  # noqa: PLR2004 (no angle has so many turns, and none is left of it)
            self.refuse("this rpy is no angle", origin.place("rpy") if origin else parent.at)
            return Pose((x, y, z))
        return Pose((x, y, z), normalised(quat_from_rpy(roll, pitch, yaw)))


def robot_of_urdf(root: Element, file: str, finder: Finder) -> tuple[Robot, tuple[Diagnostic, ...]]:
    """Return the robot that the URDF describes, right or wrong, and what was found while reading it.

    Raises:
        RejectedError: if it is no URDF.
    """
    if root.tag != "robot":
        message = f"the document is <{root.tag}>, not <robot>"
        raise RejectedError([finding("TF018", message, root.at, help="a URDF begins with <robot name=…>")])
    values = Values()
    bodies = Bodies(values, finder)
    name = values.text(root, "name", '<robot name="rover">')
    links: dict[str, Element] = {}
    for element in root.all("link"):
        _add(links, element, values)
    joints: dict[str, Element] = {}
    for element in root.all("joint"):
        _add(joints, element, values)
    edges = [edge for element in root.all("joint") if (edge := _edge(element, values))]
    frames = {link: element.place("name") for link, element in links.items()}
    robot = Robot(
        name=name,
        file=file,
        frames=frames,
        edges=tuple(edges),
        links={link: bodies.link(link, element) for link, element in links.items()},
        processes=(),
        base=None,
    )
    return robot, (*values.found, *bodies.found, *unknown_words(root))


def _add(known: dict[str, Element], element: Element, values: Values) -> None:
    """Note the element by its name; a second one of that name is a finding."""
    name = values.text(element, "name", f'<{element.tag} name="…">')
    if name in known:
        note = Note("it stands here first", known[name].place("name"))
        message = f"two {element.tag}s have the name {name}"
        advice = "another name for one of them"
        values.found.append(finding("TF722", message, element.place("name"), notes=[note], help=advice))
    elif name:
        known[name] = element


def _edge(element: Element, values: Values) -> Edge | None:
    name, kind = element.attributes.get("name", ""), values.text(element, "type", 'type="fixed"')
    if kind and kind not in TYPES:
        advice = did_you_mean(kind, TYPES, f"one of: {', '.join(TYPES)}")
        values.refuse(f"there is no joint type {kind}", element.place("type"), advice)
    ends = {}
    for tag in ("parent", "child"):
        end = element.first(tag)
        if end is None:
            values.refuse(f"the joint {name} has no {tag}", element.at, f'<{tag} link="…"/>')
        elif values.text(end, "link", f'<{tag} link="…"/>'):
            ends[tag] = end
    moving = _moving(name, kind, element, values) if kind in MOVING else None
    if len(ends) < 2:  # noqa: PLR2004 (parent and child)
        return None
    return Edge(
        parent=ends["parent"].attributes["link"],
        child=ends["child"].attributes["link"],
        kind="joint" if moving else "dynamic" if kind in {"floating", "planar"} else "static",
        pose=values.pose(element),
        owner=JOINTS if moving else STATIC,
        at=ends["parent"].place("link"),
        joint=moving,
        joint_name=name,
        child_at=ends["child"].place("link"),
    )


def _moving(name: str, kind: Any, element: Element, values: Values) -> Joint:
    written = element.first("axis")
    x, y, z = values.numbers(written, "xyz", (1.0, 0.0, 0.0))
    length = norm((x, y, z))
    if not 0 < length < math.inf:
        values.refuse(f"the axis of {name} has no direction", (written or element).place("xyz"), '<axis xyz="0 0 1"/>')
        x, y, z, length = 1.0, 0.0, 0.0, 1.0
    axis: Vector = (x / length, y / length, z / length)
    said = element.first("limit")
    limit = None
    if said is not None:
        limit = Limit(*(values.number(said, key) for key in ("lower", "upper", "effort", "velocity")))
        for key in ("effort", "velocity"):
            if key not in said.attributes:
                values.refuse(f"the limit of {name} has no {key}", said.at, f'URDF requires it: {key}="1"')
    mimic = element.first("mimic")
    master = values.text(mimic, "joint", '<mimic joint="…"/>') if mimic is not None else None
    multiplier, offset = values.number(mimic, "multiplier", 1.0), values.number(mimic, "offset", 0.0)
    at = element.place("name")
    return Joint(name, kind, at, axis, limit, master or None, multiplier, offset, length)
