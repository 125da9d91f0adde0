"""Reading of files: whatever the disk answers is a value or a finding, for every command alike.

``Path.is_file`` and its like raise for a folder that may not be entered, for a name that is too
long, and for links in a circle, and opening a pipe waits for its other end. Here a path that
cannot be looked at is no file, and one that cannot be read is one finding that names it.
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from tfcompose.foundation.findings import RejectedError, Span, finding
from tfcompose.foundation.procfs import PROC

#: Of a file of text: robot, description, plan.
MOST_BYTES = 16_000_000
#: So many files are named where one is not there.
_MOST_NAMED = 8
#: Pipes that the shell has opened. One with a name would block until it is written to.
_OPEN_ALREADY = ("/dev/fd/", "/dev/stdin")
#: Of files with another ending than these, the robot files are named that are there in their
#: place.
_ENDINGS = (".urdf", ".xacro", ".launch", ".py", ".xml", ".sh", ".bash")


def is_file(path: str | Path) -> bool:
    """Return whether a file is there that can be looked at; a link counts as what it leads to."""
    return os.path.isfile(path)  # noqa: PTH113 (that of pathlib raises)


def is_folder(path: str | Path) -> bool:
    """Return whether a folder is there that can be looked at."""
    return os.path.isdir(path)  # noqa: PTH112 (as above)


def exists(path: str | Path) -> bool:
    """Return whether anything is there that can be looked at."""
    return os.path.exists(path)  # noqa: PTH110 (as above)


def names_in(folder: str | Path) -> list[str]:
    """Return the names in a folder, sorted.

    Raises:
        RejectedError: with one TF001 finding, if it cannot be listed.
    """
    try:
        return sorted(os.listdir(folder))  # noqa: PTH208 (names)
    except (OSError, ValueError) as error:
        raise unreadable(folder, error) from None


def read_bytes(path: str | Path, most: int = MOST_BYTES) -> bytes:
    """Return what a file holds.

    Raises:
        RejectedError: with one TF001 or TF008 finding, if it cannot be read, is a pipe that nobody
        has opened, or holds more than so many bytes.
    """
    name = str(path)
    try:
        descriptor = os.open(name, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
        try:
            data = _bytes_of(descriptor, name, most + 1)
        finally:
            os.close(descriptor)
    except (OSError, ValueError) as error:
        raise unreadable(path, error) from None
    if data is None:
        nothing = finding("TF001", "cannot be read: it holds nothing yet", Span(name))
        raise RejectedError([nothing])
    if len(data) > most:
        raise RejectedError(
            [finding("TF008", f"the file is larger than {most:,} bytes", Span(name))]
        )
    return data


def _bytes_of(descriptor: int, name: str, most: int) -> bytes | None:
    """Return at most so many bytes of an open file; None where there is nothing to read yet."""
    kind = os.fstat(descriptor).st_mode
    if stat.S_ISDIR(kind):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), name)
    if stat.S_ISFIFO(kind) and not name.startswith((*_OPEN_ALREADY, f"{PROC}/")):
        raise OSError(0, "it is a pipe, not a file", name)
    os.set_blocking(descriptor, stat.S_ISFIFO(kind) or name.startswith(_OPEN_ALREADY))
    with open(descriptor, "rb", closefd=False) as stream:
        return stream.read(most)


def no_text(path: str, data: bytes, error: UnicodeDecodeError, advice: str) -> RejectedError:
    """Return the error that a file is not UTF-8, at the place of the first byte that is not."""
    before = data[: error.start]
    line, column = before.count(b"\n") + 1, error.start - before.rfind(b"\n")
    message = f"not a text file: byte 0x{data[error.start]:02x} is not UTF-8"
    span = Span(path, line, column, line, column + 1)
    return RejectedError([finding("TF001", message, span, help=advice)])


def unreadable(path: str | Path, error: OSError | ValueError) -> RejectedError:
    """Return the error that a file or folder cannot be read, with what is there in its place."""
    name = str(path)
    if not isinstance(error, OSError):
        return RejectedError([finding("TF001", "a file name cannot hold a NUL byte", Span("?"))])
    advice = ""
    if isinstance(error, FileNotFoundError):
        advice = _files_next_to(name)
    elif isinstance(error, IsADirectoryError):
        advice = "name a file in it"
    message = f"cannot be read: {error.strerror or error}"
    return RejectedError([finding("TF001", message, Span(name), help=advice)])


def _files_next_to(name: str) -> str:
    folder = Path(name).parent
    ending = next((ending for ending in _ENDINGS if name.endswith(ending)), ".yaml")
    try:
        there = [other for other in names_in(folder) if other.endswith(ending)]
    except RejectedError:
        there = []
    if not there:
        return f"there is no {ending} file in {folder}"
    return f"the folder {folder} contains {', '.join(there[:_MOST_NAMED])}"
