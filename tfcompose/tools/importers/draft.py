"""A robot file in the making: sections with entries, comments, and omissions.

Readers of launch files, scripts and running robots fill it in source order. It writes the text.
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

#: In the order of the language.
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
#: A quaternion whose length is this close to 1 is kept as it is in the source.
_UNIT = 1e-7
#: Errors of a robot file that are warnings where its source is so, and why.
_OF_SOURCE = {
    "TF335": "the clocks are those of the source, whose nodes do not agree",
    "TF501": "the names are those of the source",
}
_NO_NAME = re.compile(r"[^A-Za-z0-9_]+")


@dataclass(slots=True)
class ImportDraft:
    """A robot file in the making."""

    robot: str
    #: Comments at the top of the file.
    head: list[str] = field(default_factory=list)
    #: The robot's base if it is not the default.
    base: str | None = None
    #: Plain data, as in a robot file.
    sections: dict[str, dict[str, Any]] = field(
        default_factory=lambda: {name: {} for name in SECTIONS}
    )
    #: Comments above entries.
    notes: dict[Entry, list[str]] = field(default_factory=dict)
    #: Omitted parts of the source. Each finding is also a comment.
    findings: list[Finding] = field(default_factory=list)
    #: Frames that sensors add. They are no roots.
    brought: set[str] = field(default_factory=set)
    #: Whether parts add frames whose names are unknown here.
    has_unknown_frames: bool = False
    #: The files that the source may read; by default all files that a user names.
    reach: Reach = field(default_factory=lambda: Reach(everything=True))
    #: Texts of files that the source writes when it starts, by their placeholder paths.
    made: dict[str, str] = field(default_factory=dict)
    #: Texts of those files that the robot file names, by their paths from its folder.
    neighbours: dict[str, str] = field(default_factory=dict)
    #: The placeholder paths of files in ``neighbours``.
    used: set[str] = field(default_factory=set)
    #: Each process with its use_sim_time, None where the source does not set it, and its place.
    clocks: list[tuple[str, Any, Span | None]] = field(default_factory=list)
    #: Whether the robot keeps its launch files: each process is external.
    is_adopted: bool = False
    #: Locations in a launch file that start publishers: of a fixed edge, by its child, and of a
    #: part.
    publishers: dict[str, Span | None] = field(default_factory=dict)

    def note(self, path: Entry, *texts: str) -> None:
        """Put comments above an entry, each once."""
        known = self.notes.setdefault(path, [])
        known += [text for text in texts if text not in known]

    def todo(
        self, message: str, span: Span | None, path: Entry = ("", ""), advice: str = ""
    ) -> None:
        """Record something that is not imported, as a comment and as a finding."""
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
        known = frames.get(child)
        if known is not None:
            same = known == {"parent": parent, **keys}
            more = "" if same else f"; {_describe(parent, keys)} here"
            self.todo(f"{child} is published a second time{more}", span, ("frames", child))
            return False
        frames[child] = {**({"parent": parent} if parent else {}), **keys}
        self.note(("frames", child), *notes)
        return True

    def bring(self, path: str) -> str:
        """Put a file that the source writes next to the robot file; return its path from there."""
        self.used.add(path)
        base, ending = posixpath.splitext(posixpath.basename(path.rpartition("#")[0] or path))
        for number in itertools.count(1):
            name = f"{self.robot}_params/{base}{f'_{number}' if number > 1 else ''}{ending}"
            if self.neighbours.setdefault(name, self.made[path]) == self.made[path]:
                return name
        raise AssertionError

    def process(
        self, wanted: str, keys: Mapping[str, Any], *notes: str, section: str = "processes"
    ) -> str:
        """Add a process or a container under a free name, and return the name."""
        name = self.free_name(wanted)
        self.sections[section][name] = dict(keys)
        self.note((section, name), *notes)
        return name

    def entry_of(self, process: str) -> Entry:
        """Return the section and name of an existing process or container."""
        return ("containers" if process in self.sections["containers"] else "processes", process)

    def started_entries(self) -> dict[str, dict[str, Any]]:
        """Return the containers and processes by name."""
        return {**self.sections["containers"], **self.sections["processes"]}

    def free_name(self, wanted: str) -> str:
        """Return a name for a process or sensor, made of letters, digits and _.

        A number makes it unique.
        """
        plain = _NO_NAME.sub("_", wanted).strip("_") or "process"
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
        homeless = [
            f"{name}: {text}"
            for (title, name), texts in self.notes.items()
            if title and name not in sections.get(title, {})
            for text in texts
        ]
        return "\n".join([*lines, *comment(homeless), ""])

    def _with_roots(self) -> dict[str, dict[str, Any]]:
        """Return the sections, with frames that are only parents added as roots."""
        frames = self.sections["frames"]
        known = {*frames, *self.sections["links"], *self.brought}
        known |= {joint["child"] for joint in self.sections["joints"].values()}
        if self.has_unknown_frames:
            return self.sections
        roots: dict[str, Any] = {}
        for keys in [
            *frames.values(),
            *self.sections["joints"].values(),
            *self.sections["sensors"].values(),
        ]:
            for key in ("parent", "relative_to"):
                if isinstance(parent := keys.get(key), str) and parent not in known:
                    roots.setdefault(parent, {})
        return {**self.sections, "frames": {**roots, **frames}}


def path_from(target: Target, path: str) -> str:
    """Return a path in the form of a robot file.

    Relative to its folder, or absolute if they share only the root.
    """
    begin = posixpath.normpath(posixpath.join(target.top, target.folder))
    is_near = posixpath.commonpath([begin, posixpath.join(target.top, path)]) != "/"
    return (
        target.from_folder(path)
        if is_near
        else posixpath.normpath(posixpath.join(target.top, path))
    )


def where(span: Span | None, what: str = "") -> str:
    """Return the place of a value in the form of a comment."""
    place = f"{posixpath.basename(span.file)}:{span.line}" if span and span.file else ""
    return ": ".join(part for part in (place, what) if part)


def _describe(parent: str, keys: Mapping[str, Any]) -> str:
    return flow({"parent": parent, **keys})


def pose_keys(
    pose: Pose, rpy: Vector | None = None, *, quaternion: bool = False
) -> dict[str, Any]:
    """Return the keys of a pose, nothing for the identity.

    ``rpy`` (rad) are the source's angles. With ``quaternion`` the source has a quaternion, which
    is kept unless it clearly means whole degrees.
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


def robot_name(wanted: str) -> str:
    """Return a robot's name: lower case letters, digits and _, a letter first."""
    name = re.sub(r"[^a-z0-9_]+", "_", wanted.lower()).strip("_")
    if not name:
        return "robot"
    return name if name[0].isalpha() else f"robot_{name}"


def text_with_findings(
    draft: ImportDraft, lint: Callable[[str], Compiled]
) -> tuple[str, Compiled]:
    """Return the robot file, and lint's findings about it.

    Names and clocks from the source are not errors. A source without frames gives a robot with
    one.
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
