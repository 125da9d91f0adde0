"""Xacro files, expanded by xacro itself; what xacro refuses is a finding at its place in the xacro file.

xacro runs in a process of its own, with bounds of time and memory. It names the expression and the
macros that it stopped at, and neither line nor column: they are looked for here.
"""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

from tfcompose.compiler.urdf.xacro import NAMESPACE, Expansion, macros_in
from tfcompose.foundation.findings import Finding, Note, RejectedError, Span, did_you_mean, finding

if TYPE_CHECKING:
    import io
    from collections.abc import Collection, Iterator, Mapping

    from tfcompose.compiler.urdf.packages import Packages
    from tfcompose.compiler.urdf.xacro import Use

#: How a file declares an argument, and how it asks for one.
_ARGUMENT = re.compile(r"""<xacro:arg\b[^>]*?\bname\s*=\s*["']([^"']+)["']|\$\(arg\s+(\w+)\s*\)""")
#: What xacro's messages name, and how that begins in a file.
_NAMED = (
    (re.compile(r"when evaluating expression '(.+)'"), r"\$\{{\s*{}\s*\}}"),
    (re.compile(r"unknown macro name: (xacro:\S+)"), r"<{}(?=[\s/>])"),
)
_WORD = re.compile(r"""["']?(\w+)["']?""")
#: At most so many of the macros around an error are named.
_MOST_MACROS = 5
#: Files may be on a disk that does not answer; the process bounds its processor time itself.
_MOST_WALL_S = 600.0
#: Bytes of an expression that the process keeps for when it ends.
_NOTED = 4000
_ALONE = (
    "simplify it; or expand it outside of tfcompose, xacro {file} > robot.urdf, and use that file"
)


def expand(
    file: str, packages: Packages, arguments: Mapping[str, Any], use: Use | None = None
) -> Expansion:
    """Return what xacro makes of a file, or of a call of one of its macros; ``packages`` answer $(find …).

    Raises:
        RejectedError: if xacro refuses the file, or needs too much for it; with the findings where
            a robot file names it, if one does.
    """
    given = {name: str(value) for name, value in arguments.items()}
    request = {
        "file": file,
        "arguments": given,
        "call": _document(use) if use and use.macro else None,
    }
    with tempfile.TemporaryFile() as noted:
        noted.truncate(_NOTED)
        answer, code = _answered(request, file, packages, noted)
        if answer is None:
            raise RejectedError([_where_used(_ended(code, _text_in(noted), file), use)])
    if "text" not in answer:
        raise RejectedError([_refused(_Stop(**answer), file, packages, use)])
    _refuse_unknown(given, answer["read"], file, use)
    names = tuple(_shown(name, file) for name in answer["files"])
    places = tuple(tuple(place) if place else None for place in answer["places"])
    return Expansion(answer["text"], names, places, tuple(map(tuple, answer["comments"])))


def _answered(
    request: Mapping[str, Any], file: str, packages: Packages, noted: IO[bytes]
) -> tuple[dict[str, Any] | None, int]:
    """Return the process's answer to a request, None where it was ended, and its exit code."""
    ours, theirs = socket.socketpair()
    inherited = [theirs.fileno(), noted.fileno()]
    program = (
        f"import sys; sys.path[:] = {sys.path!r}; from tfcompose.compiler.urdf.xacro_process"
        " import main; main"
    )
    command = [sys.executable, "-c", f"{program}(*{inherited})"]
    answer: dict[str, Any] | None = None
    with (
        ours,
        ours.makefile("rwb") as channel,
        subprocess.Popen(
            command, stdout=2, pass_fds=inherited
        ) as process,  # what xacro prints is for people
    ):
        theirs.close()
        watchdog = threading.Timer(_MOST_WALL_S, process.kill)
        watchdog.daemon = True
        watchdog.start()
        try:
            message = _exchanged(channel, request)
            while "find" in message:
                folder = packages.folder(message["find"], file)
                absolute = folder and str(
                    Path(folder).absolute()
                )  # the process takes files from other folders
                message = _exchanged(channel, absolute)
            answer = message
        except (OSError, json.JSONDecodeError):
            pass  # the process's end says why
        except BaseException:
            process.kill()
            raise
        finally:
            process.wait()
            watchdog.cancel()
    return answer, process.returncode


def _exchanged(channel: io.BufferedRWPair, message: Any) -> dict[str, Any]:
    """Send a message, and return the next one."""
    channel.write(json.dumps(message).encode() + b"\n")
    channel.flush()
    answer: dict[str, Any] = json.loads(channel.readline())
    return answer


def _document(use: Use) -> str:
    words = "".join(f" {name}={quoteattr(value)}" for name, value in use.words.items())
    includes = "".join(
        f"<xacro:include filename={quoteattr(os.path.normpath(Path(file).absolute()))}/>"
        for file in use.files
    )
    macro = f"<xacro:{use.macro}{words}>{''.join(use.blocks)}</xacro:{use.macro}>"
    return f'<robot name="part" {NAMESPACE}>{includes}{macro}</robot>'


def _refuse_unknown(
    given: Mapping[str, str], files: Collection[str], file: str, use: Use | None
) -> None:
    """Refuse arguments that none of the files declares or asks for; xacro itself ignores them."""
    texts = [Path(name).read_text("utf-8", "replace") for name in files]
    known = dict.fromkeys(
        name
        for text in texts
        for found in _ARGUMENT.finditer(text)
        for name in found.groups()
        if name
    )
    wrong = [name for name in given if name not in known]
    if wrong:
        raise RejectedError([_where_used(_no_argument(name, known, file), use) for name in wrong])


def _no_argument(name: str, known: Collection[str], file: str) -> Finding:
    there = f"known: {', '.join(known)}" if known else "the file takes no arguments"
    return finding(
        "TF106", f"unknown argument {name}", Span(file), help=did_you_mean(name, known, there)
    )


def _where_used(found: Finding, use: Use | None) -> Finding:
    """Return a finding in a xacro file as one at the place in the robot file that names it, if one does."""
    if use is None or found.span is None:
        return found
    exact = () if found.span == Span(found.span.file) else (Note("reported here", found.span),)
    return replace(
        found,
        span=use.at,
        message=f"{found.span.file}: {found.message}",
        notes=(*exact, *found.notes),
    )


def _in_call(found: Finding, file: str, use: Use) -> Finding:
    """Return what xacro says about the call of a macro, at the parameter that it names, with what the macro takes."""
    named = [word for word in _WORD.findall(found.message) if word in use.places]
    macros, at = macros_in(Path(file).read_text("utf-8", "replace")), use.at
    if use.macro in macros:
        takes = macros[use.macro]
        advice = f"the params of {use.macro}: {takes}" if takes else f"{use.macro} has no params"
        advice += "; those with * take {xyz, rpy} or XML" if "*" in takes else ""
        at = use.places[named[-1]] if named else at
    else:
        advice = did_you_mean(
            use.macro, macros, f"{file} defines {', '.join(macros)}" if macros else ""
        )
    return replace(_where_used(found, replace(use, at=at)), help=advice)


@dataclass(frozen=True, slots=True)
class _Stop:
    """Why xacro stopped.

    ``files`` are those that were being read, the innermost last, and so are ``macros``, each with
    its file. ``error`` is where XML is broken, ``at`` the element that xacro was busy with: file,
    line, and column, which counts from 0.
    """

    kind: str
    reason: str
    files: list[str]
    macros: list[tuple[str, str]]
    error: tuple[str, int, int] | None
    at: tuple[str, int, int] | None


def _refused(stop: _Stop, file: str, packages: Packages, use: Use | None) -> Finding:
    """Return what xacro, or something that it called, did not like, and where, or in which other file."""
    begins = [(stop.at[0], stop.at[1])] if stop.at else []
    if stop.kind == "package":
        missing = replace(packages.not_found(stop.reason, None), severity="error", span=Span(file))
        found = _at_words(missing, rf"\$\(find\s+{re.escape(stop.reason)}\s*\)", begins)
    elif stop.kind == "argument":
        message = f"the argument {stop.reason} has no value and no default"
        advice = f"give it: {stop.reason}:=…, or in a part args: {{{stop.reason}: …}}"
        missing = finding("TF106", message, Span(file), help=advice)
        found = _at_words(missing, rf"\$\(arg\s+{re.escape(stop.reason)}\s*\)", begins)
    elif stop.kind == "limit":
        found = _placed(
            finding("TF008", stop.reason, Span(file), help=_ALONE.format(file=file)), stop, begins
        )
    else:
        found = _placed(finding("TF018", f"xacro: {stop.reason}", Span(file)), stop, begins)
    found = _relative_to(file, found)
    others = [name for name in stop.files[-1:] if Path(name).absolute() != Path(file).absolute()]
    if others and found.span == Span(file) and stop.kind not in {"package", "argument"}:
        found = replace(found, message=f"{found.message} (in {os.path.relpath(others[0])})")
    return (
        _in_call(found, file, use)
        if use and use.macro and stop.kind == "refused"
        else _where_used(found, use)
    )


def _at_words(found: Finding, pattern: str, begins: list[tuple[str, int]]) -> Finding:
    """Return the finding at the first words of the pattern from one of these lines on."""
    at = next((at for file, line in begins if (at := _first(file, pattern, line))), found.span)
    return replace(found, span=at)


def _placed(found: Finding, stop: _Stop, begins: list[tuple[str, int]]) -> Finding:
    """Return the finding at the words that it is about, with notes about the macros that were expanded then.

    Where the words are not to be found it is at the element that xacro was busy with. Places are
    in the files as xacro names them.
    """
    around = dict.fromkeys((name, file) for name, file in reversed(stop.macros))
    inner = [(name, begin) for name, file in around if (begin := _definition(file, name))]
    notes = [Note(f"in the macro {name}", at) for name, at in inner[:_MOST_MACROS]]
    if stop.error:
        at: Span | None = _mark(*stop.error)
    else:
        begins = [
            *begins,
            *((macro.file, macro.line) for _, macro in inner),
            *((one, 0) for one in stop.files[::-1]),
        ]
        busy = _mark(*stop.at) if stop.at else found.span
        at = next(
            (word for file, line in begins for word in _named_at(found.message, file, line)), busy
        )
    return replace(found, span=at, notes=(*found.notes, *notes))


def _mark(file: str, line: int, column: int) -> Span:
    return Span(file, line, column + 1, line, column + 2)


def _ended(code: int, noted: str, file: str) -> Finding:
    """Return the finding that the process was ended, and what it was evaluating then."""
    if code == -signal.SIGVTALRM:
        message = "xacro was ended: an expression takes too long"
    elif code == -signal.SIGKILL:
        message = "xacro was ended: it took too long, or too much memory"
    else:
        message = (
            f"xacro was ended by {signal.Signals(-code).name}"
            if code < 0
            else f"xacro gave up with code {code}"
        )
    found = finding(
        "TF008",
        f"{message}: {noted}" if noted else message,
        Span(file),
        help=_ALONE.format(file=file),
    )
    words = r"\s+".join(map(re.escape, noted.split()))
    return _at_words(found, words, [(file, 0)]) if words else found


def _text_in(noted: IO[bytes]) -> str:
    """Return what the process was evaluating."""
    noted.seek(0)
    return noted.read().partition(b"\0")[0].decode("utf-8", "replace")


def _definition(file: str | None, macro: str) -> Span | None:
    """Return where a file defines a macro, or None."""
    return _first(
        file, rf"""<xacro:macro\s[^>]*?\bname\s*=\s*["'](?:xacro:)?{re.escape(macro)}["']""", 0
    )


def _named_at(message: str, file: str, line: int) -> Iterator[Span]:
    """Yield where the file has what the message names, from a line on."""
    for naming, pattern in _NAMED:
        for found in naming.finditer(message):
            words = r"\s+".join(re.escape(word) for word in found[1].split())
            at = _first(file, pattern.format(words), line)
            if at:
                yield at


def _first(file: str | None, pattern: str, line: int) -> Span | None:
    """Return the first place of the pattern in the file from a line on, or None."""
    if not file:
        return None
    text = Path(file).read_text("utf-8", "replace")
    start = sum(map(len, text.splitlines(keepends=True)[: max(line - 1, 0)]))
    found = re.compile(pattern).search(text, start)
    if found is None:
        return None
    return Span(file, *_position(text, found.start()), *_position(text, found.end()))


def _position(text: str, index: int) -> tuple[int, int]:
    return text.count("\n", 0, index) + 1, index - text.rfind("\n", 0, index)


def _relative_to(file: str, found: Finding) -> Finding:
    """Return the finding with its places in files as seen from the working folder, and ``file`` as it is named."""

    def shown(span: Span | None) -> Span | None:
        return span._replace(file=_shown(span.file, file)) if span else None

    notes = tuple(replace(note, span=shown(note.span)) for note in found.notes)
    return replace(found, span=shown(found.span), notes=notes)


def _shown(name: str, file: str) -> str:
    """Return a file's name as seen from the working folder; ``file`` is as it is named."""
    return file if Path(name).absolute() == Path(file).absolute() else os.path.relpath(name)
