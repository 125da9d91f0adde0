"""Edges as the user gave them: frames, links with a parent, joints and parts; each with its owner.

The numbers of poses and limits are kept as they were written too: a pose keeps a unit quaternion,
and forgets whether 90, 1.57 or 90 deg was written. The rules about units and slips of the pen need
to know.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.poses import Draft, pose_of
from tfcompose.foundation.findings import Edit, Finding, Note, Span, finding
from tfcompose.foundation.geometry import norm
from tfcompose.foundation.units import WithUnit, quantity
from tfcompose.model.robot import (
    FREE,
    JOINTS,
    STATIC,
    Edge,
    Joint,
    Limit,
    Link,
    MountedSensor,
    Process,
    SourceNumbers,
    is_optical,
)
from tfcompose.spec.language.spec import Spec

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.compiler.resolve.bodies import Bodies
    from tfcompose.compiler.resolve.part import Joined
    from tfcompose.compiler.resolve.presets import Sensor
    from tfcompose.model.plan import EdgeKind
    from tfcompose.spec.language import Validated
    from tfcompose.spec.language.pose import EdgeKeys
    from tfcompose.spec.language.robot import JointSpec, RobotSpec
    from tfcompose.spec.load import Path, Spans


@dataclass(slots=True)
class Drafts:
    """What is known of a robot while it is resolved."""

    validated: Validated
    simulated: frozenset[str]
    bodies: Bodies
    frames: dict[str, Span] = field(default_factory=dict)
    joints: dict[str, Span] = field(default_factory=dict)
    edges: list[Draft] = field(default_factory=list)
    links: dict[str, Link] = field(default_factory=dict)
    drivers: list[Process] = field(default_factory=list)
    sensors: list[MountedSensor] = field(default_factory=list)
    found: list[Finding] = field(default_factory=list)

    @property
    def spec(self) -> RobotSpec:
        """What the user wrote."""
        return self.validated.spec

    def add_frames(self) -> None:
        """Take the bare frames; one without a parent is a root, said so."""
        for name, frame in self.spec.frames.items():
            self.frames.setdefault(name, self.spec.at_key(("frames", name)))
            if frame.parent is not None:
                self.add(("frames", name), frame.parent, name, frame, joint_name=frame.joint)

    def add_links(self) -> None:
        """Take the bodies; one with a parent has a fixed edge."""
        for name, link in self.spec.links.items():
            at = self.spec.at_key(("links", name))
            self.frames.setdefault(name, at)
            self.links[name] = self.bodies.link(name, link)
            if link.parent is not None:
                self.add(("links", name), link.parent, name, link, joint_name=link.joint)

    def add_joints(self) -> None:
        """Take the edges between bodies."""
        for name, joint in self.spec.joints.items():
            moving = joint_of(name, joint, self.spec)
            self.found += idle_joint_keys(name, joint, self.spec)
            self.add(
                ("joints", name), joint.parent, joint.child, joint, joint=moving, joint_name=name
            )

    def add_part(self, part: Joined) -> bool:
        """Take a part: its frames, edges and bodies under their new names, and its mount edge.

        Return False, and take nothing, if it brings names that are there already.
        """
        robot, at = part.robot, ("parts", part.name)
        hanging = {edge.child for edge in robot.edges}
        free = part.shared | (
            self.spec.frames.keys() - hanging
        )  # a free root can have its edge here
        taken = [name for name in robot.frames if name in self.frames and name not in free]
        named = [edge for edge in robot.edges if edge.joint_name and not part.declared.is_alone]
        joints = {edge.joint_name: edge.joint_at or edge.at for edge in named}
        taken_joints = [name for name in joints if name in self.joints]
        if taken:
            self._refuse_names(taken, part)
        elif taken_joints:
            self._refuse("joint", taken_joints, self.joints, joints, part)
        if taken or taken_joints:
            return False
        self.joints |= joints
        for name, place in robot.frames.items():
            self.frames.setdefault(name, place)
        for name, link in robot.links.items():
            self.links.setdefault(name, link)
        keys = part.declared
        if keys.parent is not None and part.root is not None:
            switched = len(keys.parent) > 1  # then the part's owner is who carries it about
            owner = keys.owner if switched else STATIC
            self.add(
                at,
                keys.parent,
                part.root,
                keys,
                joint_name=keys.joint,
                owner=owner,
                part=part.name,
            )
        self.edges += [
            Draft(replace(edge, entry=(*at, *edge.entry)), part=part.name) for edge in robot.edges
        ]
        self.sensors += robot.sensors
        return True

    def _refuse_names(self, taken: list[str], part: Joined) -> None:
        first = taken[0]
        more = f"; or ros: {{shared_frames: [{first}]}}"
        root = (
            not part.declared.prefix
            and len(taken) == 1
            and first != part.root
            and part.declared.root is None
        )
        before = f"root: {first}, if the part begins there; or " if root else ""
        self._refuse("frame", taken, self.frames, part.robot.frames, part, (before, more))

    def _refuse(  # noqa: PLR0913, PLR0917 (what is taken, where, by whom, and what else could be done)
        self,
        kind: str,
        taken: list[str],
        there: Mapping[str, Span],
        brought: Mapping[str, Span],
        part: Joined,
        else_: tuple[str, str] = ("", ""),
    ) -> None:
        first, more = taken[0], f" and {len(taken) - 1} more" if taken[1:] else ""
        notes = [Note(f"{first} is defined here", there[first]), Note("and here", brought[first])]
        advice = f"{else_[0]}a prefix of its own, prefix: {part.name}/{else_[1]}"
        message = f"the part {part.name} brings the {kind} {first}{more}, which already exists"
        place = self.spec.at_key(("parts", part.name))
        self.found.append(finding("TF505", message, place, notes=notes, help=advice))

    def add(  # noqa: PLR0913 (an edge has that many parts)
        self,
        at: Path,
        parents: tuple[str, ...],
        child: str,
        keys: EdgeKeys,
        *,
        joint: Joint | None = None,
        joint_name: str | None = None,
        sensor: Sensor | None = None,
        owner: str | None = None,
        part: str | None = None,
    ) -> None:
        """Take the edge that is written at a place; a sensor's and a part's is its mount."""
        named_at = self.named_joint(joint_name, at) if joint_name else None
        free = joint if joint and joint.type in FREE else None
        joint = None if free else joint
        owner = owner or keys.owner or (JOINTS if joint else STATIC)
        place: str | None = getattr(keys, "place", None)
        edge = Edge(
            parent=parents[0],
            child=child,
            kind=self._kind(owner, keys, joint),
            pose=pose_of(keys, place or child),
            owner=owner,
            at=self.spec.at((*at, "parent")),
            rate=keys.rate,
            joint=joint,
            free=free,
            joint_name=joint_name or "",
            joint_at=named_at,
            child_at=self.spec.at((*at, "child")) if at[0] == "joints" else None,
            entry=at,
            owner_at=self.spec.at((*at, "owner")) if keys.owner else None,
            sensor=sensor.name if sensor else None,
            rate_at=self.spec.at((*at, "rate")) if keys.rate else None,
            switched=parents[1:],
            optical_edits=(
                partial(optical_edits, at, keys, self.spec.spans) if is_optical(child) else tuple
            ),
        )
        relative_at = self.spec.at((*at, "relative_to")) if keys.relative_to else None
        place_at = self.spec.at((*at, "place")) if place else None
        self.edges.append(
            Draft(
                edge,
                keys.relative_to,
                relative_at,
                place=place,
                place_at=place_at,
                at=at,
                part=part,
            )
        )

    def named_joint(self, name: str, at: Path) -> Span:
        """Take the name of the joint that an entry is, or whose key ``joint`` it is.

        Return its place.
        """
        place = self.spec.at_key(at) if at[0] == "joints" else self.spec.at((*at, "joint"))
        if name in self.joints:
            notes = [Note("the other one", self.joints[name])]
            self.found.append(
                finding(
                    "TF502", f"two joints are called {name}", place, notes=notes, help="rename one"
                )
            )
        self.joints.setdefault(name, place)
        return place

    def _kind(self, owner: str, keys: EdgeKeys, joint: Joint | None) -> EdgeKind:
        if owner == STATIC:
            return "static"
        if joint and owner == JOINTS:
            return "joint"
        return "static" if keys.static and owner not in self.simulated else "dynamic"


_MOVING = "revolute, continuous or prismatic"
#: What is said of a joint's motion, by types of joints of which it says nothing.
_IDLE = {
    "fixed": ("axis", "limit", "mimic", "dynamics", "safety_controller", "calibration"),
    "floating": ("axis", "limit", "mimic", "dynamics", "safety_controller", "calibration"),
    "planar": ("mimic",),
}


def joint_of(name: str, declared: JointSpec, spec: RobotSpec) -> Joint | None:
    """Return the joint with a unit axis, or None where it is fixed."""
    kind: Any = declared.type
    if kind == "fixed":
        return None
    length = norm(declared.axis)
    x, y, z = declared.axis
    mimic = declared.mimic
    return Joint(
        name=name,
        type=kind,
        at=spec.at_key(("joints", name)),
        mimic_at=spec.spans.exactly_at(("joints", name, "mimic", "joint")),
        axis=(x / length, y / length, z / length),
        limit=declared.limit,
        mimic=mimic.joint if mimic else None,
        multiplier=mimic.multiplier if mimic else 1.0,
        offset=mimic.offset if mimic else 0.0,
        axis_length=length,
        dynamics=declared.dynamics,
        safety=declared.safety_controller,
        reference=declared.calibration,
    )


def idle_joint_keys(name: str, joint: JointSpec, spec: RobotSpec) -> Iterator[Finding]:
    """Yield a finding where a joint has keys that joints of its type do not use."""
    at: Path = ("joints", name)
    unused = joint.model_fields_set & {*_IDLE.get(joint.type, ())}
    advice = (
        "leave it out" if joint.type in FREE else f"leave it out; if {name} moves, type: {_MOVING}"
    )
    if joint.type == "continuous" and joint.limit:
        at = (*at, "limit")
        unused = {key for key in ("lower", "upper") if getattr(joint.limit, key) is not None}
        advice = "leave it out; if there is an end, type: revolute"
    idle = sorted(unused, key=lambda key: spec.at_key((*at, key)))
    if idle:
        message = (
            f"the joint {name} is {joint.type}: {', '.join(idle)} {'have' if idle[1:] else 'has'}"
            " no effect"
        )
        yield finding("TF727", message, spec.at_key((*at, idle[0])), help=advice)


_SECTIONS = ("frames", "links", "joints", "sensors", "parts", "processes")
_LISTS = frozenset({"xyz", "rpy", "quat_xyzw"})
_MAPPINGS = {
    "axis_angle": ("angle",),
    "look": ("up", "down", "left", "right", "roll"),
    "limit": ("lower", "upper"),
}


def source_numbers(spec: RobotSpec) -> tuple[SourceNumbers, ...]:
    """Return the numbers of every pose and joint limit of the spec."""
    return tuple(
        found
        for section in _SECTIONS
        for name, entry in getattr(spec, section).items()
        for found in _of(entry, (section, name), spec.spans)
    )


def _of(entry: Spec, path: Path, spans: Spans) -> Iterator[SourceNumbers]:
    for key in entry.model_fields_set:
        value, here = getattr(entry, key), (*path, key)
        if key in _LISTS and value is not None:
            yield _numbers(dict(enumerate(value)), here, spans)
        elif key in _MAPPINGS and isinstance(value, (Spec, Limit)):
            given = {
                step: getattr(value, step) for step in _MAPPINGS[key] if spans.has((*here, step))
            }
            numbers = {step: number for step, number in given.items() if number is not None}
            if numbers:
                yield _numbers(numbers, here, spans)
        elif isinstance(value, Spec):
            yield from _of(value, here, spans)
        elif isinstance(value, (tuple, dict)) and key != "params":
            yield from _inside(value, here, spans)


def _inside(value: Any, path: Path, spans: Spans) -> Iterator[SourceNumbers]:
    """Yield the numbers in a list or mapping; one item may stand for a list of it."""
    for step, item in value.items() if isinstance(value, dict) else enumerate(value):
        if isinstance(item, Spec):
            here = (*path, step)
            yield from _of(item, here if spans.has(here) else path, spans)


def _numbers(numbers: dict[Any, float], path: Path, spans: Spans) -> SourceNumbers:
    steps = list(numbers)
    values = tuple(numbers.values())
    with_unit = tuple(isinstance(value, WithUnit) for value in values)
    return SourceNumbers(
        path, tuple(map(float, values)), with_unit, lambda index: spans.at((*path, steps[index]))
    )


# Edits of the file that give an entry the optical rotation of REP-103, in whichever way a rotation
# is written.

_OPTICAL: dict[str, Any] = {
    "rpy": ["-90 deg", "0", "-90 deg"],
    "quat_xyzw": ["-0.5", "0.5", "-0.5", "0.5"],
    "matrix": [["0", "0", "1"], ["-1", "0", "0"], ["0", "-1", "0"]],
    "axis_angle": {"axis": ["-1", "1", "-1"], "angle": "120 deg"},
    "look": "forward",
}
_RPY = "rpy: [-90 deg, 0, -90 deg]"

#: With these the written pose is not that of the frame in its parent.
_OTHER_POSES = ("relative_to", "place", "calibration")
_OPTICAL_IN = ("frames", "links", "joints")


def optical_edits(path: Path, keys: EdgeKeys, spans: Spans) -> tuple[Edit, ...]:
    """Return edits that rotate the frame of the entry at ``path``, none if others would move."""
    if path[0] not in _OPTICAL_IN or spans.at(path).file != spans.at((*path, "parent")).file:
        return ()
    rotations = [key for key in _OPTICAL if spans.has_key((*path, key))]
    if len(rotations) > 1 or any(spans.has_key((*path, key)) for key in _OTHER_POSES):
        return ()
    if rotations:
        key = rotations[0]
        edits = _replaced(getattr(keys, key), _OPTICAL[key], (*path, key), spans)
    else:
        edits = [_insertion(path, spans)]
    edited = [spans.at((*path, "parent")), *(edit.span for edit in edits)]
    return tuple(edits) if all(_is_alone(span, path, spans) for span in edited) else ()


def _insertion(path: Path, spans: Spans) -> Edit:
    """Return the edit that writes the rotation after the parent."""
    parent, entry = spans.at((*path, "parent")), spans.places.nearest(path)
    first = min(
        (key.span for key in entry.keys.values()), key=lambda span: (span.line, span.column)
    )
    if (entry.span.line, entry.span.column) < (first.line, first.column):  # in braces
        at = (parent.end_line, parent.end_column)
        return Edit(Span(parent.file, *at, *at), f", {_RPY}")
    at = (parent.end_line + 1, 1)
    indent = " " * (spans.at_key((*path, "parent")).column - 1)
    return Edit(Span(parent.file, *at, *at), f"{indent}{_RPY}\n")


def _replaced(old: Any, new: Any, path: Path, spans: Spans) -> list[Edit]:
    """Return the edits that put each scalar of ``new`` in the place of that of ``old``.

    None where the forms differ.
    """
    if isinstance(new, dict):
        return [
            edit
            for key, item in new.items()
            for edit in _replaced(getattr(old, key, None), item, (*path, key), spans)
        ]
    if isinstance(new, list):
        pairs = zip(old, new, strict=True) if isinstance(old, tuple) else ()
        return [
            edit
            for index, pair in enumerate(pairs)
            for edit in _replaced(*pair, (*path, index), spans)
        ]
    is_same = old == (new if isinstance(old, str) else quantity(new).value)
    return [Edit(spans.at(path), new)] if isinstance(old, (str, float)) and not is_same else []


def _is_alone(span: Span, path: Path, spans: Spans) -> bool:
    """Whether what is at the span belongs to this entry alone, and to no alias of it."""
    others = (
        other
        for other, place in spans.places.walk()
        if other[: len(path)] != path and place.span == span
    )
    return next(others, None) is None
