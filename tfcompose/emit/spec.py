"""The robot file that says what an imported robot is.

Its sections and keys stand in the order of the language; what could not be taken is said in comments, at its place.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from tfcompose.emit.angles import turn
from tfcompose.emit.flow import comment, entry, leaned, section
from tfcompose.emit.said import Said

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tfcompose.files import Target
    from tfcompose.imported import Entry, Imported, Recognised
    from tfcompose.model import Edge, Hardware, Interface

#: Who publishes planar and floating joints: a URDF does not say it.
MOVER = "mover"
_NO_NAME = re.compile(r"[^a-z0-9_]+")


def spec(given: Imported, name: str, target: Target, head: Iterable[str] = ()) -> str:
    """Return the robot file of an imported robot under this name; ``head`` are comments above everything.

    ``target`` says where it will stand: relative paths in it begin there.
    """
    return "\n".join([*_Writer(given, target).lines(name, head), ""])


def robot_name(said: str) -> str:
    """Return the name as the language has it: lower case letters, digits and _, a letter first."""
    name = _NO_NAME.sub("_", said.lower()).strip("_")
    return name if name[:1].isalpha() else f"robot_{name}".rstrip("_")


class _Writer:
    """Writes one robot; each section is a mapping, in the order of the source."""

    def __init__(self, given: Imported, target: Target) -> None:
        self.given, self.robot = given, given.robot
        self.said = Said(given.rpy, given.robot, target)
        self.notes: dict[Entry, list[str]] = {at: list(notes) for at, notes in given.notes.items()}
        self.brought = {edge.child for sensor in given.sensors for edge in (sensor.mount, *sensor.inside)}
        self.named = {word for block in self.robot.blocks for word in re.findall(r"[^\s<>\"'=]+", block.text)}
        self.bare = [edge for edge in self.robot.edges if self._is_bare(edge)]

    def lines(self, name: str, head: Iterable[str]) -> list[str]:
        robot, links, joints = self.robot, self._links(), self._joints()
        lines = [*comment(head), *entry("tfcompose", 1), *comment(self._of("", "")), *entry("robot", name)]
        base = self._base()
        lines += entry("base", base) if base else []
        sections: dict[str, dict[str, Any]] = {
            "packages": dict(self.given.packages),
            "links": links,
            "joints": joints,
            "ros2_control": {one.name: _hardware(one) for one in robot.hardware},
            "xml": {block.name: leaned(block.text) for block in robot.blocks},
            "frames": {edge.child: self._frame(edge) for edge in self.bare},
            "sensors": {sensor.name: self._sensor(sensor) for sensor in self.given.sensors},
            "processes": self._processes(),
            "rules": dict(self.given.rules),
        }
        if any("${" in value for value in _texts(sections)):
            lines += entry("vars", {"dollar": "$"})
            sections = _without_holes(sections)
        lines += comment(self._homeless(sections))
        for title, entries in sections.items():
            notes = {key: self._of(title, key) for key in entries}
            lines += section(title, entries, notes)
        return lines

    def _of(self, title: str, name: str) -> list[str]:
        return self.notes.get((title, name), [])

    def _homeless(self, sections: dict[str, dict[str, Any]]) -> list[str]:
        """Return the notes of what has no entry of its own; a frame with a body has its notes there."""
        homeless = []
        for (title, name), several in list(self.notes.items()):
            if title == "frames" and name not in sections["frames"] and name in sections["links"]:
                self.notes["links", name] = self._of("links", name) + several
            elif title and name not in sections[title]:
                homeless += [f"{name}: {said}" for said in several]
        return homeless

    def _note(self, title: str, name: str, said: str) -> None:
        self.notes.setdefault((title, name), []).append(said)

    def _is_bare(self, edge: Edge) -> bool:
        """Whether the edge can be a frame's: it does not move, has no body, and nothing names its joint."""
        link = self.robot.links.get(edge.child)
        body = link and (link.visuals or link.collisions or link.inertial)
        free = edge.joint or edge.free or edge.child in self.brought
        return not (body or free or link is None or edge.joint_name in self.named)

    def _base(self) -> str | None:
        """Return where the URDF begins, if that has to be said."""
        roots = self.robot.roots()
        root = roots[0] if len(roots) == 1 else None
        above = self.robot.parent_edge("base_link") if "base_link" in self.robot.frames else None
        if root is None or above is None:
            return None
        usual = "base_footprint" if above.kind == "static" and above.parent == "base_footprint" else "base_link"
        return None if root == usual else root

    def _links(self) -> dict[str, Any]:
        frames = {edge.child for edge in self.bare}
        hidden = {sensor.body for sensor in self.given.sensors}
        entries = {}
        for name, link in self.robot.links.items():
            body = self.said.link(link)
            if name in frames or (name in self.brought and name not in hidden and not body):
                for said in self.notes.pop(("links", name), ()):
                    self._note("frames" if name in frames else "links", name, said)
                continue
            entries[name] = body
        return entries

    def _joints(self) -> dict[str, Any]:
        entries = {}
        for edge in self.robot.edges:
            if self._is_bare(edge) or edge.child in self.brought:
                continue
            entries[edge.joint_name] = self.said.joint(edge, MOVER if edge.free else None)
        return entries

    def _frame(self, edge: Edge) -> dict[str, Any]:
        for said in self.notes.pop(("joints", edge.joint_name), ()):
            self._note("frames", edge.child, said)
        self._lost_name([edge], "frames", edge.child)
        return {"parent": edge.parent, **self.said.pose(edge.pose)}

    def _lost_name(self, edges: Iterable[Edge], title: str, name: str) -> None:
        lost = [edge.joint_name for edge in edges if edge.joint_name not in {"", f"{edge.parent}_to_{edge.child}"}]
        if lost:
            several = f"joints {', '.join(lost)}" if len(lost) > 1 else f"joint {lost[0]}"
            self._note(title, name, several)

    def _sensor(self, sensor: Recognised) -> dict[str, Any]:
        own: dict[str, Any] = {}
        for edge in sensor.inside:
            values: dict[str, Any] = {}
            if edge.child in sensor.own_xyz:
                values["xyz"] = list(edge.pose.xyz)
            if edge.child in sensor.own_turn:
                values["rpy"] = turn(edge.pose.quat_xyzw, self.given.rpy.get(edge.pose.quat_xyzw)) or [0, 0, 0]
            if values:
                own[edge.child] = values
        for edge in (sensor.mount, *sensor.inside):
            for at in (("joints", edge.joint_name), ("links", edge.child)):
                if at[0] == "joints" or not self.said.link(self.robot.links[edge.child]):
                    for said in self.notes.pop(at, ()):
                        self._note("sensors", sensor.name, said)
        self._lost_name((sensor.mount, *sensor.inside), "sensors", sensor.name)
        said_of: dict[str, Any] = {"preset": sensor.preset, "parent": sensor.mount.parent}
        said_of |= self.said.pose(sensor.mount.pose)
        said_of |= {"options": sensor.options} if sensor.options else {}
        return said_of | ({"driver": "none"} if sensor.driven else {}) | ({"frames": own} if own else {})

    def _processes(self) -> dict[str, Any]:
        free = [edge.joint_name for edge in self.robot.edges if edge.free]
        if not free:
            return {}
        several = ", ".join(free)
        self._note("processes", MOVER, f"the source does not say who publishes {several}: name that process here")
        return {MOVER: {"external": True}}


def _texts(value: Any) -> list[str]:
    """Return the texts in which expressions are looked for: in a key none is."""
    if isinstance(value, dict):
        return [one for item in value.values() for one in _texts(item)]
    if isinstance(value, (list, tuple)):
        return [one for item in value for one in _texts(item)]
    return [value] if isinstance(value, str) else []


def _without_holes(value: Any) -> Any:
    """Return the data in which no text is taken for an expression."""
    if isinstance(value, dict):
        return {key: _without_holes(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_without_holes(item) for item in value]
    return type(value)(value.replace("${", "${dollar}{")) if isinstance(value, str) else value


def _hardware(hardware: Hardware) -> dict[str, Any]:
    said: dict[str, Any] = {"plugin": hardware.plugin}
    said |= {"type": hardware.type} if hardware.type != "system" else {}
    said |= {"params": _params(hardware.params)} if hardware.params else {}
    said |= {"rw_rate": hardware.rw_rate} if hardware.rw_rate is not None else {}
    said |= {"is_async": hardware.is_async} if hardware.is_async is not None else {}
    for kind in ("joint", "sensor", "gpio"):
        inside = {}
        for one in hardware.components:
            if one.kind == kind:
                values = {"command": _interfaces(one.command), "state": _interfaces(one.state)}
                values["params"] = _params(one.params)
                inside[one.name] = {key: value for key, value in values.items() if value}
        said |= {f"{kind}s": inside} if inside else {}
    return said


def _interfaces(several: tuple[Interface, ...]) -> Any:
    if any(one.params for one in several):
        return {one.name: _params(one.params) for one in several}
    return [one.name for one in several]


def _params(params: dict[str, str]) -> dict[str, Any]:
    return {name: _value(text) for name, text in params.items()}


def _value(text: str) -> Any:
    """Return the text as a number or a truth where that comes out as the same text again."""
    if text in {"true", "false"}:
        return text == "true"
    if re.fullmatch(r"-?(0|[1-9][0-9]{0,14})(\.[0-9]*[1-9])?", text) and text != "-0":
        value = float(text)
        return value if (str(int(value)) if value.is_integer() else repr(value)) == text else text
    return text
