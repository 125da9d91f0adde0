"""Calibration files: poses with parent, child and span.

Every entry is the pose of its ``child`` in its ``parent``. The formats and their sources:

- autoware: ``sensors_calibration.yaml`` of a sensor kit, parent: {child: {x, y, z, roll, pitch,
  yaw}}, in metres and radians about fixed axes. xacro copies these to the origin of a joint.
- easy_handeye2: its message HandeyeCalibration as YAML. The parent is robot_effector_frame for
  eye_in_hand, otherwise robot_base_frame. The child is tracking_base_frame. The first version and
  easy_handeye wrote ``transformation``.
- moveit: the launch file that "Save camera pose" writes, with one static_transform_publisher.
- kalibr: camchain and imucam files. ``T_cam_imu`` maps points from the IMU to the camera, so it is
  the pose of the IMU in the camera. ``T_cn_cnm1`` of cam1 maps points from cam0 to cam1, so it is
  the pose of cam0 in cam1.
- transform_stamped: geometry_msgs/TransformStamped and tf2_msgs/TFMessage, the pose of
  child_frame_id in frame_id.
- matrix: four rows of four numbers that map points from the child to the parent. It has no names.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, get_args

from pydantic import AfterValidator, BeforeValidator, ConfigDict, model_validator

from tfcompose.foundation.findings import Finding, Note, RejectedError, Span, finding
from tfcompose.foundation.geometry import (
    Pose,
    Quaternion,
    normalise,
    quat_from_matrix,
    quat_from_rpy,
)
from tfcompose.foundation.units import Number, format_value, invalid
from tfcompose.spec.language.pose import CalibrationFormat, has_unit_length, is_rotation
from tfcompose.spec.language.reading import SpecRefusal, read
from tfcompose.spec.language.spec import Spec
from tfcompose.spec.language.values import InARow, Text
from tfcompose.spec.load.calibration import load_calibration

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from tfcompose.spec.load import Path, Source
    from tfcompose.spec.load.calibration import Form

FORMATS: tuple[CalibrationFormat, ...] = get_args(CalibrationFormat)

_LONGEST_NUMBER = 60
_LAST_ROW = (0.0, 0.0, 0.0, 1.0)
_EXACT = 1e-9
#: Codes about a rotation itself, not about its notation.
_NO_ROTATION = frozenset({"TF402", "TF403", "TF614"})


def _is_no_expression(value: Any) -> Any:
    if isinstance(value, str) and ("${" in value or "(" in value):
        advice = "write the number; an angle in degrees: !degrees 15"
        raise invalid(
            "TF103", f"{format_value(value)} is an expression, which is not computed here", advice
        )
    if isinstance(value, str) and len(value) > _LONGEST_NUMBER:
        raise invalid("TF103", f"{format_value(value)} is not a number")
    return value


def _frame(name: str) -> str:
    if not name.strip("/"):
        raise invalid("TF103", f"{format_value(name)} is not a frame's name")
    return name.lstrip("/")


CalibrationNumber = Annotated[Number, BeforeValidator(_is_no_expression)]
FrameName = Annotated[Text, AfterValidator(_frame)]
_Row = Annotated[
    tuple[CalibrationNumber, CalibrationNumber, CalibrationNumber, CalibrationNumber],
    InARow(4, "[1, 0, 0, 0.2]"),
]
_Rows = tuple[_Row, _Row, _Row, _Row]


def _last_row(rows: _Rows) -> _Rows:
    if any(abs(a - b) > _EXACT for a, b in zip(rows[3], _LAST_ROW, strict=True)):
        is_transposed = all(abs(rows[i][3]) <= _EXACT for i in range(3))
        advice = (
            "it is transposed: the position belongs in the last column" if is_transposed else ""
        )
        message = f"the last row is {' '.join(f'{value:g}' for value in rows[3])}, not 0 0 0 1"
        raise invalid("TF614", message, advice)
    a, b, c, _ = rows
    is_rotation(((a[0], a[1], a[2]), (b[0], b[1], b[2]), (c[0], c[1], c[2])))
    return rows


#: A homogeneous 4×4 matrix, in rows.
MatrixRows = Annotated[_Rows, InARow(4, "four rows of four numbers"), AfterValidator(_last_row)]


class FileEntry(Spec):
    """A mapping in a calibration file. Other keys in it are ignored."""

    model_config = ConfigDict(extra="ignore")


class Translation(FileEntry):
    """geometry_msgs/Vector3, in metres."""

    x: CalibrationNumber
    y: CalibrationNumber
    z: CalibrationNumber


class Rotation(FileEntry):
    """geometry_msgs/Quaternion."""

    x: CalibrationNumber
    y: CalibrationNumber
    z: CalibrationNumber
    w: CalibrationNumber

    @property
    def quat_xyzw(self) -> Quaternion:
        """The quaternion x, y, z, w."""
        return (self.x, self.y, self.z, self.w)


def _unit(rotation: Rotation) -> Rotation:
    has_unit_length(rotation.quat_xyzw)
    return rotation


class RecordedTransform(FileEntry):
    """geometry_msgs/Transform."""

    translation: Translation
    rotation: Annotated[Rotation, AfterValidator(_unit)]

    @property
    def pose(self) -> Pose:
        """The pose of the transform."""
        xyz = (self.translation.x, self.translation.y, self.translation.z)
        return Pose(xyz, normalise(self.rotation.quat_xyzw))


class RecordedHeader(FileEntry):
    """std_msgs/Header. Only the frame is used."""

    frame_id: FrameName


class RecordedTransformStamped(FileEntry):
    """geometry_msgs/TransformStamped."""

    header: RecordedHeader
    child_frame_id: FrameName
    transform: RecordedTransform


class PoseXyzRpy(FileEntry):
    """Position and angles about fixed axes, from Autoware's files or from arguments."""

    x: CalibrationNumber
    y: CalibrationNumber
    z: CalibrationNumber
    roll: CalibrationNumber
    pitch: CalibrationNumber
    yaw: CalibrationNumber

    @property
    def pose(self) -> Pose:
        """The pose."""
        return Pose((self.x, self.y, self.z), quat_from_rpy(self.roll, self.pitch, self.yaw))


class PoseXyzQuat(FileEntry):
    """Position and unit quaternion, from easy_handeye's files or from arguments."""

    x: CalibrationNumber
    y: CalibrationNumber
    z: CalibrationNumber
    qx: CalibrationNumber
    qy: CalibrationNumber
    qz: CalibrationNumber
    qw: CalibrationNumber

    @property
    def pose(self) -> Pose:
        """The pose."""
        return Pose((self.x, self.y, self.z), normalise((self.qx, self.qy, self.qz, self.qw)))

    @model_validator(mode="after")
    def _has_unit_length(self) -> PoseXyzQuat:
        has_unit_length((self.qx, self.qy, self.qz, self.qw))
        return self


class HandeyeTransform(FileEntry):
    """HandeyeCalibration of easy_handeye2, without its parameters."""

    transform: RecordedTransform


class HandeyeTransformation(FileEntry):
    """HandeyeCalibration of easy_handeye2's first version and of easy_handeye."""

    transformation: PoseXyzQuat


class EyeInHand(FileEntry):
    """Parameters of a camera on the hand."""

    robot_effector_frame: FrameName
    tracking_base_frame: FrameName


class EyeOnBase(FileEntry):
    """Parameters of a camera next to the robot."""

    robot_base_frame: FrameName
    tracking_base_frame: FrameName


class HandeyeKind(FileEntry):
    """The kind of calibration, as easy_handeye2 writes it."""

    calibration_type: Text


class KalibrCamera(FileEntry):
    """A camera of a camchain: poses of the IMU and of the previous camera in this camera."""

    T_cam_imu: MatrixRows | None = None
    T_cn_cnm1: MatrixRows | None = None


class MatrixFile(FileEntry):
    """A file that consists of a matrix."""

    matrix: MatrixRows


#: Default values of static_transform_publisher's flags.
_DEFAULTS: dict[type[PoseXyzQuat | PoseXyzRpy], dict[str, str]] = {
    PoseXyzQuat: dict.fromkeys(PoseXyzQuat.model_fields, "0") | {"qw": "1"},
    PoseXyzRpy: dict.fromkeys(PoseXyzRpy.model_fields, "0"),
}


@dataclass(frozen=True, slots=True)
class CalibrationEntry:
    """The pose of ``child`` in ``parent``, with the names from the file.

    An entry from a matrix has no names.
    """

    pose: Pose
    span: Span
    parent: str | None = None
    child: str | None = None
    #: The key of the entry, if the key matters.
    what: str = ""

    @property
    def name(self) -> str:
        """The entry for display."""
        return f"{self.parent} → {self.child}" if self.parent else "the matrix"


@dataclass(frozen=True, slots=True)
class CalibrationFile:
    """The content of a calibration file."""

    file: str
    format: str
    entries: tuple[CalibrationEntry, ...]
    #: Findings about the file, at the span that names it.
    findings: tuple[Finding, ...]


def unreadable(file: str, form: str, span: Span, findings: Iterable[Finding]) -> CalibrationFile:
    """Return an unreadable file: no entries, and findings with the reason."""
    return CalibrationFile(
        file, form, (), tuple(_inside("TF610", finding, file, span) for finding in findings)
    )


def _inside(code: str, inner: Finding, file: str, span: Span) -> Finding:
    """Move a finding inside a calibration file to the span that names the file."""
    is_exact = inner.span is not None and inner.span != Span(file)
    notes = [Note("here", inner.span), *inner.notes] if is_exact else inner.notes
    return finding(code, f"{file}: {inner.message}", span, help=inner.help, notes=notes)


def read_calibration(text: str, file: str, form: str, span: Span) -> CalibrationFile:
    """Return the content of the text in the given format; ``auto`` recognises the format.

    ``span`` is the place that names the file.
    """
    try:
        kind, documents = load_calibration(text, file)
    except RejectedError as error:
        return unreadable(file, form, span, _without_text(error.findings, text))
    wrong = [finding for document in documents for finding in document.findings]
    if wrong:
        wrong = _without_text(wrong, text)
        return CalibrationFile(
            file, form, (), tuple(_inside("TF610", refusal, file, span) for refusal in wrong)
        )
    recognised = _recognise(kind, documents)
    chosen = recognised if form == "auto" else form
    if chosen is None or not documents:
        what = "is empty" if not documents else "is in no known format"
        advice = f"formats: {', '.join(FORMATS)}; tfcompose help calibration shows them"
        return CalibrationFile(file, form, (), (_of_no_format(file, what, span, advice),))
    if chosen != recognised and (kind != "yaml" or chosen == "moveit"):
        advice = (
            f"leave format out; it reads like {recognised}"
            if recognised
            else f"formats: {', '.join(FORMATS)}"
        )
        return CalibrationFile(
            file, chosen, (), (_of_no_format(file, f"is not a {chosen} file", span, advice),)
        )
    reader = _FormatReader(span)
    for document in documents:
        reader.source = document
        reader.entries += _READERS[chosen](reader, document.data)
    if not reader.entries and not reader.findings:
        reader.findings.append(_of_no_format(file, f"holds no pose, read as {chosen}", span))
    return CalibrationFile(file, chosen, tuple(reader.entries), tuple(reader.findings))


#: Words that calibration files contain and password files do not.
_TYPICAL = re.compile(
    r"\b(?:T_cam_imu|T_cn_cnm1|transforms?|translation|rotation|quaternion|roll|matrix"
    r"|robot_base_frame)\b"
)


def _without_text(findings: Sequence[Finding], text: str) -> list[Finding]:
    """Return the findings. If the file may be of any kind, they repeat none of its text."""
    if _TYPICAL.search(text) or any(finding.code in {"TF001", "TF008"} for finding in findings):
        return list(findings)
    return [replace(findings[0], message="it cannot be read as a calibration", help="")]


def _of_no_format(file: str, what: str, span: Span, advice: str = "") -> Finding:
    return finding("TF611", f"{file} {what}", span, help=advice, notes=[Note("here", Span(file))])


_AUTOWARE_KEYS = frozenset(PoseXyzRpy.model_fields)
_CAMERA = re.compile(r"cam(\d+)\Z")


def _recognise(kind: Form, documents: tuple[Source, ...]) -> str | None:
    """Return the apparent format of the documents, or None."""
    if kind != "yaml":
        return {"rows": "matrix", "launch": "moveit"}[kind]
    data: Any = documents[0].data if documents else None
    if isinstance(data, list):
        return "matrix" if data and all(isinstance(row, list) for row in data) else None
    if not isinstance(data, dict):
        return None
    if "transforms" in data or {"transform", "header"} <= set(data):
        return "transform_stamped"
    if {"transform", "transformation"} & set(data):
        return "easy_handeye2"
    inner = [value for value in data.values() if isinstance(value, dict)]
    if any(map(_CAMERA.match, data)) and inner:
        return "kalibr"
    leaves = [leaf for child in inner for leaf in child.values() if isinstance(leaf, dict)]
    return "autoware" if any(_AUTOWARE_KEYS & set(leaf) for leaf in leaves) else None


M = TypeVar("M", bound=FileEntry)


@dataclass(slots=True)
class _FormatReader:
    """Reads documents in each of the formats.

    An invalid entry becomes a finding. Other entries are still read.
    """

    named_at: Span
    source: Source = field(init=False)
    entries: list[CalibrationEntry] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    def model(self, model: type[M], data: Any, path: Path) -> M | None:
        """Return the data at a path as the model, None after recording what is wrong."""
        made, refusals = read(model, data)
        missing: set[Path] = set()
        for refusal in refusals:
            if refusal.code == "TF102" and refusal.path in missing:
                continue  # one of the missing keys is enough to report
            missing.add(refusal.path)
            path_of_refusal = (
                (*path, *refusal.path[1:]) if model is MatrixFile else (*path, *refusal.path)
            )
            self._refuse(replace(refusal, path=path_of_refusal, on_key=False))
        return None if refusals else made

    def refuse(self, path: Path, message: str, advice: str = "") -> None:
        """Record a fault at a path."""
        self._refuse(SpecRefusal("TF610", path, message, advice))

    def _refuse(self, refusal: SpecRefusal) -> None:
        code = "TF614" if refusal.code in _NO_ROTATION else "TF610"
        self.findings.append(
            _inside(code, refusal.finding(self.source), self.source.file, self.named_at)
        )

    def entry(
        self,
        path: Path,
        pose: Pose,
        parent: str | None = None,
        child: str | None = None,
        what: str = "",
    ) -> CalibrationEntry:
        """Return the entry at a path."""
        span = (
            self.source.key_span(path) if self.source.has_key(path) else self.source.span_of(path)
        )
        return CalibrationEntry(pose, span, parent, child, what)

    def autoware(self, data: Any) -> Iterator[CalibrationEntry]:
        """Yield the entries of a sensor kit."""
        for parent, children in data.items() if isinstance(data, dict) else ():
            for child, values in children.items() if isinstance(children, dict) else ():
                refusal = self.model(PoseXyzRpy, values, (parent, child))
                if refusal:
                    yield self.entry(
                        (parent, child), refusal.pose, parent.lstrip("/"), child.lstrip("/")
                    )

    def easy_handeye2(self, data: Any) -> Iterator[CalibrationEntry]:
        """Yield the entry of a hand-eye calibration."""
        path: Path = ("parameters",) if isinstance(data, dict) and "parameters" in data else ()
        names = self._handeye_names(data["parameters"] if path else data, path)
        if names is None:
            return
        if "transformation" in data:
            old = self.model(HandeyeTransformation, data, ())
            if old:
                yield self.entry(("transformation",), old.transformation.pose, *names)
            return
        new = self.model(HandeyeTransform, data, ())
        if new:
            yield self.entry(("transform",), new.transform.pose, *names)

    def _handeye_names(self, data: Any, path: Path) -> tuple[str, str] | None:
        """Return parent and child of the calibration."""
        is_in_hand = data.get("eye_on_hand") if isinstance(data, dict) else None
        if is_in_hand is None:
            kind = self.model(HandeyeKind, data, path)
            if kind is None:
                return None
            is_in_hand = kind.calibration_type in {"eye_in_hand", "eye_on_hand"}
        if is_in_hand:
            hand = self.model(EyeInHand, data, path)
            return (hand.robot_effector_frame, hand.tracking_base_frame) if hand else None
        base = self.model(EyeOnBase, data, path)
        return (base.robot_base_frame, base.tracking_base_frame) if base else None

    def transform_stamped(self, data: Any) -> Iterator[CalibrationEntry]:
        """Yield the entries of a TransformStamped or a TFMessage."""
        is_list = isinstance(data, dict) and "transforms" in data
        messages = data["transforms"] if is_list else [data]
        if not isinstance(messages, list):
            self.refuse(("transforms",), f"{format_value(messages)} is not a list of transforms")
            return
        for index, message in enumerate(messages):
            path: Path = ("transforms", index) if is_list else ()
            refusal = self.model(RecordedTransformStamped, message, path)
            if refusal:
                yield self.entry(
                    path, refusal.transform.pose, refusal.header.frame_id, refusal.child_frame_id
                )

    def kalibr(self, data: Any) -> Iterator[CalibrationEntry]:
        """Yield the poses of the IMU and of the previous camera in each camera."""
        for camera, values in data.items() if isinstance(data, dict) else ():
            number = _CAMERA.match(camera)
            if not number or not isinstance(values, dict):
                continue
            before = f"cam{int(number[1][:9]) - 1}"
            for key, child in (("T_cam_imu", "imu"), ("T_cn_cnm1", before)):
                refusal = (
                    self.model(KalibrCamera, {key: values[key]}, (camera,))
                    if key in values
                    else None
                )
                rows = getattr(refusal, key) if refusal else None
                if rows:
                    yield self.entry((camera, key), _pose_of(rows), camera, child, key)

    def matrix(self, data: Any) -> Iterator[CalibrationEntry]:
        """Yield the entry of a file that consists of a matrix."""
        refusal = self.model(MatrixFile, {"matrix": data}, ())
        if refusal:
            yield self.entry((), _pose_of(refusal.matrix))

    def moveit(self, data: Any) -> Iterator[CalibrationEntry]:
        """Yield an entry for each static_transform_publisher in a launch file."""
        for index, row in enumerate(data):
            if any(flag.startswith("--") for flag in row):
                yield from self._flags(index, row)
            else:
                yield from self._positions(index, row)

    def _positions(self, index: int, row: list[str]) -> Iterator[CalibrationEntry]:
        """Read x y z qx qy qz qw parent child."""
        if len(row) == 8:  # noqa: PLR2004 (x y z, three angles, two names)
            message = (
                "three angles: the first versions of MoveIt wrote them in another order than their"
                " reader takes"
            )
            self.refuse((index,), message, "write the quaternion: x y z qx qy qz qw parent child")
        elif len(row) != 9:  # noqa: PLR2004 (x y z, quaternion, two names)
            self.refuse(
                (index,), f"expected x y z qx qy qz qw parent child, got {len(row)} arguments"
            )
        else:
            names = dict(zip(PoseXyzQuat.model_fields, row[:7], strict=True))
            where = {name: index for index, name in enumerate(names)}
            pose = self._arguments(PoseXyzQuat, names, index, where)
            if pose:
                yield self.entry((index,), pose, row[7].lstrip("/"), row[8].lstrip("/"))

    def _flags(self, index: int, row: list[str]) -> Iterator[CalibrationEntry]:
        """Read --x … --qw or --roll --pitch --yaw, --frame-id and --child-frame-id."""
        flags = {flag[2:]: value for flag, value in zip(row[::2], row[1::2], strict=False)}
        missing = [name for name in ("frame-id", "child-frame-id") if name not in flags]
        if missing:
            self.refuse(
                (index,), f"--{missing[0]} is missing", "it must be a string, not a variable"
            )
            return
        where = {flag[2:]: 2 * index + 1 for index, flag in enumerate(row[::2])}
        model = PoseXyzQuat if {"qx", "qy", "qz", "qw"} & set(flags) else PoseXyzRpy
        pose = self._arguments(model, flags, index, where)
        if pose:
            yield self.entry(
                (index,), pose, flags["frame-id"].lstrip("/"), flags["child-frame-id"].lstrip("/")
            )

    def _arguments(
        self,
        model: type[PoseXyzQuat | PoseXyzRpy],
        flags: dict[str, str],
        index: int,
        where: dict[str, int],
    ) -> Pose | None:
        """Return the pose from arguments, None after recording what is wrong.

        ``where`` is the index of each argument in the command line.
        """
        made, refusals = read(model, _DEFAULTS[model] | flags)
        for refusal in refusals:
            path = (
                (index, where[str(refusal.path[0])])
                if refusal.path and str(refusal.path[0]) in where
                else (index,)
            )
            self._refuse(replace(refusal, path=path, on_key=False))
        return made.pose if made and not refusals else None


def _pose_of(rows: _Rows) -> Pose:
    a, b, c, _ = rows
    xyz = (a[3], b[3], c[3])
    return Pose(
        xyz, quat_from_matrix(((a[0], a[1], a[2]), (b[0], b[1], b[2]), (c[0], c[1], c[2])))
    )


_READERS = {
    "autoware": _FormatReader.autoware,
    "easy_handeye2": _FormatReader.easy_handeye2,
    "moveit": _FormatReader.moveit,
    "kalibr": _FormatReader.kalibr,
    "matrix": _FormatReader.matrix,
    "transform_stamped": _FormatReader.transform_stamped,
}
