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
    invalid,
    shown,
)
from tfcompose.model.robot import OpticsKind, Projection, Shutter
from tfcompose.spec.language.spec import Checked, Spec, key
from tfcompose.spec.language.values import Boolean, InARow, Integral, Text
from tfcompose.spec.load import Path

_ANGLE, _LENGTH = Measure(ANGLE), Measure(LENGTH)


def _about_zero(value: Any) -> Any:
    """Return [from, to] for a whole angle."""
    if isinstance(value, list):
        return value
    angle = _ANGLE.read(value)
    if angle < 0:
        raise invalid(
            "TF106", f"{shown(value)} is less than 0", "give the whole angle, or [from, to]"
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
#: [from, to], or a whole angle with its middle where the stream looks.
AngleOfView = Annotated[
    _FromTo, AfterValidator(_has_order), BeforeValidator(_about_zero, Angle | _FromTo)
]
_Count = Annotated[int, Strict(), Field(ge=1, le=10_000_000), Integral]
Pixels = Annotated[tuple[_Count, _Count], InARow(2, "[1280, 720]")]


def _metres(value: Any) -> float | None:
    """Return the length, or None for what is none: that is refused for itself."""
    try:
        return _LENGTH.read(value)
    except PydanticCustomError:
        return None


class OpticsSourceSpec(Spec):
    """Where values are from."""

    of: tuple[Text, ...] = key(..., "the keys that it gives", ["horizontal", "vertical"])
    where: Text = key(
        ..., "the document, or the repository and the commit", "data sheet of May 2020, table 4.3"
    )
    quality: Literal["vendor_file", "datasheet", "secondary", "derived"] = key(
        ...,
        "the vendor's own file or data sheet; secondary: others about it; derived: computed from"
        " other keys",
    )


class OpticsSpec(Checked):
    """What one stream sees. What is left out is not known."""

    frame: Text | None = key(
        None, "the frame that it is in, of those of the sensor", "{name}_depth_optical_frame"
    )
    kind: OpticsKind | None = key(
        None,
        "a camera looks along z of the frame, x right, y down; the others along x, z up; default:"
        " as the sensor",
    )
    projection: Projection | None = key(
        None, "pinhole, or fisheye, of which diagonal is the image circle"
    )
    backward: Boolean | None = key(None, "true: the camera looks along -z of its frame, with y up")
    horizontal: AngleOfView | None = key(
        None,
        "the whole angle, or [from, to], to the left positive",
        "87 deg",
        ["-135 deg", "135 deg"],
    )
    vertical: AngleOfView | None = key(
        None,
        "the whole angle, or [from, to], up positive; 0 for a scanner in one plane",
        "58 deg",
        ["-25 deg", 0.26],
    )
    diagonal: Annotated[Angle, AfterValidator(_is_angle)] | None = key(
        None, "the whole angle", "95 deg"
    )
    resolution: Pixels | None = key(None, "width and height of the image in pixels", [1280, 720])
    near: Length | None = key(
        None, "the least distance: along z for a camera, else along the ray", 0.28
    )
    far: Size | None = key(None, "the largest distance, at the best reflectivity", 10)
    channels: _Count | None = key(None, "how many beams one above the other", 16)
    elevations: tuple[Angle, ...] | None = key(
        None, "that of each channel, up positive", ["-15 deg", "15 deg"]
    )
    samples: _Count | None = key(None, "how many there are in one scan or one turn", 1081)
    rate: Rate | None = key(None, "the largest rate", "30 Hz")
    shutter: Shutter | None = key(None, "of a camera")
    baseline: Size | None = key(
        None, "how far apart the two imagers are that depth is computed from", "5 cm"
    )
    active: Boolean | None = key(
        None,
        "true: it sends light or sound, such as an infrared pattern; default: all but cameras do",
    )
    source: tuple[OpticsSourceSpec, ...] | None = key(
        None,
        "where values are from",
        [{"of": ["near"], "where": "measured", "quality": "secondary"}],
    )

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[Path, PydanticCustomError]]:
        """Yield also what cannot be true together."""
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
