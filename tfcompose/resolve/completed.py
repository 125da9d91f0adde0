"""What comes after the tree is known: raw blocks, the base, processes' topics and publishers."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, did_you_mean, finding
from tfcompose.resolve.blocks import blocks_of, hardware_of
from tfcompose.resolve.claims import settled
from tfcompose.resolve.isolation import Filler, isolate
from tfcompose.resolve.processes import has_claims
from tfcompose.resolve.stock import with_stock
from tfcompose.urdf.blocks import unknown_joints

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from tfcompose.language.robot import RobotSpec
    from tfcompose.load import Source
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
    frames = [frame for frame in robot.frames if frame in robot.links or robot.parent_edge(frame)]
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
