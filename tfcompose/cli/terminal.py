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

#: Exit codes: findings, or a process that failed; wrong use, what cannot be read, or what is not
#: installed; and as a shell has them for a program that was ended by Ctrl-C, or by writing where
#: nobody reads.
FAILED, UNREADABLE, INTERRUPTED, OUTPUT_CLOSED = 1, 2, 130, 141

#: A file that cannot be read; ROS or a package of it, trimesh, rosbags and eclipse-zenoh.
_LACKING = frozenset({"TF001", "TF901", "TF905", "TF906", "TF920"})

#: Control sequences (ECMA-48): those that end in m set colours, the others do something; and
#: titles and links.
_SEQUENCE = re.compile(r"(\033\[[0-?]*[ -/]*[@-~]|\033\][^\033\a]*(?:\a|\033\\)?|\033[ -/]*[0-~])")
#: What clears the screen, and the line in which the cursor is.
CLEAR, CLEAR_LINE = "\033[H\033[2J", "\r\033[K"
_COLOUR = re.compile(r"\033\[[0-9;:]*m")


def warn(message: str) -> None:
    """Print one sentence to stderr, with control characters in names escaped."""
    text = "\n".join(map(printable, message.split("\n")))
    sys.stderr.write(f"tfcompose: {text}\n")


def fail(message: str, code: int = FAILED) -> NoReturn:
    """Print one sentence to stderr and end the command.

    Raises:
        SystemExit: with the exit code.
    """
    warn(message)
    raise SystemExit(code)


#: So many findings of one code are printed of a file, unless all are requested.
MOST_OF_ONE_CODE = 10


def print_findings(
    findings: Sequence[Finding], stream: TextIO, *, most: int | None = None
) -> None:
    """Print findings with the lines that they are about.

    At most ``most`` of one code per file, with the number of the others; None: all.
    """
    from tfcompose.cli.reading import line_of

    shown: list[Finding] = []
    counts: Counter[tuple[str, str]] = Counter()
    for finding in findings:
        place = (finding.span.file if finding.span else "", finding.code)
        counts[place] += 1
        if most is None or counts[place] <= most:
            shown.append(finding)
    stream.write(
        render_text(shown, line_of, colour=is_coloured(stream), address_of=code_addresses(stream))
    )
    for (file, code), count in counts.items():
        if most is not None and count > most:
            where, how = (f"{file}: ", "; tfcompose lint --all lists them") if file else ("", "")
            stream.write(f"{where}and {count - most} more {code}{how}\n")


def reject(findings: Sequence[Finding], code: int | None = None) -> NoReturn:
    """Print findings to stderr and end the command.

    Raises:
        SystemExit: with the given exit code, else that of ``exit_code_of``.
    """
    print_findings(findings, sys.stderr, most=MOST_OF_ONE_CODE)
    raise SystemExit(code or exit_code_of(findings))


def exit_code_of(findings: Sequence[Finding]) -> int:
    """Return 2 if the command lacks a file, ROS or a package, else 1."""
    return UNREADABLE if any(finding.code in _LACKING for finding in findings) else FAILED


def is_coloured(stream: TextIO) -> bool:
    """Return whether to colour: on a terminal, or with FORCE_COLOR.

    Never with NO_COLOR (no-color.org).
    """
    if os.environ.get("NO_COLOR"):
        return False
    return bool(os.environ.get("FORCE_COLOR")) or can_redraw(stream)


def can_redraw(stream: TextIO) -> bool:
    """Return whether lines can be redrawn in place: on a terminal that can move its cursor."""
    return stream.isatty() and os.environ.get("TERM", "dumb") != "dumb"


#: Where the project publishes the pages that ``help --html`` writes; empty: nowhere.
DOCUMENTATION_URL = ""


def code_page(code: str) -> str:
    """Return the path of a code's page below the address of the documentation."""
    return f"codes/{code}.html"


def code_addresses(stream: TextIO) -> CodeAddress:
    """Return the function from a code to the address of its page, for links on a terminal.

    The pages are at ``$TFCOMPOSE_DOCS``, a URL or a folder, or at the project's own address.
    Files, pipes, NO_COLOR and pages missing from a folder get no links.
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
    """Return the URL of a code's page; empty if the pages are in a folder, or unpublished."""
    from urllib.parse import quote

    docs = _documentation()
    if not _URL.match(docs):
        return ""
    return f"{quote(docs.rstrip('/'), safe=_URL_SAFE)}/{code_page(code)}"


def _documentation() -> str:
    return os.environ.get("TFCOMPOSE_DOCS") or DOCUMENTATION_URL


#: The beginning of a URL, and the characters that need no escape in it (RFC 3986).
_URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://")
_URL_SAFE = ":/?#[]@!$&'()*+,;=%~"


def table_width(stream: TextIO) -> int | None:
    """Return the terminal's width, to fit tables; None for a file or a pipe."""
    return size_of(stream.fileno())[0] if can_redraw(stream) else None


def size_of(fd: int) -> tuple[int, int]:
    """Return the terminal's columns and rows, 80 and 24 if there is none."""
    try:
        size = os.get_terminal_size(fd)
    except OSError:
        return 80, 24
    return size.columns or 80, size.lines or 24


def printable(text: str) -> str:
    """Return the text without sequences that would move the cursor."""
    return mask_invisible(text, "?")


def plain(text: str) -> str:
    """Return the text without control sequences.

    Other invisible characters are marked.
    """
    return "".join(map(_mark, _SEQUENCE.split(text)[::2]))


def keep_colours(text: str) -> str:
    """Return the text with its colours, reset at the end, and no other control sequences."""
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

    In ``tfcompose logs -f | head -1`` it is gone after one line.
    """
    return _first_ready(stream, None, 0) != stream


def wait_for_data(connection: socket.socket, stream: TextIO) -> bool:
    """Wait until there is input, or the stream has lost its reader.

    Return whether the stream has a reader. The connection's timeout limits the wait.
    """
    timeout_s = connection.gettimeout()
    return (
        _first_ready(stream, connection, None if timeout_s is None else timeout_s * 1e3) != stream
    )


def _first_ready(
    stream: TextIO, connection: socket.socket | None, timeout_ms: float | None
) -> object:
    """Return the stream if it lost its reader, else the connection if it has input."""
    poll = select.poll()
    with suppress(OSError):  # it has no descriptor: nobody can leave
        poll.register(stream.fileno(), 0)
    if connection:
        poll.register(connection, select.POLLIN)
    found = [fd for fd, _ in poll.poll(timeout_ms)]
    if connection and connection.fileno() in found:
        found.remove(connection.fileno())
        return stream if found else connection
    return stream if found else None
