"""Correction of recorded TF: which transforms a bag loses, keeps and gains.

A fixed edge of the robot file replaces the recorded one. The frames inside a sensor are an
exception where the file knows only the vendor's nominal pose: there the recorded pose comes from
the device's own calibration, so it stays, and the nominal one is added only if none was recorded.
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

#: What happens to an edge of the bag or of the robot file.
ChangeKind = Literal["moved", "equal", "parent", "added", "removed from /tf", "dropped"]


class EdgeChange(NamedTuple):
    """What becomes of one edge."""

    #: ``parent → child``, by the names in the corrected bag.
    edge: str
    kind: ChangeKind
    #: How far the recorded pose was from the robot file's; None unless ``moved`` or ``equal``.
    offset: Offset | None = None
    #: The recorded parent, if it is another one.
    parent: str | None = None
    #: How many transforms leave the bag.
    transforms: int = 0


@dataclass
class TFCorrection:
    """Correction of the TFMessages of one pair of topics (moving, fixed).

    ``note_static`` must have seen every message of the fixed topic before ``opening``.
    """

    topics: Topics
    #: Fixed edges whose pose the robot file decides, by child.
    fixed: Mapping[str, PlanEdge]
    #: Fixed edges whose recorded pose is better, by child.
    nominal: Mapping[str, PlanEdge]
    #: Parents that the robot file allows, by child.
    declared: Mapping[str, frozenset[str]]
    #: New names of frames, by old name.
    renames: Mapping[str, str]
    #: Drop edges that the robot file does not declare.
    only_declared: bool = False
    #: Recorded fixed edges as they stay, by child; each file of a bag begins with those so far.
    kept: dict[str, SentTransform] = field(default_factory=dict)
    #: Transforms that left the topic of moving edges, and dropped ones, by edge.
    left_moving: Counter[str] = field(default_factory=Counter)
    dropped: Counter[str] = field(default_factory=Counter)
    _recorded: dict[str, SentTransform] = field(default_factory=dict)
    _decoder: Decoder = field(default_factory=Decoder)

    def note_static(self, data: bytes) -> None:
        """Note a recorded message of the fixed topic, before anything is corrected.

        Raises:
            ValueError: if it is no TFMessage.
        """
        for transform in decode(data):
            renamed = self._renamed(transform)
            self._recorded[renamed.child] = renamed

    def opening(self, stamp_ns: int) -> bytes | None:
        """Return the message of the fixed topic that a file of the bag begins with.

        It has the robot file's edges and the recorded fixed edges so far, with this stamp in
        nanoseconds. None: there are none.
        """
        missing = {
            child: edge for child, edge in self.nominal.items() if child not in self._recorded
        }
        sent = [_sent(edge, stamp_ns) for edge in (*self.fixed.values(), *missing.values())]
        sent += [replace(transform, stamp_ns=stamp_ns) for transform in self.kept.values()]
        return encode(sent) if sent else None

    def corrected(self, data: bytes, *, static: bool) -> bytes | None:
        """Return a recorded TFMessage as it is to be: the same bytes where nothing changes.

        None: nothing is left of it. ``static`` says that it is of the fixed topic.

        Raises:
            ValueError: if it is no TFMessage.
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
        """Return what becomes of each edge that does not stay as it is, and of the fixed ones."""
        changes = [self._change_of(edge) for edge in self.fixed.values()]
        changes += [
            EdgeChange(edge.name, "added")
            for child, edge in self.nominal.items()
            if child not in self._recorded
        ]
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
        """Return whether a message of the moving topic may have to change."""
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


#: Recorded poses are doubles that went through one quaternion: anything more is a difference.
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
