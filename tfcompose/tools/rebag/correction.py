"""Correction of recorded TF with the fixed edges of a robot file.

A fixed edge of the robot file replaces the recorded edge. A frame inside a sensor is an exception,
if the robot file contains only the vendor's nominal pose. The recorded pose of such a frame stays,
because it comes from the calibration of the device. The nominal pose is added only if the bag
contains no pose.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal, NamedTuple

from tfcompose.foundation.geometry import Offset, Pose, offset_of
from tfcompose.model.plan.topics import parts_of
from tfcompose.tf.ros.tf_codec import Decoder, SentTransform, decode, encode, plain_name

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from tfcompose.model.plan import Plan, PlanEdge
    from tfcompose.model.plan.topics import Topics

#: The kind of change of an edge.
ChangeKind = Literal["moved", "equal", "parent", "added", "removed from /tf", "dropped"]


class EdgeChange(NamedTuple):
    """The change of an edge."""

    #: ``parent → child``, with the names in the corrected bag.
    edge: str
    kind: ChangeKind
    #: The distance between the recorded pose and the robot file's pose; None unless the kind is
    #: ``moved`` or ``equal``.
    offset: Offset | None = None
    #: The recorded parent, if it is not the robot file's parent.
    parent: str | None = None
    #: The number of transforms that are removed from the bag.
    transforms: int = 0


@dataclass
class TFCorrection:
    """Corrects the TFMessages of a pair of topics (moving, fixed).

    Pass every message of the fixed topic to ``note_static`` before you call ``opening``, and, if
    there are nominal poses, every one of the moving topic to ``note_moving``.
    """

    topics: Topics
    #: Fixed edges whose pose in the robot file replaces the recorded pose, by child.
    fixed: Mapping[str, PlanEdge]
    #: Fixed edges whose recorded pose stays, by child.
    nominal: Mapping[str, PlanEdge]
    #: Parents that the robot file allows, by child.
    declared: Mapping[str, frozenset[str]]
    #: New names of frames, by old name.
    renames: Mapping[str, str]
    #: Whether to drop edges that the robot file does not declare.
    only_declared: bool = False
    #: Recorded fixed edges that stay, by child. Each file of a bag begins with the edges of
    #: earlier files.
    kept: dict[str, SentTransform] = field(default_factory=dict)
    #: The numbers of transforms that were removed from the topic of moving edges, and of dropped
    #: transforms, by edge.
    left_moving: Counter[str] = field(default_factory=Counter)
    dropped: Counter[str] = field(default_factory=Counter)
    _recorded: dict[str, SentTransform] = field(default_factory=dict)
    #: Children with a nominal pose that the bag has on the topic of moving edges.
    _moving: set[str] = field(default_factory=set)
    _decoder: Decoder = field(default_factory=Decoder)

    def note_static(self, data: bytes) -> None:
        """Store the edges of a recorded message of the fixed topic, before the correction.

        Raises:
            ValueError: if it is not a TFMessage.
        """
        for transform in decode(data):
            renamed = self._renamed(transform)
            self._recorded[renamed.child] = renamed

    def note_moving(self, data: bytes) -> None:
        """Store which nominal poses a recorded message of the moving topic has.

        Raises:
            ValueError: if it is not a TFMessage.
        """
        if len(self._moving) < len(self.nominal):
            children = {self._renamed(transform).child for transform in decode(data)}
            self._moving |= self.nominal.keys() & set(map(plain_name, children))

    def _unrecorded(self) -> list[PlanEdge]:
        """Return the edges with a nominal pose that the bag has on neither topic."""
        return [
            edge
            for child, edge in self.nominal.items()
            if child not in self._recorded and child not in self._moving
        ]

    def opening(self, stamp_ns: int) -> bytes | None:
        """Return the message of the fixed topic that a file of the bag begins with.

        It contains the robot file's edges and the recorded fixed edges of earlier files.
        ``stamp_ns`` is their stamp. Return None if there are no such edges.
        """
        sent = [_sent(edge, stamp_ns) for edge in (*self.fixed.values(), *self._unrecorded())]
        sent += [replace(transform, stamp_ns=stamp_ns) for transform in self.kept.values()]
        return encode(sent) if sent else None

    def corrected(self, data: bytes, *, static: bool) -> bytes | None:
        """Return the corrected bytes of a recorded TFMessage; the same bytes if nothing changes.

        Return None if no transform is left. ``static`` is True for messages of the fixed topic.

        Raises:
            ValueError: if it is not a TFMessage.
        """
        if not static and not self._touches(data):
            return data
        before = decode(data)
        after = [
            renamed
            for renamed in map(self._renamed, before)
            if self._stays(renamed, static=static)
        ]
        if static:
            self.kept.update((transform.child, transform) for transform in after)
        if after == before:
            return data
        return encode(after) if after else None

    def changes(self) -> list[EdgeChange]:
        """Return the changes of edges, and an entry for each fixed edge of the robot file."""
        changes = [self._change_of(edge) for edge in self.fixed.values()]
        changes += [EdgeChange(edge.name, "added") for edge in self._unrecorded()]
        changes += [
            EdgeChange(edge, "removed from /tf", transforms=count)
            for edge, count in sorted(self.left_moving.items())
        ]
        return changes + [
            EdgeChange(edge, "dropped", transforms=count)
            for edge, count in sorted(self.dropped.items())
        ]

    def _change_of(self, edge: PlanEdge) -> EdgeChange:
        recorded = self._recorded.get(edge.child)
        if recorded is None:
            return EdgeChange(edge.name, "added")
        if plain_name(recorded.parent) != edge.parent:
            return EdgeChange(edge.name, "parent", parent=recorded.parent)
        offset = offset_of(edge.pose, Pose(recorded.xyz, recorded.quat_xyzw))
        return EdgeChange(edge.name, "moved" if offset.beyond(_EQUAL) else "equal", offset)

    def _touches(self, data: bytes) -> bool:
        """Return whether a message of the moving topic may need a change."""
        for row in self._decoder.rows(data):
            parent, child = plain_name(row[0]), plain_name(row[1])
            if child in self.fixed or parent in self.renames or child in self.renames:
                return True
            if self.only_declared and not self._is_declared(parent, child):
                return True
        return False

    def _stays(self, transform: SentTransform, *, static: bool) -> bool:
        parent, child = plain_name(transform.parent), plain_name(transform.child)
        if child in self.fixed:
            if not static:
                self.left_moving[f"{parent} → {child}"] += 1
            return False
        if self.only_declared and not self._is_declared(parent, child):
            self.dropped[f"{parent} → {child}"] += 1
            return False
        return True

    def _is_declared(self, parent: str, child: str) -> bool:
        return parent in self.declared.get(child, ())

    def _renamed(self, transform: SentTransform) -> SentTransform:
        parent, child = plain_name(transform.parent), plain_name(transform.child)
        if parent not in self.renames and child not in self.renames:
            return transform
        return replace(
            transform,
            parent=self.renames.get(parent, transform.parent),
            child=self.renames.get(child, transform.child),
        )


#: The largest difference of equal poses. A recorded pose consists of doubles and a quaternion, so
#: it differs only by rounding.
_EQUAL = Offset(1e-6, 1e-6)


def corrections_of(
    plan: Plan, renames: Mapping[str, str], *, only_declared: bool
) -> dict[Topics, TFCorrection]:
    """Return the correction of each pair of topics (moving, fixed) of the plan."""
    uncertain = {
        frame
        for process in plan.processes
        for driven in process.drives
        if driven.publishes
        for frame, knowledge in driven.frames.items()
        if knowledge != "exact"
    }
    return {
        topics: _correction(topics, part.edges, uncertain, renames, only_declared=only_declared)
        for topics, part in parts_of(plan).items()
    }


def _correction(
    topics: Topics,
    edges: Iterable[PlanEdge],
    uncertain: set[str],
    renames: Mapping[str, str],
    *,
    only_declared: bool,
) -> TFCorrection:
    fixed = {edge.child: edge for edge in edges if edge.kind == "static" and edge.pose_known}
    nominal = {child: edge for child, edge in fixed.items() if child in uncertain}
    return TFCorrection(
        topics=topics,
        fixed={child: edge for child, edge in fixed.items() if child not in uncertain},
        nominal=nominal,
        declared={edge.child: frozenset((edge.parent, *edge.switched)) for edge in edges},
        renames=renames,
        only_declared=only_declared,
    )


def _sent(edge: PlanEdge, stamp_ns: int) -> SentTransform:
    return SentTransform(stamp_ns, edge.parent, edge.child, edge.pose.xyz, edge.pose.quat_xyzw)
