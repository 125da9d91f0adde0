"""Search for robot files, and others that ``lint`` checks, in a folder and its subfolders."""

from __future__ import annotations

import os
import re
import time
from pathlib import Path

from tfcompose.cli.terminal import warn
from tfcompose.foundation.procfs import PROC
from tfcompose.foundation.tool import Language, installed_tools, shipped_tools

YAML_ENDINGS = (".yaml", ".yml")
#: The key ``tfcompose`` at the beginning of a line. If the user has misspelt it, the key ``robot``
#: and another key of robot files.
_ROBOT = re.compile(
    rb"^tfcompose\s*:|\A(?=[\s\S]*^robot\s*:)"
    rb"(?=[\s\S]*^(?:links|joints|frames|sensors|parts)\s*:)",
    re.MULTILINE,
)

#: Time in seconds after which the search prints what it does.
SAY_AFTER_S = 5.0
#: The kernel's file systems. Reading their files can block or have effects.
_OF_KERNEL = frozenset({PROC, "/sys", "/dev"})


def robots_in(name: str) -> list[str]:
    """Return the files in a folder that ``lint`` checks, or else ``name`` itself.

    These are robot files, and files of tools, which their names show. A robot file is a YAML file
    with a line that begins with tfcompose:. The search skips hidden folders, the kernel's folders,
    and other file systems (as ``find -xdev`` does).
    """
    from tfcompose.foundation.reading import is_file

    robots: list[str] = []
    progress = _Progress(name)
    device = _device(name)
    for top, folders, files in os.walk(name):
        folders[:] = [
            folder
            for folder in sorted(folders)
            if not folder.startswith(".") and _is_searched(f"{top}/{folder}", device)
        ]
        paths = [str(Path(top, file)) for file in sorted(files) if file.endswith(YAML_ENDINGS)]
        robots += [path for path in paths if is_file(path) and is_checked(path)]
        progress.count_files(len(paths))
    return robots or [name]


class _Progress:
    """Prints a line, once, if a search takes long."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._say_at = time.monotonic() + SAY_AFTER_S
        self._files = 0

    def count_files(self, count: int) -> None:
        """Add to the number of YAML files that were read."""
        self._files += count
        if time.monotonic() >= self._say_at:
            self._say_at = float("inf")
            warn(
                f"looking for robot files below {self._name}: {self._files} YAML files so far;"
                " name a folder with fewer to be faster"
            )


def _device(folder: str) -> int:
    """Return the number of the folder's file system, 0 if the folder cannot be accessed."""
    try:
        return os.stat(folder).st_dev  # noqa: PTH116 (as os.walk has it)
    except (OSError, ValueError):
        return 0


def _is_searched(folder: str, device: int) -> bool:
    """Return whether a folder is on this file system and is not the kernel's."""
    return os.path.realpath(folder) not in _OF_KERNEL and _device(folder) == device


def is_checked(file: str) -> bool:
    """Return whether the file is a robot file, or in the language of a tool."""
    return language_of(file) is not None or is_robot(file)


def language_of(file: str) -> Language | None:
    """Return the language of a tool that the file is in, by its name; None for another file.

    Tools of other packages are looked up only for a file that is no robot file. A pipe, which can
    be read once, is one.
    """
    from tfcompose.foundation.reading import is_file

    language = shipped_tools().language_of(file)
    if language or not is_file(file) or is_robot(file):
        return language
    return installed_tools().language_of(file)


def is_robot(file: str) -> bool:
    """Return whether the file is a robot file, or cannot be read.

    For a file that cannot be read, lint then reports the reason.
    """
    from tfcompose.foundation.findings import RejectedError
    from tfcompose.foundation.reading import read_bytes

    try:
        return bool(_ROBOT.search(read_bytes(file)))
    except RejectedError as error:  # a file over the size limit is no robot file
        return all(finding.code == "TF001" for finding in error.findings)
