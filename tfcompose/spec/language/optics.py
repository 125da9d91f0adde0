"""Optics in the language: the streams of a sensor, in presets and robot files."""

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, Strict
from pydantic_core import PydanticCustomError

from tfcompose.foundation.units import (
    ANGLE,
    LENGTH,
    Angle,
    Length,
    Measure,
    Rate,
    Size,
    format_value,
    invalid,
)
from tfcompose.model.robot import OpticsKind, Projection, Shutter
from tfcompose.spec.language.spec import Checked, Spec, key
from tfcompose.spec.language.values import Boolean, InARow, Integral, Text
from tfcompose.spec.load import Path

_ANGLE, _LENGTH = Measure(ANGLE), Measure(LENGTH)


def _about_zero(value: Any) -> Any:
    """Return [from, to] for a full angle."""
    if isinstance(value, list):
        return value
    angle = _ANGLE.read(value)
    if angle < 0:
        raise invalid(
            "TF106", f"{format_value(value)} is less than 0", "give the whole angle, or [from, to]"
        )
    return [-angle / 2, angle / 2]


def _has_order(sector: tuple[float, float]) -> tuple[float, float]:
    start, end = sector
    if start > end:
        raise invalid(
            "TF106",
            "it ends before it begins",
            f"[{math.degrees(end):g} deg, {math.degrees(start):g} deg]",
        )
    if end - start > math.tau * (1 + 1e-9):
        message = f"{math.degrees(end - start):.5g} deg is more than a turn"
        raise invalid("TF106", message, f"if it is in degrees: {end - start:g} deg")
    return sector


def _is_angle(angle: float) -> float:
    if 0 < angle <= math.tau * (1 + 1e-9):
        return angle
    message = f"{math.degrees(angle):.5g} deg is not an angle of view"
    raise invalid("TF106", message, f"if it is in degrees: {angle:g} deg")


_FromTo = Annotated[tuple[Angle, Angle], InARow(2, "[-135 deg, 135 deg]")]
#: [from, to], or a full angle centred on the viewing direction.
AngleOfView = Annotated[
    _FromTo, AfterValidator(_has_order), BeforeValidator(_about_zero, Angle | _FromTo)
]
_Count = Annotated[int, Strict(), Field(ge=1, le=10_000_000), Integral]
Pixels = Annotated[tuple[_Count, _Count], InARow(2, "[1280, 720]")]


def _metres(value: Any) -> float | None:
    """Return the length in metres, None for an invalid value, which another check rejects."""
    try:
        return _LENGTH.read(value)
    except PydanticCustomError:
        return None


class OpticsSourceSpec(Spec):
    """A source of values."""

    of: tuple[Text, ...] = key(
        ..., "the keys with values from this source", ["horizontal", "vertical"]
    )
    where: Text = key(
        ..., "the document, or the repository and the commit", "data sheet of May 2020, table 4.3"
    )
    quality: Literal["vendor_file", "datasheet", "secondary", "derived"] = key(
        ...,
        "the vendor's file or data sheet; secondary: from a third party; derived: computed "
        "from other keys",
    )


class OpticsSpec(Checked):
    """The field of view of a stream. Keys that are left out are unknown."""

    frame: Text | None = key(
        None, "the frame of the stream, one of the sensor's frames", "{name}_depth_optical_frame"
    )
    kind: OpticsKind | None = key(
        None,
        "a camera looks along z of the frame, with x right and y down; others look along x, "
        "with z up; default: the kind of the sensor",
    )
    projection: Projection | None = key(
        None, "pinhole; or fisheye, where diagonal is the image circle"
    )
    backward: Boolean | None = key(None, "true: the camera looks along -z of its frame, with y up")
    horizontal: AngleOfView | None = key(
        None,
        "the full angle, or [from, to], positive to the left",
        "87 deg",
        ["-135 deg", "135 deg"],
    )
    vertical: AngleOfView | None = key(
        None,
        "the full angle, or [from, to], positive up; 0 for a 2D scanner",
        "58 deg",
        ["-25 deg", 0.26],
    )
    diagonal: Annotated[Angle, AfterValidator(_is_angle)] | None = key(
        None, "the full angle", "95 deg"
    )
    resolution: Pixels | None = key(None, "width and height of the image in pixels", [1280, 720])
    near: Length | None = key(
        None, "the smallest distance: along z for a camera, otherwise along the ray", 0.28
    )
    far: Size | None = key(None, "the largest distance, at the best reflectivity", 10)
    channels: _Count | None = key(None, "the number of beams, one above the other", 16)
    elevations: tuple[Angle, ...] | None = key(
        None, "the elevation of each channel, positive up", ["-15 deg", "15 deg"]
    )
    samples: _Count | None = key(None, "samples per scan or per revolution", 1081)
    rate: Rate | None = key(None, "the largest rate", "30 Hz")
    shutter: Shutter | None = key(None, "the type of a camera's shutter")
    baseline: Size | None = key(None, "the distance of the two imagers of a stereo camera", "5 cm")
    active: Boolean | None = key(
        None,
        "true: it emits light or sound, such as an infrared pattern; default: true except for "
        "cameras",
    )
    source: tuple[OpticsSourceSpec, ...] | None = key(
        None,
        "sources of the values",
        [{"of": ["near"], "where": "measured", "quality": "secondary"}],
    )

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[Path, PydanticCustomError]]:
        """Also yield values that contradict each other."""
        yield from super().check(data)
        elevations, channels = data.get("elevations"), data.get("channels")
        if (
            isinstance(elevations, list)
            and isinstance(channels, int)
            and len(elevations) != channels
        ):
            message = f"{len(elevations)} elevations, and {channels} channels"
            yield (
                ("elevations",),
                invalid("TF106", message, "give one for each, or leave channels out", keeps=True),
            )
        near, far = _metres(data.get("near")), _metres(data.get("far"))
        if near is not None and far is not None and near >= far:
            message = f"near {near:g} m is not less than far {far:g} m"
            yield ("near",), invalid("TF106", message, "swap the two", keeps=True)
