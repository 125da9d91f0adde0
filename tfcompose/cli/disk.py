"""What the compiler may ask about files on this machine: which are there, where packages are, and a mesh's volume."""

from __future__ import annotations

import contextlib
import math
import os
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tfcompose.cli.terminal import read_text
from tfcompose.resolve.moments import Moments
from tfcompose.resolve.packages import FETCH, Disk, UnmeasurableError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.pose import Vector
    from tfcompose.resolve.packages import Packages

_POINTER = b"version https://git-lfs.github.com/spec/"


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
    with contextlib.suppress(OSError), Path(path).open("rb") as file:
        return file.read(len(_POINTER)) == _POINTER
    return False


@cache
def moments(path: str, scale: Vector) -> Moments:
    """Return volume, centre and tensor of a closed mesh at a scale, integrated over its triangles by trimesh.

    Raises:
        UnmeasurableError: if the file is no mesh, or the mesh is not closed; or if trimesh is not installed.
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
        mesh.apply_scale(scale)
        closed = bool(mesh.is_watertight)
        volume = float(mesh.volume) if closed else 0.0
    except Exception as error:  # noqa: BLE001 (readers of a dozen formats: anything can come out of them)
        said = " ".join(str(error).split()) or type(error).__name__
        raise UnmeasurableError("TF725", f"it cannot be read: {said}", "STL, OBJ, PLY, or give inertia") from None
    if not 0 < abs(volume) < math.inf:
        why = "it has no volume" if closed else "it is not closed, and has no volume"
        raise UnmeasurableError("TF725", why, "close it, give a closed collision shape, or give mass and inertia")
    mesh.density = math.copysign(1.0, volume)  # where all its triangles face inwards
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = mesh.moment_inertia.tolist()
    x, y, z = mesh.center_mass.tolist()
    return Moments(abs(volume), (x, y, z), (xx, xy, xz, yy, yz, zz))
