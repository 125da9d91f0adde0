"""The files that a robot file, a xacro file or a launch file may read: its tree, and packages.

The tree of a file is its folder, and the Git repository and the package around the folder. Some
folders contain unrelated files, such as the home directory and /tmp. In these, the tree consists
only of descriptions in the same folder. This module uses functions of posixpath, which return
False where functions of pathlib raise, for example for a name that is too long.
"""

from __future__ import annotations

import os
import posixpath
import re
import stat
import sys
from pathlib import Path
from typing import Final, NamedTuple

#: Folders of the system, and folders into which programs put unrelated files.
_SHARED: Final = frozenset(
    {
        "/",
        "/bin",
        "/boot",
        "/etc",
        "/home",
        "/lib",
        "/lib64",
        "/opt",
        "/root",
        "/sbin",
        "/srv",
        "/usr",
        "/usr/local",
        "/usr/share",
        "/var",
        "/tmp",  # noqa: S108 (nothing is written there)
        "/var/tmp",  # noqa: S108 (the same)
    }
)
#: Paths that system libraries read: the libraries, the time zone, and devices.
_SYSTEM: Final = (
    "/usr/lib",
    "/usr/lib64",
    "/lib",
    "/lib64",
    "/usr/local/lib",
    "/usr/share/zoneinfo",
    "/etc/ld.so.cache",
    "/etc/localtime",
    "/dev/null",
    "/dev/urandom",
)
_OF_KERNEL: Final = re.compile(r"/(dev|proc|run|sys)(/|$)")
_HOME: Final = re.compile(r"/home/[^/]+")
#: Endings of descriptions in a robot file's folder that belong to the robot file.
_DESCRIPTIONS: Final = (".launch", ".py", ".srdf", ".urdf", ".xacro", ".xml", ".yaml", ".yml")
_PACKAGE_NAME: Final = re.compile(rb"<name>\s*[^<\s]+\s*</name>")
_MOST_OF_MANIFEST: Final = 1_000_000
_MANIFEST: Final = "package.xml"
#: Folders of a package whose files refer to each other, such as ../urdf/arm.xacro.
_LAYOUT: Final = frozenset({"config", "launch", "robots", "urdf", "xacro"})
#: Folder with Git's credentials. For example, actions/checkout writes a token to .git/config.
_HIDDEN: Final = ".git"
_HIGHEST: Final = 12
#: Depth below a folder to which repositories are searched.
_DEPTH: Final = 2


class OutsideError(Exception):
    """A path is outside the permitted paths."""


class Grants(NamedTuple):
    """Paths that may be read, with everything below them, and folders that may be listed."""

    paths: list[str]
    listed: list[str]


class Reach:
    """The paths that may be read, or all paths if ``everything`` is true."""

    def __init__(self, *, everything: bool = False) -> None:
        self.everything = everything
        self._roots: dict[str, None] = {}
        self._libraries: dict[str, None] = {}

    def add_tree(self, file: str) -> None:
        """Permit the tree of a file."""
        folder = posixpath.realpath(posixpath.dirname(posixpath.abspath(file)))
        if is_shared(folder):
            self._roots.update(dict.fromkeys(_descriptions_in(folder)))
            self._roots[posixpath.join(folder, posixpath.basename(file))] = None
            return
        self.add_folder(folder)
        if posixpath.basename(folder) in _LAYOUT:
            self.add_folder(posixpath.dirname(folder))
        for above in (_above(folder, _HIDDEN), _above(folder, _MANIFEST)):
            if above:
                self.add_folder(above)

    def add_folder(self, folder: str) -> None:
        """Permit a folder.

        If its files are links to a package's source, permit the source, too.
        """
        folder = posixpath.realpath(folder)
        source = posixpath.dirname(posixpath.realpath(posixpath.join(folder, _MANIFEST)))
        for path in (folder, source):
            if not is_shared(path):
                self._roots[path] = None

    def add_package_around(self, file: str) -> None:
        """Permit the package that contains the file, if there is one."""
        folder = _above(posixpath.realpath(posixpath.dirname(file)), _MANIFEST)
        if folder and is_package(folder):
            self.add_folder(folder)

    def add_prefix(self, prefix: str) -> None:
        """Permit the packages installed below a prefix from AMENT_PREFIX_PATH."""
        share = posixpath.join(prefix, "share")
        self.add_folder(share)
        for folder in _folders_in(share):
            if posixpath.islink(posixpath.join(folder, _MANIFEST)):
                self.add_folder(folder)

    def add_neighbours(self, file: str) -> None:
        """Permit the packages next to the file, or next to a folder that contains it."""
        for above in list(Path(file).absolute().parents)[:_HIGHEST]:
            for folder in (str(above), *_folders_in(str(above))):
                if is_package(folder):
                    self.add_folder(folder)

    def add_libraries(self) -> None:
        """Permit the paths of Python's modules and of the system's libraries."""
        loaded = os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)
        around = posixpath.realpath("")
        paths = [sys.prefix, sys.base_prefix, *sys.path, *filter(None, loaded)]
        for path in map(posixpath.realpath, filter(None, paths)):
            if not is_shared(path) and path != around:  # python -m adds the working directory
                self._libraries[path] = None
        self._libraries.update(dict.fromkeys(map(posixpath.realpath, _SYSTEM)))
        self._libraries[posixpath.dirname(posixpath.dirname(posixpath.realpath(__file__)))] = None

    def allows(self, path: str) -> bool:
        """Return whether a path may be read, after following links."""
        if "\0" in path:
            return False
        real = posixpath.realpath(path)
        if self.everything:
            return True
        if f"/{_HIDDEN}/" in f"{real}/":
            return False
        return any(real == root or real.startswith(f"{root}/") for root in self._roots)

    def read(self, path: str, most: int) -> bytes:
        """Return the content of a regular file.

        Raises:
            OutsideError: if it may not be read.
            OSError: if it cannot be read or has more than ``most`` bytes.
        """
        if not self.allows(path):
            raise OutsideError(path)
        return _read_plain(posixpath.realpath(path), path, most)

    def names_in(self, folder: str) -> list[str]:
        """Return the names in a folder, sorted.

        Raises:
            OutsideError: if it may not be listed.
            OSError: if it cannot be listed.
        """
        if not self.allows(folder):
            raise OutsideError(folder)
        return sorted(os.listdir(folder))  # noqa: PTH208 (names)

    def grants(self) -> Grants:
        """Return the permitted paths for the kernel, which cannot exclude paths below a folder."""
        grants = Grants([], [])
        for root in self._roots:
            _grant(root, _DEPTH, grants)
        grants.paths.extend(self._libraries)
        return grants


def _read_plain(real: str, path: str, most: int) -> bytes:
    """Return the content of a regular file; findings call it ``path``.

    Raises:
        OSError: if it cannot be read, is not a regular file, or has more than ``most`` bytes.
    """
    flags = os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK  # opening a pipe would block
    file = os.open(real, flags)
    try:
        if not stat.S_ISREG(os.fstat(file).st_mode):
            raise OSError(0, "not a plain file", path)
        with os.fdopen(file, "rb", closefd=False) as stream:
            data = stream.read(most + 1)
    finally:
        os.close(file)
    if len(data) > most:
        raise OSError(0, f"larger than {most:,} bytes", path)
    return data


def _grant(root: str, depth: int, grants: Grants) -> None:
    """Permit a path. For a folder with a repository, permit its entries except the repository."""
    if not _has_repository(root, depth):
        grants.paths.append(root)
        return
    grants.listed.append(root)
    for entry in _entries(root):
        if entry.name == _HIDDEN or entry.is_symlink():
            continue
        if entry.is_dir():
            _grant(entry.path, depth - 1, grants)
        else:
            grants.paths.append(entry.path)


def _has_repository(folder: str, depth: int) -> bool:
    entries = _entries(folder)
    if any(entry.name == _HIDDEN for entry in entries):
        return True
    below = [entry.path for entry in entries if entry.is_dir(follow_symlinks=False)]
    return depth > 0 and any(_has_repository(path, depth - 1) for path in below)


def is_shared(folder: str) -> bool:
    """Return whether a folder contains unrelated files, such as the home directory or /tmp."""
    return (
        folder in _SHARED
        or f"{_home()}/".startswith(f"{folder}/")
        or _OF_KERNEL.match(folder) is not None
        or _HOME.fullmatch(folder) is not None
    )


def _home() -> str:
    return posixpath.realpath(posixpath.expanduser("~"))


def is_package(folder: str) -> bool:
    """Return whether a folder is a ROS package."""
    manifest = posixpath.join(folder, _MANIFEST)
    try:
        data = _read_plain(manifest, manifest, _MOST_OF_MANIFEST)
    except (OSError, ValueError):  # missing, or an invalid path
        return False
    return _PACKAGE_NAME.search(data) is not None


def _above(folder: str, name: str) -> str:
    """Return the nearest folder, from this folder upwards, with an entry ``name``, or ""."""
    for _ in range(_HIGHEST):
        if is_shared(folder):
            break
        if posixpath.exists(posixpath.join(folder, name)):
            return folder
        folder = posixpath.dirname(folder)
    return ""


def _entries(folder: str) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder) as entries:
            return list(entries)
    except OSError:  # a file, or a folder without permission
        return []


def _folders_in(folder: str) -> list[str]:
    return [entry.path for entry in _entries(folder) if entry.is_dir()]


def _descriptions_in(folder: str) -> list[str]:
    return [
        entry.path
        for entry in _entries(folder)
        if entry.is_file(follow_symlinks=False)
        and entry.name.endswith(_DESCRIPTIONS)
        and not entry.name.startswith(".")
    ]
