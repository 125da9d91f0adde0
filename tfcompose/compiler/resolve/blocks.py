"""``ros2_control`` and ``xml``: URDF elements other than links and joints.

This module checks these elements against the robot. Places in a raw block are places in the robot
file.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from tfcompose.compiler.urdf.blocks import faults_of, find_unexpanded, read_block, unknown_joints
from tfcompose.foundation.findings import Finding, RejectedError, Span
from tfcompose.model.robot.hardware import Block, Hardware, HardwareComponent, Interface

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from tfcompose.compiler.resolve.draft import Draft
    from tfcompose.spec.language.robot import ComponentSpec, HardwareSpec, RobotSpec
    from tfcompose.spec.load import Path


@dataclass(frozen=True, slots=True)
class _NamesOrExcused(Collection[str]):
    """Names, plus names that may be missing because an entry was rejected."""

    names: Sequence[str]
    #: Returns whether a rejected entry may have defined the name.
    tolerates: Callable[[str], bool]

    def __contains__(self, name: object) -> bool:
        return name in self.names or (isinstance(name, str) and self.tolerates(name))

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


def take_blocks(draft: Draft) -> Iterator[Finding]:
    """Add the hardware and the raw blocks of the file to the draft. Parts add theirs later."""
    robot, spec = draft.robot, draft.spec
    moving = [edge.joint.name for edge in robot.edges if edge.joint]
    hardware = tuple(
        _hardware(name, declared, spec) for name, declared in spec.ros2_control.items()
    )
    yield from unknown_joints(hardware, _NamesOrExcused(moving, robot.tolerates))
    children = {edge.child for edge in robot.edges}
    frames = [frame for frame in robot.frames if frame in robot.links or frame in children]
    joints = [edge.joint_name for edge in robot.edges if edge.joint_name]
    names = (_NamesOrExcused(frames, robot.tolerates), _NamesOrExcused(joints, robot.tolerates))
    blocks = []
    for name, text in spec.xml.items():
        path: Path = ("xml", name)
        try:
            root = read_block(text, spec.spans.file)
            findings = [*faults_of(root, *names), *find_unexpanded(text, spec.spans.file)]
            blocks.append(Block(name, spec.span_of(path), text))
        except RejectedError as error:
            findings = [*error.findings]
        for finding in findings:
            yield replace(finding, span=_in_file(finding.span, text, spec, path))
    draft.robot = replace(
        robot, hardware=(*hardware, *robot.hardware), blocks=(*blocks, *robot.blocks)
    )


def _hardware(name: str, declared: HardwareSpec, spec: RobotSpec) -> Hardware:
    path: Path = ("ros2_control", name)
    kinds = (("joint", declared.joints), ("sensor", declared.sensors), ("gpio", declared.gpios))
    components = tuple(
        _component(kind, inner, component, spec.key_span((*path, f"{kind}s", inner)))
        for kind, components in kinds
        for inner, component in components.items()
    )
    return Hardware(
        name,
        declared.plugin,
        declared.type,
        span=spec.key_span(path),
        params=declared.params,
        components=components,
        rw_rate=declared.rw_rate,
        is_async=declared.is_async,
    )


def _component(kind: str, name: str, spec: ComponentSpec, span: Span) -> HardwareComponent:
    command, state = (
        [Interface(i, params) for i, params in interfaces.items()]
        for interfaces in (spec.command, spec.state)
    )
    return HardwareComponent(
        kind, name, span, command=tuple(command), state=tuple(state), params=spec.params
    )


def _in_file(span: Span | None, text: str, spec: RobotSpec, path: Path) -> Span:
    """Convert a place in the text of a raw block to a place in the robot file.

    The text starts at line 2 of the block's document. Lines correspond only in a literal block
    (``|``). For any other scalar the place is the complete value.
    """
    value, key = spec.span_of(path), spec.key_span(path)
    lines = text.rstrip("\n").count("\n") + 1
    if span is None or value.end_line - value.line < lines:
        return value
    line = value.line + min(max(span.line - 1, 1), lines)
    indent = key.column + 1  # assumes the usual indentation: two more than the key
    return Span(
        value.file,
        line,
        span.column + indent,
        line,
        max(span.end_column, span.column + 1) + indent,
    )
