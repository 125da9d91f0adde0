"""The bodies around a sensor, in the frame of one of its streams."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.foundation.geometry import Pose

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.robot import MountedSensor, Robot, Shape


@dataclass(frozen=True, slots=True)
class PosedShape:
    """A shape of a link. ``pose`` is the shape's, in the frame from which it is seen."""

    link: str
    shape: Shape
    pose: Pose


def fixed_to(robot: Robot, frame: str, *, only_static: bool = False) -> dict[str, Pose]:
    """Return the pose in ``frame`` of each frame that stands still there, up and down the tree.

    ``only_static`` keeps to static edges. Otherwise those inside a sensor count too, whoever
    publishes them, and what a continuous joint turns with its pose at zero, if it is below: a
    wheel turns on the spot.
    """
    neighbours: dict[str, list[tuple[str, Pose]]] = {}
    for edge in robot.edges:
        is_fixed = edge.kind == "static" or (
            not only_static and edge.sensor is not None and not edge.joint
        )
        spins = not only_static and edge.joint is not None and edge.joint.type == "continuous"
        if not edge.pose_known or not (is_fixed or spins):
            continue
        neighbours.setdefault(edge.parent, []).append((edge.child, edge.pose))
        if is_fixed:
            neighbours.setdefault(edge.child, []).append((edge.parent, edge.pose.inverse()))
    poses, waiting = {frame: Pose()}, [frame]
    while waiting:
        here = waiting.pop()
        for there, pose in neighbours.get(here, ()):
            if there not in poses:
                poses[there] = poses[here] @ pose
                waiting.append(there)
    return poses


def sphere_around(shape: Shape) -> tuple[Vector, float] | None:
    """Return the centre, in the shape's frame, and radius of its bounding sphere, in m.

    None: a mesh that cannot be read, because trimesh is not installed or the file is no mesh.
    """
    if shape.kind != "mesh":
        return (0.0, 0.0, 0.0), shape.radius
    x, y, z = shape.size
    try:
        # Numpy and trimesh: 0.3 s that most robots need not wait for.
        from tfcompose.compiler.rays import meshes  # noqa: PLC0415

        return meshes.sphere_around(shape.mesh.path if shape.mesh else "", (x, y, z))
    except Exception:  # noqa: BLE001 (readers of a dozen formats: anything can come out of them)
        return None


def bodies_around(
    robot: Robot, sensor: MountedSensor, poses: Mapping[str, Pose]
) -> Iterator[PosedShape]:
    """Yield the shapes of the links at ``poses`` that are not the sensor's own.

    For collision, else those seen.

    A link in whose origin the sensor stands is its housing.
    """
    own = {sensor.mount, *sensor.frames}
    above = robot.parent_edge(sensor.mount)
    if above and above.pose == Pose():
        own.add(above.parent)
    for name, pose in poses.items():
        link = robot.links.get(name)
        if link and name not in own:
            for shape in link.collisions or link.visuals:
                yield PosedShape(name, shape, pose @ shape.pose)
