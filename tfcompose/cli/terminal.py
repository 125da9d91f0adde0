"""Output of commands: exit codes, findings, terminal size, colours, closed readers."""

from __future__ import annotations

import os
import re
import select
import sys
from collections import Counter
from contextlib import suppress
from typing import TYPE_CHECKING, NoReturn

from tfcompose.compiler.render.text import PLAIN, no_address, render_text
from tfcompose.foundation.text import mask_invisible

if TYPE_CHECKING:
    import socket
    from collections.abc import Sequence
    from typing import TextIO

    from tfcompose.compiler.render.text import CodeAddress
    from tfcompose.foundation.findings import Finding

#: Exit codes: 1 for findings or a failed process; 2 for wrong use, an unreadable file or a missing
#: package; 130 for Ctrl-C and 141 for a closed output, as in a shell.
FAILED, UNREADABLE, INTERRUPTED, OUTPUT_CLOSED = 1, 2, 130, 141

#: Codes for an unreadable file, and for a missing package: ROS, trimesh, rosbags or eclipse-zenoh.
_LACKING = frozenset({"TF001", "TF901", "TF905", "TF906", "TF920"})

#: Control sequences (ECMA-48), titles and links. A sequence that ends with m sets colours.
_SEQUENCE = re.compile(r"(\033\[[0-?]*[ -/]*[@-~]|\033\][^\033\a]*(?:\a|\033\\)?|\033[ -/]*[0-~])")
#: Control sequences that clear the screen, and the cursor's line.
CLEAR, CLEAR_LINE = "\033[H\033[2J", "\r\033[K"
_COLOUR = re.compile(r"\033\[[0-9;:]*m")


def warn(message: str) -> None:
    """Print a sentence on stderr. Control characters in names are escaped."""
    text = "\n".join(map(printable, message.split("\n")))
    sys.stderr.write(f"tfcompose: {text}\n")


def fail(message: str, code: int = FAILED) -> NoReturn:
    """Print a sentence on stderr and end the command.

    Raises:
        SystemExit: always, with the exit code.
    """
    warn(message)
    raise SystemExit(code)


#: Maximum number of findings with the same code for a file, unless the user requests all.
MOST_OF_ONE_CODE = 10


def print_findings(
    findings: Sequence[Finding], stream: TextIO, *, most: int | None = None
) -> None:
    """Print findings, each with the line of the file that it is about.

    For each file, print at most ``most`` findings with the same code, then the number of the
    others. None prints all.
    """
    from tfcompose.cli.reading import line_of

    printed: list[Finding] = []
    counts: Counter[tuple[str, str]] = Counter()
    for finding in findings:
        place = (finding.span.file if finding.span else "", finding.code)
        counts[place] += 1
        if most is None or counts[place] <= most:
            printed.append(finding)
    stream.write(
        render_text(
            printed, line_of, colour=is_coloured(stream), address_of=code_addresses(stream)
        )
    )
    for (file, code), count in counts.items():
        if most is not None and count > most:
            where, how = (f"{file}: ", "; tfcompose lint --all lists them") if file else ("", "")
            stream.write(f"{where}and {count - most} more {code}{how}\n")


def reject(findings: Sequence[Finding], code: int | None = None) -> NoReturn:
    """Print findings on stderr and end the command.

    Raises:
        SystemExit: always, with ``code`` or else the result of ``exit_code_of``.
    """
    print_findings(findings, sys.stderr, most=MOST_OF_ONE_CODE)
    raise SystemExit(code or exit_code_of(findings))


def exit_code_of(findings: Sequence[Finding]) -> int:
    """Return 2 if a file, ROS or a package is missing, otherwise 1."""
    return UNREADABLE if any(finding.code in _LACKING for finding in findings) else FAILED


def is_coloured(stream: TextIO) -> bool:
    """Return whether to print colours: on a terminal, or with FORCE_COLOR.

    With NO_COLOR (no-color.org), the result is always False.
    """
    if os.environ.get("NO_COLOR"):
        return False
    return bool(os.environ.get("FORCE_COLOR")) or can_redraw(stream)


def can_redraw(stream: TextIO) -> bool:
    """Return whether lines can be redrawn in place, as on a terminal with cursor movement."""
    return stream.isatty() and os.environ.get("TERM", "dumb") != "dumb"


#: The URL where the project publishes the pages of ``help --html``. Empty means that they are not
#: published.
DOCUMENTATION_URL = ""


def code_page(code: str) -> str:
    """Return the path of a code's page, relative to the address of the documentation."""
    return f"codes/{code}.html"


def code_addresses(stream: TextIO) -> CodeAddress:
    """Return a function that maps a code to its page's address, for links on a terminal.

    The pages are at ``$TFCOMPOSE_DOCS`` (a URL or a folder), or at the project's own address.
    There are no links in files and pipes, with NO_COLOR, and to pages that the folder does not
    contain.
    """
    docs = _documentation()
    if not docs or os.environ.get("NO_COLOR") or not can_redraw(stream):
        return no_address
    from pathlib import Path
    from urllib.parse import quote

    from tfcompose.foundation.reading import exists

    if _URL.match(docs):
        return code_url
    folder = Path(docs).expanduser().absolute()
    base = f"file://{os.uname().nodename}{quote(os.fsencode(folder))}"
    return lambda code: f"{base}/{code_page(code)}" if exists(folder / code_page(code)) else ""


def code_url(code: str) -> str:
    """Return the URL of a code's page, empty if the pages are in a folder or not published."""
    from urllib.parse import quote

    docs = _documentation()
    if not _URL.match(docs):
        return ""
    return f"{quote(docs.rstrip('/'), safe=_URL_SAFE)}/{code_page(code)}"


def _documentation() -> str:
    return os.environ.get("TFCOMPOSE_DOCS") or DOCUMENTATION_URL


#: The beginning of a URL, and the characters that need no escape in a URL (RFC 3986).
_URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://")
_URL_SAFE = ":/?#[]@!$&'()*+,;=%~"


def table_width(stream: TextIO) -> int | None:
    """Return the terminal's width in columns for tables, None for a file or a pipe."""
    return size_of(stream.fileno())[0] if can_redraw(stream) else None


def size_of(fd: int) -> tuple[int, int]:
    """Return the terminal's columns and rows, (80, 24) without a terminal."""
    try:
        size = os.get_terminal_size(fd)
    except OSError:
        return 80, 24
    return size.columns or 80, size.lines or 24


def printable(text: str) -> str:
    """Return the text without control characters, so that it cannot move the cursor."""
    return mask_invisible(text, "?")


def plain(text: str) -> str:
    """Return the text without control sequences.

    Marks replace other invisible characters.
    """
    return "".join(map(_mark, _SEQUENCE.split(text)[::2]))


def keep_colours(text: str) -> str:
    """Return the text with its colours, but without other control sequences; reset at the end."""
    pieces = _SEQUENCE.split(text)
    if len(pieces) == 1:
        return _mark(text)
    colours = [(_COLOUR.fullmatch(piece) and piece) or "" for piece in pieces[1::2]]
    pieces[::2], pieces[1::2] = map(_mark, pieces[::2]), colours
    last = "".join(colours).rpartition("\033")[2]
    return "".join(pieces) + (PLAIN if last and f"\033{last}" != PLAIN else "")


def _mark(text: str) -> str:
    return mask_invisible(text, "\N{REPLACEMENT CHARACTER}", kept="\t")


def has_reader(stream: TextIO) -> bool:
    """Return whether the stream still has a reader.

    In ``tfcompose logs -f | head -1``, the reader is gone after a line.
    """
    return _first_ready(stream, None, 0) != stream


def wait_for_data(connection: socket.socket, stream: TextIO) -> bool:
    """Wait until the connection has input, or the stream has lost its reader.

    Return whether the stream has a reader. The connection's timeout limits the wait.
    """
    timeout_s = connection.gettimeout()
    return (
        _first_ready(stream, connection, None if timeout_s is None else timeout_s * 1e3) != stream
    )


def _first_ready(
    stream: TextIO, connection: socket.socket | None, timeout_ms: float | None
) -> object:
    """Return the stream if its reader is gone, else the connection if it has input."""
    poll = select.poll()
    with suppress(OSError):  # a stream without a descriptor cannot lose its reader
        poll.register(stream.fileno(), 0)
    if connection:
        poll.register(connection, select.POLLIN)
    ready = [fd for fd, _ in poll.poll(timeout_ms)]
    if connection and connection.fileno() in ready:
        ready.remove(connection.fileno())
        return stream if ready else connection
    return stream if ready else None
