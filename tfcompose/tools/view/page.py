"""Writer of a robot as a single HTML page, for a pull request or a ticket.

The page needs no network. It contains the frames with owners, poses and locations, a picture that
the user can turn, and a slider for each joint.
"""

from __future__ import annotations

import base64
import json
import re
import zlib
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from tfcompose.compiler.mounts.kinematics import poses_in_roots
from tfcompose.foundation.geometry import Pose
from tfcompose.foundation.text import plural
from tfcompose.tools.view.camera import VIEWS, Bounds
from tfcompose.tools.view.facts import facts_of
from tfcompose.tools.view.fields import FIELD_COLOURS, outline, reach_at_scale, streams, surface
from tfcompose.tools.view.frame_tree import FrameTree
from tfcompose.tools.view.joints import first_positions, slider_range
from tfcompose.tools.view.scene import AXES_M, colour_of, colours_of, scale_of
from tfcompose.tools.view.shapes import mesh_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from tfcompose.model.robot import Joint, Robot
    from tfcompose.spec.load import Source

#: The decimals of lengths in metres: lengths are exact to a hundredth of a millimetre.
_DECIMALS = 5


def page_of(robot: Robot, sources: Sequence[Source]) -> str:
    """Return the HTML page of a robot; ``sources`` are the files that contain its values."""
    colours = colours_of(robot)
    tree = FrameTree(robot)
    rows = []
    for row in tree.rows(dict.fromkeys(tree.frames, True)):
        edge = robot.parent_edge(row.frame)
        first, *further = map(escape, facts_of(robot, sources, row.frame))
        rows.append(
            f'<details data-frame="{escape(row.frame)}" style="{row.style}">'
            f"<summary>{_swatch(colours[edge.owner]) if edge else ''}{escape(row.frame)}</summary>"
            f"<p>{'<br>'.join([first, *further])}</p></details>"
        )
    scene = json.dumps(_scene(robot, tree), separators=(",", ":"))
    filled = {
        "scene": base64.b64encode(zlib.compress(scene.encode(), 9)).decode(),
        "count": plural(len(tree.frames), "frame"),
        "owners": "".join(f"{_swatch(rgb)}{escape(owner)} " for owner, rgb in colours.items()),
        "title": escape(robot.name),
        "frames": "".join(rows),
    }
    page = files("tfcompose.tools.view").joinpath("page.html").read_text("utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda match: filled[match[1]], page)


def _swatch(colour: tuple[int, int, int]) -> str:
    return f'<i style="background: rgb{colour}"></i>'


def _scene(robot: Robot, tree: FrameTree) -> dict[str, Any]:
    """Return the data that the page draws: frames, joints and bodies, with indices."""
    index = {frame: number for number, frame in enumerate(tree.frames)}
    poses = poses_in_roots(robot, first_positions(robot))
    colours = colours_of(robot)
    bodies = list(_bodies(robot))
    sides = [points.max(axis=0) - points.min(axis=0) for _, _, points, _ in bodies]
    scale = scale_of(float(side) for box in sides for side in box)
    fields = list(_fields(robot, scale))
    standing = [np.array([pose.xyz for pose in poses.values()])]
    standing += [_move_points(poses[frame], points) for frame, _, points, _ in bodies]
    visible = [
        _move_points(poses[field["frame"]], field["ends"]) for field in fields if field["isShown"]
    ]
    bounds = Bounds.around(np.concatenate((*standing, *visible)), AXES_M * scale)
    joints = [edge.joint for edge in robot.edges if edge.joint]
    numbers = {joint.name: number for number, joint in enumerate(joints)}
    return {
        "frames": [_frame(robot, tree, index, numbers, frame) for frame in tree.frames],
        "edges": [
            (index[edge.parent], index[edge.child], colours[edge.owner])
            for edge in robot.edges
            if edge.parent in index and edge.child in index
        ],
        "joints": [_joint(joint, numbers, first_positions(robot)) for joint in joints],
        "bodies": [
            {"frame": index[frame], "colour": colour} | _triangles(points, faces)
            for frame, colour, points, faces in bodies
        ],
        "fields": [
            field | {"frame": index[field["frame"]], "ends": _round(field["ends"])}
            for field in fields
        ],
        "views": VIEWS,
        "middle": _round(bounds.middle),
        "radius": bounds.radius,
        "ground": float(np.concatenate(standing)[:, 2].min()),
        "axes": AXES_M * scale,
    }


def _frame(
    robot: Robot, tree: FrameTree, index: dict[str, int], numbers: dict[str, int], frame: str
) -> dict[str, Any]:
    parent, edge = tree.parent(frame), robot.parent_edge(frame)
    if parent is None or edge is None:
        return {"name": frame, "parent": None, "joint": None}
    return {
        "name": frame,
        "parent": index[parent],
        "joint": numbers[edge.joint.name] if edge.joint else None,
        "xyz": edge.pose.xyz,
        "quat": edge.pose.quat_xyzw,
    }


def _joint(joint: Joint, numbers: dict[str, int], starts: dict[str, float]) -> dict[str, Any]:
    lower, upper = slider_range(joint)
    return {
        "name": joint.name,
        "axis": joint.axis,
        "slides": joint.type == "prismatic",
        "lower": lower,
        "upper": upper,
        "start": starts.get(joint.name, 0.0),
        "mimic": numbers.get(joint.mimic) if joint.mimic else None,
        "multiplier": joint.multiplier,
        "offset": joint.offset,
    }


def _bodies(robot: Robot) -> Iterator[tuple[str, tuple[int, int, int], Any, Any]]:
    """Yield frame, colour, points (n, 3) in the frame and faces of each shape.

    If the visual meshes of a link cannot be read, the page draws its collision shapes.
    """
    for frame, link in robot.links.items():
        shapes = link.visuals
        if not shapes or (link.collisions and any(mesh_of(shape) is None for shape in shapes)):
            shapes = link.collisions
        for shape in shapes if frame in robot.frames else ():
            mesh = mesh_of(shape)
            if mesh is not None and not mesh.is_empty:
                yield frame, colour_of(shape), _move_points(shape.pose, mesh.vertices), mesh.faces


def _fields(robot: Robot, scale: float) -> Iterator[dict[str, Any]]:
    reach = reach_at_scale(scale)
    for sensor, optics in streams(robot):
        yield {
            "frame": optics.frame,
            "sensor": sensor.name,
            "colour": FIELD_COLOURS[optics.kind],
            "isShown": optics.kind == "camera",
            "ends": outline(optics, reach).reshape(-1, 3),
        } | _triangles(*surface(optics, reach))


def _move_points(pose: Pose, points: Any) -> Any:
    """Transform points (n, 3) from a frame to the frame in which it has this pose."""
    rotation = Pose(quat_xyzw=pose.quat_xyzw)
    axes = [(rotation @ Pose(axis)).xyz for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    return np.asarray(points) @ np.array(axes) + pose.xyz


def _triangles(points: Any, faces: Any) -> dict[str, Any]:
    return {"vertices": _round(points.reshape(-1)), "faces": faces.reshape(-1).tolist()}


def _round(values: Any) -> Any:
    return np.asarray(values, float).round(_DECIMALS).tolist()
