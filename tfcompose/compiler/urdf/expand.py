"""Expansion of xacro files with xacro itself; errors of xacro become findings at their places.

xacro runs in a sandbox in a separate process, which requests each file from this process. It
reports the expression and the macros where it stopped, but neither line nor column. This module
searches the files for them.
"""

from __future__ import annotations

import os
import posixpath
import re
import signal
import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

from tfcompose.compiler.urdf.xacro import NAMESPACE, Expansion, macros_in
from tfcompose.foundation import confined
from tfcompose.foundation.confined import Outcome, run_confined
from tfcompose.foundation.findings import Finding, Note, RejectedError, Span, did_you_mean, finding
from tfcompose.foundation.reach import OutsideError, Reach, is_package
from tfcompose.foundation.shape import fits

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping

    from tfcompose.compiler.urdf.packages import Packages
    from tfcompose.compiler.urdf.xacro import Use

#: The module that runs xacro in the sandbox.
PROCESS = "tfcompose.compiler.urdf.xacro_process"
#: Declaration or use of an argument in a file.
_ARGUMENT = re.compile(
    r"""<xacro:arg\b[^>]{0,4000}?\bname\s*=\s*["']([^"']+)["']|\$\(arg\s+(\w+)\s*\)"""
)
#: Patterns of names in xacro's messages, and of the text around such a name in a file.
_NAMED = (
    (re.compile(r"when evaluating expression '(.+)'"), r"\$\{\s*", r"\s*\}"),
    (re.compile(r"unknown macro name: (xacro:\S+)"), "<", r"(?=[\s/>])"),
)
#: Maximum number of words of an expression to search for. The search tries all words at each
#: possible start in a file.
_MOST_WORDS = 20
_WORD = re.compile(r"""["']?(\w+)["']?""")
#: Maximum number of enclosing macros that a finding names.
_MOST_MACROS = 5
#: Maximum number of files to read, and of bytes in each file.
_MOST_FILES, _MOST_BYTES = 10_000, 16_000_000
#: A package name, which is not a path.
_PACKAGE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")
#: Maximum bytes of the current expression that the process stores, for the case that it dies.
_NOTED = 4000
_OUTSIDE = (
    "a file may read only its own folder, its repository and ROS packages (folders with a"
    " package.xml); --trust lifts this for files of your own"
)
_UNSAFE = "an expression computes values: leave these names out"
_ALONE = (
    "simplify it; or expand it outside of tfcompose, xacro {file} > robot.urdf, and use that file"
)


_PLACE = ([int], None)
#: Structure of the process's answer.
_MADE = {"text": str, "files": [str], "places": [_PLACE], "comments": [[int]]}
_MARK = ([(str, int)], None)
_STOPPED = {
    "kind": str,
    "reason": str,
    "files": [str],
    "macros": [[(str, None)]],
    "error": _MARK,
    "at": _MARK,
}
_PAIR, _IN_PLACE = 2, 3
#: Maximum number of characters of a reason, and of files and macros around it.
_LONGEST, _DEEPEST = 4000, 100


@dataclass(frozen=True, slots=True)
class Sandbox:
    """Limits of a xacro run, and callbacks for its output and for missing sandbox features."""

    reach: Reach = field(default_factory=Reach)
    print_output: Callable[[str, str], None] = lambda _file, _text: None
    report_missing: Callable[[tuple[str, ...]], None] = lambda _: None
    #: Whether to reject the file if the kernel cannot run xacro in a sandbox.
    is_strict: bool = False


def expand(
    file: str,
    packages: Packages,
    arguments: Mapping[str, Any],
    use: Use | None = None,
    sandbox: Sandbox | None = None,
) -> Expansion:
    """Return the expansion of a file, or of a call of one of its macros.

    ``packages`` resolves $(find …). xacro can read the folder tree of the file that names the
    xacro file, of the package around the xacro file, of packages that it finds, and of the
    sandbox.

    Raises:
        RejectedError: if xacro rejects the file or needs too many resources. Findings are placed
            where a robot file names the xacro file, if there is one.
    """
    sandbox = sandbox or Sandbox()
    values = {name: str(value) for name, value in arguments.items()}
    files = _XacroFiles(file, packages, sandbox.reach, use)
    trusted = sandbox.reach.everything
    wall_s = confined.MOST_TRUSTED_WALL_S if trusted else confined.MOST_WALL_S
    request = {
        "file": file,
        "arguments": values,
        "call": _document(use) if use and use.macro else None,
        "is_trusted": trusted,
        "is_strict": sandbox.is_strict,
        "wall_s": wall_s,
    }
    with tempfile.TemporaryFile() as noted:
        noted.truncate(_NOTED)
        outcome = run_confined(
            PROCESS,
            request,
            files.answers,
            wall_s=wall_s,
            shared=[noted.fileno()],
        )
        sandbox.print_output(file, outcome.printed)
        sandbox.report_missing(outcome.missing)
        answer = outcome.answer
        if sandbox.is_strict and "seccomp" in outcome.missing:
            message = "xacro was not run: this kernel has no seccomp, which confines it"
            unconfined = finding("TF923", message, Span(file), severity="error")
            raise RejectedError([_where_used(unconfined, use)])
        if not (_is_made(answer) or fits(answer, _STOPPED)):
            raise RejectedError([_where_used(_end_finding(outcome, _text_in(noted), files), use)])
    if "text" not in answer:
        raise RejectedError([_refusal_of(_Stop.of(answer, files), files, packages, use)])
    if files.refused:  # the xacro file caught the error
        outside = finding(
            "TF021", f"{files.refused[0]} may not be read", Span(file), help=_OUTSIDE
        )
        raise RejectedError([_where_used(outside, use)])
    if not all(map(files.has_served, answer["files"])):
        raise RejectedError([_where_used(_end_finding(outcome, "", files), use)])
    _refuse_unknown(values, files.served, file, use)
    names = tuple(_show_file(name, file) for name in answer["files"])
    places = tuple(place and tuple(place) for place in answer["places"])
    return Expansion(answer["text"], names, places, tuple(map(tuple, answer["comments"])))


def _is_made(answer: Any) -> bool:
    """Return whether an answer from the untrusted process is a valid expansion."""
    if not fits(answer, _MADE):
        return False
    count = len(answer["files"])
    places = [*filter(None, answer["places"]), *answer["comments"]]
    if not all(len(place) == _IN_PLACE and 0 <= place[0] < count for place in places):
        return False
    try:
        answer["text"].encode()
    except UnicodeEncodeError:  # an unpaired surrogate
        return False
    return min((number for place in places for number in place), default=0) >= 0


class _XacroFiles:
    """Answers the process's requests for files, and remembers the files that it has read.

    The process can read only permitted files.
    """

    def __init__(self, file: str, packages: Packages, reach: Reach, use: Use | None) -> None:
        self.file, self._packages, self._reach = file, packages, reach
        #: Absolute paths of files that the process has read. ``refused`` holds the first rejected
        #: path.
        self.served: dict[str, None] = {}
        self.refused: list[str] = []
        is_of_user = use is None or use.span.file.startswith("--")  # named on the command line
        reach.add_tree(file if use is None or is_of_user else use.span.file)
        for name in (file, *(use.files if use else ())):
            if not reach.allows(name):
                reach.add_package_around(name)
        self.answers: dict[str, Callable[[str], tuple[Any, bytes]]] = {
            "find": self._find,
            "read": self._read,
            "list": self._list,
        }

    def has_served(self, name: str) -> bool:
        """Return whether the process has read a file. Findings may show only such files."""
        return posixpath.abspath(name) in self.served

    def _find(self, name: str) -> tuple[Any, bytes]:
        folder = self._packages.folder(name, self.file) if _PACKAGE.fullmatch(name) else None
        if folder is None:
            return {"folder": None}, b""
        named = self._packages.named.get(name)
        is_named = named is not None and posixpath.abspath(folder) == posixpath.abspath(
            self._packages.candidates(name)[0]
        )
        if not is_named or is_package(folder):
            self._reach.add_folder(folder)
        return {"folder": posixpath.abspath(folder)}, b""  # xacro must use this folder only

    def _read(self, path: str) -> tuple[Any, bytes]:
        if len(self.served) > _MOST_FILES:
            return self._refuse(path)
        try:
            data = self._reach.read(path, _MOST_BYTES)
        except OutsideError:
            return self._refuse(path)
        except OSError as error:
            return {"error": [error.errno, error.strerror]}, b""
        self.served[posixpath.abspath(path)] = None
        return {"bytes": len(data)}, data

    def _list(self, folder: str) -> tuple[Any, bytes]:
        try:
            return {"names": self._reach.names_in(folder)}, b""
        except OutsideError:
            return self._refuse(folder)
        except OSError as error:
            return {"error": [error.errno, error.strerror]}, b""

    def _refuse(self, path: str) -> tuple[Any, bytes]:
        self.refused = self.refused or [path]
        return {"outside": True}, b""


def _document(use: Use) -> str:
    attributes = "".join(f" {name}={quoteattr(value)}" for name, value in use.words.items())
    includes = "".join(
        f"<xacro:include filename={quoteattr(os.path.normpath(Path(file).absolute()))}/>"
        for file in use.files
    )
    macro = f"<xacro:{use.macro}{attributes}>{''.join(use.blocks)}</xacro:{use.macro}>"
    return f'<robot name="part" {NAMESPACE}>{includes}{macro}</robot>'


def _refuse_unknown(
    names: Mapping[str, str], files: Collection[str], file: str, use: Use | None
) -> None:
    """Reject arguments that no file declares or uses, because xacro silently ignores them."""
    texts = [Path(name).read_text("utf-8", "replace") for name in files]
    arguments = dict.fromkeys(
        name
        for text in texts
        for match in _ARGUMENT.finditer(text)
        for name in match.groups()
        if name
    )
    wrong = [name for name in names if name not in arguments]
    if wrong:
        raise RejectedError(
            [_where_used(_no_argument(name, arguments, file), use) for name in wrong]
        )


def _no_argument(name: str, arguments: Collection[str], file: str) -> Finding:
    otherwise = f"known: {', '.join(arguments)}" if arguments else "the file takes no arguments"
    return finding(
        "TF106",
        f"unknown argument {name}",
        Span(file),
        help=did_you_mean(name, arguments, otherwise),
    )


def _where_used(finding: Finding, use: Use | None) -> Finding:
    """Move a finding in a xacro file to the place in the robot file that names the xacro file."""
    if use is None or finding.span is None:
        return finding
    exact = (
        () if finding.span == Span(finding.span.file) else (Note("reported here", finding.span),)
    )
    return replace(
        finding,
        span=use.span,
        message=f"{finding.span.file}: {finding.message}",
        notes=(*exact, *finding.notes),
    )


def _in_call(finding: Finding, file: str, use: Use) -> Finding:
    """Place xacro's finding about a macro call at the parameter, with the macro's parameters."""
    named = [name for name in _WORD.findall(finding.message) if name in use.places]
    macros, span = macros_in(Path(file).read_text("utf-8", "replace")), use.span
    if use.macro in macros:
        takes = macros[use.macro]
        advice = f"the params of {use.macro}: {takes}" if takes else f"{use.macro} has no params"
        advice += "; those with * take {xyz, rpy} or XML" if "*" in takes else ""
        span = use.places[named[-1]] if named else span
    else:
        advice = did_you_mean(
            use.macro, macros, f"{file} defines {', '.join(macros)}" if macros else ""
        )
    return replace(_where_used(finding, replace(use, span=span)), help=advice)


@dataclass(frozen=True, slots=True)
class _Stop:
    """The reason why xacro stopped, and the place."""

    kind: str
    reason: str
    #: Files that xacro was reading, innermost last.
    files: list[str]
    #: Macros that xacro was expanding, innermost last, each with its file.
    macros: list[tuple[str, str]]
    #: The place of invalid XML: file, line, column from 0.
    error: tuple[str, int, int] | None
    #: The element that xacro was evaluating: file, line, column from 0.
    element: tuple[str, int, int] | None

    @classmethod
    def of(cls, answer: Mapping[str, Any], files: _XacroFiles) -> _Stop:
        """Return the process's report, without files that the process has not read."""

        def mark(value: Any) -> tuple[str, int, int] | None:
            if not fits(value, [(str, int)]) or list(map(type, value)) != [str, int, int]:
                return None
            return tuple(value) if files.has_served(value[0]) else None

        macros = answer["macros"][-_DEEPEST:]
        macros = [pair for pair in macros if len(pair) == _PAIR and None not in pair]
        return cls(
            answer["kind"],
            answer["reason"][:_LONGEST],
            list(filter(files.has_served, answer["files"][-_DEEPEST:])),
            [(name, file) for name, file in macros if files.has_served(file)],
            mark(answer["error"]),
            mark(answer["at"]),
        )


def _refusal_of(stop: _Stop, files: _XacroFiles, packages: Packages, use: Use | None) -> Finding:
    """Return the finding with the reason why xacro stopped, and its place."""
    file = files.file
    begins = [(stop.element[0], stop.element[1])] if stop.element else []
    if stop.kind == "package":
        missing = replace(packages.not_found(stop.reason, None), severity="error", span=Span(file))
        shown_path = _at_words(missing, rf"\$\(find\s+{re.escape(stop.reason)}\s*\)", begins)
    elif stop.kind == "argument":
        message = f"the argument {stop.reason} has no value and no default"
        advice = f"give it: {stop.reason}:=…, or in a part args: {{{stop.reason}: …}}"
        missing = finding("TF106", message, Span(file), help=advice)
        shown_path = _at_words(missing, rf"\$\(arg\s+{re.escape(stop.reason)}\s*\)", begins)
    elif stop.kind == "limit":
        shown_path = _place_finding(
            finding("TF008", stop.reason, Span(file), help=_ALONE.format(file=file)), stop, begins
        )
    elif stop.kind == "outside":
        shown_path = _place_finding(
            finding("TF021", stop.reason, Span(file), help=_OUTSIDE), stop, begins
        )
    elif stop.kind == "unsafe":
        shown_path = _place_finding(
            finding("TF022", stop.reason, Span(file), help=_UNSAFE), stop, begins
        )
    else:
        shown_path = _place_finding(
            finding("TF018", f"xacro: {stop.reason}", Span(file)), stop, begins
        )
    shown_path = _relative_to(file, shown_path)
    inner_files = [
        name for name in stop.files[-1:] if Path(name).absolute() != Path(file).absolute()
    ]
    if inner_files and shown_path.span == Span(file) and stop.kind not in {"package", "argument"}:
        shown_path = replace(
            shown_path, message=f"{shown_path.message} (in {os.path.relpath(inner_files[0])})"
        )
    is_of_call = use and use.macro and stop.kind == "refused" and files.has_served(file)
    return _in_call(shown_path, file, use) if use and is_of_call else _where_used(shown_path, use)


def _at_words(finding: Finding, pattern: str, begins: list[tuple[str, int]]) -> Finding:
    """Return the finding at the first match of the pattern, from one of these lines on."""
    span = next(
        (span for file, line in begins if (span := _first(file, pattern, line))), finding.span
    )
    return replace(finding, span=span)


def _place_finding(finding: Finding, stop: _Stop, begins: list[tuple[str, int]]) -> Finding:
    """Return the finding at the text that it names, with notes about enclosing macros.

    If no file contains the text, the finding is at the element that xacro was processing. Files
    have the names that xacro uses.
    """
    around = dict.fromkeys((name, file) for name, file in reversed(stop.macros))
    inner = [(name, begin) for name, file in around if (begin := _definition(file, name))]
    notes = [Note(f"in the macro {name}", span) for name, span in inner[:_MOST_MACROS]]
    if stop.error:
        span: Span | None = _mark(*stop.error)
    else:
        begins = [
            *begins,
            *((macro.file, macro.line) for _, macro in inner),
            *((file, 0) for file in stop.files[::-1]),
        ]
        busy = _mark(*stop.element) if stop.element else finding.span
        span = next(
            (name for file, line in begins for name in _find_spans(finding.message, file, line)),
            busy,
        )
    return replace(finding, span=span, notes=(*finding.notes, *notes))


def _mark(file: str, line: int, column: int) -> Span:
    return Span(file, line, column + 1, line, column + 2)


def _end_finding(outcome: Outcome, noted: str, files: _XacroFiles) -> Finding:
    """Return the finding that the process was killed, with the expression it was evaluating."""
    code, file = outcome.code, files.file
    if outcome.timed_out:
        message = f"xacro was ended: it took more than {confined.MOST_WALL_S:g} s"
    elif outcome.refused:
        message = f"xacro was ended: {outcome.refused}"
    elif outcome.answer is not None:
        message = "xacro was ended: its answer is none"
    elif code == -signal.SIGVTALRM:
        message = "xacro was ended: an expression takes too long"
    elif code == -signal.SIGKILL:
        message = "xacro was ended: it took too long, or too much memory"
    else:
        by_signal = f"xacro was ended by {_signal_name(-code)}"
        message = by_signal if code < 0 else f"xacro gave up with code {code}"
    full = f"{message}: {noted}" if noted else message
    error = finding("TF008", full, Span(file), help=_ALONE.format(file=file))
    pattern = _pattern_of(noted)
    return _at_words(error, pattern, [(file, 0)]) if pattern and files.has_served(file) else error


def _signal_name(number: int) -> str:
    is_known = number in set(signal.Signals)
    return signal.Signals(number).name if is_known else f"signal {number}"


def _text_in(noted: IO[bytes]) -> str:
    """Return the expression that the process was evaluating."""
    noted.seek(0)
    return noted.read().partition(b"\0")[0].decode("utf-8", "replace")


def _definition(file: str | None, macro: str) -> Span | None:
    """Return the span of a macro's definition in a file, or None."""
    return _first(
        file,
        rf"""<xacro:macro\s[^>]{{0,4000}}?\bname\s*=\s*["'](?:xacro:)?{re.escape(macro)}["']""",
        0,
    )


def _find_spans(message: str, file: str, line: int) -> Iterator[Span]:
    """Yield the spans of names from the message in the file, from a line on."""
    for naming, before, after in _NAMED:
        for match in naming.finditer(message):
            end = after if len(match[1].split()) <= _MOST_WORDS else ""
            span = _first(file, before + _pattern_of(match[1]) + end, line)
            if span:
                yield span


def _pattern_of(text: str) -> str:
    """Return a pattern for the first words of a text, with any line breaks between them."""
    return r"\s+".join(map(re.escape, text.split()[:_MOST_WORDS]))


def _first(file: str | None, pattern: str, line: int) -> Span | None:
    """Return the span of the pattern's first match in the file from a line on, or None."""
    if not file:
        return None
    text = Path(file).read_text("utf-8", "replace")
    start = sum(map(len, text.splitlines(keepends=True)[: max(line - 1, 0)]))
    match = re.compile(pattern).search(text, start)
    if match is None:
        return None
    return Span(file, *_position(text, match.start()), *_position(text, match.end()))


def _position(text: str, index: int) -> tuple[int, int]:
    return text.count("\n", 0, index) + 1, index - text.rfind("\n", 0, index)


def _relative_to(file: str, finding: Finding) -> Finding:
    """Return the finding with paths relative to the working directory.

    The path ``file`` stays as the user wrote it.
    """

    def find_span(span: Span | None) -> Span | None:
        return span._replace(file=_show_file(span.file, file)) if span else None

    notes = tuple(replace(note, span=find_span(note.span)) for note in finding.notes)
    return replace(finding, span=find_span(finding.span), notes=notes)


def _show_file(name: str, file: str) -> str:
    """Return a path relative to the working directory; ``file`` stays as the user wrote it."""
    return file if Path(name).absolute() == Path(file).absolute() else os.path.relpath(name)
