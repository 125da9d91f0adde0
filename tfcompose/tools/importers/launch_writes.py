"""Files that a launch file writes when it starts, kept in memory for the import.

The launch file believes that it writes to the disk. The import writes the texts next to the robot
file if the robot file names them.
"""

from __future__ import annotations

import io
import os
import tempfile
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.tools.importers.launch_records import LaunchRecording

#: Maximum size of one file, in characters or bytes.
MOST = 1_000_000
_READABLE = frozenset("rbt")
_write = os.write


class SavedFiles:
    """The files that a launch file has written, by path.

    The launch file can read these files back, and also the files that launch writes. ``finish``
    reports folders in which it wrote no file, and temporary names that it did not use.
    """

    def __init__(self, recording: LaunchRecording, null: int) -> None:
        self.texts = recording.files
        self._null = null
        #: The paths of open files by file descriptor.
        self._descriptors: dict[int, str] = {}
        self._recording = recording
        self._folders: dict[str, tuple[str, int]] = {}
        self._temporary: dict[str, tuple[str, int]] = {}

    def open(self, file: str | int, mode: str) -> Any | None:
        """Return a file as ``open`` does, or None if the caller should open it on the disk."""
        name = self._descriptors.get(file) if isinstance(file, int) else file
        if name is None:
            return None
        path = os.path.abspath(name)  # noqa: PTH100 (links stay)
        kind = _BytesFile if "b" in mode else _TextFile
        if set(mode) <= _READABLE:
            return kind(path, self.texts[path], lambda _: None) if path in self.texts else None
        if "+" in mode and "w" not in mode:
            return None
        before = self.texts.get(path, "") if "a" in mode else ""
        if path not in self.texts:
            self.texts[path] = ""
            self._recording.record("file", self._recording.here(), path=path)
        made = kind(path, before, lambda text: self.texts.update({path: text[:MOST]}))
        made.seek(0, io.SEEK_END)
        return made

    def open_named(
        self,
        mode: str = "w+b",
        *_: Any,
        suffix: str | None = None,
        prefix: str | None = None,
        dir: str | None = None,  # noqa: A002 (as tempfile has it)
        **_more: Any,
    ) -> Any:
        """Return a named file as ``tempfile.NamedTemporaryFile`` does."""
        return self.open(self._name(suffix, prefix, dir), mode.replace("+", ""))

    def open_descriptor(
        self,
        suffix: str | None = None,
        prefix: str | None = None,
        dir: str | None = None,  # noqa: A002 (as tempfile has it)
        text: bool = False,  # noqa: FBT001, FBT002 (as tempfile has it)
    ) -> tuple[int, str]:
        """Return a descriptor and a name as ``tempfile.mkstemp`` does."""
        del text
        path = self._name(suffix, prefix, dir)
        self.open(path, "w")
        descriptor = os.dup(self._null)
        self._descriptors[descriptor] = path
        return descriptor, path

    def write(self, descriptor: int, data: bytes) -> int:
        """Write as ``os.write`` does."""
        file = self.open(descriptor, "ab")
        if file is None:
            return _write(descriptor, data)
        with file:
            return int(file.write(data))

    def temporary(
        self,
        suffix: str = "",
        prefix: str = "tmp",
        dir: str | None = None,  # noqa: A002 (as tempfile has it)
    ) -> str:
        """Return a name as ``tempfile.mktemp`` does."""
        path = self._name(suffix, prefix, dir)
        self._temporary[path] = self._recording.here()
        return path

    def _name(self, suffix: str | None, prefix: str | None, folder: str | None) -> str:
        number = len(self.texts) + len(self._temporary)
        return f"{folder or tempfile.gettempdir()}/{prefix or 'tmp'}{number}{suffix or ''}"

    def folder(self, path: Any, *_args: Any, **_more: Any) -> None:
        """Record that the launch file would create a folder."""
        name = os.path.abspath(os.fsdecode(path))  # noqa: PTH100 (links stay)
        self._folders.setdefault(name, self._recording.here())

    def finish(self) -> None:
        """Report folders without a file, and unused temporary names."""
        for path, place in self._folders.items():
            if not any(PurePath(file).is_relative_to(path) for file in self.texts):
                self._recording.todo(place, f"the folder {path} was not created")
        for path, place in self._temporary.items():
            if path not in self.texts:
                self._recording.todo(
                    place, f"the temporary file {path}: its name changes at each launch"
                )


class _TextFile(io.StringIO):
    def __init__(self, path: str, text: str, keep: Callable[[str], object]) -> None:
        super().__init__(text)
        self.name = path
        self._keep = keep

    def flush(self) -> None:
        self._keep(self.getvalue())

    def close(self) -> None:
        if not self.closed:
            self.flush()
        super().close()


class _BytesFile(io.BytesIO):
    def __init__(self, path: str, text: str, keep: Callable[[str], object]) -> None:
        super().__init__(text.encode())
        self.name = path
        self._keep = keep

    def flush(self) -> None:
        self._keep(self.getvalue().decode(errors="replace"))

    def close(self) -> None:
        if not self.closed:
            self.flush()
        super().close()
