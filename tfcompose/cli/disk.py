"""What the compiler may ask about files on this machine: which are there, where packages are, and a mesh's volume."""

from __future__ import annotations

import contextlib
import math
import os
import re
import warnings
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from tfcompose.cli.terminal import read_text
from tfcompose.resolve.moments import Moments
from tfcompose.resolve.packages import FETCH, Disk, UnmeasurableError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.geometry import Vector
    from tfcompose.resolve.packages import Packages

_POINTER = b"version https://git-lfs.github.com/spec/"

#: A COLLADA file says its unit in its head, before the first geometry.
_HEAD = 65_536
_UNIT = re.compile(rb"""<unit\b[^>]*\bmeter\s*=\s*["']\s*([0-9.eE+-]+)""")

#: The part of its size cubed below which a volume is what rounding leaves of a plane.
_FLAT = 1e-12


def disk() -> Disk:
    """Return this machine's files, with the packages of the workspaces that are sourced."""
    prefixes = tuple(prefix for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if prefix)
    return Disk(read_text, os.path.isfile, os.path.isdir, prefixes, moments, _expanded, os.path.abspath, _is_pointer)


def _expanded(file: str, packages: Packages, arguments: Mapping[str, Any], text: str | None) -> str:
    result: str = import_module("tfcompose.cli.xacro").expanded(file, packages, arguments, text)
    return result


@cache
def _is_pointer(path: str) -> bool:
    """Return whether the file is what a checkout without Git LFS has in another's place (git-lfs's own spec, v1)."""
    with contextlib.suppress(OSError):
        return _beginning(path, len(_POINTER)) == _POINTER
    return False


def _beginning(path: str, size: int) -> bytes:
    descriptor = os.open(path, os.O_RDONLY)  # pathlib's import costs more than all reads of a lint
    try:
        return os.read(descriptor, size)
    finally:
        os.close(descriptor)


@cache
def moments(path: str, scale: Vector) -> Moments:
    """Return volume, centre and tensor of a closed mesh at a scale, integrated over its triangles by trimesh.

    A COLLADA file is in the unit that it says, as RViz and Gazebo read it; its up_axis is passed over, as they do.

    Raises:
        UnmeasurableError: if the file is no mesh, or the mesh is not closed or has faces turned both ways; or if
            trimesh is not installed.
    """
    if _is_pointer(path):
        raise UnmeasurableError("TF725", "it is a Git LFS pointer, and has no volume", FETCH)
    try:
        trimesh: Any = import_module("trimesh")
    except ImportError:
        advice = "pip install 'tfcompose[mesh]', or give inertia: {ixx, iyy, izz}"
        raise UnmeasurableError("TF905", "trimesh is not installed, and computes its volume", advice) from None
    try:
        mesh = trimesh.load(path, force="mesh")
        unit = _collada_unit(path)
        mesh.apply_scale([factor * unit for factor in scale])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numpy's, about what is divided by a volume of 0
            why = _why_open(mesh)
            mesh = mesh if why else import_module("tfcompose.cli.mesh_bodies").facing_alike(mesh)
            why = why or _why_flat(mesh)
            volume = 0.0 if why else float(mesh.volume)
    except Exception as error:  # noqa: BLE001 (readers of a dozen formats: anything can come out of them)
        said = " ".join(str(error).split()) or type(error).__name__
        raise UnmeasurableError("TF725", f"it cannot be read: {said}", "STL, OBJ, PLY, or give inertia") from None
    if not 0 < abs(volume) < math.inf:
        advice = "mend it, give a closed collision shape, or give mass and inertia"
        raise UnmeasurableError("TF725", why or "it has no volume", advice)
    mesh.density = math.copysign(1.0, volume)  # where all its triangles face inwards
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = mesh.moment_inertia.tolist()
    x, y, z = mesh.center_mass.tolist()
    return Moments(abs(volume), (x, y, z), (xx, xy, xz, yy, yz, zz))


def _why_open(mesh: Any) -> str:
    """Return why the triangles enclose nothing, or an empty text."""
    if not len(mesh.faces):
        return "it has no triangles"
    if not mesh.is_watertight:
        return "it is not closed, and has no volume"
    if not mesh.is_winding_consistent:
        return "some of its triangles face inwards and others outwards, so that it has no volume"
    return ""


def _why_flat(mesh: Any) -> str:
    return "" if abs(mesh.volume) > _FLAT * mesh.scale**3 else "it is flat, and has no volume"


def _collada_unit(path: str) -> float:
    """Return the metres in the unit of a COLLADA file; 1 where it says none, and for other files."""
    if not path.lower().endswith(".dae"):
        return 1.0
    said = _UNIT.search(_beginning(path, _HEAD))
    metres = float(said[1]) if said else 1.0
    return metres if 0 < metres < math.inf else 1.0
