"""Poses and edges as users write them.

An edge has a position, at most one of five forms of rotation, a parent and an owner. Models keep
the values in their original form. ``rotation`` and ``Posed.xyz`` return their meaning.
"""

import math
from collections.abc import Iterator
from datetime import date
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError
from typing_extensions import Self, TypeAliasType

from tfcompose.foundation.geometry import (
    Matrix,
    Quaternion,
    Vector,
    norm,
    normalise,
    quat_from_axis_angle,
    quat_from_matrix,
    quat_from_rpy,
)
from tfcompose.foundation.units import Angle, Length, Number, Rate, invalid
from tfcompose.spec.language.spec import Checked, Entry, Spec, key, several
from tfcompose.spec.language.values import (
    Axis,
    Boolean,
    Day,
    InARow,
    Numbers,
    OneOrMore,
    Text,
    Texts,
    Xyz,
    as_list,
    short,
)
from tfcompose.spec.load import Path

#: Tolerance for the length of a quaternion or of a row of a matrix. It allows for four decimals.
UNIT_TOLERANCE = 1e-3

Direction = Literal["forward", "backward", "left", "right", "up", "down"]
DIRECTIONS: dict[Direction, Vector] = {
    "forward": (0, 0, 0),
    "backward": (0, 0, math.pi),
    "left": (0, 0, math.pi / 2),
    "right": (0, 0, -math.pi / 2),
    "up": (0, -math.pi / 2, 0),
    "down": (0, math.pi / 2, 0),
}


def has_unit_length(quat_xyzw: Quaternion) -> Quaternion:
    """Return the quaternion.

    Raises:
        PydanticCustomError: if its length is not 1 within ``UNIT_TOLERANCE``.
    """
    length = norm(quat_xyzw)
    if abs(length - 1) <= UNIT_TOLERANCE:
        return quat_xyzw
    advice = "the order is x, y, z, w"
    if length:
        advice = (
            f"normalised it is [{', '.join(f'{part:.6g}' for part in normalise(quat_xyzw))}];"
            f" {advice}"
        )
    raise invalid("TF402", f"the quaternion has length {length:.6g}, not 1", advice)


def is_rotation(rows: Matrix) -> Matrix:
    """Return the rows of a rotation matrix.

    Raises:
        PydanticCustomError: if they are not a rotation within ``UNIT_TOLERANCE``.
    """
    pairs = [(i, j) for i in range(3) for j in range(i + 1)]
    worst = max(
        abs(sum(a * b for a, b in zip(rows[i], rows[j], strict=True)) - (i == j)) for i, j in pairs
    )
    if worst > UNIT_TOLERANCE:
        message = (
            f"the matrix is not a rotation: its rows are not orthonormal (off by {worst:.3g})"
        )
        raise invalid("TF403", message, "three rows; column i is the child's axis i in the parent")
    (a, b, c), (d, e, f), (g, h, i) = rows
    if a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0:
        advice = "frames are right-handed; one axis is flipped"
        raise invalid("TF403", "the matrix mirrors: its determinant is -1", advice)
    return rows


class AxisAngle(Spec):
    """A rotation about an axis, right-handed."""

    axis: Axis = key(..., "the axis of rotation, of any length", [0, 0, 1])
    angle: Angle = key(..., "the angle of rotation")


class LookAngles(Checked):
    """A direction, as angles from straight ahead."""

    EXCLUSIVE: ClassVar[tuple[frozenset[str], ...]] = (
        frozenset({"up", "down"}),
        frozenset({"left", "right"}),
    )

    up: Angle | None = key(None, "angle up")
    down: Angle | None = key(None, "angle down")
    left: Angle | None = key(None, "angle to the left")
    right: Angle | None = key(None, "angle to the right")
    roll: Angle = key(0.0, "roll about the viewing direction, right-handed")

    @property
    def rotation(self) -> Quaternion:
        """The rotation x, y, z, w: pitch is down − up, yaw is left − right (REP-103)."""
        return quat_from_rpy(
            self.roll,
            (self.down or 0.0) - (self.up or 0.0),
            (self.left or 0.0) - (self.right or 0.0),
        )


def _look_form(value: Any) -> str:
    return "[angles]" if isinstance(value, (dict, LookAngles)) else "[direction]"


Rpy = TypeAliasType("Rpy", Annotated[tuple[Angle, Angle, Angle], InARow(3, "[0, 15 deg, 0]")])
QuatXyzw = TypeAliasType(
    "QuatXyzw",
    Annotated[
        tuple[Number, Number, Number, Number],
        InARow(4, "[0, 0, 0, 1]"),
        AfterValidator(has_unit_length),
    ],
)
RotationMatrix = TypeAliasType(
    "RotationMatrix",
    Annotated[
        tuple[Numbers, Numbers, Numbers],
        InARow(3, "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]"),
        AfterValidator(is_rotation),
    ],
)
Look = TypeAliasType(
    "Look",
    Annotated[
        Annotated[Direction, Tag("[direction]")] | Annotated[LookAngles, Tag("[angles]")],
        Discriminator(_look_form),
    ],
)

ROTATIONS = frozenset({"rpy", "quat_xyzw", "axis_angle", "matrix", "look"})


class Rotated(Checked):
    """At most one rotation of the child in its parent."""

    EXCLUSIVE: ClassVar[tuple[frozenset[str], ...]] = (ROTATIONS,)

    rpy: Rpy | None = key(
        None,
        "roll, pitch and yaw about fixed axes; looking down is positive pitch",
        [0, "15 deg", 0],
    )
    quat_xyzw: QuatXyzw | None = key(
        None, "a unit quaternion in the order x, y, z, w", [0, 0, 0, 1]
    )
    axis_angle: AxisAngle | None = key(
        None, "a rotation about an axis, right-handed", {"axis": [0, 0, 1], "angle": "90 deg"}
    )
    matrix: RotationMatrix | None = key(
        None,
        "3×3 rows; column i is the child's axis i in the parent",
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    )
    look: Look | None = key(
        None,
        "where the x axis, or the lens of an optical frame, points: a direction, or angles "
        "from straight ahead",
        "down",
        {"down": "15 deg"},
    )

    @property
    def rotation(self) -> Quaternion | None:
        """The rotation as a unit quaternion x, y, z, w, None without a rotation."""
        if self.look is not None:
            return (
                self.look.rotation
                if isinstance(self.look, LookAngles)
                else quat_from_rpy(*DIRECTIONS[self.look])
            )
        if self.rpy is not None:
            return quat_from_rpy(*self.rpy)
        if self.quat_xyzw is not None:
            return normalise(self.quat_xyzw)
        if self.axis_angle is not None:
            return quat_from_axis_angle(self.axis_angle.axis, self.axis_angle.angle)
        return quat_from_matrix(self.matrix) if self.matrix is not None else None


class Posed(Rotated):
    """The pose of the child in its parent."""

    xyz: Xyz = key((0.0, 0.0, 0.0), "position: x forward, y left, z up", [0.2, 0, "30 cm"])


def _each_once(names: Texts) -> Texts:
    if not names:
        raise invalid("TF103", "an empty list names no parent", "name the parent frame")
    twice = next((index for index, name in enumerate(names) if name in names[:index]), None)
    if twice is not None:
        raise several(
            ((twice,), invalid("TF106", f"{names[twice]} is in the list already", "remove it"))
        )
    return names


#: A parent, or several possible parents, of which the first is nominal; always a tuple.
Parents = TypeAliasType("Parents", Annotated[OneOrMore, AfterValidator(_each_once)])


class EdgeKeys(Posed, Entry):
    """The keys that may stand wherever a parent is."""

    parent: Parents | None = key(
        None,
        "the parent frame; or a list of possible parents, as for a tool changer",
        "base_link",
    )
    relative_to: Text | None = key(
        None, "the frame in which the pose is given, if it is not the parent", "base_link"
    )
    owner: Text | None = key(None, "the process that publishes this edge", "base_drive")
    rate: Rate | None = key(None, "the rate at which the owner sends it", "50 Hz")
    static: Boolean | None = key(
        None, "true: the owner, not tfcompose, sends it on /tf_static", True
    )


#: Formats of calibration files, described in ``tfcompose.spec.language.calibration``.
CalibrationFormat = Literal[
    "autoware", "easy_handeye2", "moveit", "kalibr", "matrix", "transform_stamped"
]


class CalibrationLimit(Spec):
    """The largest deviation of a calibration from the nominal pose."""

    xyz: Length = key(0.05, "the largest distance", "5 cm")
    rot: Angle = key(math.radians(5), "the largest angle", "5 deg")


class Validity(Checked):
    """The days on which a calibration is valid, including the first and the last."""

    from_: Day | None = Field(
        None,
        alias="from",
        description="the first day; default: valid from the beginning",
        examples=["2026-03-01"],
    )
    to: Day | None = key(
        None,
        "the last day; default: still valid; build and up use only files without it",
        "2026-06-30",
    )

    @model_validator(mode="after")
    def _is_ordered(self) -> Self:
        if self.from_ and self.to and self.to < self.from_:
            message = f"the last day, {self.to}, is before the first, {self.from_}"
            raise invalid("TF106", message, "swap them")
        return self

    def has(self, day: date | None) -> bool:
        """Return whether the day is within the range.

        Without a day, whether the range has no end.
        """
        if day is None:
            return self.to is None
        return (self.from_ or day) <= day <= (self.to or day)


class CalibrationFileSpec(Spec):
    """A calibration file, and the days on which it is valid."""

    file: Text = key(..., "the file, relative to this file", "calibration/sensors.yaml")
    valid: Validity | None = key(
        None,
        "the days on which it is valid, in UTC; rebag and verify --bag take the calibrations of "
        "the recording's day",
        {"from": "2026-03-01", "to": "2026-06-30"},
    )

    def holds(self, day: date | None) -> bool:
        """Return whether the file is valid on the day.

        Without a day, whether it is still valid.
        """
        return self.valid is None or self.valid.has(day)


class CalibrationSpec(CalibrationFileSpec):
    """A measured pose, in a file. The pose in the robot file is the nominal one."""

    format: Literal["auto", CalibrationFormat] = key("auto", "the format of the file", "kalibr")
    parent: Text | None = key(
        None, "the parent in the calibration file; default: the parent of this frame", "tool0"
    )
    child: Text | None = key(
        None,
        "the child in the calibration file; default: this frame, or a frame of the sensor",
        "camera_link",
    )
    limit: CalibrationLimit = key(
        CalibrationLimit(),
        "the largest deviation from the nominal pose",
        {"xyz": "5 cm", "rot": "5 deg"},
    )


_Calibration = Annotated[CalibrationSpec, short("file", CalibrationSpec)]
#: A calibration, or several for different days.
Calibrations = TypeAliasType(
    "Calibrations",
    Annotated[
        tuple[_Calibration, ...],
        BeforeValidator(as_list, _Calibration | tuple[_Calibration, ...]),
    ],
)
_CalibrationFile = Annotated[CalibrationFileSpec, short("file", CalibrationFileSpec)]
CalibrationFiles = TypeAliasType(
    "CalibrationFiles",
    Annotated[
        tuple[_CalibrationFile, ...],
        BeforeValidator(as_list, _CalibrationFile | tuple[_CalibrationFile, ...]),
    ],
)


class MountKeys(EdgeKeys):
    """The keys of what is attached, and so can be measured."""

    calibration: Calibrations = key(
        (),
        "a file with the measured pose, or a list of files with the days on which each is valid;"
        " the pose in this entry is the nominal one; []: no file, also none under calibrations",
        "calibration/hand_eye.yaml",
    )
    joint: Text | None = key(
        None, "the name of the fixed joint in URDF; default: PARENT_to_CHILD", "camera_mount_joint"
    )

    #: Advice for a pose without a parent.
    NEEDS_PARENT: ClassVar[str] = "add the frame that it is in, parent: FRAME, or remove it"

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[Path, PydanticCustomError]]:
        """Also yield the first key of a pose without a parent, because it has no effect."""
        yield from super().check(data)
        name = next((name for name in data if name in _OF_A_POSE), None)
        if (
            name is not None
            and "parent" not in data
            and not cls.model_fields["parent"].is_required()
        ):
            message = f"{name} without a parent places nothing"
            yield (name,), invalid("TF102", message, cls.NEEDS_PARENT, on_key=True, keeps=True)


_OF_A_POSE = ROTATIONS | {"xyz", "relative_to", "calibration"}
