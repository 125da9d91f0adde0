"""Optics of a sensor's streams: values from the preset, overridden by the robot file."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.findings import did_you_mean, finding
from tfcompose.model.robot import Optics, OpticsSource
from tfcompose.spec.language.optics import OpticsSpec

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Sequence

    from tfcompose.compiler.resolve.draft import Finds
    from tfcompose.compiler.resolve.presets import Sensor
    from tfcompose.model.robot import OpticsKind
    from tfcompose.spec.language.optics import OpticsSourceSpec
    from tfcompose.spec.language.robot import RobotSpec

#: Keys that ``Optics`` has under the same name, without keys that this module computes.
_KEYS = tuple(
    field.name
    for field in fields(Optics)
    if field.name in OpticsSpec.model_fields and field.name not in {"frame", "kind"}
)
#: Default kinds of a sensor's streams.
_KINDS: dict[str, OpticsKind] = {
    "camera": "camera",
    "stereo": "camera",
    "rgbd": "camera",
    "lidar2d": "lidar",
    "lidar3d": "lidar",
    "radar": "radar",
    "ultrasonic": "ultrasonic",
}
#: Keys that replace other keys of the same stream. If the robot file sets such a key, the other
#: keys of the preset are ignored.
_REPLACES = {"elevations": ("channels", "vertical"), "channels": ("elevations",)}


def optics_of(
    sensor: Sensor, frames: Collection[str], renamed: Callable[[str], str], spec: RobotSpec
) -> Finds[tuple[Optics, ...]]:
    """Return the optics of the sensor's streams in ``frames``.

    ``frames`` are the sensor's frames, including its mount, before any renaming.
    """
    declared, preset = sensor.spec.optics, sensor.preset
    made = []
    for stream in dict.fromkeys((*preset.optics, *declared)):
        base, override = preset.optics.get(stream), declared.get(stream)
        path = ("sensors", sensor.name, "optics", stream)
        pattern = (override.frame if override else None) or (base.frame if base else None)
        if pattern is None:
            advice = f"frame: {sensor.fill_name(preset.mount)}; {sensor.spec.preset} has "
            advice += f"the streams {', '.join(preset.optics)}" if preset.optics else "no streams"
            yield finding(
                "TF102", f"the stream {stream} has no frame", spec.key_span(path), help=advice
            )
            continue
        frame = sensor.fill_name(pattern)
        if override and override.frame and frame not in frames:
            advice = did_you_mean(frame, frames, f"its frames: {', '.join(frames)}")
            span = spec.span_of((*path, "frame"))
            yield finding("TF203", f"{sensor.name} has no frame {frame}", span, help=advice)
            continue
        if frame not in frames or not (override or base is None or sensor.holds(base.when)):
            continue
        kind = (
            (override.kind if override else None)
            or (base.kind if base else None)
            or _KINDS.get(preset.kind)
        )
        if kind is None:
            advice = "kind: camera, lidar, radar or ultrasonic"
            message = f"{preset.kind} sees nothing: the stream {stream} has no kind"
            yield finding("TF102", message, spec.key_span(path), help=advice)
            continue
        span = spec.key_span(path) if override else spec.key_span(path[:2])
        values, sources = _merge_optics(base, override, str(spec.key_span(path)))
        values.setdefault("active", kind != "camera")
        made.append(Optics(stream, renamed(frame), kind, span, sources=tuple(sources), **values))
    return tuple(made)


def _merge_optics(
    base: OpticsSpec | None, override: OpticsSpec | None, where: str
) -> tuple[dict[str, Any], Iterable[OpticsSource]]:
    """Return the values of all keys that are set, and their sources."""
    values, declared = _values(base), _values(override)
    replaced = {
        *declared,
        *(replaced_key for key in declared for replaced_key in _REPLACES.get(key, ())),
    }
    values = {key: value for key, value in values.items() if key not in replaced} | declared
    elevations = values.get("elevations")
    if elevations:
        values.setdefault("channels", len(elevations))
        values.setdefault("vertical", (min(elevations), max(elevations)))
    sources = []
    for spec, outdated in ((base, replaced), (override, set[str]())):
        for source in _sources(spec):
            keys = tuple(key for key in source.of if key not in outdated)
            if keys:
                sources.append(OpticsSource(keys, source.where, source.quality))
    sourced = {key for source in _sources(override) for key in source.of}
    unsourced = tuple(key for key in declared if key not in sourced)
    if unsourced:
        sources.append(OpticsSource(unsourced, where, "robot file"))
    return values, sources


def _sources(spec: OpticsSpec | None) -> Sequence[OpticsSourceSpec]:
    return (spec.source if spec else None) or ()


def _values(spec: OpticsSpec | None) -> dict[str, Any]:
    values = {key: getattr(spec, key) for key in _KEYS} if spec else {}
    return {key: value for key, value in values.items() if value is not None}
