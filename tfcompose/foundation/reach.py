"""The files that a robot file, a xacro file or a launch file may read: its tree, and packages.

The tree of a file is its folder, the Git repository and the package around that. Where its folder
is shared by unrelated files, as the home and /tmp are, the tree is the descriptions beside it.
Functions of posixpath return False where those of pathlib raise, as for names that are too long.
"""

from __future__ import annotations

import os
import posixpath
import re
import stat
import sys
from pathlib import Path
from typing import Final, NamedTuple

#: Folders of the system, and those that programs put unrelated files into.
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
#: What libraries of the system read: themselves, the time zone, and what is no file.
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
#: Files that lie beside a robot file, and are about it.
_DESCRIPTIONS: Final = (".launch", ".py", ".srdf", ".urdf", ".xacro", ".xml", ".yaml", ".yml")
_PACKAGE_NAME: Final = re.compile(rb"<name>\s*[^<\s]+\s*</name>")
_MOST_OF_MANIFEST: Final = 1_000_000
_MANIFEST: Final = "package.xml"
#: Folders of a package whose files name those in the others, as ../urdf/arm.xacro.
_LAYOUT: Final = frozenset({"config", "launch", "robots", "urdf", "xacro"})
#: Git keeps credentials there: actions/checkout writes a token into .git/config.
_HIDDEN: Final = ".git"
_HIGHEST: Final = 12
#: How deep below a folder repositories are looked for.
_DEPTH: Final = 2


class OutsideError(Exception):
    """A path is outside of what may be read."""


class Grants(NamedTuple):
    """Paths that may be read, folders with all that is below; and folders that may be listed."""

    paths: list[str]
    listed: list[str]


class Reach:
    """The paths that may be read; all of them if ``everything`` is true."""

    def __init__(self, *, everything: bool = False) -> None:
        self.everything = everything
        self._roots: dict[str, None] = {}
        self._libraries: dict[str, None] = {}

    def add_tree(self, file: str) -> None:
        """Add the tree of a file."""
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
        """Add a folder; where it is a package whose files are links, also the package's source."""
        folder = posixpath.realpath(folder)
        source = posixpath.dirname(posixpath.realpath(posixpath.join(folder, _MANIFEST)))
        for path in (folder, source):
            if not is_shared(path):
                self._roots[path] = None

    def add_package_around(self, file: str) -> None:
        """Add the package that a file is in, if it is in one."""
        folder = _above(posixpath.realpath(posixpath.dirname(file)), _MANIFEST)
        if folder and is_package(folder):
            self.add_folder(folder)

    def add_prefix(self, prefix: str) -> None:
        """Add the packages that are installed below a prefix of AMENT_PREFIX_PATH."""
        share = posixpath.join(prefix, "share")
        self.add_folder(share)
        for folder in _folders_in(share):
            if posixpath.islink(posixpath.join(folder, _MANIFEST)):
                self.add_folder(folder)

    def add_neighbours(self, file: str) -> None:
        """Add the packages that lie beside a file, or beside a folder that it is in."""
        for above in list(Path(file).absolute().parents)[:_HIGHEST]:
            for folder in (str(above), *_folders_in(str(above))):
                if is_package(folder):
                    self.add_folder(folder)

    def add_libraries(self) -> None:
        """Add what Python loads modules from, and the system its libraries."""
        loaded = os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)
        around = posixpath.realpath("")
        paths = [sys.prefix, sys.base_prefix, *sys.path, *filter(None, loaded)]
        for path in map(posixpath.realpath, filter(None, paths)):
            if not is_shared(path) and path != around:  # python -m puts the working folder there
                self._libraries[path] = None
        self._libraries.update(dict.fromkeys(map(posixpath.realpath, _SYSTEM)))
        self._libraries[posixpath.dirname(posixpath.dirname(posixpath.realpath(__file__)))] = None

    def allows(self, path: str) -> bool:
        """Return whether a path may be read, wherever links lead."""
        if "\0" in path:
            return False
        real = posixpath.realpath(path)
        if self.everything:
            return True
        if f"/{_HIDDEN}/" in f"{real}/":
            return False
        return any(real == root or real.startswith(f"{root}/") for root in self._roots)

    def read(self, path: str, most: int) -> bytes:
        """Return the bytes of a plain file.

        Raises:
            OutsideError: if it may not be read.
            OSError: if it cannot be read, or has more than so many bytes.
        """
        if not self.allows(path):
            raise OutsideError(path)
        return _read_plain(posixpath.realpath(path), path, most)

    def names_in(self, folder: str) -> list[str]:
        """Return the names in a folder, in order.

        Raises:
            OutsideError: if it may not be listed.
            OSError: if it cannot be.
        """
        if not self.allows(folder):
            raise OutsideError(folder)
        return sorted(os.listdir(folder))  # noqa: PTH208 (names)

    def grants(self) -> Grants:
        """Return all of it for the kernel, which cannot leave out what is below a folder."""
        grants = Grants([], [])
        for root in self._roots:
            _grant(root, _DEPTH, grants)
        grants.paths.extend(self._libraries)
        return grants


def _read_plain(real: str, path: str, most: int) -> bytes:
    """Return the bytes of a file that findings call ``path``.

    Raises:
        OSError: if it cannot be read, is no plain file, or has more than so many bytes.
    """
    flags = os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK  # a pipe would be waited for
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
    """Add a path; a folder with a repository by what is in it, without the repository."""
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
    """Return whether unrelated files lie in a folder, such as the home, one above it, or /tmp."""
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
    except (OSError, ValueError):  # not there, or no path
        return False
    return _PACKAGE_NAME.search(data) is not None


def _above(folder: str, name: str) -> str:
    """Return the nearest folder, from this one upwards, that has an entry of a name, or ''."""
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
    except OSError:  # a file, or one that may not be entered
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
