"""Drawing of sensors' fields of view, and of rays that the robot's bodies block."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from tfcompose.compiler.rays import Surroundings, different_streams, is_plane, view_of
from tfcompose.foundation.geometry import Pose

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    import viser

    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.robot import MountedSensor, Optics, Robot

#: The colours of fields of view, by the kind of stream.
FIELD_COLOURS = {
    "camera": (40, 110, 220),
    "lidar": (225, 125, 20),
    "radar": (140, 70, 200),
    "ultrasonic": (20, 150, 140),
}
_BLOCKED = (215, 40, 40)
_OPACITY = 0.1
#: The angle between points of an arc, in radians, and the number of points of a cone's rim.
_ARC_RAD = math.radians(3)
_RIM = 48
#: The drawn length of a field of view in metres, at a scale of 1, if the stream's range is not
#: shorter.
_REACH_M = 0.5


def rims(optics: Optics) -> list[Any]:
    """Return the boundary of the field of view: polylines, arrays (n, 3) in the stream's frame.

    The list is empty if the field of view is unknown. The points of a camera are at a depth of 1
    along the optical axis. The points of other sensors are at a distance of 1. A closed polyline
    ends at its first point.
    """
    if optics.projection == "fisheye":
        if optics.diagonal is None:
            return []
        angle, around = optics.diagonal / 2, np.linspace(0, math.tau, _RIM + 1)
        return [
            _camera(
                optics,
                math.sin(angle) * np.cos(around),
                math.sin(angle) * np.sin(around),
                math.cos(angle),
            )
        ]
    if optics.horizontal is None or optics.vertical is None:
        return []
    if optics.kind == "camera":
        if max(map(abs, (*optics.horizontal, *optics.vertical))) >= math.pi / 2:
            return []
        (right, left), (down, up) = (
            tuple(map(math.tan, sector)) for sector in (optics.horizontal, optics.vertical)
        )
        return [
            _camera(
                optics,
                np.array([left, right, right, left, left]),
                np.array([up, up, down, down, up]),
                1.0,
            )
        ]
    if optics.kind == "lidar":
        extent = optics.horizontal[1] - optics.horizontal[0]
        azimuths = np.linspace(*optics.horizontal, max(2, math.ceil(extent / _ARC_RAD) + 1))
        elevations = optics.vertical[:1] if is_plane(optics) else optics.vertical
        return [
            _directions(azimuths, np.full_like(azimuths, elevation)) for elevation in elevations
        ]
    around = np.linspace(0, math.tau, _RIM + 1)
    middles = [(sector[0] + sector[1]) / 2 for sector in (optics.horizontal, optics.vertical)]
    halves = [(sector[1] - sector[0]) / 2 for sector in (optics.horizontal, optics.vertical)]
    return [
        _directions(
            middles[0] + halves[0] * np.cos(around), middles[1] + halves[1] * np.sin(around)
        )
    ]


def _camera(optics: Optics, left: Any, up: Any, forward: float) -> Any:
    depth = np.full_like(left, forward)
    return np.stack((-left, up, -depth) if optics.backward else (-left, -up, depth), axis=-1)


def _directions(azimuths: Any, elevations: Any) -> Any:
    flat = np.cos(elevations)
    return np.stack(
        (flat * np.cos(azimuths), flat * np.sin(azimuths), np.sin(elevations)), axis=-1
    )


def outline(optics: Optics, reach: float) -> Any:
    """Return the lines that show a field of view up to ``reach`` metres.

    The result is an array (n, 2, 3) in the stream's frame, in metres. It contains the rims at the
    minimum range and at ``reach``, and lines between the two.
    """
    far, near = min(reach, optics.far or reach), optics.near or 0.0
    made = []
    for rim in rims(optics):
        made += [
            np.stack((rim[:-1], rim[1:]), axis=1) * distance
            for distance in {far, min(near, far)} - {0.0}
        ]
        spokes = rim[_corners(optics, rim)]
        made.append(np.stack((spokes * min(near, far), spokes * far), axis=1))
    return np.concatenate(made).astype(np.float32) if made else np.zeros((0, 2, 3), np.float32)


def _corners(optics: Optics, rim: Any) -> list[int]:
    """Return the indices of the rim's points from which ``outline`` draws lines.

    These are the corners of an image, four points of a circle, or the ends of an arc.
    """
    if optics.kind == "camera" and optics.projection != "fisheye":
        return [0, 1, 2, 3]
    if np.allclose(rim[0], rim[-1]):
        return [round(index * (len(rim) - 1) / 4) for index in range(4)]
    return [0, len(rim) - 1]


def surface(optics: Optics, reach: float) -> tuple[Any, Any]:
    """Return the sides of a field of view as triangles (vertices, faces) up to ``reach``."""
    far = min(reach, optics.far or reach)
    vertices, faces = [np.zeros((1, 3))], [np.zeros((0, 3), int)]
    for rim in rims(optics):
        first = sum(map(len, vertices))
        here = np.arange(first, first + len(rim) - 1)
        vertices.append(rim * far)
        faces.append(np.stack((np.zeros_like(here), here, here + 1), axis=1))
    return np.concatenate(vertices).astype(np.float32), np.concatenate(faces).astype(np.uint32)


def streams(robot: Robot) -> Iterator[tuple[MountedSensor, Optics]]:
    """Yield the streams with a known field of view.

    Streams with the same frame and the same field of view are yielded once.
    """
    for sensor in robot.sensors:
        for optics in different_streams(sensor):
            if optics.frame in robot.frames and rims(optics):
                yield sensor, optics


def reach_at_scale(scale: float) -> float:
    """Return the drawn length of fields of view at a scale, in metres."""
    return round(_REACH_M * scale, 2)


class FieldsOfView:
    """The fields of view in a scene.

    At first, only the fields of cameras are visible. ``update`` moves all fields. They are drawn
    up to ``reach``, in metres; its first value depends on ``scale``.
    """

    def __init__(self, scene: viser.SceneApi, robot: Robot, scale: float = 1.0) -> None:
        self._scene = scene
        self._streams = list(streams(robot))
        self._frames: list[Any] = []
        self._blocked: dict[int, Any] = {}
        self._hidden: frozenset[str] = frozenset()
        self._at: Mapping[str, Pose] = {}
        self.sensors = tuple(dict.fromkeys(sensor.name for sensor, _ in self._streams))
        cameras = {sensor.name for sensor, optics in self._streams if optics.kind == "camera"}
        self.visible = {name: name in cameras for name in self.sensors}
        for index, (sensor, _) in enumerate(self._streams):
            self._frames.append(
                scene.add_frame(
                    f"/fields/{index}", show_axes=False, visible=self.visible[sensor.name]
                )
            )
        self.draw(reach_at_scale(scale))

    def draw(self, reach: float) -> None:
        """Draw the fields of view up to the length ``reach``, in metres."""
        self.reach = reach
        for index, (_, optics) in enumerate(self._streams):
            colour = FIELD_COLOURS[optics.kind]
            self._scene.add_line_segments(
                f"/fields/{index}/lines",
                outline(optics, reach),
                colour,
                thickness=1.5,
                thickness_units="screen",
            )
            vertices, faces = surface(optics, reach)
            self._scene.add_mesh_simple(
                f"/fields/{index}/sides",
                vertices,
                faces,
                color=colour,
                opacity=_OPACITY,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )

    def update(self, poses: Mapping[str, Pose]) -> None:
        """Move every field of view to the pose of its frame.

        ``poses`` are poses of frames in the roots of their trees.
        """
        for handle, (_, optics) in zip(self._frames, self._streams, strict=True):
            if optics.frame in poses and poses[optics.frame] != self._at.get(optics.frame):
                x, y, z, w = poses[optics.frame].quat_xyzw
                handle.wxyz, handle.position = (w, x, y, z), poses[optics.frame].xyz
        self._at = poses

    def points(self, poses: Mapping[str, Pose]) -> Any:
        """Return the end points of the shown fields of view, shape (n, 3), in metres.

        ``poses`` are poses of frames in the roots of their trees.
        """
        clouds = [np.zeros((0, 3))]
        for sensor, optics in self._streams:
            if self.visible[sensor.name] and optics.frame in poses:
                pose = poses[optics.frame]
                ends = outline(optics, self.reach).reshape(-1, 3)
                clouds.append(np.array([(pose @ Pose(tuple(end))).xyz for end in ends.tolist()]))
        return np.concatenate(clouds)

    def pose(self, index: int) -> Pose:
        """Return the pose of a stream's frame in the scene."""
        w, x, y, z = (float(value) for value in self._frames[index].wxyz)
        px, py, pz = (float(value) for value in self._frames[index].position)
        return Pose((px, py, pz), (x, y, z, w))

    def show(self, sensor: str, *, visible: bool) -> None:
        """Show or hide a sensor's fields of view."""
        self.visible[sensor] = visible
        self.hide(self._hidden)

    def hide(self, frames: frozenset[str]) -> None:
        """Hide the fields of view of these frames, and show those of all other shown sensors."""
        self._hidden = frames
        for handle, (sensor, optics) in zip(self._frames, self._streams, strict=True):
            handle.visible = self.visible[sensor.name] and optics.frame not in frames

    def show_blocked(self, robot: Robot | None) -> list[str]:
        """Draw the rays of visible sensors that bodies of the robot block, as TF641 counts them.

        If ``robot`` is None, draw no rays.

        Returns:
            a text for each stream with blocked rays: ``front (depth): 12 % by mast``.
        """
        for handle in self._blocked.values():
            handle.remove()
        self._blocked.clear()
        if robot is None:
            return []
        lines, around = [], Surroundings(robot)
        mounted = {sensor.name: sensor for sensor in robot.sensors}
        for index, (sensor, optics) in enumerate(self._streams):
            if not self.visible[sensor.name] or sensor.name not in mounted:
                continue
            view = view_of(around, mounted[sensor.name], optics)
            ends = [_end(ray.direction, ray.distance) for ray in view.rays if ray.link is not None]
            if ends:
                points = np.array([((0.0, 0.0, 0.0), end) for end in ends], np.float32)
                self._blocked[index] = self._scene.add_line_segments(
                    f"/fields/{index}/blocked", points, _BLOCKED
                )
            by = f" by {', '.join(view.blocking)}" if view.blocking else ""
            lines.append(f"{sensor.name} ({optics.stream}): {view.blocked:.0%} blocked{by}")
        return lines


def _end(direction: Vector, distance: float) -> Vector:
    return (direction[0] * distance, direction[1] * distance, direction[2] * distance)
