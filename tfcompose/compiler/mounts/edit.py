"""Edits of the robot file that give a mount a new pose and change nothing else.

An edit changes a number where the file has it, in the file's unit, and accounts for ``place`` and
``relative_to``. Some values do not belong to the mount alone: values of a variable, an included
file, a calibration or a YAML anchor. These are not edited; an overlay can replace them instead.
"""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.mounts.kinematics import poses_in_roots
from tfcompose.compiler.mounts.rotations import FORMS
from tfcompose.foundation.findings import Edit
from tfcompose.foundation.geometry import (
    OPTICAL_XYZW,
    Pose,
    angle_between,
    multiply,
    norm,
    quat_from_rpy,
)
from tfcompose.foundation.numbers import number
from tfcompose.foundation.units import UnitError, quantity
from tfcompose.model.robot import JOINTS, STATIC, is_optical
from tfcompose.spec.language import DIRECTIONS
from tfcompose.spec.load import load
from tfcompose.spec.load.editing import MappingKeys, text_at, with_value

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from tfcompose.compiler.mounts.rotations import Numbers
    from tfcompose.foundation.findings import Span
    from tfcompose.foundation.geometry import Quaternion
    from tfcompose.model.robot import Edge, Robot
    from tfcompose.spec.load import Location, Path, Source

#: Maximum error of a new number, in metres or radians, for the sake of a short text. With a lever
#: arm the maximum is smaller.
ROUNDING = 1e-7
#: Text that can precede a scalar: an anchor and a tag.
_PROPERTIES = re.compile(r"(?:[&!]\S*\s+)+")
#: A number with an optional unit. A space may separate them.
_NUMBER = re.compile(r"([-+.0-9eE]+?)(\s*)([A-Za-z][A-Za-z/]*)?\s*")


class ImmovableError(Exception):
    """No file states the frame's pose, so there is nothing to edit."""


@dataclass(frozen=True, slots=True)
class MountEdits:
    """Edits that move one mount. Apply all of them or none."""

    edits: tuple[Edit, ...]


@dataclass(frozen=True, slots=True)
class Elsewhere:
    """A pose that cannot be edited in its file, with values for an overlay that sets the pose."""

    #: Why the pose cannot be edited.
    reason: str
    span: Span
    #: The path of the mapping that takes ``values``; empty if an overlay cannot set them.
    entry: Path
    #: YAML text by key. None removes the key.
    values: Mapping[str, str | None]

    def overlay(self, text: str, file: str) -> str:
        """Return ``text``, an overlay's text that may be empty, with these values added."""
        return with_value(text, file, self.entry, self.values)


@dataclass(frozen=True, slots=True)
class Mount:
    """The pose that a file states for an edge."""

    edge: Edge
    #: The path of the entry in the robot file.
    entry: Path
    #: The entry's mapping.
    data: Mapping[str, Any]
    #: The frame whose pose the file states.
    place: str
    #: The reference frame of the pose in the file.
    relative_to: str
    #: The pose of ``relative_to`` in the edge's parent.
    parent_from_base: Pose
    #: The pose of ``place`` in the edge's child, without the offset of a joint's zero.
    child_from_place: Pose

    @property
    def is_optical(self) -> bool:
        """Whether z is the viewing direction of the frame whose pose the file states."""
        name = str(self.entry[-1]) if self.entry[2:3] == ("frames",) else self.place
        return is_optical(name)

    def pose_in_file(self, parent_from_child: Pose) -> Pose:
        """Return the pose to write into the file so that the edge gets ``parent_from_child``."""
        return self.parent_from_base.inverse() @ parent_from_child @ self.child_from_place

    @property
    def tolerance(self) -> float:
        """By how much a written number may differ, in metres or radians."""
        return ROUNDING / max(1.0, norm(self.child_from_place.xyz))

    def pose_values(self, parent_from_child: Pose) -> dict[str, str]:
        """Return ``xyz`` and ``rpy`` as YAML, in metres and degrees, for the edge's new pose."""
        pose = self.pose_in_file(parent_from_child)
        rpy = _rpy_text(pose.quat_xyzw, self.tolerance)
        return {"xyz": _xyz_text(pose, self.tolerance), "rpy": rpy}

    def of_edge(self, pose: Pose) -> Pose:
        """Return the edge's pose that follows from a pose in the file."""
        return self.parent_from_base @ pose @ self.child_from_place.inverse()


def mount_of(robot: Robot, source: Source, child: str) -> Mount:
    """Return the file's entry for the edge from its parent to ``child``.

    Raises:
        ImmovableError: if no robot file states the edge's pose.
    """
    edge = robot.parent_edge(child)
    if edge is None:
        raise ImmovableError(f"{child} is a root: it has no pose in another frame")
    if not edge.pose_known:
        raise ImmovableError(f"only {edge.owner} knows where {child} is in {edge.parent}")
    if edge.joint is None and edge.owner.rpartition("/")[2] not in {STATIC, JOINTS}:
        raise ImmovableError(f"{edge.owner} publishes where {child} is in {edge.parent}")
    data = source.mapping(*edge.entry)
    place, base = (data.get(key) for key in ("place", "relative_to"))
    place = place if isinstance(place, str) else child
    base = base if isinstance(base, str) else edge.parent
    if base not in robot.frames or place not in robot.frames:
        raise ImmovableError(f"the pose of {child} is given by frames that are not there")
    poses = poses_in_roots(robot, {})
    parent_from_base = poses[edge.parent].inverse() @ poses[base]
    child_from_place = edge.pose.inverse() @ edge.mount @ poses[child].inverse() @ poses[place]
    return Mount(
        edge,
        edge.entry,
        data,
        place=place,
        relative_to=base,
        parent_from_base=parent_from_base,
        child_from_place=child_from_place,
    )


def change_of(
    robot: Robot, source: Source, texts: Mapping[str, str], child: str, parent_from_child: Pose
) -> MountEdits | Elsewhere:
    """Return the edits that move ``child`` to a pose, or the value that prevents them.

    ``source`` is the robot's source with overlays merged. ``texts`` holds the texts of the
    editable files, by the file names in spans.

    Raises:
        ImmovableError: if no robot file states the pose of ``child``.
    """
    mount = mount_of(robot, source, child)
    computed = {
        number.path: number.numbers for number in robot.source_numbers if not number.in_part
    }
    return _MountEditor(mount, source, texts, mount.tolerance, computed).of(
        mount.pose_in_file(parent_from_child)
    )


class _ElsewhereError(Exception):
    """A number that does not belong to the mount alone; ``span`` is its place."""

    def __init__(self, reason: str, span: Span) -> None:
        self.reason = reason
        self.span = span
        super().__init__(reason)


@dataclass(slots=True)
class _MountEditor:
    mount: Mount
    source: Source
    texts: Mapping[str, str]
    tolerance: float
    computed: Mapping[Path, tuple[float, ...]]
    _raw: dict[str, Location] = field(default_factory=dict)

    def of(self, new: Pose) -> MountEdits | Elsewhere:
        """Return the edits that replace the mount's pose with ``new``."""
        mount = self.mount
        old = mount.pose_in_file(mount.edge.pose)
        moves = any(abs(a - b) > self.tolerance for a, b in zip(new.xyz, old.xyz, strict=True))
        rotates = angle_between(new.quat_xyzw, old.quat_xyzw) > self.tolerance
        if not moves and not rotates:
            return MountEdits(())
        try:
            self._refuse_other_files()
            edits = self._move_edits(old, new) if moves else []
            edits += self._rotate_edits(old.quat_xyzw, new.quat_xyzw) if rotates else []
        except _ElsewhereError as error:
            return self._elsewhere(error, new, moves=moves, rotates=rotates)
        return MountEdits(tuple(_join_edits(edits)))

    def _elsewhere(
        self, error: _ElsewhereError, new: Pose, *, moves: bool, rotates: bool
    ) -> Elsewhere:
        entry, measured = self.mount.entry, self.mount.edge.calibration is not None
        if self._is_in_part():
            return Elsewhere(error.reason, error.span, (), {})
        values: dict[str, str | None] = {"calibration": "[]"} if measured else {}
        if moves or measured:
            values["xyz"] = self._xyz(new)
        if rotates or measured:
            values["rpy"] = self._rpy(new.quat_xyzw)
        return Elsewhere(error.reason, error.span, entry, values)

    def _is_in_part(self) -> bool:
        return self.mount.entry[:1] == ("parts",) and len(self.mount.entry) > _PART

    def _refuse_other_files(self) -> None:
        """Raise if the pose is not in a robot file, or is in a file without an editable text."""
        edge, measured = self.mount.edge, self.mount.edge.calibration
        if measured is not None:
            raise _ElsewhereError(
                f"the pose is measured, in the calibration {measured.span.file}", measured.span
            )
        if self._is_in_part():
            reason = f"the pose is given in the part {self.mount.entry[1]}"
            if edge.span.file.endswith((".yaml", ".yml")):
                reason += (
                    f"; tfcompose view {shlex.quote(edge.span.file)} --edit changes it for all"
                    " that use the file"
                )
            raise _ElsewhereError(reason, edge.span)
        if not self.mount.data:
            raise _ElsewhereError(f"the pose is that of the preset of {edge.sensor}", edge.span)

    def _move_edits(self, old: Pose, new: Pose) -> list[Edit]:
        if "xyz" not in self.mount.data:
            return [self._insert_keys({"xyz": self._xyz(new)}, ("parent",))]
        before: Numbers = {(index,): value for index, value in enumerate(old.xyz)}
        after: Numbers = {(index,): value for index, value in enumerate(new.xyz)}
        return self._edit_or_insert("xyz", self._xyz(new), before, after)

    def _rotate_edits(self, old: Quaternion, new: Quaternion) -> list[Edit]:
        key = next((name for name in FORMS if name in self.mount.data), None)
        if key is None:
            return [
                self._insert_keys(
                    {"rpy": self._rpy(new)}, ("parent", "xyz", "place", "relative_to")
                )
            ]
        if key == "look" and self.mount.is_optical:
            x, y, z, w = OPTICAL_XYZW
            old, new = multiply(old, (-x, -y, -z, w)), multiply(new, (-x, -y, -z, w))
        if key == "look" and not isinstance(self.mount.data[key], dict):
            return [self._direction(new)]
        before = self._numbers(key)
        after: Numbers = FORMS[key](new, before, self.tolerance)
        return self._edit_or_insert(key, self._complete(key, new, after), before, after)

    def _edit_or_insert(
        self, key: str, complete: str | None, before: Numbers, after: Numbers
    ) -> list[Edit]:
        """Return the edits of the numbers below a key.

        If the entry has the key through ``<<``, the edit inserts the key into the entry.
        """
        try:
            return list(self._renumber(key, before, after))
        except _SharedError:
            entry = self._place_in_text(self.mount.entry)
            if complete is None or key in MappingKeys(self.texts[entry.span.file], entry).own_keys:
                raise
            return [self._insert_keys({key: complete}, ("parent", "xyz"))]

    def _complete(self, key: str, rotation: Quaternion, numbers: Numbers) -> str | None:
        """Return the YAML of a rotation under its own key, None without a short form."""
        if key == "rpy":
            return self._rpy(rotation)
        if key == "look":
            return self._angles(numbers)
        return (
            _list(self._short(value, "") for value in numbers.values())
            if key == "quat_xyzw"
            else None
        )

    def _direction(self, rotation: Quaternion) -> Edit:
        """Return the edit of ``look: down``: another direction, or angles."""
        span = self._unshared_span(("look",))
        for name, rpy in DIRECTIONS.items():
            if angle_between(quat_from_rpy(*rpy), rotation) <= self.tolerance:
                return Edit(span, name)
        return Edit(span, self._angles(FORMS["look"](rotation, {}, self.tolerance)))

    def _angles(self, numbers: Numbers) -> str:
        angles = [f"{step}: {self._new_angle(value)}" for (step,), value in numbers.items()]
        return f"{{{', '.join(angles)}}}"

    def _numbers(self, key: str) -> Numbers:
        """Return the numbers below the key in SI, including numbers computed from variables."""
        data = self.mount.data[key]
        leaves: Numbers = dict(_leaves(data))
        numbers = self.computed.get((*self.mount.entry, key), ())
        steps: list[str | int] = [step for step in _IN_ORDER.get(key, ()) if step in data] or [
            0,
            1,
            2,
            3,
        ]
        if key != "matrix":
            leaves |= {(step,): value for step, value in zip(steps, numbers, strict=False)}
        unknown = [path for path in _scalars(data) if path not in leaves]
        if unknown:
            path = (key, *unknown[0])
            raise _ElsewhereError(
                f"{_dotted_path(path)} is computed",
                self.source.span_of((*self.mount.entry, *path)),
            )
        return leaves

    def _renumber(self, key: str, before: Numbers, after: Numbers) -> Iterator[Edit]:
        """Yield an edit for each changed number, and an insertion for each missing number."""
        missing = {
            str(path[0]): self._new_angle(value)
            for path, value in after.items()
            if path not in before
        }
        for path, value in after.items():
            if path in before and abs(value - before[path]) > self.tolerance:
                yield self._number((key, *path), value)
        if missing:
            self._unshared_span((key,))
            location = self._place_in_text((*self.mount.entry, key))
            yield MappingKeys(self.texts[location.span.file], location).insertion(missing)

    def _number(self, path: Path, value: float) -> Edit:
        span = self._unshared_span(path)
        scalar = text_at(self.texts[span.file], span).strip("\"'")
        if "${" in scalar:
            raise _ElsewhereError(f"{_dotted_path(path)} is computed: {scalar}", span)
        match = _NUMBER.fullmatch(scalar)
        if match is None or _value(scalar) is None:
            raise _ElsewhereError(f"{_dotted_path(path)} is {scalar}", span)
        return Edit(span, self._short(value, match[3] or "", match[2]))

    def _unshared_span(self, path: Path) -> Span:
        """Return the span of a value below the entry, without anchor and tag.

        Raise if the value does not belong to this entry alone.
        """
        full_path = (*self.mount.entry, *path)
        span = self.source.exact_span(full_path)
        if span is None:
            raise _ElsewhereError(
                f"{_dotted_path(path)} is not there", self.source.span_of(full_path)
            )
        if span.file not in self.texts:
            raise _ElsewhereError(
                f"{_dotted_path(path) or 'the pose'} is given in {span.file}", span
            )
        sharing = [
            shared_path
            for shared_path, location in self._places(span.file).walk()
            if location.span == span
        ]
        if len(sharing) > 1:
            other_path = next(shared_path for shared_path in sharing if shared_path != full_path)
            raise _SharedError(
                str(path[0]) if path else "the entry", _dotted_path(other_path), span
            )
        match = _PROPERTIES.match(text_at(self.texts[span.file], span))
        return (
            span._replace(column=span.column + match.end())
            if match and "\n" not in match[0]
            else span
        )

    def _places(self, file: str) -> Location:
        if file not in self._raw:
            self._raw[file] = load(self.texts[file], file).places
        return self._raw[file]

    def _place_in_text(self, path: Path) -> Location:
        """Return the location of a mapping in its file, before overlays are merged."""
        span = self.source.span_of(path)
        return next(
            location for _, location in self._places(span.file).walk() if location.span == span
        )

    def _insert_keys(self, values: Mapping[str, str], after: tuple[str, ...]) -> Edit:
        """Return the edit that inserts keys into the entry."""
        self._unshared_span(())
        location = self._place_in_text(self.mount.entry)
        return MappingKeys(self.texts[location.span.file], location).insertion(values, after)

    def _xyz(self, pose: Pose) -> str:
        return _xyz_text(pose, self.tolerance)

    def _rpy(self, rotation: Quaternion) -> str:
        return _rpy_text(rotation, self.tolerance)

    def _new_angle(self, value: float) -> str:
        return _angle_text(value, self.tolerance)

    def _short(self, value: float, unit: str, space: str = " ") -> str:
        return _short(value, self.tolerance, unit, space)


#: Length of the path to a part.
_PART = 2


class _SharedError(_ElsewhereError):
    def __init__(self, what: str, sharer: str, span: Span) -> None:
        super().__init__(f"{what} is shared with {sharer}", span)


#: Keys of mappings whose values are numbers, in the order of ``Robot.source_numbers``.
_IN_ORDER: dict[str, tuple[str, ...]] = {
    "axis_angle": ("angle",),
    "look": ("up", "down", "left", "right", "roll"),
}


def _xyz_text(pose: Pose, tolerance: float) -> str:
    return _list(_short(value, tolerance) for value in pose.xyz)


def _rpy_text(rotation: Quaternion, tolerance: float) -> str:
    angles: Numbers = FORMS["rpy"](rotation, {(0,): 0.0, (1,): 0.0, (2,): 0.0}, tolerance)
    return _list(_angle_text(value, tolerance) for value in angles.values())


def _angle_text(value: float, tolerance: float) -> str:
    return _short(value, tolerance, "deg") if abs(value) > tolerance else "0"


def _short(value: float, tolerance: float, unit: str = "", space: str = " ") -> str:
    """Return the number in a unit, with as few decimals as ``tolerance`` allows."""
    size = quantity(f"1 {unit}").value if unit else 1.0
    decimals = next(
        n for n in range(400) if abs(round(value / size, n) * size - value) <= tolerance
    )
    rounded = round(value / size, decimals)
    text = f"{rounded:.{decimals}f}" if "e" in number(rounded) else number(rounded)
    return f"{text}{space}{unit}" if unit else text


def _list(values: Iterable[str]) -> str:
    return f"[{', '.join(values)}]"


def _dotted_path(path: Path) -> str:
    return ".".join(map(str, path))


def _join_edits(edits: list[Edit]) -> Iterator[Edit]:
    """Yield the edits, with insertions at the same point joined into one."""
    texts: dict[Span, str] = {}
    for edit in edits:
        texts[edit.span] = texts.get(edit.span, "") + edit.text
    return (Edit(span, text) for span, text in texts.items())


def _scalars(value: Any, path: Path = ()) -> dict[Path, Any]:
    """Return the scalars within a value, by path."""
    if not isinstance(value, (dict, list)):
        return {path: value}
    items = value.items() if isinstance(value, dict) else enumerate(value)
    return {
        inner_path: scalar
        for step, item in items
        for inner_path, scalar in _scalars(item, (*path, step)).items()
    }


def _value(text: str) -> float | None:
    """Return the quantity in SI, None if the text is not a quantity."""
    try:
        return quantity(text).value
    except UnitError:
        return None


def _leaves(value: Any) -> Iterator[tuple[Path, float]]:
    """Yield the numbers in a value with their paths, except computed numbers."""
    for path, item in _scalars(value).items():
        if isinstance(item, str) and (number_in := _value(item)) is not None:
            yield path, number_in
        elif isinstance(item, (int, float)) and not isinstance(item, bool):
            yield path, float(item)
