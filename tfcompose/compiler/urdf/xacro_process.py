"""xacro in a separate, sandboxed process, because xacro evaluates arbitrary expressions.

This process cannot open files. It requests packages, texts and folder listings from its parent
process. Then it answers with xacro's result, or with the reason why xacro stopped. It imports only
xacro and tfcompose's sandbox, because every expansion starts such a process.
"""

from __future__ import annotations

import encodings.utf_8_sig  # noqa: F401 (once confined, no module can be loaded)
import fnmatch
import io
import mmap
import os
import posixpath
import signal
import sys
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, SimpleNamespace
from typing import TYPE_CHECKING, Any
from xml.dom import Node, expatbuilder

import xacro
from xacro import substitution_args

from tfcompose.foundation.sandbox import (
    MOST_MEMORY_BYTES,
    Channel,
    confine,
    limit,
    take_spare_memory,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType, TracebackType

#: Maximum CPU time for an expression, in seconds.
MOST_EXPRESSION_S = 5.0
#: The process stops this long before the parent would kill it, so that it can report its state; in
#: seconds.
_SPARE_S = 1.0
#: Maximum size of the expanded text.
MOST_BYTES = 16_000_000
#: Maximum number of elements created during expansion, including elements that macros leave out
#: later.
MOST_ELEMENTS = 1_000_000
MOST_FILES_OPEN = 40

#: The key under which a node stores its place: file index, line, and column from 0.
_PLACE = "place"
_ALLOW = "tfcompose:"


class LimitError(Exception):
    """The expansion exceeds a limit."""


class MissingError(LookupError):
    """A package is not found."""


class OutsideDocumentError(Exception):
    """A file is outside the folder trees that the document may read."""


class UnsafeError(Exception):
    """An expression uses names that could give access beyond the sandbox."""


class XacroFiles:
    """Files for xacro, requested from the parent process."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel

    def find(self, name: str) -> str | None:
        """Return the folder of a package, or None."""
        folder: str | None = self._ask("find", name)["folder"]
        return folder

    def open(self, path: str) -> io.StringIO:
        """Return an open text stream with the file's text.

        Raises:
            OSError: if the file cannot be read.
            OutsideDocumentError: if access to the file is not permitted.
            UnicodeDecodeError: if the file is not UTF-8.
        """
        count = self._ask("read", path)["bytes"]
        return io.StringIO(self._channel.receive_bytes(count).decode("utf-8-sig"))

    def glob(self, pattern: str) -> list[str]:
        """Return the paths that match a pattern, as ``glob.glob`` does.

        Raises:
            OutsideDocumentError: if access to a folder is not permitted.
        """
        if not any(character in pattern for character in "*?["):
            return [pattern]
        head, tail = posixpath.split(pattern)
        return [
            posixpath.join(folder, name)
            for folder in (self.glob(head) if head else [""])
            for name in self._names_in(folder or ".")
            if fnmatch.fnmatch(name, tail) and name.startswith(".") == tail.startswith(".")
        ]

    def _names_in(self, folder: str) -> list[str]:
        try:
            names: list[str] = self._ask("list", folder)["names"]
        except OSError:  # missing, or not a folder
            return []
        return names

    def _ask(self, kind: str, value: str) -> dict[str, Any]:
        self._channel.send({kind: value})
        reply: dict[str, Any] = self._channel.receive()
        if "outside" in reply:
            raise OutsideDocumentError(posixpath.normpath(value))
        if "error" in reply:
            raise OSError(*reply["error"], value)
        return reply


class _Cloned:
    """Copies a node's place to its clones, and counts the clones."""

    def __init__(self) -> None:
        self.elements = 0

    def handle(self, _operation: int, key: str, data: Any, source: Any, clone: Any) -> None:
        """Handle the DOM's notification that a node was cloned."""
        clone.setUserData(key, data, self)
        if source.nodeType == Node.ELEMENT_NODE:
            self.count()

    def count(self) -> None:
        self.elements += 1
        if self.elements > MOST_ELEMENTS:
            raise LimitError(f"xacro makes more than {MOST_ELEMENTS:,} elements")


class _Builder(expatbuilder.ExpatBuilderNS):
    """Builds a document and stores the places of elements and of comments that allow findings."""

    def __init__(self, file: int | None, cloned: _Cloned) -> None:
        super().__init__()
        self._file, self._cloned = file, cloned

    def start_element_handler(self, name: str, attributes: Any) -> None:
        super().start_element_handler(name, attributes)
        self._cloned.count()
        self._place(self.curNode)

    def comment_handler(self, data: str) -> None:
        super().comment_handler(data)
        if _ALLOW in data:
            self._place(self.curNode.lastChild)

    def _place(self, node: Any) -> None:
        if self._file is not None:
            parser = self.getParser()
            place = (self._file, parser.CurrentLineNumber, parser.CurrentColumnNumber)
            node.setUserData(_PLACE, place, self._cloned)


class XacroRun:
    """Runs xacro on a request. ``note`` records the expression under evaluation."""

    def __init__(self, files: XacroFiles, note: Callable[[str], None]) -> None:
        self._reader = files
        self._note = note
        self._files: dict[str, int] = {}
        self._cloned = _Cloned()
        self._noted = ""

    def expand(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return xacro's document with the places of its elements, or the reason of a failure."""
        try:
            with self._hook_xacro():
                document = self._document(request)
                for node in document.childNodes:
                    if node.nodeType == Node.COMMENT_NODE:  # xacro's comment names the file
                        node.data = node.data.encode("utf-8", "replace").decode()
                text = document.toprettyxml(indent="  ")
                text.encode()
        except Exception as error:  # noqa: BLE001 (xacro evaluates Python: anything can come out of it)
            return self._failure(error)
        if len(text) > MOST_BYTES:
            return self._failure(LimitError(f"xacro makes a text of {len(text):,} characters"))
        places, comments = self._places(document)
        return {
            "text": text,
            "files": list(self._files),
            "places": places,
            "comments": comments,
        }

    def _document(self, request: dict[str, Any]) -> Any:
        file, arguments = request["file"], request["arguments"]
        if request["call"] is None:
            return xacro.process_file(file, mappings=arguments)
        xacro.init_stacks(file)  # relative includes start in the file's folder
        document = _Builder(None, self._cloned).parseString(request["call"])
        xacro.process_doc(document, mappings=arguments)
        return document

    @contextmanager
    def _hook_xacro(self) -> Iterator[None]:
        """Replace the functions with which xacro opens, parses, evaluates and looks up."""
        hooks = {
            (xacro, "open"): self._reader.open,
            (xacro, "glob"): SimpleNamespace(glob=self._reader.glob),
            (xacro, "parse"): self._parse,
            (xacro, "safe_eval"): _with_safe_names(xacro.safe_eval),
            (xacro, "eval_text"): self._evaluate(xacro.eval_text),
            (substitution_args, "_eval_find"): self._folder,
        }
        before = {(module, name): getattr(module, name, None) for module, name in hooks}
        for (module, name), hook in hooks.items():
            setattr(module, name, hook)
        xacro.all_includes.clear()
        try:
            yield
        finally:
            for (module, name), original in before.items():
                setattr(module, name, original) if original else delattr(module, name)

    def _parse(self, document: Any, file: str) -> Any:
        if document is not None:
            return document
        if len(xacro.filestack) > MOST_FILES_OPEN:
            names = [Path(name).name for name in xacro.filestack if name]
            raise LimitError(f"files that include each other: … → {' → '.join(names[-3:])}")
        try:
            text = self._reader.open(posixpath.join(xacro.root_dir, file)).read()
        except OSError as error:
            xacro.filestack.pop()
            raise xacro.XacroException(f"{error.strerror}: {error.filename}", exc=error) from error
        except OutsideDocumentError:
            xacro.filestack.pop()
            raise
        number = self._files.setdefault(file, len(self._files))
        return _Builder(number, self._cloned).parseString(text)

    def _folder(self, name: str) -> str:
        folder = self._reader.find(name)
        if folder is None:
            raise MissingError(name)
        return folder

    def _evaluate(self, evaluate: Callable[[str, Any], Any]) -> Callable[[str, Any], Any]:
        """Wrap xacro's evaluation with a time limit that the expression cannot intercept."""

        def evaluated(text: str, symbols: Any) -> Any:
            if "$" not in text:
                return evaluate(text, symbols)
            outer = self._noted
            self._noted = text
            self._note(text)
            left = signal.setitimer(
                signal.ITIMER_VIRTUAL, MOST_EXPRESSION_S
            )  # the signal has no handler, so it ends the process
            try:
                return evaluate(text, symbols)
            finally:
                signal.setitimer(signal.ITIMER_VIRTUAL, *left)
                self._noted = outer

        return evaluated

    def _places(self, document: Any) -> tuple[list[Any], list[Any]]:
        """Return the place of each element, in document order, and the places of comments.

        The place is None for an element that is in no file.
        """
        places, comments, waiting = [], [], [document]
        while waiting:
            node = waiting.pop()
            if node.nodeType == Node.ELEMENT_NODE:
                places.append(node.getUserData(_PLACE))
            elif node.nodeType == Node.COMMENT_NODE and _ALLOW in node.data:
                comments.append(node.getUserData(_PLACE))
            waiting += reversed(node.childNodes)
        return places, [place for place in dict.fromkeys(comments) if place]

    def _failure(self, error: Exception) -> dict[str, Any]:
        """Return the reason why xacro stopped, and what it was processing."""
        chain: list[Any] = [error]
        while (
            getattr(chain[-1], "exc", None) is not None
        ):  # xacro wraps exceptions, possibly several times
            chain.append(chain[-1].exc)
        root = chain[-1]
        kind, reason = "refused", _reason(chain) or type(error).__name__
        if isinstance(root, MissingError):
            kind, reason = "package", str(root.args[0])
        elif isinstance(root, substitution_args.ArgException):
            kind, reason = "argument", str(root)
        elif isinstance(root, OutsideDocumentError):
            kind, reason = "outside", " ".join([f"{root} may not be read", *_suffixes(chain)])
        elif isinstance(root, UnsafeError):
            parts = [f"an expression may not use {root}", *_suffixes(chain)]
            kind, reason = "unsafe", " ".join(parts)
        elif isinstance(root, LimitError):
            kind, reason = "limit", str(root)
        elif isinstance(root, MemoryError):
            take_spare_memory()  # the message needs memory
            parts = [
                f"xacro needs more than {MOST_MEMORY_BYTES >> 30} GB of memory",
                *_suffixes(chain),
            ]
            kind, reason = "limit", " ".join(parts)
        elif isinstance(root, RecursionError):
            kind, reason = "limit", "xacro goes too deep: macros, or elements in each other"
        line = getattr(root, "lineno", None)  # an ExpatError
        files = [name for name in xacro.filestack or [] if name]
        return {
            "kind": kind,
            "reason": reason,
            "files": files,
            "macros": [
                (macro.body.getAttribute("name"), macro.history[-1][-1])
                for macro in xacro.macrostack or []
            ],
            "error": (files[-1], line, root.offset) if line is not None and files else None,
            "at": self._node_at(error.__traceback__),
        }

    def _node_at(self, trace: TracebackType | None) -> tuple[str, int, int] | None:
        """Return the place of the innermost element that xacro was processing, or None."""
        innermost, files = None, list(self._files)
        while trace is not None:
            node = _busy_with(trace.tb_frame)
            place = node.getUserData(_PLACE) if node is not None else None
            innermost = place or innermost
            trace = trace.tb_next
        return (files[innermost[0]], *innermost[1:]) if innermost else None


def _busy_with(frame: FrameType) -> Any | None:
    """Return the element that a function of xacro is processing.

    None for a function of another module.
    """
    if frame.f_globals.get("__name__") != "xacro":
        return None
    node: Any = frame.f_locals.get("node") or frame.f_locals.get("elt")
    return (
        node
        if getattr(node, "nodeType", None) == Node.ELEMENT_NODE
        else getattr(node, "parentNode", None)
    )


def _reason(chain: list[Any]) -> str:
    """Return the message of a chain of exceptions on a single line.

    The last exception caused the others.
    """
    root = chain[-1]
    if isinstance(root, OSError):
        parts = [f"{root.strerror}: {root.filename}"]
    else:
        heads = [str(error.args[0]) for error in chain[:-1] if error.args and error.args[0]]
        reason = (
            str(root)
            if hasattr(root, "suffix") or "line" in str(root)
            else f"{type(root).__name__}: {root}"
        )
        parts = [*(head for head in heads if str(root) not in head), reason]
        parts += _suffixes(chain)
    return " ".join(" ".join(parts).split())


def _suffixes(chain: list[Any]) -> list[str]:
    return [
        " ".join(str(error.suffix).split())
        for error in reversed(chain[:-1])
        if getattr(error, "suffix", None)
    ]


#: Attributes of generators and tracebacks that lead to frames, and so out of the sandbox.
_FRAMES = frozenset(
    {
        "ag_code",
        "ag_frame",
        "cr_code",
        "cr_frame",
        "f_back",
        "f_builtins",
        "f_code",
        "f_globals",
        "f_locals",
        "gi_code",
        "gi_frame",
        "gi_yieldfrom",
        "tb_frame",
        "tb_next",
    }
)


def _with_safe_names(evaluate: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap xacro's evaluation with a check of names, including names in lambdas and generators."""

    def evaluated(expression: str, *symbols: Any) -> Any:
        code = compile(expression.strip(), "<expression>", "eval")
        unsafe = sorted({name for name in _names_in(code) if name[:2] == "__" or name in _FRAMES})
        if unsafe:
            raise UnsafeError(", ".join(unsafe))
        return evaluate(expression, *symbols)

    return evaluated


def _names_in(code: CodeType) -> Iterator[str]:
    """Yield the names in the code and in nested code."""
    yield from (*code.co_names, *code.co_varnames, *code.co_freevars)
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names_in(constant)


def main(reads: int, writes: int, noted: int) -> None:
    """Serve a single request; ``noted`` is a file that records the expression under evaluation."""
    channel = Channel(reads, writes)
    request = channel.receive()
    limit(request["wall_s"])

    def refuse_more_time(_number: int, _frame: FrameType | None) -> None:
        raise LimitError(f"xacro takes more than {request['wall_s'] - _SPARE_S:g} s")

    signal.signal(signal.SIGALRM, refuse_more_time)
    signal.setitimer(signal.ITIMER_REAL, request["wall_s"] - _SPARE_S)
    with mmap.mmap(noted, 0) as kept:
        missing = [] if request["is_trusted"] else confine(None)
        channel.send({"missing": missing})
        if request["is_strict"] and "seccomp" in missing:  # only seccomp prevents access to files
            os._exit(0)

        def note(text: str) -> None:
            data = text.encode("utf-8", "replace")[: len(kept) - 1] + b"\0"
            kept[: len(data)] = data

        answer = XacroRun(XacroFiles(channel), note).expand(request)
        sys.stdout.flush()
        channel.send({"answer": answer})
    os._exit(0)  # nothing remains to be done, and freeing a large document takes long
