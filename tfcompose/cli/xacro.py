"""Xacro files, expanded by xacro itself."""

from __future__ import annotations

import contextlib
import os
import re
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tfcompose.cli.terminal import read_text
from tfcompose.findings import Finding, RejectedError, Span, did_you_mean, finding

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from tfcompose.resolve.packages import Packages

#: How a file declares an argument, and how it asks for one.
_ARGUMENT = re.compile(r"""<xacro:arg\b[^>]*?\bname\s*=\s*["']([^"']+)["']|\$\(arg\s+(\w+)\s*\)""")


def expanded(file: str, packages: Packages, arguments: Mapping[str, str] | None = None, text: str | None = None) -> str:
    """Return the URDF that xacro makes of a file, or of a ``text`` that stands for it; ``packages`` answer $(find …).

    Raises:
        RejectedError: if xacro is not installed, or refuses the file.
    """
    if text is None:
        read_text(file)  # what cannot be read is said as everywhere
    try:
        xacro: Any = import_module("xacro")
    except ImportError:
        advice = "pip install xacro, or take the expanded file"
        raise RejectedError([finding("TF904", "xacro is not installed", Span(file), help=advice)]) from None
    try:
        xacro.all_includes.clear()
        with _finding(packages, file):
            given = {name: str(value) for name, value in (arguments or {}).items()}
            document = _document(xacro, file, text, given)
        _refuse_unknown(given, [file, *xacro.all_includes], file)
        _raise_comments(document)
        result: str = document.toprettyxml(indent="  ")
    except RejectedError:
        raise
    except Exception as error:  # noqa: BLE001 (xacro evaluates Python: anything can come out of it)
        raise RejectedError([_refused(error, file, xacro)]) from None
    return result


class _MissingError(LookupError):
    """A package is not to be found; ``found`` says where it was looked for."""

    def __init__(self, found: Finding) -> None:
        super().__init__(found.message)
        self.found = found


def _refused(error: Exception, file: str, xacro: Any) -> Finding:
    """Return what xacro, or something that it called, did not like, and where, or in which other file."""
    chain: list[Any] = [error]
    while getattr(chain[-1], "exc", None) is not None:  # xacro wraps what it calls, again and again
        chain.append(chain[-1].exc)
    root = chain[-1]
    if isinstance(root, _MissingError):
        return replace(root.found, severity="error", span=Span(file))
    if type(root).__name__ == "ArgException":
        message = f"the argument {root} has no value: the file gives it none"
        return finding("TF106", message, Span(file), help=f"{root}:=…; of a part, args: {{{root}: …}}")
    if isinstance(root, OSError):
        words = [f"{root.strerror}: {root.filename}"]
    else:
        heads = [str(one.args[0]) for one in chain[:-1] if one.args and one.args[0]]
        own = str(root) if hasattr(root, "suffix") or "line" in str(root) else f"{type(root).__name__}: {root}"
        words = [*(head for head in heads if str(root) not in head), own]
        words += [str(one.suffix) for one in reversed(chain[:-1]) if getattr(one, "suffix", None)]
    said = " ".join(" ".join(words).split()) or type(error).__name__
    files, macros = list(xacro.filestack or ()), list(xacro.macrostack or ())
    whole = finding("TF018", f"xacro: {said}", Span(file))
    places: Any = import_module("tfcompose.cli.xacro_places")
    exact: Finding = places.seen_from(file, places.placed(whole, root, files, macros))
    others = [name for name in files[-1:] if name and Path(name).absolute() != Path(file).absolute()]
    if others and exact.span == whole.span:
        return replace(exact, message=f"{exact.message} (in {os.path.relpath(others[0])})")
    return exact


def _document(xacro: Any, file: str, text: str | None, arguments: dict[str, str]) -> Any:
    if text is None:
        return xacro.process_file(file, mappings=arguments)
    document = xacro.parse(text, file)
    xacro.init_stacks(file)  # relative includes begin beside the file
    xacro.process_doc(document, mappings=arguments)
    return document


def _refuse_unknown(given: Mapping[str, str], files: list[str], file: str) -> None:
    """Refuse arguments that none of the files declares or asks for; xacro itself ignores them."""
    texts = [Path(name).read_text("utf-8", "replace") for name in files]
    known = dict.fromkeys(
        name for text in texts for found in _ARGUMENT.finditer(text) for name in found.groups() if name
    )
    wrong = [name for name in given if name not in known]
    if wrong:
        raise RejectedError([_no_argument(name, known, file) for name in wrong])


def _no_argument(name: str, known: Collection[str], file: str) -> Finding:
    there = f"there is {', '.join(known)}" if known else "it takes none"
    return finding("TF106", f"no argument {name}", Span(file), help=did_you_mean(name, known, there))


@contextlib.contextmanager
def _finding(packages: Packages, file: str) -> Iterator[None]:
    """Let $(find NAME) be answered by the robot's packages too, for as long as ``file`` is expanded."""
    substitution: Any = import_module("xacro.substitution_args")
    before = substitution._eval_find  # noqa: SLF001 (xacro offers no other way)

    def find(name: str) -> str:
        folder = packages.folder(name, file)
        if folder is None:
            raise _MissingError(packages.not_found(name, None))
        return str(Path(folder).absolute())  # relative paths in xacro begin at the file that includes

    substitution._eval_find = find  # noqa: SLF001 (as above)
    try:
        yield
    finally:
        substitution._eval_find = before  # noqa: SLF001 (as above)


def _raise_comments(node: Any) -> None:
    """Put comments that let findings stand above the tag on whose line they stood: printing gives each its own line."""
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
