"""Scene of a robot in viser: bodies, frames as axes, edges as lines in owners' colours."""

from __future__ import annotations

import colorsys
import contextlib
import itertools
import math
import threading
from typing import TYPE_CHECKING, Any

import numpy as np

from tfcompose.foundation.geometry import Pose
from tfcompose.tools.view.camera import Bounds
from tfcompose.tools.view.fields import FieldsOfView
from tfcompose.tools.view.shapes import mesh_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    import viser

    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.robot import Robot, Shape

#: The first hue, and the step to the next one. With the golden angle as the step, colours of
#: consecutive owners differ clearly. Red hues are not used, because red marks a wrong edge.
_FIRST_HUE, _NEXT_HUE = 0.58, 0.381966
_NO_RED = 0.1
_GREY = (105, 112, 122)
#: The length of axes in metres, for a robot whose largest body is 1 m long.
AXES_M = 0.08
#: The factor by which the axes of the selected frame are longer.
_SELECTED = 2.0
_GHOST = (60, 120, 220)
_RULER = (20, 20, 20)


def wxyz(pose: Pose) -> tuple[float, float, float, float]:
    """Return the rotation of a pose as a quaternion in viser's order (w, x, y, z)."""
    x, y, z, w = pose.quat_xyzw
    return (w, x, y, z)


def colours_of(robot: Robot) -> dict[str, tuple[int, int, int]]:
    """Return a colour for each owner of an edge, in tree order."""
    owners = dict.fromkeys(edge.owner for edge in robot.edges)
    colours = {}
    for index, owner in enumerate(owners):
        hue = _NO_RED + (1 - 2 * _NO_RED) * ((_FIRST_HUE + index * _NEXT_HUE) % 1)
        rgb = colorsys.hsv_to_rgb(hue, 0.85, 0.85)
        colours[owner] = (round(rgb[0] * 255), round(rgb[1] * 255), round(rgb[2] * 255))
    return colours


def colour_of(shape: Shape) -> tuple[int, int, int]:
    """Return the colour of a shape's material; grey if it has none."""
    rgba = shape.material.rgba if shape.material else None
    if rgba is None:
        return _GREY
    return round(rgba[0] * 255), round(rgba[1] * 255), round(rgba[2] * 255)


def scale_of(sides: Iterable[float]) -> float:
    """Return the scale of axes and other marks; 1 for a robot whose largest body is 1 m.

    The scale is the square root of the longest of ``sides``, in metres, which are the sides of
    bodies.
    """
    return math.sqrt(max(sides, default=1.0) or 1.0)


def _add_shape(
    scene: viser.SceneApi, name: str, shape: Shape, colour: tuple[int, int, int], opacity: float
) -> Any:
    """Add a shape to the scene. Return its mesh and handle, or None if it is empty."""
    mesh = mesh_of(shape)
    if mesh is None or mesh.is_empty:
        return None
    handle = scene.add_mesh_simple(
        name,
        np.asarray(mesh.vertices, np.float32),
        np.asarray(mesh.faces, np.uint32),
        color=colour,
        opacity=opacity,
        flat_shading=True,
        side="double",
        cast_shadow=False,
        receive_shadow=False,
        wxyz=wxyz(shape.pose),
        position=shape.pose.xyz,
    )
    return mesh, handle


class RobotScene:
    """The scene of a robot; ``update`` moves its frames.

    It takes seconds to read the meshes of an arm. Therefore a link with collision shapes shows
    these until ``add_meshes`` has read its visual meshes.
    """

    def __init__(self, scene: viser.SceneApi, robot: Robot) -> None:
        self._scene = scene
        self.colours = colours_of(robot)
        self._bodies: dict[str, Any] = {}
        self._later: list[tuple[str, str, tuple[Shape, ...], list[Any]]] = []
        self._lock = threading.Lock()
        self._is_gone = False
        self._corners: dict[str, list[Any]] = {}
        self._axes: Any = None
        self._lines: dict[str, Any] = {}
        self._labels: dict[str, Any] = {}
        self._at: Mapping[str, Pose] = {}
        self._robot = robot
        self._hidden: frozenset[str] = frozenset()
        self._selected = ""
        self._names_all = False
        self._measured: tuple[str, ...] = ()
        self._ruler: Any = None
        #: A function that is called with the frame of a body when the user clicks the body.
        self.clicked: Callable[[str], None] = lambda _: None
        scene.set_up_direction("+z")
        with contextlib.suppress(AttributeError):  # a window has no world axes; its server has
            scene.world_axes.visible = False
        for index, (frame, link) in enumerate(robot.links.items()):
            shapes = link.visuals or link.collisions
            if not shapes or frame not in robot.frames:
                continue
            name = f"/body/{index}"
            self._bodies[frame] = scene.add_frame(name, show_axes=False)
            is_later = link.collisions and any(shape.kind == "mesh" for shape in link.visuals)
            handles = self._add_shapes(
                frame, f"{name}/first", link.collisions if is_later else shapes
            )
            if is_later:
                self._later.append((frame, f"{name}/visual", shapes, handles))
        sides = (
            high - low
            for frame in self._corners
            for low, high in zip(*self.bounds(frame), strict=True)
        )
        self.scale = scale_of(sides)
        self._axes_m = AXES_M * self.scale
        self.fields = FieldsOfView(scene, robot, self.scale)

    def add_meshes(self) -> None:
        """Replace collision shapes with visual meshes.

        A link with an unreadable mesh keeps its collision shapes.
        """
        for frame, name, shapes, before in self._later:
            if any(mesh_of(shape) is None for shape in shapes):
                continue
            with self._lock:
                if self._is_gone:
                    return
                self._add_shapes(frame, name, shapes)
                for handle in before:
                    handle.remove()

    def end(self) -> None:
        """Stop ``add_meshes``, because this scene is no longer used."""
        with self._lock:
            self._is_gone = True

    def _add_shapes(self, frame: str, name: str, shapes: tuple[Shape, ...]) -> list[Any]:
        handles = []
        for number, shape in enumerate(shapes):
            added = _add_shape(self._scene, f"{name}/{number}", shape, colour_of(shape), 0.8)
            if added is not None:
                mesh, handle = added
                handles.append(handle)
                handle.on_click(lambda _, frame=frame: self.clicked(frame))
                corners = itertools.product(*mesh.bounds.T.tolist())
                self._corners.setdefault(frame, []).extend(
                    (shape.pose @ Pose(corner)).xyz for corner in corners
                )
        return handles

    def update(self, robot: Robot, poses: Mapping[str, Pose]) -> None:
        """Move every frame.

        ``poses`` are poses of frames in the roots of their trees.
        """
        for frame, body in self._bodies.items():
            if poses[frame] != self._at.get(frame):
                body.wxyz, body.position = wxyz(poses[frame]), poses[frame].xyz
        # A copy: a window adds labels in a thread of its own, while the live tree moves them.
        for frame, label in tuple(self._labels.items()):
            if poses[frame] != self._at.get(frame):
                label.position = poses[frame].xyz
        self._robot, self._at = robot, poses
        self.fields.update(poses)
        rows = np.array(
            [poses[frame].xyz + poses[frame].quat_xyzw for frame in robot.frames], np.float32
        ).reshape(-1, 7)
        rotations, positions = rows[:, [6, 3, 4, 5]], rows[:, :3]
        if self._axes is None:
            self._axes = self._scene.add_batched_axes(
                "/frames",
                rotations,
                positions,
                axes_length=self._axes_m,
                axes_radius=self._axes_m / 20,
                batched_scales=self._scales(),
            )
        else:
            self._axes.batched_wxyzs, self._axes.batched_positions = rotations, positions
        self._draw_edges()
        if self._measured:
            self._draw_measured()

    def _draw_edges(self) -> None:
        poses, visible = self._at, self._at.keys() - self._hidden
        ends: dict[str, list[tuple[Vector, Vector]]] = {owner: [] for owner in self.colours}
        for edge in self._robot.edges:
            if edge.parent in poses and edge.child in visible:
                ends[edge.owner].append((poses[edge.parent].xyz, poses[edge.child].xyz))
        for index, (owner, colour) in enumerate(self.colours.items()):
            points = np.array(ends[owner], np.float32).reshape(-1, 2, 3)
            if owner in self._lines:
                self._lines[owner].points = points
            else:
                self._lines[owner] = self._scene.add_line_segments(
                    f"/edges/{index}", points, colour, thickness=3, thickness_units="screen"
                )

    def add_grid(self, poses: Mapping[str, Pose]) -> Bounds:
        """Draw a grid below the robot; return the bounds of everything shown."""
        bodies = [
            (poses[frame] @ Pose(xyz)).xyz
            for frame, corners in self._corners.items()
            for xyz in corners
        ]
        points = np.array([pose.xyz for pose in poses.values()] + bodies).reshape(-1, 3)
        bounds = Bounds.around(np.concatenate((points, self.fields.points(poses))), self._axes_m)
        self._scene.add_grid(
            "/grid",
            20,
            20,
            cell_size=0.1,
            section_size=1,
            cell_color=(235, 235, 235),
            fade_distance=max(12.0, 4 * bounds.radius),
            position=(0.0, 0.0, float(points[:, 2].min())),
        )
        return bounds

    def measure(self, frames: tuple[str, ...]) -> None:
        """Draw a line between two frames, or remove it."""
        self._measured = frames
        self._draw_measured()

    def _draw_measured(self) -> None:
        ends = [self._at[frame].xyz for frame in self._measured if frame in self._at]
        if self._ruler is not None:
            self._ruler.remove()
            self._ruler = None
        if len(ends) == 2:  # noqa: PLR2004 (a line's)
            self._ruler = self._scene.add_line_segments(
                "/ruler",
                np.array([ends], np.float32),
                _RULER,
                thickness=2,
                thickness_units="screen",
            )

    def hide(self, frames: Iterable[str]) -> None:
        """Hide these frames, with their bodies, labels and edges; show all other frames."""
        self._hidden = frozenset(frames)
        for frame, handle in (*self._bodies.items(), *self._labels.items()):
            handle.visible = frame not in self._hidden
        self._axes.batched_scales = self._scales()
        self._draw_edges()
        self.fields.hide(self._hidden)

    def select(self, frame: str) -> None:
        """Draw the axes of a frame longer than all others, and show its name."""
        self._selected = frame
        self._axes.batched_scales = self._scales()
        self._label()

    def _scales(self) -> Any:
        sizes = []
        for frame in self._robot.frames:
            size = _SELECTED if frame == self._selected else 1
            sizes.append(0 if frame in self._hidden else size)
        return np.fromiter(sizes, np.float32)

    def name_all(self, *, visible: bool) -> None:
        """Show the names of all frames next to them, or only that of the selected frame."""
        self._names_all = visible
        self._label()

    def _label(self) -> None:
        for frame in [
            label for label in self._labels if not (self._names_all or label == self._selected)
        ]:
            self._labels.pop(frame).remove()
        for index, (frame, pose) in enumerate(self._at.items()):
            if frame not in self._labels and (self._names_all or frame == self._selected):
                self._labels[frame] = self._scene.add_label(
                    f"/labels/{index}",
                    frame,
                    position=pose.xyz,
                    visible=frame not in self._hidden,
                    anchor="bottom-left",
                )

    def show_owner(self, owner: str, *, visible: bool) -> None:
        """Show or hide the edges of an owner."""
        self._lines[owner].visible = visible

    def bounds(self, frame: str) -> tuple[Vector, Vector]:
        """Return the bounds of a frame's shown body, in the frame, in metres."""
        columns = list(zip(*self._corners[frame], strict=True))
        (x0, y0, z0), (x1, y1, z1) = (tuple(map(bound, columns)) for bound in (min, max))
        return (x0, y0, z0), (x1, y1, z1)

    def is_shown(self, frame: str) -> bool:
        """Return whether the scene shows the body of a frame."""
        return bool(self._bodies[frame].visible)


class Ghosts:
    """Transparent bodies and axes at the expected poses of frames that are elsewhere."""

    def __init__(self, scene: viser.SceneApi, robot: Robot) -> None:
        self._scene = scene
        self._links = robot.links
        self._names = {frame: f"/ghost/{index}" for index, frame in enumerate(robot.frames)}
        self._axes: dict[str, Any] = {}

    def show(self, poses: Mapping[str, Pose]) -> None:
        """Show only these frames.

        ``poses`` are poses of frames in the roots of their trees.
        """
        for frame in self._axes.keys() - poses.keys():
            self._axes.pop(frame).remove()
        for frame, name in self._names.items():
            if frame not in poses:
                continue
            if frame not in self._axes:
                self._axes[frame] = self._scene.add_frame(
                    name, axes_length=AXES_M / 2, axes_radius=AXES_M / 40
                )
                link = self._links.get(frame)
                for number, shape in enumerate((link.visuals or link.collisions) if link else ()):
                    _add_shape(self._scene, f"{name}/{number}", shape, _GHOST, 0.25)
            self._axes[frame].wxyz, self._axes[frame].position = (
                wxyz(poses[frame]),
                poses[frame].xyz,
            )
