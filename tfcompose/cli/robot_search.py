"""Search for the robot files below a folder."""

from __future__ import annotations

import os
import re
import time
from pathlib import Path

from tfcompose.cli.terminal import warn
from tfcompose.foundation.procfs import PROC

YAML_ENDINGS = (".yaml", ".yml")
#: What a robot file has at the begin of a line: its first key, or, with that misspelt, two others
#: of its keys.
_ROBOT = re.compile(
    rb"^tfcompose\s*:|\A(?=[\s\S]*^robot\s*:)"
    rb"(?=[\s\S]*^(?:links|joints|frames|sensors|parts)\s*:)",
    re.MULTILINE,
)

#: After this time a search for robot files says what it does, in seconds.
SAY_AFTER_S = 5.0
#: What the kernel shows as files: reading some waits, or does something.
_OF_KERNEL = frozenset({PROC, "/sys", "/dev"})


def robots_in(name: str) -> list[str]:
    """Return the file itself, or the robot files below a folder.

    Robot files are YAML files with a line that begins with tfcompose:. The search skips hidden
    folders, those of the kernel, and other file systems (as ``find -xdev`` does).
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
        robots += [path for path in paths if is_file(path) and is_robot(path)]
        progress.count_files(len(paths))
    return robots or [name]


class _Progress:
    """Prints once that a search takes long."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._say_at = time.monotonic() + SAY_AFTER_S
        self._files = 0

    def count_files(self, count: int) -> None:
        """Count YAML files that were read."""
        self._files += count
        if time.monotonic() >= self._say_at:
            self._say_at = float("inf")
            warn(
                f"looking for robot files below {self._name}: {self._files} YAML files so far;"
                " name a folder with fewer to be faster"
            )


def _device(folder: str) -> int:
    """Return the file system of a folder, 0 if it cannot be accessed."""
    try:
        return os.stat(folder).st_dev  # noqa: PTH116 (as os.walk has it)
    except (OSError, ValueError):
        return 0


def _is_searched(folder: str, device: int) -> bool:
    """Return whether a folder is on this file system and is not the kernel's."""
    return os.path.realpath(folder) not in _OF_KERNEL and _device(folder) == device


def is_robot(file: str) -> bool:
    """Return whether it is a robot file, or unreadable: lint reports the reason."""
    from tfcompose.foundation.findings import RejectedError
    from tfcompose.foundation.reading import read_bytes

    try:
        return bool(_ROBOT.search(read_bytes(file)))
    except RejectedError as error:  # what is larger than a robot may be is none
        return all(finding.code == "TF001" for finding in error.findings)
