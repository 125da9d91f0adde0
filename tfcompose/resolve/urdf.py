"""From a URDF that somebody else wrote to a robot, with the places of that file."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, RejectedError, finding
from tfcompose.model import Block, Robot
from tfcompose.resolve.blocks import REFERRING, references
from tfcompose.resolve.urdf_bodies import Bodies
from tfcompose.resolve.urdf_joints import edge_of
from tfcompose.resolve.urdf_values import Values, version_of
from tfcompose.resolve.urdf_words import unknown_words

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.catalogue import Severity
    from tfcompose.load.urdf import Element
    from tfcompose.resolve.urdf_bodies import Finder

#: What links and joints are made of; everything else beside them is kept as it is written.
_READ = frozenset({"link", "joint", "material"})


def robot_of_urdf(root: Element, file: str, finder: Finder) -> tuple[Robot, tuple[Finding, ...]]:
    """Return the robot that the URDF describes, right or wrong, and what was found while reading it.

    Raises:
        RejectedError: if it is no URDF.
    """
    if root.tag != "robot":
        message = f"the document is <{root.tag}>, not <robot>"
        raise RejectedError([finding("TF018", message, root.at, help="a URDF begins with <robot name=…>")])
    values = Values()
    values.has_quaternions = version_of(root, values) >= (1, 1)
    bodies = Bodies(values, finder, root)
    name = values.text(root, "name", '<robot name="rover">')
    links: dict[str, Element] = {}
    for element in root.all("link"):
        _add(links, element, values)
    joints: dict[str, Element] = {}
    for element in root.all("joint"):
        _add(joints, element, values)
    materials: dict[str, Element] = {}
    for element in (one for one in root.all("material") if one.attributes.get("name")):
        _add(materials, element, values, "warning")
    edges = [edge for element in root.all("joint") if (edge := edge_of(element, values))]
    frames = {link: element.place("name") for link, element in links.items()}
    names = {edge.joint_name: None for edge in edges}
    for element in root.children:
        if element.tag in REFERRING:
            wrong = references(element, frames, names)
            values.found += [replace(one, severity="warning") for one in wrong]
    robot = Robot(
        name=name,
        file=file,
        frames=frames,
        edges=tuple(edges),
        links={link: bodies.link(link, element) for link, element in links.items()},
        processes=(),
        base=None,
        blocks=tuple(_blocks(root)),
        foreign=frozenset({file}),
    )
    return robot, (*values.found, *bodies.found, *unknown_words(root))


def _blocks(root: Element) -> Iterator[Block]:
    """Yield what stands beside links and joints, each element by its tag and number."""
    counts: dict[str, int] = {}
    for element in root.children:
        if element.tag not in _READ:
            counts[element.tag] = counts.get(element.tag, 0) + 1
            name = f"{element.tag.replace(':', '_')}_{counts[element.tag]}"
            yield Block(name, element.at, _declared(element, root))


def _declared(element: Element, root: Element) -> str:
    """Return the element as it is written, with the namespaces that it takes from the root."""
    raw = element.raw
    spaces = {name: value for name, value in root.attributes.items() if name.startswith("xmlns:")}
    needed = {name: value for name, value in spaces.items() if re.search(rf"[<\s]{re.escape(name[6:])}:", raw)}
    more = "".join(f' {name}="{_quoted(value)}"' for name, value in needed.items() if name not in element.attributes)
    begin = 1 + len(element.tag)
    return raw[:begin] + more + raw[begin:]


def _add(known: dict[str, Element], element: Element, values: Values, severity: Severity = "error") -> None:
    """Note the element by its name; a second one of that name is a finding."""
    name = values.text(element, "name", f'<{element.tag} name="…">')
    if name in known:
        note = Note("it stands here first", known[name].place("name"))
        message = f"two {element.tag}s have the name {name}"
        advice = "another name for one of them" if severity == "error" else "remove it: readers of ROS refuse the robot"
        values.found.append(
            finding("TF722", message, element.place("name"), notes=[note], help=advice, severity=severity)
        )
    elif name:
        known[name] = element


def _quoted(value: str) -> str:
    return value.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")
