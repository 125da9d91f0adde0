"""The bodies around a sensor, in the frame of one of the sensor's streams."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from tfcompose.compiler.rays.bundle import bundle_of
from tfcompose.foundation.geometry import Pose

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.robot import MountedSensor, Robot, Shape

Neighbours = dict[str, list[tuple[str, Pose]]]


@dataclass(frozen=True, slots=True)
class PosedShape:
    """A shape of a link, with its pose in a stream's frame or a group's first frame."""

    link: str
    shape: Shape
    #: The shape's pose in that frame.
    pose: Pose


@dataclass(frozen=True)
class _Body(PosedShape):
    """A shape in the first frame of its group, with its bounding sphere."""

    @cached_property
    def sphere(self) -> tuple[float, float, float, float]:
        """Centre (x, y, z) and radius in metres; infinite radius for an unreadable mesh."""
        centre, radius = sphere_around(self.shape) or ((0.0, 0.0, 0.0), math.inf)
        return *(self.pose @ Pose(centre)).xyz, radius


class _Group:
    """Frames that are fixed to each other, and the bodies on these frames.

    ``poses`` are in the first frame of the group.
    """

    def __init__(self, robot: Robot, poses: dict[str, Pose]) -> None:
        self._robot = robot
        self.poses = poses

    @cached_property
    def bodies(self) -> list[_Body]:
        """The collision shapes of the group's links.

        For a link without these, its visual shapes.
        """
        links = self._robot.links
        return [
            _Body(name, shape, pose @ shape.pose)
            for name, pose in self.poses.items()
            if name in links
            for shape in links[name].collisions or links[name].visuals
        ]


class Surroundings:
    """Frames and bodies that do not move relative to a frame of the robot.

    With ``only_static`` only static edges count as fixed. Otherwise inner edges of a sensor count
    too, even if a driver publishes them. So do bodies below a continuous joint, at position zero,
    because a wheel turns on the spot.
    """

    def __init__(self, robot: Robot, *, only_static: bool = False) -> None:
        self.robot = robot
        self._above = {edge.child: edge for edge in reversed(robot.edges)}
        self._fixed: Neighbours = {}
        self._all: Neighbours = {}
        self._groups: dict[str, _Group] = {}
        for edge in robot.edges:
            is_fixed = edge.kind == "static" or (
                not only_static and edge.sensor is not None and not edge.joint
            )
            spins = not only_static and edge.joint is not None and edge.joint.type == "continuous"
            if not edge.pose_known or not (is_fixed or spins):
                continue
            down, up = (edge.child, edge.pose), (edge.parent, edge.pose.inverse())
            self._all.setdefault(edge.parent, []).append(down)
            if is_fixed:
                self._all.setdefault(edge.child, []).append(up)
                self._fixed.setdefault(edge.parent, []).append(down)
                self._fixed.setdefault(edge.child, []).append(up)

    def _group(self, frame: str) -> _Group:
        if frame not in self._groups:
            members = _reach_frames(self._fixed, {frame: Pose()})
            group = _Group(self.robot, _reach_frames(self._all, members))
            self._groups.update(dict.fromkeys(members, group))
        return self._groups[frame]

    def poses(self, frame: str) -> dict[str, Pose]:
        """Return the pose in ``frame`` of each frame that is fixed relative to ``frame``."""
        group = self._group(frame)
        to_frame = group.poses[frame].inverse()
        return {name: to_frame @ pose for name, pose in group.poses.items()}

    def pose(self, frame: str, target: str) -> Pose | None:
        """Return the pose of ``target`` in ``frame``, None if one moves relative to the other."""
        poses = self._group(frame).poses
        return poses[frame].inverse() @ poses[target] if target in poses else None

    def bodies(
        self,
        sensor: MountedSensor,
        frame: str,
        into: tuple[Vector, ...],
        reach: float,
        without: Collection[str] = (),
    ) -> Iterator[PosedShape]:
        """Yield, in ``frame``, the shapes that rays from its origin may hit within ``reach`` m.

        ``into`` holds the directions of the rays. Shapes of the sensor and shapes of the links
        ``without`` are left out. A link counts as part of the sensor if its origin is the sensor's
        origin.
        """
        excluded = {sensor.mount, *sensor.frames, *without}
        above = self._above.get(sensor.mount)
        if above and above.pose == Pose():
            excluded.add(above.parent)
        group = self._group(frame)
        pose = group.poses[frame]
        (from_x, from_y, from_z), to_frame = pose.xyz, pose.inverse()
        cone = bundle_of(into).rotate(pose.quat_xyzw)
        for body in group.bodies:
            if body.link in excluded:
                continue
            x, y, z, radius = body.sphere
            x, y, z = x - from_x, y - from_y, z - from_z
            if cone.may_meet(x, y, z, radius) and math.hypot(x, y, z) - radius <= reach:
                yield PosedShape(body.link, body.shape, to_frame @ body.pose)


def _reach_frames(neighbours: Neighbours, poses: dict[str, Pose]) -> dict[str, Pose]:
    """Return ``poses`` plus the poses of all frames that can be reached from them."""
    poses, waiting = dict(poses), list(poses)
    while waiting:
        frame = waiting.pop()
        for neighbour, pose in neighbours.get(frame, ()):
            if neighbour not in poses:
                poses[neighbour] = poses[frame] @ pose
                waiting.append(neighbour)
    return poses


def sphere_around(shape: Shape) -> tuple[Vector, float] | None:
    """Return the centre and radius of the shape's bounding sphere, in its frame, in metres.

    None for a mesh that cannot be read, because trimesh is missing or the file is not a mesh.
    """
    if shape.kind != "mesh":
        return (0.0, 0.0, 0.0), shape.radius
    x, y, z = shape.size
    try:
        # Importing numpy and trimesh takes 0.3 s, and most robots do not need them.
        from tfcompose.compiler.rays import meshes  # noqa: PLC0415

        return meshes.sphere_around(shape.mesh.path if shape.mesh else "", (x, y, z))
    except Exception:  # noqa: BLE001 (readers of a dozen formats: anything can come out of them)
        return None
