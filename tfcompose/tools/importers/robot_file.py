"""Writer of the robot file for an imported URDF.

Sections and keys have the order of the reference. A comment at an entry lists the parts of the
source that the entry does not contain.
"""

from __future__ import annotations

import posixpath
import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.urdf.blocks import with_hardware
from tfcompose.foundation.yaml_text import comment, dedent_block, entry, section
from tfcompose.tools.importers.draft import robot_name
from tfcompose.tools.importers.sensors import recognise
from tfcompose.tools.importers.unsupported import (
    angles,
    omitted_notes,
    with_material_names,
    without_unused_blocks,
)
from tfcompose.tools.importers.values import RobotFileValues, rotation
from tfcompose.tools.importers.yaml_text import without_expressions

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from tfcompose.compiler.compile import Compiled
    from tfcompose.compiler.resolve import Library
    from tfcompose.compiler.urdf.lint import Document
    from tfcompose.foundation.findings import Finding
    from tfcompose.foundation.geometry import Quaternion, Vector
    from tfcompose.model.files import Target
    from tfcompose.model.robot import Edge, Robot
    from tfcompose.model.robot.hardware import Hardware, Interface
    from tfcompose.tools.importers.draft import ImportDraft
    from tfcompose.tools.importers.sensors import Recognised
    from tfcompose.tools.importers.unsupported import Entry


#: Name of the process that owns planar and floating joints, because a URDF does not name their
#: publisher.
MOVER = "mover"


@dataclass(frozen=True, slots=True)
class Imported:
    """A robot to be written as a robot file."""

    robot: Robot
    #: The robot's name in the file.
    name: str
    #: Path of the file to write.
    target: Target
    sensors: tuple[Recognised, ...] = ()
    #: Comments by entry about omitted parts of the source, with the reasons.
    notes: Mapping[Entry, Iterable[str]] = field(default_factory=dict)
    #: The roll, pitch and yaw in the source (rad), by rotation.
    rpy: Mapping[Quaternion, Vector] = field(default_factory=dict)
    #: Folders of packages, relative to the robot file.
    packages: Mapping[str, str] = field(default_factory=dict)
    #: Severities of findings that the source justifies, by code.
    rules: Mapping[str, str] = field(default_factory=dict)


def robot_file(imported: Imported, head: Iterable[str]) -> str:
    """Return the robot file of an imported robot; ``head`` are comments at its beginning."""
    return "\n".join([*_Writer(imported).lines(head), ""])


def put_into(draft: ImportDraft, imported: Imported) -> None:
    """Put an imported description into the draft of a larger robot."""
    writer = _Writer(imported)
    for title, entries in writer.sections().items():
        draft.sections[title].update(entries)
    for path, notes in writer.notes.items():
        draft.note(path, *notes)
    draft.brought |= writer.brought
    draft.base = draft.base or writer.base()


class _Writer:
    """Makes the sections of a robot file from a robot.

    Entries of a section have the order of the source.
    """

    def __init__(self, imported: Imported) -> None:
        self.imported, self.robot = imported, imported.robot
        self.values = RobotFileValues(imported.rpy, imported.robot, imported.target)
        self.notes: dict[Entry, list[str]] = {
            path: list(notes) for path, notes in imported.notes.items()
        }
        self.brought = {edge.child for sensor in imported.sensors for edge in sensor.edges}
        self.fixed = self._fixed_edges()

    def sections(self) -> dict[str, dict[str, Any]]:
        """Return the sections in the order of the reference.

        After this call, ``notes`` are complete.
        """
        imported, robot, links, joints = self.imported, self.robot, self._links(), self._joints()
        return {
            "packages": dict(imported.packages),
            "links": links,
            "joints": joints,
            "ros2_control": {system.name: _hardware(system) for system in robot.hardware},
            "xml": {block.name: dedent_block(block.text) for block in robot.blocks},
            "frames": {
                child: self._mount(edge)
                for child, edge in self.fixed.items()
                if not self._has_body(child)
            },
            "sensors": {sensor.name: self._sensor(sensor) for sensor in imported.sensors},
            "processes": self._processes(),
            "rules": dict(imported.rules),
        }

    def lines(self, head: Iterable[str]) -> list[str]:
        imported, sections = self.imported, self.sections()
        lines = [
            *comment(head),
            *entry("tfcompose", 1),
            *comment(self._of("", "")),
            *entry("robot", imported.name),
        ]
        base = self.base()
        lines += entry("base", base) if base else []
        sections, variables = without_expressions(sections)
        lines += variables
        lines += comment(self._homeless(sections))
        for title, entries in sections.items():
            lines += section(title, entries, {key: self._of(title, key) for key in entries})
        return lines

    def _of(self, title: str, name: str) -> list[str]:
        return self.notes.get((title, name), [])

    def _homeless(self, sections: dict[str, dict[str, Any]]) -> list[str]:
        """Return the notes that belong to no entry.

        The notes of a frame with a body are at its link.
        """
        unplaced = []
        for (title, name), notes in list(self.notes.items()):
            if title == "frames" and name not in sections["frames"] and name in sections["links"]:
                self.notes["links", name] = self._of("links", name) + notes
            elif title and name not in sections[title]:
                unplaced += [f"{name}: {note}" for note in notes]
        return unplaced

    def _note(self, title: str, name: str, *notes: str) -> None:
        if notes:
            self.notes.setdefault((title, name), []).extend(notes)

    def _fixed_edges(self) -> dict[str, Edge]:
        """Return the fixed edges that do not belong to a sensor, by child.

        If several edges lead to a child, return the first.
        """
        fixed: dict[str, Edge] = {}
        for edge in self.robot.edges:
            moves = edge.joint or edge.free
            if not moves and edge.child not in self.brought and edge.child in self.robot.links:
                fixed.setdefault(edge.child, edge)
        return fixed

    def _has_body(self, name: str) -> bool:
        link = self.robot.links[name]
        return bool(link.visuals or link.collisions or link.inertial)

    def base(self) -> str | None:
        """Return the base frame, if it is not the default of a robot file."""
        roots = self.robot.roots()
        root = roots[0] if len(roots) == 1 else None
        above = self.robot.parent_edge("base_link") if "base_link" in self.robot.frames else None
        if root is None or above is None:
            return None
        usual = (
            "base_footprint"
            if above.kind == "static" and above.parent == "base_footprint"
            else "base_link"
        )
        return None if root == usual else root

    def _links(self) -> dict[str, Any]:
        bodies_of_presets = {sensor.body for sensor in self.imported.sensors}
        entries = {}
        for name, link in self.robot.links.items():
            edge, has_body = self.fixed.get(name), self._has_body(name)
            is_frame = edge is not None and not has_body
            if is_frame or (
                name in self.brought and name not in bodies_of_presets and not has_body
            ):
                self._note(
                    "frames" if is_frame else "links", name, *self.notes.pop(("links", name), ())
                )
                continue
            entries[name] = (self._mount(edge, "links") if edge else {}) | self.values.link(link)
        return entries

    def _joints(self) -> dict[str, Any]:
        joints = {}
        for edge in self.robot.edges:
            if self.fixed.get(edge.child) is not edge and edge.child not in self.brought:
                mover = MOVER if edge.free else None
                joints[edge.joint_name] = self.values.joint(edge, mover)
        return joints

    def _mount(self, edge: Edge, title: str = "frames") -> dict[str, Any]:
        """Return the keys of a fixed edge for the entry of its child."""
        self._note(title, edge.child, *self.notes.pop(("joints", edge.joint_name), ()))
        return {"parent": edge.parent, **self.values.pose(edge.pose), **_joint_name(edge)}

    def _sensor(self, sensor: Recognised) -> dict[str, Any]:
        for edge in sensor.edges:
            self._note("sensors", sensor.name, *self.notes.pop(("joints", edge.joint_name), ()))
            if not self._has_body(edge.child):
                self._note("sensors", sensor.name, *self.notes.pop(("links", edge.child), ()))
        return sensor_keys(sensor, self.values.pose(sensor.mount.pose), self.imported.rpy)

    def _processes(self) -> dict[str, Any]:
        free = [edge.joint_name for edge in self.robot.edges if edge.free]
        if not free:
            return {}
        names = ", ".join(free)
        self._note(
            "processes",
            MOVER,
            f"the source does not say which process publishes {names}: name it here",
        )
        return {MOVER: {"external": True}}


def sensor_keys(
    sensor: Recognised, pose: Mapping[str, Any], rpy: Mapping[Quaternion, Vector], driver: str = ""
) -> dict[str, Any]:
    """Return the keys of a sensor.

    ``pose`` contains the keys of the mount's pose. ``rpy`` contains the source's angles, by
    rotation. ``driver`` is the process that publishes the frames inside the sensor; empty if
    tfcompose publishes them.
    """
    frames: dict[str, Any] = {}
    mount = sensor.mount.child
    if mount in sensor.names:
        frames[sensor.names[mount]] = {"name": mount}
    for edge in sensor.inside:
        values: dict[str, Any] = {"name": edge.child} if edge.child in sensor.names else {}
        if edge.child in sensor.own_xyz:
            values["xyz"] = list(edge.pose.xyz)
        if edge.child in sensor.own_rotation:
            quat_xyzw = edge.pose.quat_xyzw
            values["rpy"] = rotation(quat_xyzw, rpy.get(quat_xyzw)) or [0, 0, 0]
        values |= _joint_name(edge)
        if values:
            frames[sensor.names.get(edge.child, edge.child)] = values
    keys: dict[str, Any] = {"preset": sensor.preset, "parent": sensor.mount.parent}
    keys |= {**pose, **_joint_name(sensor.mount)}
    if sensor.options:
        keys["options"] = sensor.options
    if driver:
        keys |= {"tf": "driver", "driver": driver}
    elif sensor.driven:
        keys["driver"] = "none"
    if frames:
        keys["frames"] = frames
    return keys


def _joint_name(edge: Edge) -> dict[str, str]:
    """Return the joint name of a fixed edge, if ``build`` would write another name."""
    return (
        {"joint": edge.joint_name}
        if edge.joint_name not in {"", f"{edge.parent}_to_{edge.child}"}
        else {}
    )


def _hardware(hardware: Hardware) -> dict[str, Any]:
    keys: dict[str, Any] = {"plugin": hardware.plugin}
    keys |= {"type": hardware.type} if hardware.type != "system" else {}
    keys |= {"params": _params(hardware.params)} if hardware.params else {}
    keys |= {"rw_rate": hardware.rw_rate} if hardware.rw_rate is not None else {}
    keys |= {"is_async": hardware.is_async} if hardware.is_async is not None else {}
    for kind in ("joint", "sensor", "gpio"):
        components = {}
        for component in hardware.components:
            if component.kind == kind:
                values = {
                    "command": _interfaces(component.command),
                    "state": _interfaces(component.state),
                }
                values["params"] = _params(component.params)
                components[component.name] = {key: value for key, value in values.items() if value}
        keys |= {f"{kind}s": components} if components else {}
    return keys


def _interfaces(interfaces: tuple[Interface, ...]) -> Any:
    if any(interface.params for interface in interfaces):
        return {interface.name: _params(interface.params) for interface in interfaces}
    return [interface.name for interface in interfaces]


def _params(params: dict[str, str]) -> dict[str, Any]:
    return {name: _value(text) for name, text in params.items()}


def _value(text: str) -> Any:
    """Return the number or bool that a text represents, if it is written as the same text."""
    if text in {"true", "false"}:
        return text == "true"
    if re.fullmatch(r"-?(0|[1-9][0-9]{0,14})(\.[0-9]*[1-9])?", text) and text != "-0":
        value = float(text)
        return value if (str(int(value)) if value.is_integer() else repr(value)) == text else text
    return text


def import_document(
    document: Document,
    target: Target,
    name: str,
    packages: Mapping[str, str],
    library: Library | None,
) -> Imported:
    """Return the robot file's contents for the document, for a file at the target.

    If ``name`` is empty, the robot keeps the source's name. ``packages`` are the folders of
    packages that are not installed. If there is a ``library``, its presets replace frames by
    sensors.
    """
    robot, unused = without_unused_blocks(with_hardware(document.robot))
    robot, renamed = with_material_names(robot)
    sensors, undecided = recognise(robot, library) if library else ([], {})
    notes = omitted_notes(document)
    for mount, note in undecided.items():
        notes.setdefault(("frames", mount), []).append(note)
    name = name or robot_name(robot.name)
    other_name = [f"called {robot.name} in the source"] if name != robot.name else []
    notes.setdefault(("", ""), []).extend([*renamed, *unused, *other_name])
    folders = {package: target.from_folder(folder) for package, folder in packages.items()}
    return Imported(
        robot,
        name,
        target,
        sensors=tuple(sensors),
        notes=notes,
        rpy=angles(document.root),
        packages=folders,
    )


def with_findings(
    robot: Imported, source: str, lint: Callable[[str], Compiled]
) -> tuple[str, list[Finding]]:
    """Return the robot file with lint's findings as comments, and the remaining errors.

    ``source`` is the imported file. Names from the source are not errors.
    """
    head = [f"imported from {posixpath.basename(source)} by tfcompose"]
    compiled = lint(robot_file(robot, head))
    errors = [finding for finding in compiled.errors if finding.code != "TF501"]
    if errors != list(compiled.errors):
        notes = {**robot.notes, ("rules", "TF501"): ("the names are those of the source",)}
        robot = replace(robot, rules={"TF501": "warning"}, notes=notes)
    return robot_file(robot, [*head, *_faults(compiled)]), errors


def _faults(compiled: Compiled) -> Iterable[str]:
    """Yield lint's findings about the robot file, each code once: faults of the source."""
    by_code: dict[str, list[Finding]] = {}
    for finding in compiled.findings:
        by_code.setdefault(finding.code, []).append(finding)
    if by_code:
        yield "findings of lint, which the source has too:"
    for code, findings in by_code.items():
        more = f" (and {len(findings) - 1} more)" if findings[1:] else ""
        yield f"{code}: {findings[0].message}{more}"
