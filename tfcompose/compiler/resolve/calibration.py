"""Measured poses from calibration files, matched with edges.

A calibration entry is the pose of its child in its parent. If the child is an inner frame of the
sensor, or the parent is not the edge's parent, the edge's pose is solved, as with ``place`` and
``relative_to``. A given function reads the files. An error in a calibration file is reported at
the place in the robot file, with a note that points into the calibration file.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from tfcompose.compiler.resolve.poses import group_of, place_of
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
from tfcompose.spec.language.pose import CalibrationLimit, MountKeys
from tfcompose.spec.load import find_path

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from tfcompose.compiler.resolve.draft import Draft
    from tfcompose.spec.language.calibration import CalibrationEntry
    from tfcompose.spec.language.pose import CalibrationFileSpec, CalibrationSpec
    from tfcompose.spec.load import Path

    Reader = Callable[[str], str]

_DEFAULT_LIMIT = CalibrationLimit()


def measure(draft: Draft) -> Iterator[Finding]:
    """Assign calibrations to mount edges; ``solve_poses`` later computes the edges' poses."""
    work = _Calibrations(draft, _Files(draft.read))
    for edge in draft.edges:
        if group := group_of(edge):
            work.inside.setdefault(group, set()).add(edge.child)
    for index in draft.keys:
        work.measure(index)
    work.apply_files()
    yield from (*work.files.findings, *work.findings)


@dataclass(slots=True)
class _Files:
    """Calibration files. Each file is read only once."""

    read: Reader | None
    findings: list[Finding] = field(default_factory=list)
    _files: dict[tuple[str, str], CalibrationFile] = field(default_factory=dict)

    def get(self, named: str, span: Span, form: str = "auto") -> CalibrationFile:
        """Return the entries of the file. Its errors are reported only once."""
        path = find_path(named, span)
        if (path, form) not in self._files:
            self._files[path, form] = self._load(path, span, form)
        return self._files[path, form]

    def _load(self, path: str, span: Span, form: str) -> CalibrationFile:
        if self.read is None:
            loaded = unreadable(
                path, form, span, [finding("TF001", "files cannot be read here", None)]
            )
        else:
            try:
                loaded = read_calibration(self.read(path), path, form, span)
            except RejectedError as error:
                loaded = unreadable(path, form, span, error.findings)
        self.findings += loaded.findings
        return loaded


@dataclass(frozen=True, slots=True)
class _Match:
    """A calibration entry that fits an edge."""

    entry: CalibrationEntry
    #: Whether the entry's parent is the edge's child.
    inverted: bool

    @property
    def names(self) -> tuple[str | None, str | None]:
        """The names of parent and child in the direction of the edge."""
        parent, child = self.entry.parent, self.entry.child
        return (child, parent) if self.inverted else (parent, child)


def _matches(
    entries: Sequence[CalibrationEntry], parents: Collection[str], children: Collection[str]
) -> list[_Match]:
    """Return the entries that have a parent from ``parents`` and a child from ``children``.

    If there is none, return entries in the opposite direction.
    """
    straight = [
        _Match(entry, inverted=False)
        for entry in entries
        if entry.parent in parents and entry.child in children
    ]
    turned = [
        _Match(entry, inverted=True)
        for entry in entries
        if entry.child in parents and entry.parent in children
    ]
    return list({(match.names, match.entry.pose): match for match in straight or turned}.values())


@dataclass(slots=True)
class _Calibrations:
    draft: Draft
    files: _Files
    findings: list[Finding] = field(default_factory=list)
    used: set[int] = field(default_factory=set)
    inside: dict[Path, set[str]] = field(default_factory=dict)

    def measure(self, index: int) -> None:
        """Apply the edge's own ``calibration`` key."""
        edge, keys = self.draft.edges[index], self.draft.keys[index]
        if not isinstance(keys, MountKeys) or not keys.calibration:
            return
        path = (*edge.entry, "calibration")
        valid = self._valid(keys.calibration, path)
        if len(valid) > 1:
            self._several_valid(edge.name, keys.calibration, valid, path)
        for position, declared in enumerate(keys.calibration):
            span = self._span(path, position)
            file = self.files.get(declared.file, span, declared.format)
            match = self._pick(index, declared, file, span)
            if match and valid == [position]:
                self._take(index, match, file, declared, span)

    def _span(self, path: Path, position: int) -> Span:
        """Return the span of a file in a list, or of the entry if it is written without a list."""
        item = (*path, position)
        spans = self.draft.spec.spans
        return spans.span_of((*(item if spans.has(item) else path), "file"))

    def _valid(self, declared: Sequence[CalibrationFileSpec], path: Path) -> list[int]:
        """Return the positions of the calibrations that are valid today.

        If none is valid, add a finding.
        """
        validated = self.draft.validated
        if any(refused[: len(path)] == path for refused in validated.refused):
            return []
        day = validated.inputs.day
        valid = [index for index, calibration in enumerate(declared) if calibration.holds(day)]
        if declared and not valid:
            names = ", ".join(calibration.file for calibration in declared)
            message = (
                f"none of the calibrations is valid on {day}: {names}"
                if day
                else f"all calibrations have expired: {names}"
            )
            advice = (
                "add the calibration of that day, or correct valid:"
                if day
                else "add a newer one, or remove to: from the one that still holds"
            )
            self.findings.append(finding("TF608", message, self._span(path, 0), help=advice))
        return valid

    def _several_valid(
        self, name: str, declared: Sequence[CalibrationSpec], valid: Sequence[int], path: Path
    ) -> None:
        """Report that a mount has several calibrations that are valid on the same day."""
        first, second = valid[:2]
        files = ", ".join(declared[position].file for position in valid)
        day = self.draft.validated.inputs.day
        message = f"{name} has several calibrations valid {f'on {day}' if day else 'now'}: {files}"
        notes = [Note("the other one", self._span(path, first))]
        advice = "end the older one: valid: {to: DAY}"
        span = self._span(path, second)
        self.findings.append(finding("TF613", message, span, help=advice, notes=notes))

    def _around(self, index: int) -> tuple[set[str], set[str]]:
        """Return the frames that a calibration entry may name as the edge's parent and child."""
        edge = self.draft.edges[index]
        relative_to = self.draft.keys[index].relative_to
        return {edge.parent, relative_to or edge.parent}, self.inside.get(
            group_of(edge), {edge.child}
        )

    def _pick(
        self, index: int, declared: CalibrationSpec, file: CalibrationFile, span: Span
    ) -> _Match | None:
        own_parents, inside = self._around(index)
        nameless = [entry for entry in file.entries if entry.parent is None]
        if nameless:
            return _Match(
                nameless[0], inverted=declared.parent in inside or declared.child in own_parents
            )
        parents = _alias(declared.parent) if declared.parent else own_parents
        children = _alias(declared.child) if declared.child else inside
        matches = _matches(file.entries, parents, children)
        if not matches and not file.findings:
            self._missing(declared, file, span, index)
        if len(matches) > 1:
            self._ambiguous(
                f"{self.draft.edges[index].name}: {len(matches)} entries of {file.file} fit",
                span,
                matches,
            )
            return None
        return matches[0] if matches else None

    def _missing(
        self, declared: CalibrationSpec, file: CalibrationFile, span: Span, index: int
    ) -> None:
        edge = self.draft.edges[index]
        child = declared.child or place_of(self.draft.keys[index]) or edge.child
        parent = declared.parent or edge.parent
        names = [name for entry in file.entries for name in (entry.child, entry.parent) if name]
        near = next(
            (
                hint
                for name in (child, parent)
                if name not in names and (hint := nearest(name, names))
            ),
            None,
        )
        entries = [entry for entry in file.entries if near in {entry.child, entry.parent}] or list(
            file.entries
        )
        notes = [Note(f"{entry.name} is defined here", entry.span) for entry in entries[:1]]
        contents = (
            f"it has {', '.join(entry.name for entry in file.entries[:6])}; parent: and child:"
            " pick one"
        )
        advice = f"did you mean {near}? {contents}" if near else contents
        message = f"{file.file} holds no pose of {child} in {parent}"
        self.findings.append(finding("TF612", message, span, help=advice, notes=notes))

    def _ambiguous(self, message: str, span: Span, matches: Sequence[_Match]) -> None:
        notes = [
            Note(f"{match.entry.name} is defined here", match.entry.span) for match in matches[:4]
        ]
        names = {match.entry.name for match in matches}
        advice = (
            "pick one with child: and parent:"
            if len(names) > 1
            else "keep one of them in the file"
        )
        self.findings.append(finding("TF613", message, span, help=advice, notes=notes))

    def _take(
        self,
        index: int,
        match: _Match,
        file: CalibrationFile,
        declared: CalibrationSpec | None,
        span: Span,
    ) -> None:
        """Assign a calibration entry to the edge."""
        self.used.add(id(match.entry))
        edge, keys, frames = self.draft.edges[index], self.draft.keys[index], self.draft.frames
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
            parent=(parent if parent in frames and parent else keys.relative_to or edge.parent),
            child=child if child in frames and child else place_of(keys) or edge.child,
            pose=pose,
            entry=match.entry.pose,
            span=match.entry.span,
            format=f"{file.format} {match.entry.what}".strip(),
            named_at=span,
            limit_m=limit.xyz,
            limit_rad=limit.rot,
            inverted=match.inverted,
        )
        self.draft.edges[index] = replace(edge, calibration=calibration)

    def apply_files(self) -> None:
        """Apply every entry of the valid files under ``calibrations``."""
        declared, path = self.draft.spec.calibrations, ("calibrations",)
        valid = self._valid(declared, path)
        for position, calibration in enumerate(declared):
            span = self._span(path, position)
            file = self.files.get(calibration.file, span)
            if position in valid:
                self._apply(file, span)

    def _apply(self, file: CalibrationFile, span: Span) -> None:
        """Apply every entry of a file, and report entries that fit no edge."""
        for index in self.draft.keys:
            self._apply_to(index, file, span)
        self._report_unused(file, span)

    def _apply_to(self, index: int, file: CalibrationFile, span: Span) -> None:
        edge, matches = self.draft.edges[index], self._fitting(index, file)
        measured = edge.calibration
        if self._takes_precedence(index, span):
            self.used.update(id(match.entry) for match in matches)
        elif len(matches) > 1:
            self._ambiguous(
                f"{edge.name}: {len(matches)} entries of {file.file} fit", span, matches
            )
            self.used.update(id(match.entry) for match in matches)
        elif matches and measured:
            notes = [Note("the other one", measured.span), Note("this one", matches[0].entry.span)]
            message = f"{edge.name} is measured twice: by {measured.span.file} and by {file.file}"
            if matches[0].entry.span != measured.span:
                self.findings.append(
                    finding("TF613", message, span, help="keep one of them", notes=notes)
                )
            self.used.add(id(matches[0].entry))
        elif matches:
            self._take(index, matches[0], file, None, span)

    def _takes_precedence(self, index: int, span: Span) -> bool:
        """Return whether a mount's own ``calibration`` overrides the files of all mounts.

        It does if it is an empty list, or an overlay sets it.
        """
        keys = self.draft.keys[index]
        if not isinstance(keys, MountKeys) or "calibration" not in keys.model_fields_set:
            return False
        spans = self.draft.spec.spans
        file = spans.key_span((*self.draft.edges[index].entry, "calibration")).file
        return not keys.calibration or (file != span.file and file in spans.overlays)

    def _fitting(self, index: int, file: CalibrationFile) -> list[_Match]:
        if not isinstance(self.draft.keys[index], MountKeys):
            return []
        direct, inside = self._around(index)
        elsewhere = [
            entry
            for entry in file.entries
            if entry.parent in self.draft.frames and entry.parent not in inside
        ]
        return _matches(file.entries, direct, inside) or [
            _Match(entry, inverted=False) for entry in elsewhere if entry.child in inside
        ]

    def _report_unused(self, file: CalibrationFile, span: Span) -> None:
        for entry in file.entries:
            if (
                id(entry) in self.used or self.draft.spec.spans.is_variant
            ):  # the robot file without overlays may use it
                continue
            advice = (
                "calibration: beside the mount takes it"
                if entry.child is None
                else "no such mount: remove it"
            )
            if entry.child is not None and entry.child not in self.draft.frames:
                advice = did_you_mean(entry.child, self.draft.frames, advice)
            message = f"{file.file}: no mount uses {entry.name}"
            note = Note("defined here", entry.span)
            self.findings.append(finding("TF619", message, span, help=advice, notes=[note]))


def _alias(name: str) -> set[str]:
    """Return the possible names of a device.

    Kalibr calls an IMU imu0 in its input, and imu in its results.
    """
    return {name, "imu"} if name == "imu0" else {name}
