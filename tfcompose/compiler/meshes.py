"""Mesh files as triangles in metres, read by trimesh."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import trimesh

if TYPE_CHECKING:
    from tfcompose.foundation.geometry import Vector

#: A COLLADA file declares its unit in its head, before the first geometry.
_HEAD = 65_536
_UNIT = re.compile(rb"""<unit\b[^>]*\bmeter\s*=\s*["']\s*([0-9.eE+-]+)""")


def read_mesh(path: str, scale: Vector) -> Any:
    """Return the mesh of a file at a scale, a ``trimesh.Trimesh``.

    A COLLADA file is in the unit that it declares, as in RViz and Gazebo. Like them, this ignores
    up_axis.

    Raises:
        Exception: any exception of a reader, for a file that is no mesh.
    """
    mesh: Any = trimesh.load(path, force="mesh")
    unit = _collada_unit(path)
    mesh.apply_scale([factor * unit for factor in scale])
    return mesh


def _collada_unit(path: str) -> float:
    """Return the metres in the unit of a COLLADA file.

    1 where it declares none, and for other files.
    """
    if not path.lower().endswith(".dae"):
        return 1.0
    with Path(path).open("rb") as file:
        match = _UNIT.search(file.read(_HEAD))
    metres = float(match[1]) if match else 1.0
    return metres if 0 < metres < math.inf else 1.0
