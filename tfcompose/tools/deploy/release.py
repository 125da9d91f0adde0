"""Release of a robot: its built files and the files that they name."""

from __future__ import annotations

import io
import os
import posixpath
import re
import tarfile
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.compiler.emit import emit
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.foundation.findings import RejectedError, finding
from tfcompose.foundation.reading import is_file, is_folder
from tfcompose.model.files import Target, assets
from tfcompose.model.plan.file import write_plan
from tfcompose.tools.deploy.agent import digest_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.model.plan import Plan
    from tfcompose.model.robot import Asset, Robot

#: The folders in a release for files that the robot names, and for wheels.
NAMED, WHEELS = "files", "wheels"
#: The maximum numbers of files and bytes in a folder that a process names.
MOST_FILES, MOST_BYTES = 20_000, 2_000_000_000
#: The length of a release's name, in characters of its digest.
NAME_LENGTH = 16
#: Suffixes of files that may name other files relative to their own folder, and the maximum size
#: of such a file in bytes.
_NAMING = frozenset(
    {".dae", ".gltf", ".json", ".mtl", ".obj", ".sdf", ".urdf", ".xacro", ".xml", ".yaml", ".yml"}
)
_MOST_NAMING_BYTES = 20_000_000
_WORD = re.compile(rb"[A-Za-z0-9_./ -]+\.[A-Za-z0-9]+")


@dataclass(frozen=True, slots=True)
class _Packing(Target):
    """Replaces paths of files by their paths in the release."""

    #: The path of each file in the release, by its absolute path on this computer. Empty if the
    #: path is not yet known.
    places: dict[str, str] = field(default_factory=dict)

    def address(self, asset: Asset) -> str:
        """Return the address of a mesh or an image.

        An address in a package stays, because the hosts must have the package installed.
        """
        is_file = bool(asset.path) and ("://" not in asset.uri or asset.uri.startswith("file://"))
        return self.from_folder(asset.path) if is_file else asset.uri

    def from_folder(self, path: str) -> str:
        """Return a file's path relative to the URDF that names it."""
        file = posixpath.normpath(posixpath.join(self.top, path))
        return posixpath.relpath(self.places.setdefault(file, NAMED), self.folder)


@dataclass(frozen=True)
class Release:
    """The files of a release, by their paths in its folder.

    The name of a release is a digest of its files. The same files have the same name on every
    computer.
    """

    plan: Plan
    #: Built files.
    texts: Mapping[str, str]
    #: Paths on this computer of the files to copy, by their paths in the release.
    copies: Mapping[str, Path]

    @cached_property
    def manifest(self) -> dict[str, str]:
        """The digest of each file's content, by path."""
        built = {path: digest_of(text.encode()) for path, text in self.texts.items()}
        return built | {path: digest_of(file.read_bytes()) for path, file in self.copies.items()}

    @property
    def name(self) -> str:
        """The name of the release."""
        return name_of(self.manifest)

    @property
    def has_wheels(self) -> bool:
        """Whether the release has its own Python environment."""
        return any(path.startswith(f"{WHEELS}/") for path in self.copies)

    def with_text(self, path: str, text: str) -> Release:
        """Return the release with another file, without computing the other digests again."""
        made = Release(self.plan, {**self.texts, path: text}, self.copies)
        made.__dict__["manifest"] = self.manifest | {path: digest_of(text.encode())}
        return made

    def archive(self) -> Iterator[bytes]:
        """Yield the files as a tar archive, in chunks."""
        buffer = io.BytesIO()
        with tarfile.open(fileobj=buffer, mode="w", format=tarfile.PAX_FORMAT) as tar:
            for path, text in self.texts.items():
                data = text.encode()
                yield from _add(tar, buffer, path, data, executable=False)
            for path, file in self.copies.items():
                yield from _add(
                    tar, buffer, path, file.read_bytes(), executable=os.access(file, os.X_OK)
                )
        yield buffer.getvalue()


def name_of(manifest: Mapping[str, str]) -> str:
    """Return the name of a release from the digests of its files."""
    return digest_of(repr(sorted(manifest.items())).encode())[:NAME_LENGTH]


def _add(
    tar: tarfile.TarFile, buffer: io.BytesIO, path: str, data: bytes, *, executable: bool
) -> Iterator[bytes]:
    entry = tarfile.TarInfo(path)
    entry.size, entry.mode = len(data), 0o755 if executable else 0o644
    tar.addfile(entry, io.BytesIO(data))
    yield buffer.getvalue()
    buffer.seek(0)
    buffer.truncate()


def pack_release(robot: Robot, wheels: Path | None = None) -> Release:
    """Return the release of a valid robot.

    Relative paths start at the current folder. Files keep their positions relative to each other,
    so that a map finds its image and a mesh finds its textures.

    Raises:
        RejectedError: with each named file that cannot be copied.
    """
    top = Path.cwd().as_posix()
    draft = _Packing(top=top)
    plan_of(robot.with_final_names(), draft)
    for asset in assets(robot):
        draft.address(asset)
    for part in robot.parts:
        for asset in assets(part.robot):
            draft.address(asset)
    files = _add_named_files(draft.places)
    places = _places(files, draft.places)
    target = _Packing(top=top, folder=".", places={file: places[file] for file in draft.places})
    texts = {file.path: file.text for file in emit(robot, target)}
    plan = replace(
        plan_of(robot.with_final_names(), target), hosts={}
    )  # only addresses of hosts may differ
    texts["plan.json"] = write_plan(plan)
    copies = {places[file]: Path(file) for file in files}
    for wheel in sorted(wheels.glob("*.whl")) if wheels else ():
        copies[f"{WHEELS}/{wheel.name}"] = wheel
    return Release(plan, texts, copies)


def _add_named_files(named: Mapping[str, str]) -> list[str]:
    """Return the named files, all files in named folders, and the files that these name.

    Raises:
        RejectedError: if a file does not exist, or there are too many files.
    """
    paths: dict[str, None] = {}
    size = 0
    waiting = sorted(named)
    while waiting:
        path = Path(waiting.pop())
        if path.as_posix() in paths:
            continue
        if is_folder(path):
            inside = (inner for inner in sorted(path.rglob("*")) if is_file(inner))
            waiting += [
                inner.as_posix() for inner in inside if not _is_hidden(inner.relative_to(path))
            ]
        elif is_file(path):
            paths[path.as_posix()] = None
            size += path.stat().st_size
            waiting += _files_named_in(path)
        else:
            raise RejectedError(
                [finding("TF912", f"{path} does not exist, and the robot needs it", None)]
            )
        if len(paths) + len(waiting) > MOST_FILES or size > MOST_BYTES:
            most = f"{MOST_FILES:,} files or {MOST_BYTES // 10**9} GB"
            advice = "name a folder with only what the robot needs"
            raise RejectedError(
                [
                    finding(
                        "TF912", f"the files that the robot names exceed {most}", None, help=advice
                    )
                ]
            )
    return sorted(paths)


def _is_hidden(path: Path) -> bool:
    return any(part.startswith(".") or part == "__pycache__" for part in path.parts)


def _files_named_in(path: Path) -> list[str]:
    """Return the files that a file names relative to its own folder."""
    if path.suffix.lower() not in _NAMING or path.stat().st_size > _MOST_NAMING_BYTES:
        return []
    names = {name.decode().strip() for name in _WORD.findall(path.read_bytes())}
    files = (path.parent / name for name in names if not name.startswith("/") and len(name) < 200)  # noqa: PLR2004
    return [os.path.normpath(file) for file in files if is_file(file)]


def _places(files: list[str], named: Mapping[str, str]) -> dict[str, str]:
    """Return the paths of files and named folders in the release.

    These paths are relative to the folder that contains all of them.
    """
    everything = [*files, *named]
    folders = [posixpath.dirname(file) for file in files] + [
        folder for folder in named if is_folder(folder)
    ]
    top = posixpath.commonpath(folders) if folders else "/"
    return {
        file: posixpath.normpath(f"{NAMED}/{posixpath.relpath(file, top)}") for file in everything
    }
