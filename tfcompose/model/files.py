"""Files that tfcompose writes: their text, and how they address meshes and textures."""

from __future__ import annotations

import html
import posixpath
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal
from urllib.parse import quote

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model.robot import Asset, Robot

Form = Literal["as-written", "package", "file", "relative"]


@dataclass(frozen=True, slots=True)
class File:
    """A file to be written: its path below the output folder, and its text."""

    path: str
    text: str


@dataclass(frozen=True, slots=True)
class Target:
    """Where files are written, relative to the robot's paths, and how they address others.

    ``as-written`` keeps addresses. ``package`` writes ``package://``, ``file`` absolute
    ``file://``, and ``relative`` paths from the folder.
    """

    form: Form = "as-written"
    #: The folder of the written file; relative paths become relative to it.
    folder: str = "."
    #: The absolute folder from which relative paths begin.
    top: str = "/"

    def address(self, asset: Asset) -> str:
        """Return the address; one impossible in this form is kept (see ``unaddressed``)."""
        if self.form == "package" and asset.package:
            return f"package://{asset.package}/{_quote_path(asset.inside)}"
        if self.form == "file" and asset.path:
            return "file://" + _quote_path(
                posixpath.normpath(posixpath.join(self.top, asset.path))
            )
        plain = "://" not in asset.uri and not asset.uri.startswith("/")
        if asset.path and (self.form == "relative" or plain):
            return self.from_folder(asset.path)
        return asset.uri

    def from_folder(self, path: str) -> str:
        """Return the path seen from the folder of the written files."""
        begin = posixpath.join(self.top, self.folder)
        return posixpath.relpath(posixpath.join(self.top, path), begin)


AS_IN_SOURCE = Target()
_NOT_IN_ADDRESSES = re.compile(r"[\x00-\x20\x7f#%?]")


def _quote_path(path: str) -> str:
    """Return the path as an address has it: a space is %20.

    ROS reads addresses with libcurl, which refuses spaces and takes ``#``, ``?`` and ``%`` for
    something else. What it takes as it is stays so, since other readers decode nothing.
    """
    return _NOT_IN_ADDRESSES.sub(lambda match: f"%{ord(match[0]):02X}", path)


def assets(robot: Robot) -> Iterator[Asset]:
    """Yield the files that the robot's bodies name."""
    for link in robot.links.values():
        for shape in (*link.visuals, *link.collisions):
            if shape.mesh:
                yield shape.mesh
            if shape.material and shape.material.texture:
                yield shape.material.texture


def assets_without_address(robot: Robot, form: Form) -> list[Asset]:
    """Return the files that have no address of this form: in no package, or of unknown place.

    Each once.
    """
    if form == "as-written":
        return []
    unaddressed: dict[Asset, None] = {}
    for asset in assets(robot):
        known = asset.package if form == "package" else asset.path
        if not known and not _elsewhere(asset):
            unaddressed[asset] = None
    return list(unaddressed)


def _elsewhere(asset: Asset) -> bool:
    """Whether the address is for others to resolve: http, model."""
    return "://" in asset.uri and not asset.uri.startswith(("package://", "file://"))


_RELATIVE = re.compile(
    r"""(<(?:mesh|texture)\s[^<>]*?\bfilename\s*=\s*)(["'])"""
    r"""(?!/|[A-Za-z][A-Za-z0-9+.-]*://)([^<>]+?)\2"""
)


def with_absolute_addresses(urdf: str, folder: Path) -> str:
    """Return the URDF with paths relative to ``folder`` as absolute ``file://`` addresses.

    Who reads the description from a topic does not know that folder. Only the machine that runs
    the plan does, so that what is built stays the same everywhere.
    """

    def absolute(match: re.Match[str]) -> str:
        path = Path(folder, html.unescape(match[3])).resolve()
        return f"{match[1]}{match[2]}file://{quote(str(path))}{match[2]}"

    return _RELATIVE.sub(absolute, urdf)
