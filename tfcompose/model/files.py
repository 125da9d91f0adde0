"""Files that tfcompose writes, and the form in which they address meshes and textures."""

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
    """A file to write: its path below the output folder, and its text."""

    path: str
    text: str


@dataclass(frozen=True, slots=True)
class Target:
    """The folder to write files to, and the form in which they address other files.

    ``as-written`` keeps addresses. ``package`` writes ``package://``, ``file`` absolute
    ``file://``, and ``relative`` paths relative to the folder.
    """

    form: Form = "as-written"
    #: The folder of the written file, from which relative paths start.
    folder: str = "."
    #: The absolute folder from which the robot's relative paths start.
    top: str = "/"

    def address(self, asset: Asset) -> str:
        """Return the address in this form, or the original address if this form is impossible."""
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
        """Return the path relative to the folder of the written files."""
        begin = posixpath.join(self.top, self.folder)
        return posixpath.relpath(posixpath.join(self.top, path), begin)


AS_IN_SOURCE = Target()
_NOT_IN_ADDRESSES = re.compile(r"[\x00-\x20\x7f#%?]")


def _quote_path(path: str) -> str:
    """Return the path as part of an address: a space becomes %20.

    ROS reads addresses with libcurl, which rejects spaces and gives ``#``, ``?`` and ``%`` a
    meaning. Other characters stay unchanged, because other readers do not decode addresses.
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
    """Return the files that have no address in this form, without duplicates.

    A file lacks an address if it is in no package or its place is unknown.
    """
    if form == "as-written":
        return []
    unaddressed: dict[Asset, None] = {}
    for asset in assets(robot):
        location = asset.package if form == "package" else asset.path
        if not location and not _elsewhere(asset):
            unaddressed[asset] = None
    return list(unaddressed)


def _elsewhere(asset: Asset) -> bool:
    """Return whether other programs resolve the address, as for http and model."""
    return "://" in asset.uri and not asset.uri.startswith(("package://", "file://"))


_RELATIVE = re.compile(
    r"""(<(?:mesh|texture)\s[^<>]*?\bfilename\s*=\s*)(["'])"""
    r"""(?!/|[A-Za-z][A-Za-z0-9+.-]*://)([^<>]+?)\2"""
)


def with_absolute_addresses(urdf: str, folder: Path) -> str:
    """Replace relative paths in the URDF by absolute ``file://`` addresses.

    Paths are relative to ``folder``. Readers of the description on a topic do not know the folder.
    Only the machine that runs the plan replaces the paths, so that built files are the same on
    every machine.
    """

    def absolute(match: re.Match[str]) -> str:
        path = Path(folder, html.unescape(match[3])).resolve()
        return f"{match[1]}{match[2]}file://{quote(str(path))}{match[2]}"

    return _RELATIVE.sub(absolute, urdf)
