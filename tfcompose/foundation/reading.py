"""Reading of files: every answer of the disk becomes a value or a finding.

``Path.is_file`` and similar methods raise for a folder without permission, a name that is too
long, and a loop of links. Opening a pipe waits for its other end. Here, a path that cannot be
examined counts as missing. A path that cannot be read becomes a finding that names the path.
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from tfcompose.foundation.findings import RejectedError, Span, finding
from tfcompose.foundation.procfs import PROC

#: Maximum number of bytes of a text file: robot, description, plan.
MOST_BYTES = 16_000_000
#: Maximum number of existing files that a finding about a missing file lists.
_MOST_NAMED = 8
#: Pipes that the shell has opened. A named pipe would block until a program writes to it.
_OPEN_ALREADY = ("/dev/fd/", "/dev/stdin")
#: If a missing file has one of these endings, files with the same ending are listed, otherwise
#: robot files.
_ENDINGS = (".urdf", ".xacro", ".launch", ".py", ".xml", ".sh", ".bash")


def is_file(path: str | Path) -> bool:
    """Return whether a regular file exists and can be examined, after following links."""
    return os.path.isfile(path)  # noqa: PTH113 (that of pathlib raises)


def is_folder(path: str | Path) -> bool:
    """Return whether a folder exists and can be examined."""
    return os.path.isdir(path)  # noqa: PTH112 (as above)


def exists(path: str | Path) -> bool:
    """Return whether the path exists and can be examined."""
    return os.path.exists(path)  # noqa: PTH110 (as above)


def names_in(folder: str | Path) -> list[str]:
    """Return the names in a folder, sorted.

    Raises:
        RejectedError: with a TF001 finding, if it cannot be listed.
    """
    try:
        return sorted(os.listdir(folder))  # noqa: PTH208 (names)
    except (OSError, ValueError) as error:
        raise unreadable(folder, error) from None


def read_bytes(path: str | Path, most: int = MOST_BYTES) -> bytes:
    """Return the content of a file.

    Raises:
        RejectedError: with a TF001 or TF008 finding, if it cannot be read, is a pipe that the
            shell has not opened, or has more than ``most`` bytes.
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
    """Return at most ``most`` bytes of an open file, None if no data are available yet."""
    kind = os.fstat(descriptor).st_mode
    if stat.S_ISDIR(kind):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), name)
    if stat.S_ISFIFO(kind) and not name.startswith((*_OPEN_ALREADY, f"{PROC}/")):
        raise OSError(0, "it is a pipe, not a file", name)
    os.set_blocking(descriptor, stat.S_ISFIFO(kind) or name.startswith(_OPEN_ALREADY))
    with open(descriptor, "rb", closefd=False) as stream:
        return stream.read(most)


def no_text(path: str, data: bytes, error: UnicodeDecodeError, advice: str) -> RejectedError:
    """Return the error that a file is not UTF-8, at the place of the first invalid byte."""
    before = data[: error.start]
    line, column = before.count(b"\n") + 1, error.start - before.rfind(b"\n")
    message = f"not a text file: byte 0x{data[error.start]:02x} is not UTF-8"
    span = Span(path, line, column, line, column + 1)
    return RejectedError([finding("TF001", message, span, help=advice)])


def unreadable(path: str | Path, error: OSError | ValueError) -> RejectedError:
    """Return the error that a file or folder cannot be read, with existing alternatives."""
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
        files = [file for file in names_in(folder) if file.endswith(ending)]
    except RejectedError:
        files = []
    if not files:
        return f"there is no {ending} file in {folder}"
    return f"the folder {folder} contains {', '.join(files[:_MOST_NAMED])}"
