"""Edges from the robot file: frames, links with a parent, joints and parts, with their owners.

The draft also keeps the numbers of poses and limits as the user wrote them, because rules about
units and typing errors need the original numbers. After conversion to a unit quaternion, 90, 1.57
and 90 deg look the same.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.bodies import Bodies
from tfcompose.compiler.resolve.poses import place_of, pose_of
from tfcompose.foundation.findings import Edit, Finding, Note, Span, finding
from tfcompose.foundation.geometry import norm
from tfcompose.foundation.units import WithUnit, quantity
from tfcompose.model.robot import (
    FREE,
    JOINTS,
    MOVING,
    STATIC,
    Edge,
    Joint,
    Limit,
    SourceNumbers,
    is_optical,
)
from tfcompose.spec.language.robot import JointSpec, JointZeroSpec
from tfcompose.spec.language.spec import Spec

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.resolve.draft import Draft, Finds
    from tfcompose.model.plan import EdgeKind
    from tfcompose.spec.language.pose import EdgeKeys
    from tfcompose.spec.language.robot import RobotSpec
    from tfcompose.spec.load import Path, Spans


def add_frames(draft: Draft) -> Iterator[Finding]:
    """Add the entries of ``frames`` to the draft. An entry without a parent declares a root."""
    for name, frame in draft.spec.frames.items():
        path = ("frames", name)
        draft.frames.setdefault(name, draft.spec.key_span(path))
        yield from add_edge(draft, path, name, frame, joint_name=frame.joint)


def add_links(draft: Draft) -> Iterator[Finding]:
    """Add the bodies to the draft. A body with a parent also adds a fixed edge."""
    bodies = Bodies(draft.spec, draft.packages)
    for name, link in draft.spec.links.items():
        path = ("links", name)
        draft.frames.setdefault(name, draft.spec.key_span(path))
        draft.links[name] = bodies.link(name, link)
        yield from add_edge(draft, path, name, link, joint_name=link.joint)
    yield from bodies.findings


def add_joints(draft: Draft) -> Iterator[Finding]:
    """Add the joints' edges to the draft."""
    for name, joint in draft.spec.joints.items():
        if isinstance(joint, JointZeroSpec):
            continue
        yield from _idle_joint_keys(name, joint, draft.spec)
        yield from add_edge(draft, ("joints", name), joint.child, joint, joint_name=name)


def add_edge(  # noqa: PLR0913 (an edge has that many parts)
    draft: Draft,
    path: Path,
    child: str,
    keys: EdgeKeys,
    *,
    joint_name: str | None,
    sensor: str | None = None,
    owner: str | None = None,
) -> Iterator[Finding]:
    """Add the edge of an entry to the draft; for a sensor or a part, the edge of its mount.

    An entry without a parent adds no edge.
    """
    spec = draft.spec
    if keys.parent is None:
        return
    joint = _joint_of(path, keys, spec) if isinstance(keys, JointSpec) else None
    free = joint if joint and joint.type in FREE else None
    joint = None if free else joint
    joint_at = yield from add_joint_name(draft, joint_name, path)
    owner = owner or keys.owner or (JOINTS if joint else STATIC)
    is_simulated = keys.static and any(
        process.name == owner and process.kind == "simulate" for process in draft.all_processes
    )
    kind: EdgeKind = "dynamic"
    if owner == STATIC or (keys.static and not is_simulated):
        kind = "static"
    if joint and owner == JOINTS:
        kind = "joint"
    draft.keys[len(draft.edges)] = keys
    edge = Edge(
        parent=keys.parent[0],
        child=child,
        kind=kind,
        pose=pose_of(keys, place_of(keys) or child),
        owner=owner,
        span=spec.span_of((*path, "parent")),
        rate=keys.rate,
        joint=joint,
        free=free,
        joint_name=joint_name or "",
        joint_at=joint_at,
        xyz_at=spec.spans.exact_span((*path, "xyz")),
        child_at=spec.span_of((*path, "child")) if path[0] == "joints" else None,
        entry=path,
        owner_at=spec.span_of((*path, "owner")) if keys.owner else None,
        sensor=sensor,
        rate_at=spec.span_of((*path, "rate")) if keys.rate else None,
        switched=keys.parent[1:],
        optical_edits=partial(optical_edits, path, keys, spec.spans)
        if is_optical(child)
        else tuple,
    )
    draft.edges.append(edge)


def add_joint_name(draft: Draft, name: str | None, path: Path) -> Finds[Span | None]:
    """Add the joint name of an entry, which is the entry's name or its key ``joint``.

    Return the span of the name, None without a name.
    """
    if not name:
        return None
    spec = draft.spec
    span = spec.key_span(path) if path[0] == "joints" else spec.span_of((*path, "joint"))
    if name in draft.joints:
        notes = [Note("the other one", draft.joints[name])]
        message = f"two joints are called {name}"
        yield finding("TF502", message, span, notes=notes, help="rename one")
    draft.joints.setdefault(name, span)
    return span


_MOVING = "revolute, continuous or prismatic"
#: Keys that describe a motion, by the types of joints that do not use these keys.
_IDLE = {
    "fixed": ("axis", "limit", "mimic", "dynamics", "safety_controller", "calibration"),
    "floating": ("axis", "limit", "mimic", "dynamics", "safety_controller", "calibration"),
    "planar": ("mimic",),
}


def _joint_of(path: Path, declared: JointSpec, spec: RobotSpec) -> Joint | None:
    """Return the joint with a unit axis, None for a fixed joint."""
    kind: Any = declared.type
    if kind == "fixed":
        return None
    length = norm(declared.axis)
    x, y, z = declared.axis
    mimic = declared.mimic
    return Joint(
        name=str(path[1]),
        type=kind,
        span=spec.key_span(path),
        mimic_at=spec.spans.exact_span((*path, "mimic", "joint")),
        axis=(x / length, y / length, z / length),
        limit=declared.limit,
        limit_at=spec.spans.exact_span((*path, "limit")),
        mimic=mimic.joint if mimic else None,
        multiplier=mimic.multiplier if mimic else 1.0,
        offset=mimic.offset if mimic else 0.0,
        axis_length=length,
        axis_at=spec.spans.exact_span((*path, "axis")),
        dynamics=declared.dynamics,
        safety=declared.safety_controller,
        reference=declared.calibration,
    )


def _idle_joint_keys(name: str, joint: JointSpec, spec: RobotSpec) -> Iterator[Finding]:
    """Yield a finding for each key of a joint that joints of its type do not use."""
    path: Path = ("joints", name)
    if "offset" in joint.model_fields_set and joint.type not in MOVING:
        message = f"the joint {name} is {joint.type}, and has no zero that an offset could correct"
        advice = f"correct its mount instead: xyz and rpy, or tfcompose nudge {joint.child}"
        if joint.type in FREE:
            advice = f"correct the pose in {joint.owner or 'the process that publishes it'}"
        yield finding("TF739", message, spec.key_span((*path, "offset")), help=advice)
    unused = joint.model_fields_set & {*_IDLE.get(joint.type, ())}
    advice = (
        "leave it out" if joint.type in FREE else f"leave it out; if {name} moves, type: {_MOVING}"
    )
    if joint.type == "continuous" and joint.limit:
        path = (*path, "limit")
        unused = {key for key in ("lower", "upper") if getattr(joint.limit, key) is not None}
        advice = "leave it out; if there is an end, type: revolute"
    idle = sorted(unused, key=lambda key: spec.key_span((*path, key)))
    if idle:
        message = (
            f"the joint {name} is {joint.type}: {', '.join(idle)} {'have' if idle[1:] else 'has'}"
            " no effect"
        )
        yield finding("TF727", message, spec.key_span((*path, idle[0])), help=advice)


_SECTIONS = ("frames", "links", "joints", "sensors", "parts", "processes")
_LISTS = frozenset({"xyz", "rpy", "quat_xyzw"})
_MAPPINGS = {
    "axis_angle": ("angle",),
    "look": ("up", "down", "left", "right", "roll"),
    "limit": ("lower", "upper", "velocity"),
}


def source_numbers(spec: RobotSpec) -> tuple[SourceNumbers, ...]:
    """Return the numbers of all poses and joint limits in the file."""
    return tuple(
        span
        for section in _SECTIONS
        for name, entry in getattr(spec, section).items()
        for span in _of(entry, (section, name), spec.spans)
    )


def _of(entry: Spec, path: Path, spans: Spans) -> Iterator[SourceNumbers]:
    for key in entry.model_fields_set:
        value, here = getattr(entry, key), (*path, key)
        if key in _LISTS and value is not None:
            yield _numbers(dict(enumerate(value)), here, spans)
        elif key in _MAPPINGS and isinstance(value, (Spec, Limit)):
            steps = {
                step: getattr(value, step) for step in _MAPPINGS[key] if spans.has((*here, step))
            }
            numbers = {step: number for step, number in steps.items() if number is not None}
            if numbers:
                yield _numbers(numbers, here, spans)
        elif key == "offset" and isinstance(entry, JointSpec):
            yield _numbers({key: value}, here, spans)
        elif isinstance(value, Spec):
            yield from _of(value, here, spans)
        elif isinstance(value, (tuple, dict)) and key != "params":
            yield from _inside(value, here, spans)


def _inside(value: Any, path: Path, spans: Spans) -> Iterator[SourceNumbers]:
    """Yield the numbers in a list or mapping. A list may be written as its only item."""
    for step, item in value.items() if isinstance(value, dict) else enumerate(value):
        if isinstance(item, Spec):
            here = (*path, step)
            yield from _of(item, here if spans.has(here) else path, spans)


def _numbers(numbers: dict[Any, float], path: Path, spans: Spans) -> SourceNumbers:
    steps = list(numbers)
    values = tuple(numbers.values())
    with_unit = tuple(isinstance(value, WithUnit) for value in values)
    return SourceNumbers(
        path,
        tuple(map(float, values)),
        with_unit,
        lambda index: spans.span_of((*path, steps[index])),
        steps=tuple(steps),
    )


# Edits of the robot file that give an entry the optical rotation of REP-103. The edits keep the
# form in which the file states the rotation.

_OPTICAL: dict[str, Any] = {
    "rpy": ["-90 deg", "0", "-90 deg"],
    "quat_xyzw": ["-0.5", "0.5", "-0.5", "0.5"],
    "matrix": [["0", "0", "1"], ["-1", "0", "0"], ["0", "-1", "0"]],
    "axis_angle": {"axis": ["-1", "1", "-1"], "angle": "120 deg"},
    "look": "forward",
}
_RPY = "rpy: [-90 deg, 0, -90 deg]"

#: Keys with which the pose in the file is not the pose of the frame in its parent.
_OTHER_POSES = ("relative_to", "place", "calibration")
_OPTICAL_IN = ("frames", "links", "joints")


def optical_edits(path: Path, keys: EdgeKeys, spans: Spans) -> tuple[Edit, ...]:
    """Return edits that give the frame of the entry at ``path`` an optical rotation.

    Empty if the edits would also move other frames.
    """
    if (
        path[0] not in _OPTICAL_IN
        or spans.span_of(path).file != spans.span_of((*path, "parent")).file
    ):
        return ()
    rotations = [key for key in _OPTICAL if spans.has_key((*path, key))]
    if len(rotations) > 1 or any(spans.has_key((*path, key)) for key in _OTHER_POSES):
        return ()
    if rotations:
        key = rotations[0]
        edits = _replacement_edits(getattr(keys, key), _OPTICAL[key], (*path, key), spans)
    else:
        edits = [_insertion(path, spans)]
    edited = [spans.span_of((*path, "parent")), *(edit.span for edit in edits)]
    return tuple(edits) if all(_is_alone(span, path, spans) for span in edited) else ()


def _insertion(path: Path, spans: Spans) -> Edit:
    """Return the edit that inserts the rotation after the parent."""
    parent, entry = spans.span_of((*path, "parent")), spans.places.nearest(path)
    first = min(
        (key.span for key in entry.keys.values()), key=lambda span: (span.line, span.column)
    )
    if (entry.span.line, entry.span.column) < (first.line, first.column):  # in braces
        position = (parent.end_line, parent.end_column)
        return Edit(Span(parent.file, *position, *position), f", {_RPY}")
    position = (parent.end_line + 1, 1)
    indent = " " * (spans.key_span((*path, "parent")).column - 1)
    return Edit(Span(parent.file, *position, *position), f"{indent}{_RPY}\n")


def _replacement_edits(old: Any, new: Any, path: Path, spans: Spans) -> list[Edit]:
    """Return the edits that replace each scalar of ``old`` by its counterpart in ``new``.

    Empty if ``old`` and ``new`` have different structures.
    """
    if isinstance(new, dict):
        return [
            edit
            for key, item in new.items()
            for edit in _replacement_edits(getattr(old, key, None), item, (*path, key), spans)
        ]
    if isinstance(new, list):
        pairs = zip(old, new, strict=True) if isinstance(old, tuple) else ()
        return [
            edit
            for index, pair in enumerate(pairs)
            for edit in _replacement_edits(*pair, (*path, index), spans)
        ]
    is_same = old == (new if isinstance(old, str) else quantity(new).value)
    return (
        [Edit(spans.span_of(path), new)] if isinstance(old, (str, float)) and not is_same else []
    )


def _is_alone(span: Span, path: Path, spans: Spans) -> bool:
    """Return whether the text at the span belongs only to this entry, not to an alias."""
    aliases = (
        alias_path
        for alias_path, location in spans.places.walk()
        if alias_path[: len(path)] != path and location.span == span
    )
    return next(aliases, None) is None
