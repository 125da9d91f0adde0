"""From a URDF that was read to a robot file: sensors are looked for, and what has no place is noted."""

from __future__ import annotations

import posixpath
import re
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.importing.omitted import angles, omitted, with_material_names, without_unused_blocks
from tfcompose.importing.robot_file import Imported, robot_file
from tfcompose.importing.sensors import recognised
from tfcompose.urdf.ros2_control import with_hardware

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from tfcompose.compile import Compiled
    from tfcompose.files import Target
    from tfcompose.findings import Finding
    from tfcompose.resolve import Library
    from tfcompose.urdf.lint import Document

_NO_NAME = re.compile(r"[^a-z0-9_]+")


def imported(
    document: Document, target: Target, name: str, packages: Mapping[str, str], library: Library | None
) -> Imported:
    """Return what a robot file at the target holds of the document.

    An empty ``name`` is the source's; ``packages`` are the folders of packages that are not installed. Sensors are
    looked for in the ``library``, if there is one.
    """
    robot, unused = without_unused_blocks(with_hardware(document.robot))
    robot, renamed = with_material_names(robot)
    reserved = frozenset(word for block in robot.blocks for word in re.findall(r"[^\s<>\"'=]+", block.text))
    sensors, undecided = recognised(robot, library, reserved) if library else ([], {})
    notes = omitted(document)
    for mount, note in undecided.items():
        notes.setdefault(("frames", mount), []).append(note)
    name = name or _robot_name(robot.name)
    other_name = [f"called {robot.name} in the source"] if name != robot.name else []
    notes.setdefault(("", ""), []).extend([*renamed, *unused, *other_name])
    folders = {package: target.from_folder(folder) for package, folder in packages.items()}
    return Imported(robot, name, target, reserved, tuple(sensors), notes, angles(document.root), folders)


def _robot_name(name: str) -> str:
    """Return the name as the language has it: lower case letters, digits and _, a letter first."""
    name = _NO_NAME.sub("_", name.lower()).strip("_")
    return name if name[:1].isalpha() else f"robot_{name}".rstrip("_")


def with_findings(robot: Imported, source: str, lint: Callable[[str], Compiled]) -> tuple[str, list[Finding]]:
    """Return the robot file with what ``lint`` finds in it as comments, and the errors that only a robot file has.

    ``source`` is the file that the robot was imported from. Names that the source has are no errors.
    """
    head = [f"imported from {posixpath.basename(source)} by tfcompose"]
    compiled = lint(robot_file(robot, head))
    errors = [one for one in compiled.errors if one.code != "TF501"]
    if errors != list(compiled.errors):
        notes = {**robot.notes, ("rules", "TF501"): ("the names are those of the source",)}
        robot = replace(robot, rules={"TF501": "warning"}, notes=notes)
    return robot_file(robot, [*head, *_faults(compiled)]), errors


def _faults(compiled: Compiled) -> Iterable[str]:
    """Yield what lint finds in the result, each rule once: these are faults of the source."""
    several: dict[str, list[Finding]] = {}
    for one in compiled.found:
        several.setdefault(one.code, []).append(one)
    if several:
        yield "findings of lint, which the source has too:"
    for code, found in several.items():
        more = f" (and {len(found) - 1} more)" if found[1:] else ""
        yield f"{code}: {found[0].message}{more}"
