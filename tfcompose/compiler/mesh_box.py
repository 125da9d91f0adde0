"""Bounding boxes of mesh files (STL, OBJ and COLLADA), read without a library.

Rules use the boxes to detect the unit of a file. For that, a sample of a large file is enough, and
it saves the time to import numpy.
"""

from __future__ import annotations

import itertools
import math
import re
import struct
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from tfcompose.foundation.geometry import quat_from_axis_angle, rotate

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.robot import Shape

#: The minimum and maximum of x, y and z.
Corners = tuple["Vector", "Vector"]

_MOST_BYTES = 100_000_000
_HEAD, _COUNT, _TRIANGLE = 80, struct.Struct("<I"), struct.Struct("<12x9f2x")
_BODY = _HEAD + _COUNT.size
#: Maximum number of triangles to read from an STL file, evenly spread over the file.
_MOST_TRIANGLES = 5_000
_NUMBER = rb"[-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?"
_STL_VERTEX = re.compile(rb"\bvertex\s+(%b)\s+(%b)\s+(%b)" % (_NUMBER, _NUMBER, _NUMBER))
_OBJ_VERTEX = re.compile(
    rb"^v[ \t]+(%b)[ \t]+(%b)[ \t]+(%b)" % (_NUMBER, _NUMBER, _NUMBER), re.MULTILINE
)
_DEEPEST = 50


def size_of(shape: Shape) -> Vector | None:
    """Return the side lengths of the shape's bounding box along the shape's axes, in metres.

    None for a mesh whose file is missing, unreadable, or in another format.
    """
    match shape.kind:
        case "box":
            x, y, z = shape.size
            return (x, y, z)
        case "sphere":
            return (2 * shape.size[0],) * 3
        case "cylinder":
            return (2 * shape.size[0], 2 * shape.size[0], shape.size[1])
        case "capsule":
            width = 2 * shape.size[0]
            return (width, width, shape.size[1] + width)
    box = mesh_box(shape.mesh.path) if shape.mesh and shape.mesh.path else None
    if box is None:
        return None
    x, y, z = (
        abs(factor) * (high - low) for factor, low, high in zip(shape.size, *box, strict=True)
    )
    return (x, y, z)


@lru_cache(maxsize=512)
def mesh_box(path: str) -> Corners | None:
    """Return the bounding box of a mesh at scale 1, in metres.

    None if the file is unreadable, has another format, or has no vertices.
    """
    read = _READERS.get(path.rpartition(".")[2].lower())
    try:
        if read is None or Path(path).stat().st_size > _MOST_BYTES:
            return None
        return read(Path(path).read_bytes())
    except (OSError, ValueError, ArithmeticError, LookupError, TypeError, ET.ParseError):
        return None  # code that needs the triangles reports the broken mesh


def _around(points: Iterable[Vector]) -> Corners | None:
    columns = list(zip(*points, strict=True))
    if len(columns) != 3 or not all(math.isfinite(sum(column)) for column in columns):  # noqa: PLR2004 (x, y, z)
        return None
    x, y, z = ((min(column), max(column)) for column in columns)
    return (x[0], y[0], z[0]), (x[1], y[1], z[1])


def _stl(data: bytes) -> Corners | None:
    count = _COUNT.unpack_from(data, _HEAD)[0] if len(data) >= _BODY else 0
    if not count or _BODY + _TRIANGLE.size * count != len(data):
        return _around(_vertices(_STL_VERTEX, data))
    step = -(-count // _MOST_TRIANGLES) * _TRIANGLE.size
    triangles = (_TRIANGLE.unpack_from(data, offset) for offset in range(_BODY, len(data), step))
    return _around(numbers[i : i + 3] for numbers in triangles for i in (0, 3, 6))


def _obj(data: bytes) -> Corners | None:
    return _around(_vertices(_OBJ_VERTEX, data))


def _vertices(pattern: re.Pattern[bytes], data: bytes) -> Iterator[Vector]:
    for x, y, z in pattern.findall(data):
        yield float(x), float(y), float(z)


def _collada(data: bytes) -> Corners | None:
    """Return the box around the geometries as the scene places them, in metres.

    ``up_axis`` is ignored, as in RViz and Gazebo.
    """
    if b"<!ENTITY" in data:
        return None
    root = ET.fromstring(data)  # noqa: S314 (entities were refused)
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    scene = _Scene({f"#{element.get('id')}": element for element in root.iter()})
    unit = root.find("asset/unit")
    metres = float(unit.get("meter", 1)) if unit is not None else 1.0
    nodes = [node for visual in root.iter("visual_scene") for node in visual.iterfind("node")]
    points = [point for node in nodes for point in scene.points_of(node)]
    if not points:
        points = [point for mesh in root.iter("mesh") for point in scene.corners(mesh)]
    return _around((metres * x, metres * y, metres * z) for x, y, z in points)


@dataclass(frozen=True, slots=True)
class _Scene:
    """The elements of a COLLADA file, by the identifiers that other elements refer to."""

    elements: Mapping[str, ET.Element]

    def points_of(self, node: ET.Element, depth: int = 0) -> list[Vector]:
        """Return corner points around the node's meshes, in the frame of the node's parent."""
        if depth > _DEEPEST:
            return []
        points: list[Vector] = []
        for child in node:
            target = self.elements.get(child.get("url", ""))
            if child.tag == "node":
                points += self.points_of(child, depth + 1)
            elif target is None:
                continue
            elif child.tag == "instance_node":
                points += self.points_of(target, depth + 1)
            elif child.tag == "instance_geometry":
                points += self._of_geometry(target)
            elif child.tag == "instance_controller":
                skin = target.find("skin")
                skinned = self.elements.get(skin.get("source", "")) if skin is not None else None
                points += self._of_geometry(skinned) if skinned is not None else []
        for child in reversed(node):
            move = _MOVES.get(child.tag)
            if move:
                points = [move(_floats(child), point) for point in points]
        return points

    def _of_geometry(self, geometry: ET.Element) -> list[Vector]:
        return [point for mesh in geometry.iter("mesh") for point in self.corners(mesh)]

    def corners(self, mesh: ET.Element) -> list[Vector]:
        """Return the eight corners of the box around a mesh's vertices; empty without vertices."""
        numbers: list[float] = []
        for position in mesh.iterfind("vertices/input[@semantic='POSITION']"):
            source = self.elements.get(position.get("source", ""))
            array = source.find("float_array") if source is not None else None
            numbers += _floats(array) if array is not None else []
        box = _around(zip(numbers[0::3], numbers[1::3], numbers[2::3], strict=True))
        if box is None:
            return []
        xs, ys, zs = zip(*box, strict=True)
        return [(x, y, z) for x, y, z in itertools.product(xs, ys, zs)]


def _floats(element: ET.Element) -> list[float]:
    return [float(token) for token in (element.text or "").split()]


def _by_matrix(values: list[float], point: Vector) -> Vector:
    x, y, z = point
    a, b, c, d = (
        values[row] * x + values[row + 1] * y + values[row + 2] * z + values[row + 3]
        for row in (0, 4, 8, 12)
    )
    return (a / d, b / d, c / d)


def _by_translation(values: list[float], point: Vector) -> Vector:
    x, y, z = (value + offset for value, offset in zip(point, values, strict=True))
    return (x, y, z)


def _by_scale(values: list[float], point: Vector) -> Vector:
    x, y, z = (value * factor for value, factor in zip(point, values, strict=True))
    return (x, y, z)


def _by_rotation(values: list[float], point: Vector) -> Vector:
    x, y, z, degrees = values
    return rotate(quat_from_axis_angle((x, y, z), math.radians(degrees)), point)


#: Functions that transform a node's content, by the tag of the transformation.
_MOVES: dict[str, Callable[[list[float], Vector], Vector]] = {
    "matrix": _by_matrix,
    "translate": _by_translation,
    "scale": _by_scale,
    "rotate": _by_rotation,
}

_READERS = {"stl": _stl, "obj": _obj, "dae": _collada}
