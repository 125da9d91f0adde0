"""Measured poses from calibration files: which entry of which file is which edge's.

An entry is the pose of its child in its parent. Where the child is a frame inside a sensor, or the
parent another frame than the edge's, the edge is solved for, as with ``place`` and
``relative_to``. Files are read with the reader that is handed in; what is wrong with them is said
at the place in the robot file, with a note into the calibration file.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.findings import (
    Finding,
    Note,
    RejectedError,
    Span,
    did_you_mean,
    finding,
    nearest,
)
from tfcompose.model.robot import Calibration
from tfcompose.spec.language.calibration import CalibrationFile, read_calibration, unreadable
from tfcompose.spec.language.pose import ROTATIONS, CalibrationLimit, CalibrationSpec, MountKeys
from tfcompose.spec.load import path_named

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from tfcompose.compiler.resolve.poses import Draft
    from tfcompose.spec.language.calibration import Entry
    from tfcompose.spec.language.robot import RobotSpec

    Reader = Callable[[str], str]

_MEASURABLE = frozenset({"frames", "links", "sensors", "parts"})
_DEFAULT_LIMIT = CalibrationLimit()


def calibrated(
    drafts: Sequence[Draft],
    frames: Collection[str],
    spec: RobotSpec,
    read: Reader | None,
) -> tuple[list[Draft], list[Finding]]:
    """Return the drafts with measured calibrations, and what is wrong with calibrations."""
    work = _Work(_Files(read), frozenset(frames), spec)
    for draft in drafts:
        if draft.group:
            work.inside.setdefault(draft.group, set()).add(draft.edge.child)
    result = [work.own(draft) for draft in drafts]
    for index, name in enumerate(spec.calibrations):
        path = ("calibrations", index)
        result = work.apply(name, spec.at(path), result)
    return result, [*work.files.found, *work.found]


@dataclass(slots=True)
class _Files:
    """Calibration files, each read once."""

    read: Reader | None
    found: list[Finding] = field(default_factory=list)
    _known: dict[tuple[str, str], CalibrationFile] = field(default_factory=dict)

    def get(self, named: str, at: Span, form: str = "auto") -> CalibrationFile:
        """Return what the file says; what is wrong with it is said once."""
        path = path_named(named, at)
        if (path, form) not in self._known:
            self._known[path, form] = self._load(path, at, form)
        return self._known[path, form]

    def _load(self, path: str, at: Span, form: str) -> CalibrationFile:
        if self.read is None:
            loaded = unreadable(
                path, form, at, [finding("TF001", "files cannot be read here", None)]
            )
        else:
            try:
                loaded = read_calibration(self.read(path), path, form, at)
            except RejectedError as error:
                loaded = unreadable(path, form, at, error.findings)
        self.found += loaded.found
        return loaded


@dataclass(frozen=True, slots=True)
class _Match:
    """An entry that fits an edge; ``inverted``: its parent is the edge's child."""

    entry: Entry
    inverted: bool

    @property
    def names(self) -> tuple[str | None, str | None]:
        """The names of parent and child as the edge has them."""
        parent, child = self.entry.parent, self.entry.child
        return (child, parent) if self.inverted else (parent, child)


def _matches(
    entries: Sequence[Entry], parents: Collection[str], children: Collection[str]
) -> list[_Match]:
    """Return the entries of a child in a parent.

    Those the other way round only if there is none.
    """
    straight = [
        _Match(one, inverted=False)
        for one in entries
        if one.parent in parents and one.child in children
    ]
    turned = [
        _Match(one, inverted=True)
        for one in entries
        if one.child in parents and one.parent in children
    ]
    return list({(one.names, one.entry.pose): one for one in straight or turned}.values())


@dataclass(slots=True)
class _Work:
    files: _Files
    frames: frozenset[str]
    spec: RobotSpec
    found: list[Finding] = field(default_factory=list)
    used: set[int] = field(default_factory=set)
    inside: dict[tuple[str, str], set[str]] = field(default_factory=dict)

    def own(self, draft: Draft) -> Draft:
        """Return the draft with what its own ``calibration`` says."""
        declared = _declared(draft, self.spec)
        if declared is None:
            return draft
        at = self.spec.at((*draft.at, "calibration", "file"))
        file = self.files.get(declared.file, at, declared.format)
        match = self._pick(draft, declared, file, at)
        return self._measured(draft, match, file, declared, at) if match else draft

    def _around(self, draft: Draft) -> tuple[set[str], set[str]]:
        """Return the frame names that the edge's parent and child can have in its entry."""
        inside = self.inside[draft.group] if draft.group else {draft.edge.child}
        return {draft.edge.parent, draft.relative_to or draft.edge.parent}, inside

    def _pick(
        self, draft: Draft, declared: CalibrationSpec, file: CalibrationFile, at: Span
    ) -> _Match | None:
        own_parents, inside = self._around(draft)
        nameless = [one for one in file.entries if one.parent is None]
        if nameless:
            return _Match(
                nameless[0], inverted=declared.parent in inside or declared.child in own_parents
            )
        parents = _alias(declared.parent) if declared.parent else own_parents
        children = _alias(declared.child) if declared.child else inside
        matches = _matches(file.entries, parents, children)
        if not matches and not file.found:
            self._missing(declared, file, at, draft)
        if len(matches) > 1:
            self._ambiguous(
                f"{draft.edge.name}: {len(matches)} entries of {file.file} fit", at, matches
            )
            return None
        return matches[0] if matches else None

    def _missing(
        self, declared: CalibrationSpec, file: CalibrationFile, at: Span, draft: Draft
    ) -> None:
        child, parent = (
            declared.child or draft.place or draft.edge.child,
            declared.parent or draft.edge.parent,
        )
        names = [name for entry in file.entries for name in (entry.child, entry.parent) if name]
        near = next(
            (
                hint
                for name in (child, parent)
                if name not in names and (hint := nearest(name, names))
            ),
            None,
        )
        shown = [one for one in file.entries if near in {one.child, one.parent}] or list(
            file.entries
        )
        notes = [Note(f"{entry.name} is defined here", entry.at) for entry in shown[:1]]
        there = (
            f"there is {', '.join(entry.name for entry in file.entries[:6])}; parent: and child:"
            " pick one"
        )
        advice = f"did you mean {near}? {there}" if near else there
        message = f"{file.file} holds no pose of {child} in {parent}"
        self.found.append(finding("TF612", message, at, help=advice, notes=notes))

    def _ambiguous(self, message: str, at: Span, matches: Sequence[_Match]) -> None:
        notes = [Note(f"{one.entry.name} is defined here", one.entry.at) for one in matches[:4]]
        names = {one.entry.name for one in matches}
        advice = (
            "pick one with child: and parent:"
            if len(names) > 1
            else "keep one of them in the file"
        )
        self.found.append(finding("TF613", message, at, help=advice, notes=notes))

    def _measured(
        self,
        draft: Draft,
        match: _Match,
        file: CalibrationFile,
        declared: CalibrationSpec | None,
        at: Span,
    ) -> Draft:
        self.used.add(id(match.entry))
        parent, child = match.names
        if parent is None and declared:
            parent, child = (
                (declared.child, declared.parent)
                if match.inverted
                else (declared.parent, declared.child)
            )
        limit = declared.limit if declared else _DEFAULT_LIMIT
        pose = match.entry.pose.inverse() if match.inverted else match.entry.pose
        calibration = Calibration(
            parent=(
                parent
                if parent in self.frames and parent
                else draft.relative_to or draft.edge.parent
            ),
            child=child if child in self.frames and child else draft.place or draft.edge.child,
            pose=pose,
            entry=match.entry.pose,
            at=match.entry.at,
            format=f"{file.format} {match.entry.what}".strip(),
            named_at=at,
            limit_m=limit.xyz,
            limit_rad=limit.rot,
            inverted=match.inverted,
        )
        return replace(draft, measured=calibration, has_nominal=_has_pose(draft, self.spec))

    def apply(self, named: str, at: Span, drafts: list[Draft]) -> list[Draft]:
        """Return the drafts with every entry of a file applied.

        One that nothing takes is a finding.
        """
        file = self.files.get(named, at)
        result = []
        for draft in drafts:
            matches = self._fitting(draft, file)
            if len(matches) > 1:
                self._ambiguous(
                    f"{draft.edge.name}: {len(matches)} entries of {file.file} fit", at, matches
                )
                self.used.update(id(match.entry) for match in matches)
            elif matches and draft.measured:
                notes = [
                    Note("the other one", draft.measured.at),
                    Note("this one", matches[0].entry.at),
                ]
                message = (
                    f"{draft.edge.name} is measured twice: by {draft.measured.at.file} and by"
                    f" {file.file}"
                )
                if matches[0].entry.at != draft.measured.at:
                    self.found.append(
                        finding("TF613", message, at, help="keep one of them", notes=notes)
                    )
                self.used.add(id(matches[0].entry))
            one = matches[0] if len(matches) == 1 and not draft.measured else None
            result.append(self._measured(draft, one, file, None, at) if one else draft)
        self._unused(file, at)
        return result

    def _fitting(self, draft: Draft, file: CalibrationFile) -> list[_Match]:
        if not draft.at or draft.at[0] not in _MEASURABLE or not draft.edge.given:
            return []
        own, inside = self._around(draft)
        elsewhere = [
            one for one in file.entries if one.parent in self.frames and one.parent not in inside
        ]
        return _matches(file.entries, own, inside) or [
            _Match(one, inverted=False) for one in elsewhere if one.child in inside
        ]

    def _unused(self, file: CalibrationFile, at: Span) -> None:
        for entry in file.entries:
            if id(entry) in self.used or self.spec.spans.is_variant:  # the file alone may use it
                continue
            advice = (
                "calibration: beside the mount takes it"
                if entry.child is None
                else "no such mount: remove it"
            )
            if entry.child is not None and entry.child not in self.frames:
                advice = did_you_mean(entry.child, self.frames, advice)
            message = f"{file.file}: no mount uses {entry.name}"
            note = Note("defined here", entry.at)
            self.found.append(finding("TF619", message, at, help=advice, notes=[note]))


def _declared(draft: Draft, spec: RobotSpec) -> CalibrationSpec | None:
    if not draft.at or draft.at[0] not in _MEASURABLE:
        return None
    section: dict[str, Any] = getattr(spec, str(draft.at[0]))
    found: CalibrationSpec | None = section[str(draft.at[1])].calibration
    return found


def _alias(name: str) -> set[str]:
    """Return the name, and what Kalibr's results call the IMU that its input calls imu0."""
    return {name, "imu"} if name == "imu0" else {name}


def _has_pose(draft: Draft, spec: RobotSpec) -> bool:
    section, name = draft.at
    entry: MountKeys = getattr(spec, str(section))[name]
    return bool((ROTATIONS | {"xyz"}) & entry.model_fields_set)
