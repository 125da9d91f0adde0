"""What the compiler may ask about files on this machine: which are there, where packages are, and a mesh's volume."""

from __future__ import annotations

import contextlib
import os
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tfcompose.cli.reading import read_text
from tfcompose.urdf.inertia import UnmeasurableError
from tfcompose.urdf.packages import FETCH, Disk

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.geometry import Vector
    from tfcompose.urdf.inertia import Moments
    from tfcompose.urdf.packages import Packages
    from tfcompose.urdf.xacro import Call

_POINTER = b"version https://git-lfs.github.com/spec/"


def disk() -> Disk:
    """Return this machine's files, with the packages of the workspaces that are sourced."""
    prefixes = tuple(prefix for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if prefix)
    return Disk(read_text, os.path.isfile, os.path.isdir, prefixes, moments, _expanded, _is_pointer)


@cache
def _is_pointer(path: str) -> bool:
    """Return whether the file is what a checkout without Git LFS has in another's place (git-lfs's own spec, v1)."""
    with contextlib.suppress(OSError), Path(path).open("rb") as file:
        return file.read(len(_POINTER)) == _POINTER
    return False


@cache
def moments(path: str, scale: Vector) -> Moments:
    """Return volume, centre and tensor of a closed mesh at a scale; what reads meshes is loaded only here.

    Raises:
        UnmeasurableError: as ``tfcompose.urdf.mesh.moments``, and if trimesh is not installed.
    """
    if _is_pointer(path):
        raise UnmeasurableError("TF725", "it is a Git LFS pointer, not the mesh", FETCH)
    try:
        from tfcompose.urdf import mesh
    except ImportError:
        advice = "pip install 'tfcompose[mesh]', or give inertia: {ixx, iyy, izz}"
        raise UnmeasurableError("TF905", "trimesh, which computes its volume, is not installed", advice) from None
    return mesh.moments(path, scale)


def _expanded(file: str, packages: Packages, arguments: Mapping[str, Any], call: Call | None) -> str:
    """Return the URDF that xacro makes of a file, or of a call of one of its macros; xacro is loaded only here."""
    if call is None:
        read_text(file)  # a file that cannot be read is refused as everywhere
    from tfcompose.urdf.expand import expand

    return expand(file, packages, arguments, call)
