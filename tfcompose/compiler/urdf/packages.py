"""Lookup of packages and files.

The lookup searches the robot's ``packages:``, then the ament index, then the folders around the
file. This module opens no files itself. It gets functions that access files, so that a robot can
be compiled from text alone.
"""

from __future__ import annotations

import posixpath
import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

from tfcompose.foundation.findings import Finding, RejectedError, Span, finding, nearest, slip_of
from tfcompose.model.robot import Asset
from tfcompose.spec.load import find_path

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.compiler.urdf.inertia import Moments
    from tfcompose.compiler.urdf.xacro import Expansion, Use
    from tfcompose.foundation.geometry import Vector

_PACKAGE_NAME = re.compile(r"<name>\s*([^<\s]+)\s*</name>")
_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://")
#: Other forms of addresses: xacro's and launch's, and an address with a missing slash.
_MEANT = re.compile(
    r"(?:(?:file://)?\$\(find(?:-pkg-share)?\s+([\w.-]+)\s*\)|package:/?([\w.-]+))/+(.+)"
)
#: A file in a package: package://NAME/PATH, or the forms of xacro and launch files.
_IN_PACKAGE = re.compile(
    r"(?:package://|\$\(find(?:-pkg-share)?\s+)([A-Za-z][A-Za-z0-9_.-]*)\)?/(.+)"
)
_NEAR = 0.8  # high, because many names end in _description
OUTSIDE = (
    "with --untrusted a robot reads its folder, its repository, packages and presets; leave"
    " --untrusted out for files of your own"
)
FETCH = "run git lfs pull to fetch the file"
_HIGHEST = 12  # number of parent folders to search for a package.xml


def _reject_expansion(file: str, *_: object) -> Expansion:
    raise RejectedError([finding("TF001", "files cannot be read here", Span(file))])


@dataclass(frozen=True, slots=True)
class Disk:
    """Functions that access files and packages for the compiler."""

    read: Callable[[str], str]
    is_file: Callable[[str], bool]
    is_folder: Callable[[str], bool]
    #: The entries of AMENT_PREFIX_PATH, in order.
    prefixes: tuple[str, ...] = ()
    #: Returns the moments of a mesh file at a scale. Raises ``UnmeasurableError`` with code,
    #: message and help of the finding.
    moments: Callable[[str, Vector], Moments] | None = None
    #: Expands a xacro file with arguments, or as a robot file uses it.
    expand: Callable[[str, Packages, Mapping[str, Any], Use | None], Expansion] = _reject_expansion
    #: Returns whether the file is a Git LFS pointer instead of the content.
    is_pointer: Callable[[str], bool] = lambda _: False
    #: Returns whether a file may be read.
    allows: Callable[[str], bool] = lambda _: True


@dataclass(slots=True)
class Packages:
    """Finds packages and files by their addresses."""

    disk: Disk | None = None
    #: The section ``packages:`` of the robot file: name → folder and its span.
    named: Mapping[str, tuple[str, Span]] = field(default_factory=dict)
    #: Help for a package that is not found.
    advice: str = "add packages: {{{name}: FOLDER}}, or source the workspace's setup file"
    #: Packages and their folders that were found only around the file that names them, as in a
    #: source tree that is not built.
    local: dict[str, str] = field(default_factory=dict)
    _above: dict[str, tuple[str, str]] = field(default_factory=dict)
    _missed: set[tuple[str, str]] = field(default_factory=set)

    def candidates(self, name: str) -> list[str]:
        """Return the possible folders of a package, in search order."""
        named_folders = [find_path(*self.named[name])] if name in self.named else []
        return named_folders + [
            posixpath.join(prefix, "share", name)
            for prefix in (self.disk.prefixes if self.disk else ())
        ]

    def folder(self, name: str, file: str) -> str | None:
        """Return the package's folder, or None.

        The last candidate is the package that contains ``file``.
        """
        if self.disk is None:
            return None
        first = next(
            (folder for folder in self.candidates(name) if self.disk.is_folder(folder)), None
        )
        around, folder = ("", "") if first is not None else self._around(posixpath.dirname(file))
        return (folder or ".") if around == name else first

    def not_found(self, name: str, span: Span | None) -> Finding:
        """Return the finding that a package was not found, with the searched folders."""
        folders = self.candidates(name)
        searched = f"looked in {', '.join(folders)}" if folders else "AMENT_PREFIX_PATH is empty"
        near = slip_of(name, self.named) or nearest(name, self.named, _NEAR)
        way_out = f"did you mean {near}?" if near else self.advice.format(name=name)
        advice = (
            f"{searched};"
            f" {'correct the folder that it is given' if name in self.named else way_out}"
        )
        return finding("TF724", f"package {name} not found", span, help=advice, severity="warning")

    def path_of(self, named: str, span: Span) -> str:
        """Return the path of a file that the robot file names at a span.

        The name is an address in a package, or a path relative to the file of the span.

        Raises:
            RejectedError: if the package is not found.
        """
        match = _IN_PACKAGE.fullmatch(named)
        if match is None:
            return find_path(named, span)
        folder = self.folder(match[1], span.file)
        if folder is None:
            raise RejectedError([replace(self.not_found(match[1], span), severity="error")])
        return posixpath.join(folder, match[2])

    def asset(self, uri: str, span: Span, document: str = "") -> tuple[Asset, Finding | None]:
        """Return the file at an address, and a finding if the address is wrong.

        ``package://NAME/PATH`` is a file in a package. ``file:///PATH`` and plain paths are files.
        A relative path starts in the folder of the file that contains it, or of the ``document``
        that includes that file. Other schemes, such as ``http`` and ``model``, are not resolved.
        """
        document = document or span.file
        url = _MEANT.fullmatch(uri)
        if url or not uri:
            advice = (
                f"package://{url[1] or url[2]}/{url[3]}"
                if url
                else "write package://NAME/PATH or a path"
            )
            return Asset(uri, span), finding(
                "TF723", f"{uri or repr(uri)} is not a valid file address", span, help=advice
            )
        scheme = _SCHEME.match(uri)
        if scheme and scheme[1] == "package":
            return self._in_package(uri, span, document)
        if scheme and scheme[1] != "file":
            return Asset(uri, span), None
        path = unquote(uri[scheme.end() :]) if scheme else uri
        if scheme and not path.startswith("/"):
            wrong = f"{uri} is not a valid file address"
            return Asset(uri, span), finding(
                "TF723", wrong, span, help="file:// with an absolute path has three slashes"
            )
        path = (
            posixpath.normpath(path) if path.startswith("/") else find_path(path, Span(document))
        )
        if refusal := self._refusal(path, uri, span):
            return Asset(uri, span), refusal
        package, inside = self._package_above(path)
        return Asset(uri, span, path, package, inside), self._missing(
            path, f"file {uri} not found", span
        )

    def _in_package(self, uri: str, span: Span, document: str) -> tuple[Asset, Finding | None]:
        name, _, inside = unquote(uri.partition("://")[2]).partition("/")
        if not name or not inside:
            advice = (
                f"one slash too many: package://{inside}"
                if "/" in inside
                else "package://NAME/PATH"
            )
            return Asset(uri, span), finding(
                "TF723", f"{uri} is not a valid file address", span, help=advice
            )
        folder = self.folder(name, document)
        if folder is None:
            is_new = self.disk is not None and (name, document) not in self._missed
            self._missed.add((name, document))  # a missing package is reported once for each file
            return Asset(uri, span, "", name, inside), self.not_found(
                name, span
            ) if is_new else None
        if folder not in self.candidates(name):
            self.local[name] = folder
        path = posixpath.join(folder, inside)
        if refusal := self._refusal(path, uri, span):
            return Asset(uri, span), refusal
        return Asset(uri, span, path, name, inside), self._missing(
            path, f"file {inside} not found in {name}", span
        )

    def _refusal(self, path: str, uri: str, span: Span) -> Finding | None:
        if self.disk is None or self.disk.allows(path):
            return None
        message = f"{uri} may not be read: it is outside of the robot's tree"
        return finding("TF021", message, span, help=OUTSIDE)

    def _missing(self, path: str, message: str, span: Span) -> Finding | None:
        if self.disk is None:
            return None
        if "\0" in path or not self.disk.is_file(path):
            where = (
                path if path.startswith("/") else f"{path}, from the folder where tfcompose runs"
            )
            return finding("TF723", message, span, help=f"looked for {where}")
        if self.disk.is_pointer(path):
            return finding(
                "TF723", f"{path} is a Git LFS pointer", span, help=FETCH, severity="warning"
            )
        return None

    def _package_above(self, path: str) -> tuple[str, str]:
        """Return the package that contains the file, and the file's path in the package.

        Both are empty if the file is in no source or share folder of a package.
        """
        name, top = self._around(posixpath.dirname(path))
        return (name, posixpath.relpath(path, top or ".")) if name else ("", "")

    def _around(self, folder: str) -> tuple[str, str]:
        """Return the name and folder of the package that is or contains the folder.

        Both are empty without a package.
        """
        if folder not in self._above:
            self._above[folder] = self._find_above(folder)
        return self._above[folder]

    def _find_above(self, folder: str) -> tuple[str, str]:
        for _ in range(_HIGHEST if self.disk else 0):
            manifest = posixpath.join(folder, "package.xml")
            if self.disk and self.disk.is_file(manifest):
                match = _PACKAGE_NAME.search(self.disk.read(manifest))
                return (match[1], folder) if match else ("", "")
            above = posixpath.normpath(posixpath.join(folder, ".."))
            if above == folder:
                break
            folder = above
        return ("", "")
