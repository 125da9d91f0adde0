"""Draft of a robot file: sections with entries, comments, and findings about omissions.

The readers of launch files, scripts and running robots add entries to the draft, in the order of
the source. The draft then writes the text of the robot file.
"""

from __future__ import annotations

import itertools
import posixpath
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.findings import Finding, Span, finding
from tfcompose.foundation.geometry import norm, normalise
from tfcompose.foundation.reach import Reach
from tfcompose.foundation.yaml_text import comment, entry, flow, section
from tfcompose.model.robot import BUILT_IN
from tfcompose.tools.importers.values import angle, rotation
from tfcompose.tools.importers.yaml_text import without_expressions

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.compiler.compile import Compiled
    from tfcompose.foundation.geometry import Pose, Vector
    from tfcompose.model.files import Target

#: A section and the name of an entry in it; both are empty for the file itself.
Entry = tuple[str, str]

#: The sections of a robot file, in the order in which it lists them.
SECTIONS = (
    "args",
    "ros",
    "packages",
    "links",
    "joints",
    "ros2_control",
    "xml",
    "frames",
    "sensors",
    "parts",
    "containers",
    "processes",
    "rules",
)
#: If a quaternion's length differs from 1 by at most this, the robot file contains the source's
#: numbers.
_UNIT = 1e-7
#: Errors that a draft takes over from its source. ``text_with_findings`` makes each a warning,
#: with this reason as a comment.
_OF_SOURCE = {
    "TF335": "the clocks are those of the source, whose nodes do not agree",
    "TF501": "the names are those of the source",
}
_NO_NAME = re.compile(r"[^A-Za-z0-9_]+")


@dataclass(slots=True)
class ImportDraft:
    """A robot file that readers fill and that then writes its text."""

    robot: str
    #: Comments at the top of the file.
    head: list[str] = field(default_factory=list)
    #: The robot's base frame, if it is not the default.
    base: str | None = None
    #: The entries by section and name, as plain data.
    sections: dict[str, dict[str, Any]] = field(
        default_factory=lambda: {name: {} for name in SECTIONS}
    )
    #: Comments above entries.
    notes: dict[Entry, list[str]] = field(default_factory=dict)
    #: Omitted parts of the source. Each finding is also a comment.
    findings: list[Finding] = field(default_factory=list)
    #: Frames that sensors bring. They need no entry under ``frames``.
    brought: set[str] = field(default_factory=set)
    #: Whether parts add frames whose names are unknown here.
    has_unknown_frames: bool = False
    #: The files that the import may read. The default is all files.
    reach: Reach = field(default_factory=lambda: Reach(everything=True))
    #: Texts of files that the source would write when it starts, by placeholder path. This
    #: is the path of the file, or that of its source file with ``#`` and a number.
    made: dict[str, str] = field(default_factory=dict)
    #: Texts of the files that the import writes next to the robot file, by their paths from the
    #: robot file's folder.
    neighbours: dict[str, str] = field(default_factory=dict)
    #: The placeholder paths of the files that ``bring`` copied from ``made`` to ``neighbours``.
    used: set[str] = field(default_factory=set)
    #: Each process with its use_sim_time (None if the source does not set it) and its location.
    clocks: list[tuple[str, Any, Span | None]] = field(default_factory=list)
    #: Whether the robot keeps its launch files, so that each process is external.
    is_adopted: bool = False
    #: Locations in the launch file at which publishers start, by the child frame of their fixed
    #: edge or by the name of their part.
    publishers: dict[str, Span | None] = field(default_factory=dict)

    def note(self, path: Entry, *texts: str) -> None:
        """Add comments above an entry, without repeating a comment."""
        notes = self.notes.setdefault(path, [])
        notes += [text for text in texts if text not in notes]

    def todo(
        self, message: str, span: Span | None, path: Entry = ("", ""), advice: str = ""
    ) -> None:
        """Report a part of the source that is not imported, as a comment and a finding."""
        where = f"{posixpath.basename(span.file)}:{span.line}: " if span and span.file else ""
        self.note(path, f"TODO {where}{message}")
        noted = finding("TF020", message, span, help=advice)
        if noted not in self.findings:
            self.findings.append(noted)

    def frame(
        self, parent: str, child: str, keys: Mapping[str, Any], span: Span | None, *notes: str
    ) -> bool:
        """Add a fixed frame unless its name is taken; return whether it was added."""
        frames = self.sections["frames"]
        entry = frames.get(child)
        if entry is not None:
            same = entry == {"parent": parent, **keys}
            more = "" if same else f"; {_describe(parent, keys)} here"
            self.todo(f"{child} is published a second time{more}", span, ("frames", child))
            return False
        frames[child] = {**({"parent": parent} if parent else {}), **keys}
        self.note(("frames", child), *notes)
        return True

    def bring(self, path: str) -> str:
        """Copy a file from ``made`` to ``neighbours``, in the folder ``ROBOT_params``.

        ``path`` is its placeholder path. Return its path from the robot file's folder.
        """
        self.used.add(path)
        base, ending = posixpath.splitext(posixpath.basename(path.rpartition("#")[0] or path))
        for number in itertools.count(1):
            name = f"{self.robot}_params/{base}{f'_{number}' if number > 1 else ''}{ending}"
            if self.neighbours.setdefault(name, self.made[path]) == self.made[path]:
                return name
        raise AssertionError

    def process(
        self, preferred: str, keys: Mapping[str, Any], *notes: str, section: str = "processes"
    ) -> str:
        """Add a process or a container under a free name, and return the name."""
        name = self.free_name(preferred)
        self.sections[section][name] = dict(keys)
        self.note((section, name), *notes)
        return name

    def entry_of(self, process: str) -> Entry:
        """Return the section and name of an existing process or container."""
        return ("containers" if process in self.sections["containers"] else "processes", process)

    def started_entries(self) -> dict[str, dict[str, Any]]:
        """Return the containers and processes by name."""
        return {**self.sections["containers"], **self.sections["processes"]}

    def free_name(self, preferred: str) -> str:
        """Return an unused name for a process or sensor, made of letters, digits and _.

        If the preferred name is used, a number is appended.
        """
        plain = _NO_NAME.sub("_", preferred).strip("_") or "process"
        plain = plain if plain[0].isalpha() else f"process_{plain}"
        names_in_use = {
            *self.sections["processes"],
            *self.sections["sensors"],
            *self.sections["containers"],
            *BUILT_IN,
        }
        count, name = 1, plain
        while name in names_in_use:
            count += 1
            name = f"{plain}_{count}"
        return name

    def is_empty(self) -> bool:
        """Return whether no section has an entry."""
        return not any(self.sections.values())

    def text(self) -> str:
        """Return the robot file."""
        sections = {name: entries for name, entries in self._with_roots().items() if entries}
        lines = [
            *comment(self.head),
            *entry("tfcompose", 1),
            *comment(self.notes.get(("", ""), ())),
        ]
        lines += entry("robot", self.robot)
        lines += entry("base", self.base) if self.base else []
        sections, variables = without_expressions(sections)
        lines += variables
        for title, entries in sections.items():
            lines += section(
                title, entries, {name: self.notes.get((title, name), ()) for name in entries}
            )
        unplaced = [
            f"{name}: {text}"
            for (title, name), texts in self.notes.items()
            if title and name not in sections.get(title, {})
            for text in texts
        ]
        return "\n".join([*lines, *comment(unplaced), ""])

    def _with_roots(self) -> dict[str, dict[str, Any]]:
        """Return the sections, with a root frame for each parent that no entry describes.

        If parts add unknown frames, add none, because those frames can be the parents.
        """
        frames = self.sections["frames"]
        names = {*frames, *self.sections["links"], *self.brought}
        names |= {joint["child"] for joint in self.sections["joints"].values()}
        if self.has_unknown_frames:
            return self.sections
        roots: dict[str, Any] = {}
        for keys in [
            *frames.values(),
            *self.sections["joints"].values(),
            *self.sections["sensors"].values(),
        ]:
            for key in ("parent", "relative_to"):
                if isinstance(parent := keys.get(key), str) and parent not in names:
                    roots.setdefault(parent, {})
        return {**self.sections, "frames": {**roots, **frames}}


def path_from(target: Target, path: str) -> str:
    """Return the form in which the robot file at ``target`` names the file or folder ``path``.

    This is ``path`` relative to the robot file's folder. If ``path`` and that folder have only
    the root folder ``/`` in common, it is the absolute path.
    """
    begin = posixpath.normpath(posixpath.join(target.top, target.folder))
    is_near = posixpath.commonpath([begin, posixpath.join(target.top, path)]) != "/"
    return (
        target.from_folder(path)
        if is_near
        else posixpath.normpath(posixpath.join(target.top, path))
    )


def where(span: Span | None, what: str = "") -> str:
    """Return a comment with the location of a value in the source."""
    place = f"{posixpath.basename(span.file)}:{span.line}" if span and span.file else ""
    return ": ".join(part for part in (place, what) if part)


def _describe(parent: str, keys: Mapping[str, Any]) -> str:
    return flow({"parent": parent, **keys})


def pose_keys(
    pose: Pose, rpy: Vector | None = None, *, quaternion: bool = False
) -> dict[str, Any]:
    """Return the keys of a pose; empty for the identity.

    ``rpy`` are the source's angles, in radians. With ``quaternion``, the source has a quaternion.
    The result then contains it, unless each angle is a number of degrees with few decimals: then
    the result contains the angles.
    """
    keys: dict[str, Any] = {"xyz": [value + 0.0 for value in pose.xyz]} if any(pose.xyz) else {}
    if rpy is not None:
        angles = [angle(value) for value in rpy]
        return keys | ({"rpy": angles} if any(angles) else {})
    unit = normalise(pose.quat_xyzw)
    turned = rotation(unit)
    if turned is None or not any(turned):
        return keys
    if quaternion and any(isinstance(value, float) and value for value in turned):
        return keys | {
            "quat_xyzw": list(pose.quat_xyzw if abs(norm(pose.quat_xyzw) - 1) < _UNIT else unit)
        }
    return keys | {"rpy": turned}


def robot_name(text: str) -> str:
    """Return the text as a robot's name, with lower case letters, digits and _."""
    name = re.sub(r"[^a-z0-9_]+", "_", text.lower()).strip("_")
    if not name:
        return "robot"
    return name if name[0].isalpha() else f"robot_{name}"


def text_with_findings(
    draft: ImportDraft, lint: Callable[[str], Compiled]
) -> tuple[str, Compiled]:
    """Return the robot file, and lint's findings about it.

    First complete the draft: if it has no frames, add the frame ``base_link``; if lint reports
    errors of ``_OF_SOURCE``, add rules that make them warnings.
    """
    if not any(
        draft.sections[title] for title in ("links", "joints", "frames", "sensors", "parts")
    ):
        draft.frame(
            "",
            "base_link",
            {},
            None,
            "the source describes no frames: add those of the robot here",
        )
    compiled = lint(draft.text())
    errors = {error.code for error in compiled.errors}
    for code, why in _OF_SOURCE.items():
        if code in errors:
            draft.sections["rules"][code] = "warning"
            draft.note(("rules", code), why)
    if draft.sections["rules"]:
        compiled = lint(draft.text())
    return draft.text(), compiled
