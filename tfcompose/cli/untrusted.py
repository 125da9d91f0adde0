"""``lint --untrusted`` limits a robot file to its own tree, packages and presets.

Then a pull request reveals nothing about the computer that checks it: no other files, and no
environment variables, which in CI contain secrets.
"""

from __future__ import annotations

import os
import posixpath
import re
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tfcompose.cli.compiling import PRESETS, PresetFolders, disk
from tfcompose.cli.reading import STDIN, withhold
from tfcompose.compiler.resolve import Library
from tfcompose.compiler.urdf.packages import OUTSIDE
from tfcompose.foundation.findings import RejectedError, Span, finding
from tfcompose.foundation.reach import Reach, is_package
from tfcompose.foundation.reading import is_file, is_folder
from tfcompose.spec.load import find_path

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from tfcompose.compiler.resolve import Disk
    from tfcompose.spec.load import Source

#: Variables that programs need to run, to write to a terminal, and to find packages.
_NEEDED = frozenset(
    {
        "AMENT_PREFIX_PATH",
        "COLUMNS",
        "FORCE_COLOR",
        "HOME",
        "LANG",
        "LC_ALL",
        "LC_CTYPE",
        "LD_LIBRARY_PATH",
        "LINES",
        "NO_COLOR",
        "PATH",
        "PYTHONDONTWRITEBYTECODE",
        "PYTHONIOENCODING",
        "PYTHONPATH",
        "PYTHONUTF8",
        "TERM",
        "TMPDIR",
    }
)
#: A value that cannot be a secret: a switch or a number.
_PLAIN = re.compile(r"true|false|yes|no|on|off|[-+]?[0-9]{0,9}(?:\.[0-9]{0,9})?", re.IGNORECASE)


@contextmanager
def without_environment(*, applies: bool) -> Iterator[Mapping[str, str]]:
    """Remove all environment variables from this process except those that programs need.

    Yield all the original variables.
    """
    before = dict(os.environ)
    if applies:
        for name in before.keys() - _NEEDED:
            del os.environ[name]
    try:
        yield before
    finally:
        os.environ.update(before)


def declared_variables(source: Source, environment: Mapping[str, str]) -> dict[str, str]:
    """Return the variables that the file's args read, if the values cannot be secrets.

    A value must be one of the declared choices, a switch or a number. The reason is that an
    untrusted file may declare an argument for any variable, and findings quote values.
    """
    declared: dict[str, str] = {}
    for spec in source.mapping("args").values():
        name = spec.get("env") if isinstance(spec, dict) else None
        value = environment.get(name) if isinstance(name, str) else None
        if value is not None and (value in _choices(spec) or _PLAIN.fullmatch(value)):
            declared[str(name)] = value
    return declared


def _choices(spec: Mapping[str, Any]) -> Sequence[str]:
    choices = spec.get("choices")
    return [str(choice) for choice in choices] if isinstance(choices, list) else []


class UntrustedFiles:
    """Files that an untrusted file may read. All other files are rejected, or missing.

    Args:
        file: the robot file or URDF.
        read: returns the text of a file that may be read.
    """

    def __init__(self, file: str, read: Callable[[str], str]) -> None:
        self._read = read
        self._disk = disk(sources=[file], is_strict=True)
        self.reach = Reach()
        self.reach.add_tree(file)
        for prefix in self._disk.prefixes:
            self.reach.add_prefix(prefix)
        for folder in (str(PRESETS), *PresetFolders().packages()):
            self.reach.add_folder(folder)

    def read(self, path: str) -> str:
        """Return the text of a file.

        Raises:
            RejectedError: if the file must not be read, or cannot be read.
        """
        if path != STDIN and not self.reach.allows(path):
            withhold(path)
            message = "may not be read: it is outside the robot's tree"
            raise RejectedError([finding("TF021", message, Span(path), help=OUTSIDE)])
        return self._read(path)

    def is_file(self, path: str) -> bool:
        """Return whether a readable file exists there."""
        return self.reach.allows(path) and is_file(path)

    def is_folder(self, path: str) -> bool:
        """Return whether a readable folder exists there."""
        return self.reach.allows(path) and is_folder(path)

    def disk(self) -> Disk:
        """Return the compiler's access to files. It does not measure meshes."""
        return replace(
            self._disk,
            read=self.read,
            is_file=self.is_file,
            is_folder=self.is_folder,
            moments=None,
            allows=self.reach.allows,
        )

    def disk_for(self, source: Source) -> Disk:
        """Return the compiler's access for a robot file, which may also read its ``packages``."""
        for name, folder in source.mapping("packages").items():
            if isinstance(folder, str):
                path = find_path(folder, source.span_of(("packages", name)))
                if is_package(posixpath.realpath(path)):
                    self.reach.add_folder(path)
        return self.disk()

    def library(self) -> Library:
        """Return the library of presets that may be read."""
        return Library((str(PRESETS),), PresetFolders(self.read, self.reach.allows), str(PRESETS))
