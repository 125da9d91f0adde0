"""Writing a build: every file whole, and all of them or none."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.emit import File


def write_all(folder: Path, files: Sequence[File]) -> None:
    """Write the files below ``folder``; a reader sees each file as it was or as it is, never half.

    All of them are written to a folder beside first. Only when the last byte is on the disk are they moved into place,
    which needs no more space. Parameter files of an earlier build that are not among the files are removed.

    Raises:
        OSError: if the files cannot be written; then nothing in ``folder`` has changed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    staging = Path(tempfile.mkdtemp(prefix=".tfcompose-", dir=folder))
    try:
        for file in files:
            _write(staging / file.path, file.text)
        for file in files:
            target = folder / file.path
            target.parent.mkdir(parents=True, exist_ok=True)
            if target.is_dir():
                raise IsADirectoryError(21, "is a folder", str(target))
        for file in files:
            (staging / file.path).replace(folder / file.path)
        _remove_stale(folder, {file.path for file in files})
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())


def _remove_stale(folder: Path, current: set[str]) -> None:
    params = folder / "params"
    for old in params.glob("*.yaml") if params.is_dir() else ():
        if f"params/{old.name}" not in current:
            old.unlink(missing_ok=True)
    with contextlib.suppress(OSError):
        params.rmdir()  # only if nothing is left in it
