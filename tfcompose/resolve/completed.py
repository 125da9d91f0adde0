"""What comes after the tree is known: raw blocks, the base, processes' topics and publishers."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, RejectedError, Span, did_you_mean, finding
from tfcompose.model import Block, Component, Hardware, Interface
from tfcompose.resolve.claims import settled
from tfcompose.resolve.isolation import Filler, isolate
from tfcompose.resolve.processes import has_claims
from tfcompose.resolve.stock import with_stock
from tfcompose.urdf.blocks import faults_of, read_block, unexpanded, unknown_joints

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from tfcompose.language.robot import ComponentSpec, HardwareSpec, RobotSpec
    from tfcompose.load import Path, Source
    from tfcompose.model import Robot
    from tfcompose.urdf.packages import Disk


@dataclass(frozen=True, slots=True)
class Known(Collection[str]):
    """Names, which count as known too where ``excuses`` says that they may be missing only for a refused entry."""

    names: Sequence[str]
    excuses: Callable[[str], bool]

    def __contains__(self, name: object) -> bool:
        return name in self.names or (isinstance(name, str) and self.excuses(name))

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


def completed(robot: Robot, spec: RobotSpec, source: Source, disk: Disk | None) -> tuple[Robot, list[Finding]]:
    """Return the robot with what stands beside links and joints, its base, and its processes' topics and publishers."""
    found: list[Finding] = []
    if spec.ros2_control or spec.xml:
        robot, refused = _with_blocks(robot, spec, source)
        found += refused
    robot = replace(robot, base=_base(robot, spec, source, found))
    if spec.ros.state_publisher == "stock":
        robot, refused = with_stock(robot)
        found += refused
    robot, refused = isolate(robot, spec, source, disk)
    found += refused
    if has_claims(spec):  # what knows them is loaded only then
        robot, refused = settled(robot, spec, source)
        found += refused
    filler = Filler(robot, source, disk)
    found += [one for process in robot.processes for one in filler.needless(process)]
    return robot, found


def _with_blocks(robot: Robot, spec: RobotSpec, source: Source) -> tuple[Robot, list[Finding]]:
    """Return the robot with its hardware and raw blocks."""
    moving = [edge.joint.name for edge in robot.edges if edge.joint]
    hardware = hardware_of(spec.ros2_control, source)
    children = {edge.child for edge in robot.edges}
    frames = [frame for frame in robot.frames if frame in robot.links or frame in children]
    joints = [edge.joint_name for edge in robot.edges if edge.joint_name]
    blocks, found = blocks_of(spec.xml, source, Known(frames, robot.excuses), Known(joints, robot.excuses))
    found += unknown_joints(hardware, Known(moving, robot.excuses))
    return replace(robot, hardware=(*hardware, *robot.hardware), blocks=(*blocks, *robot.blocks)), found


def _base(robot: Robot, spec: RobotSpec, source: Source, found: list[Finding]) -> str | None:
    """Return where the URDF begins: as said; base_link, or a fixed base_footprint above it; else the only root."""
    if spec.base is not None:
        if spec.base in robot.frames:
            return spec.base
        if not robot.excuses(spec.base):
            advice = did_you_mean(spec.base, robot.frames)
            found.append(finding("TF203", f"no frame {spec.base}", source.at(("base",)), help=advice))
        return None
    if "base_link" in robot.frames:
        above = robot.parent_edge("base_link")
        if above and above.kind == "static" and above.parent == "base_footprint":
            return "base_footprint"
        return "base_link"
    roots = robot.roots()
    return roots[0] if len(roots) == 1 else None


# ``ros2_control`` and ``xml``: what a URDF holds next to links and joints. Places in a raw block are those of the robot
# file.


def hardware_of(specs: dict[str, HardwareSpec], source: Source) -> tuple[Hardware, ...]:
    """Return the hardware components with the places of their joints."""
    return tuple(_hardware(name, spec, source) for name, spec in specs.items())


def _hardware(name: str, spec: HardwareSpec, source: Source) -> Hardware:
    at: Path = ("ros2_control", name)
    kinds = (("joint", spec.joints), ("sensor", spec.sensors), ("gpio", spec.gpios))
    components = tuple(
        _component(kind, inner, one, source.at_key((*at, f"{kind}s", inner)))
        for kind, several in kinds
        for inner, one in several.items()
    )
    return Hardware(
        name, spec.plugin, spec.type, source.at_key(at), spec.params, components, spec.rw_rate, spec.is_async
    )


def _component(kind: str, name: str, spec: ComponentSpec, at: Span) -> Component:
    command, state = ([Interface(i, params) for i, params in one.items()] for one in (spec.command, spec.state))
    return Component(kind, name, at, tuple(command), tuple(state), spec.params)


def blocks_of(
    texts: dict[str, str], source: Source, frames: Collection[str], joints: Collection[str]
) -> tuple[tuple[Block, ...], list[Finding]]:
    """Return the raw blocks, and what is wrong with them. ``joints`` are the names of all joints of the robot."""
    found: list[Finding] = []
    blocks = []
    for name, text in texts.items():
        at: Path = ("xml", name)
        try:
            root = read_block(text, source.file)
        except RejectedError as error:
            found += [replace(one, span=_in_file(one.span, text, source, at)) for one in error.findings]
            continue
        blocks.append(Block(name, source.at(at), text))
        for one in (*faults_of(root, frames, joints), *unexpanded(text, source.file)):
            found.append(replace(one, span=_in_file(one.span, text, source, at)))
    return tuple(blocks), found


def _in_file(span: Span | None, text: str, source: Source, at: Path) -> Span:
    """Return the place in the robot file of a place in the block, in which its text begins at line 2.

    Only in a literal block (``|``) are the lines those of the file; elsewhere it is the whole value.
    """
    value, key = source.at(at), source.at_key(at)
    lines = text.rstrip("\n").count("\n") + 1
    if span is None or value.end_line - value.line < lines:
        return value
    line = value.line + min(max(span.line - 1, 1), lines)
    indent = key.column + 1  # as most people write it: two more than the key
    return Span(value.file, line, span.column + indent, line, max(span.end_column, span.column + 1) + indent)
