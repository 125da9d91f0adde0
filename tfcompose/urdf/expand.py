"""Xacro files, expanded by xacro itself; what xacro refuses is a finding at its place in the xacro file.

xacro names the expression and the macros that it stopped at, and neither line nor column: they are looked for here.
"""

from __future__ import annotations

import contextlib
import os
import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import xacro
from xacro import substitution_args

from tfcompose.findings import Finding, Note, RejectedError, Span, did_you_mean, finding
from tfcompose.urdf.xacro import NAMESPACE, macros_in

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from tfcompose.urdf.packages import Packages
    from tfcompose.urdf.xacro import Use

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


def expand(file: str, packages: Packages, arguments: Mapping[str, Any], use: Use | None = None) -> str:
    """Return the URDF that xacro makes of a file, or of a call of one of its macros; ``packages`` answer $(find …).

    Raises:
        RejectedError: if xacro refuses the file; with the findings where a robot file names it, if one does.
    """
    given = {name: str(value) for name, value in arguments.items()}
    try:
        xacro.all_includes.clear()
        with _finding_in(packages, file):
            document = _processed(file, use, given)
        _refuse_unknown(given, [file, *xacro.all_includes], file, use)
        _raise_comments(document)
        result: str = document.toprettyxml(indent="  ")
    except RejectedError:
        raise
    except Exception as error:  # noqa: BLE001 (xacro evaluates Python: anything can come out of it)
        raise RejectedError([_refused(error, file, use)]) from None
    return result


def _processed(file: str, use: Use | None, arguments: dict[str, str]) -> Any:
    """Return the DOM document that xacro makes."""
    if use is None or not use.macro:
        return xacro.process_file(file, mappings=arguments)
    document = xacro.parse(_document(use), file)
    xacro.init_stacks(file)  # relative includes begin in the file's folder
    xacro.process_doc(document, mappings=arguments)
    return document


def _document(use: Use) -> str:
    words = "".join(f" {name}={quoteattr(value)}" for name, value in use.words.items())
    includes = "".join(
        f"<xacro:include filename={quoteattr(os.path.normpath(Path(file).absolute()))}/>" for file in use.files
    )
    macro = f"<xacro:{use.macro}{words}>{''.join(use.blocks)}</xacro:{use.macro}>"
    return f'<robot name="part" {NAMESPACE}>{includes}{macro}</robot>'


class _MissingError(LookupError):
    """A package is not found; ``found`` is the finding about it."""

    def __init__(self, found: Finding) -> None:
        super().__init__(found.message)
        self.found = found


@contextlib.contextmanager
def _finding_in(packages: Packages, file: str) -> Iterator[None]:
    """Let $(find NAME) be answered by the robot's packages too, for as long as ``file`` is expanded."""
    before = substitution_args._eval_find  # noqa: SLF001 (xacro offers no other way)

    def find(name: str) -> str:
        folder = packages.folder(name, file)
        if folder is None:
            raise _MissingError(packages.not_found(name, None))
        return str(Path(folder).absolute())  # relative paths in xacro begin at the file that includes

    substitution_args._eval_find = find  # noqa: SLF001 (as above)
    try:
        yield
    finally:
        substitution_args._eval_find = before  # noqa: SLF001 (as above)


def _refuse_unknown(given: Mapping[str, str], files: list[str], file: str, use: Use | None) -> None:
    """Refuse arguments that none of the files declares or asks for; xacro itself ignores them."""
    texts = [Path(name).read_text("utf-8", "replace") for name in files]
    known = dict.fromkeys(
        name for text in texts for found in _ARGUMENT.finditer(text) for name in found.groups() if name
    )
    wrong = [name for name in given if name not in known]
    if wrong:
        raise RejectedError([_where_used(_no_argument(name, known, file), use) for name in wrong])


def _no_argument(name: str, known: Collection[str], file: str) -> Finding:
    there = f"known: {', '.join(known)}" if known else "the file takes no arguments"
    return finding("TF106", f"unknown argument {name}", Span(file), help=did_you_mean(name, known, there))


def _raise_comments(node: Any) -> None:
    """Move comments that allow findings above the tag on their line: printing gives each a line of its own."""
    for child in list(node.childNodes):
        _raise_comments(child)
        before = child.previousSibling
        if child.nodeType != child.COMMENT_NODE or "tfcompose:" not in child.data or before is None:
            continue
        if before.nodeType == child.TEXT_NODE and ("\n" in before.data or before.data.strip()):
            continue
        while before is not None and before.nodeType != child.ELEMENT_NODE:
            before = before.previousSibling
        over = before or node
        over.parentNode.insertBefore(child, over)


def _where_used(found: Finding, use: Use | None) -> Finding:
    """Return a finding in a xacro file as one at the place in the robot file that names it, if one does."""
    if use is None or found.span is None:
        return found
    exact = () if found.span == Span(found.span.file) else (Note("reported here", found.span),)
    return replace(found, span=use.at, message=f"{found.span.file}: {found.message}", notes=(*exact, *found.notes))


def _in_call(found: Finding, file: str, use: Use) -> Finding:
    """Return what xacro says about the call of a macro, at the parameter that it names, with what the macro takes."""
    named = [word for word in _WORD.findall(found.message) if word in use.places]
    macros, at = macros_in(Path(file).read_text("utf-8", "replace")), use.at
    if use.macro in macros:
        advice = f"{use.macro} takes {macros[use.macro] or 'nothing'}"
        advice += "; parameters with * take {xyz, rpy} or XML" if "*" in macros[use.macro] else ""
        at = use.places[named[-1]] if named else at
    else:
        advice = did_you_mean(use.macro, macros, f"{file} defines {', '.join(macros)}" if macros else "")
    return replace(_where_used(found, replace(use, at=at)), help=advice)


def _refused(error: Exception, file: str, use: Use | None) -> Finding:
    """Return what xacro, or something that it called, did not like, and where, or in which other file."""
    chain: list[Any] = [error]
    while getattr(chain[-1], "exc", None) is not None:  # xacro wraps what it calls, again and again
        chain.append(chain[-1].exc)
    root = chain[-1]
    if isinstance(root, _MissingError):
        return _where_used(replace(root.found, severity="error", span=Span(file)), use)
    if type(root).__name__ == "ArgException":
        message = f"the argument {root} has no value and no default"
        advice = f"give it: {root}:=…, or in a part args: {{{root}: …}}"
        return _where_used(finding("TF106", message, Span(file), help=advice), use)
    reason = _reason(chain) or type(error).__name__
    found = finding("TF018", f"xacro: {reason}", Span(file))
    files, macros = list(xacro.filestack or ()), list(xacro.macrostack or ())
    placed = _relative_to(file, _placed(found, root, files, macros))
    others = [name for name in files[-1:] if name and Path(name).absolute() != Path(file).absolute()]
    if others and placed.span == found.span:
        placed = replace(placed, message=f"{placed.message} (in {os.path.relpath(others[0])})")
    return _in_call(placed, file, use) if use and use.macro else _where_used(placed, use)


def _reason(chain: list[Any]) -> str:
    """Return the message of a chain of exceptions in one line; the last one is the cause of the others."""
    root = chain[-1]
    if isinstance(root, OSError):
        words = [f"{root.strerror}: {root.filename}"]
    else:
        heads = [str(one.args[0]) for one in chain[:-1] if one.args and one.args[0]]
        own = str(root) if hasattr(root, "suffix") or "line" in str(root) else f"{type(root).__name__}: {root}"
        words = [*(head for head in heads if str(root) not in head), own]
        words += [str(one.suffix) for one in reversed(chain[:-1]) if getattr(one, "suffix", None)]
    return " ".join(" ".join(words).split())


def _placed(found: Finding, error: Any, files: list[str], macros: list[Any]) -> Finding:
    """Return the finding at the words that it is about, with notes about the macros that were expanded then.

    ``files`` are those that were being read, the innermost last, and so are ``macros``. The finding stays where it is
    if the words are not to be found. Places are in the files as xacro names them.
    """
    files = [file for file in files if file]
    around = dict.fromkeys((macro.body.getAttribute("name"), macro.history[-1][-1]) for macro in reversed(macros))
    inner = [(name, begin) for name, file in around if (begin := _definition(file, name))]
    notes = [Note(f"in the macro {name}", at) for name, at in inner[:_MOST_MACROS]]
    if getattr(error, "lineno", None) is not None and files:  # an ExpatError; its columns count from 0
        line, column = error.lineno, error.offset + 1
        at: Span | None = Span(files[-1], line, column, line, column + 1)
    else:
        begins = [(macro.file, macro.line) for _, macro in inner] + [(file, 0) for file in reversed(files)]
        at = next((word for file, line in begins for word in _named_at(found.message, file, line)), found.span)
    return replace(found, span=at, notes=(*found.notes, *notes))


def _definition(file: str | None, macro: str) -> Span | None:
    """Return where a file defines a macro, or None."""
    return _first(file, rf"""<xacro:macro\s[^>]*?\bname\s*=\s*["'](?:xacro:)?{re.escape(macro)}["']""", 0)


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
        if span is None or span.file == file:
            return span
        same = Path(span.file).absolute() == Path(file).absolute()
        return span._replace(file=file if same else os.path.relpath(span.file))

    notes = tuple(replace(note, span=shown(note.span)) for note in found.notes)
    return replace(found, span=shown(found.span), notes=notes)
