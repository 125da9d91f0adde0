"""Mesh files as triangles in metres, read by trimesh."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import trimesh

if TYPE_CHECKING:
    from tfcompose.foundation.geometry import Vector

#: Number of bytes to search for the unit, which a COLLADA file declares before its first geometry.
_HEAD = 65_536
_UNIT = re.compile(rb"""<unit\b[^>]*\bmeter\s*=\s*["']\s*([0-9.eE+-]+)""")


def read_mesh(path: str, scale: Vector) -> Any:
    """Return the mesh of a file at a scale, as a ``trimesh.Trimesh`` in metres.

    Lengths in a COLLADA file are in the file's declared unit, as in RViz and Gazebo. ``up_axis``
    is ignored, as in RViz and Gazebo.

    Raises:
        Exception: any exception of trimesh's readers, if the file is not a mesh.
    """
    mesh: Any = trimesh.load(path, force="mesh")
    unit = _collada_unit(path)
    mesh.apply_scale([factor * unit for factor in scale])
    return mesh


def _collada_unit(path: str) -> float:
    """Return the length of a COLLADA file's unit in metres.

    1 if the file declares no unit or has another format.
    """
    if not path.lower().endswith(".dae"):
        return 1.0
    with Path(path).open("rb") as file:
        match = _UNIT.search(file.read(_HEAD))
    metres = float(match[1]) if match else 1.0
    return metres if 0 < metres < math.inf else 1.0
