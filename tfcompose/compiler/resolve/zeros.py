"""Offsets of joints' zeros: ``joints: {neck: {offset: 0.4 deg}}``.

With the offset o, the joint at a reported position q places its child where q + o would without
it, as ros2_control's transmissions have it (``SimpleTransmission``: joint position = actuator
position / reduction + offset) and robot_calibration's joint offsets. URDF has no element for it:
the pose of the child at 0 moves along or about the axis by o. Whatever is a position of the joint
(limits, soft limits, the reference switch) is reported smaller by o, so that the physical range
stays the same; in MuJoCo ``ref`` does the same to a joint's ``range``.

A joint with ``mimic`` follows the corrected position of its joint, to which a gear or a belt
couples it: multiplier · (q + o) + offset. Readers of URDF compute that from q, so the offset of
``mimic`` includes multiplier · o. The follower's own offset then places its child, as with any
joint.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.compiler.urdf.blocks import unknown_joint
from tfcompose.foundation.findings import finding
from tfcompose.foundation.units import ANGLE, LENGTH, WithUnit, example, with_article
from tfcompose.spec.language.robot import JointSpec, JointZeroSpec

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.compiler.resolve.draft import Draft
    from tfcompose.foundation.findings import Finding
    from tfcompose.model.robot import Edge, Joint
    from tfcompose.spec.language.pose import EdgeKeys


def with_zero_offset(edge: Edge, keys: EdgeKeys | None) -> Edge:
    """Return the edge with the offset that its keys give the zero of its joint."""
    if edge.joint is None or not isinstance(keys, JointSpec) or not keys.offset:
        return edge
    return _corrected(edge, edge.joint, float(keys.offset))


def _corrected(edge: Edge, joint: Joint, offset: float) -> Edge:
    return replace(
        edge, pose=edge.pose @ joint.motion(offset), joint=_with_reported(joint, offset)
    )


def _with_reported(joint: Joint, offset: float) -> Joint:
    """Return the joint with each of its positions as it is reported."""
    limit, safety, switch = joint.limit, joint.safety, joint.reference
    if limit:
        lower, upper = _reported(limit.lower, offset), _reported(limit.upper, offset)
        limit = replace(limit, lower=lower, upper=upper)
    if safety:
        safety = replace(
            safety,
            soft_lower_limit=safety.soft_lower_limit - offset,
            soft_upper_limit=safety.soft_upper_limit - offset,
        )
    if switch:
        rising, falling = _reported(switch.rising, offset), _reported(switch.falling, offset)
        switch = replace(switch, rising=rising, falling=falling)
    zero_offset = joint.zero_offset + offset
    return replace(joint, zero_offset=zero_offset, limit=limit, safety=safety, reference=switch)


def _reported(position: float | None, offset: float) -> float | None:
    return None if position is None else position - offset


def correct_mimics(draft: Draft) -> None:
    """Let joints of this file follow the corrected positions of the joints that they mimic."""
    offsets = {edge.joint.name: edge.joint.zero_offset for edge in draft.edges if edge.joint}
    for index, keys in draft.keys.items():
        edge = draft.edges[index]
        joint = edge.joint
        if joint is None or not isinstance(keys, JointSpec) or joint.mimic is None:
            continue
        correction = joint.multiplier * offsets.get(joint.mimic, 0.0)
        if correction:
            joint = replace(joint, offset=joint.offset + correction)
            draft.edges[index] = replace(edge, joint=joint)


def correct_parts(draft: Draft) -> Iterator[Finding]:
    """Apply the offsets that this file gives the joints of its parts, and report unknown joints.

    A part's own offset, and what its joints mimic, is already in its edges.
    """
    offsets = {
        name: entry.offset
        for name, entry in draft.spec.joints.items()
        if isinstance(entry, JointZeroSpec)
    }
    if not offsets:
        return
    apart = {part.name for part in draft.joined if part.declared.is_alone}
    moving: dict[str, Joint] = {}
    for index, edge in enumerate(draft.edges):
        joint = edge.joint
        if joint is None or edge.entry[:1] != ("parts",) or edge.entry[1] in apart:
            continue
        moving[joint.name] = joint
        correction = joint.multiplier * offsets.get(joint.mimic or "", 0.0)
        if correction:
            joint = replace(joint, offset=joint.offset + correction)
        draft.edges[index] = _corrected(edge, joint, float(offsets.get(joint.name, 0.0)))
    for name, offset in offsets.items():
        yield from _check_offset(draft, name, offset, moving)


def _check_offset(
    draft: Draft, name: str, offset: float, moving: Mapping[str, Joint]
) -> Iterator[Finding]:
    """Yield a finding if no part has this moving joint, or its positions have another unit."""
    spec, path = draft.spec, ("joints", name)
    if name not in moving:
        broken = any(section == "parts" for section, *_ in draft.broken)
        if not broken:
            yield unknown_joint(name, spec.key_span(path), [*moving, *draft.joints])
        return
    expected = LENGTH if moving[name].type == "prismatic" else ANGLE
    if isinstance(offset, WithUnit) and offset.dimension != expected:
        moves = "slides" if expected == LENGTH else "turns"
        what = with_article(offset.dimension)
        message = f"a {moving[name].type} joint {moves}: offset cannot be {what}"
        span = spec.span_of((*path, "offset"))
        yield finding("TF104", message, span, help=f"for example {example(expected)}")
