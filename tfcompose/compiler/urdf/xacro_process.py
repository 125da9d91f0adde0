"""xacro in a process of its own, which can be ended: it evaluates expressions, and a file may ask for anything.

It reads one request and writes lines of JSON: questions for packages, each of which is answered by
a line, then what xacro made, or why it stopped. It imports xacro and nothing of tfcompose, because
each expansion starts one.
"""

from __future__ import annotations

import io
import json
import mmap
import os
import resource
import signal
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.dom import Node, expatbuilder

import xacro
from xacro import substitution_args

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType, TracebackType

#: Processor time for an expansion, and for one expression of it, in seconds.
MOST_CPU_S = 120
MOST_EXPRESSION_S = 5.0
MOST_MEMORY_BYTES = 2 << 30
#: Of each file that is read, and of the text that is made.
MOST_BYTES = 16_000_000
#: Elements that are made on the way; most of what a macro holds can be left out again.
MOST_ELEMENTS = 1_000_000
MOST_FILES_OPEN = 40

#: Under this key nodes have their place: the file's number, line and column, which counts from 0.
_PLACE = "place"
_ALLOW = "tfcompose:"


class LimitError(Exception):
    """The expansion asks for more than a robot needs."""


class MissingError(LookupError):
    """A package is not found."""


class _Cloned:
    """Gives clones of a node its place, and counts them."""

    def __init__(self) -> None:
        self.elements = 0

    def handle(self, _operation: int, key: str, data: Any, source: Any, clone: Any) -> None:
        """Be told by the DOM that a node was cloned."""
        clone.setUserData(key, data, self)
        if source.nodeType == Node.ELEMENT_NODE:
            self.count()

    def count(self) -> None:
        self.elements += 1
        if self.elements > MOST_ELEMENTS:
            raise LimitError(f"xacro makes more than {MOST_ELEMENTS:,} elements")


class _Builder(expatbuilder.ExpatBuilderNS):
    """Builds a document whose elements, and comments that allow findings, know their places."""

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


class Expansion:
    """Runs xacro on a request; ``find`` answers where a package is, ``note`` keeps what is being evaluated."""

    def __init__(self, find: Callable[[str], str | None], note: Callable[[str], None]) -> None:
        self._find = find
        self._note = note
        self._files: dict[str, int] = {}
        self._cloned = _Cloned()
        self._noted = ""

    def made(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the document that xacro makes, with the places of its elements, or why it makes none."""
        try:
            with self._hooked():
                document = self._document(request)
                for node in document.childNodes:
                    if node.nodeType == Node.COMMENT_NODE:  # xacro's own names the file
                        node.data = node.data.encode("utf-8", "replace").decode()
                text = document.toprettyxml(indent="  ")
                text.encode()
        except Exception as error:  # noqa: BLE001 (xacro evaluates Python: anything can come out of it)
            return self._failure(error)
        if len(text) > MOST_BYTES:
            return self._failure(LimitError(f"xacro makes a text of {len(text):,} characters"))
        places, comments = self._places(document)
        read = [request["file"], *xacro.all_includes]
        return {
            "text": text,
            "files": list(self._files),
            "places": places,
            "comments": comments,
            "read": read,
        }

    def _document(self, request: dict[str, Any]) -> Any:
        file, arguments = request["file"], request["arguments"]
        if request["call"] is None:
            return xacro.process_file(file, mappings=arguments)
        xacro.init_stacks(file)  # relative includes begin in the file's folder
        document = _Builder(None, self._cloned).parseString(request["call"])
        xacro.process_doc(document, mappings=arguments)
        return document

    @contextmanager
    def _hooked(self) -> Iterator[None]:
        """Put this between xacro and what it opens, parses, evaluates and looks for; it offers no other way."""
        hooks = {
            (xacro, "open"): _open,
            (xacro, "parse"): self._parse,
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
            for (module, name), own in before.items():
                setattr(module, name, own) if own else delattr(module, name)

    def _parse(self, document: Any, file: str) -> Any:
        if document is not None:
            return document
        if len(xacro.filestack) > MOST_FILES_OPEN:
            names = [Path(name).name for name in xacro.filestack if name]
            raise LimitError(f"files that include each other: … → {' → '.join(names[-3:])}")
        number = self._files.setdefault(file, len(self._files))
        try:
            text = _open(os.path.join(xacro.root_dir, file)).read()  # noqa: PTH118 (as xacro does)
        except OSError as error:
            xacro.filestack.pop()
            raise xacro.XacroException(f"{error.strerror}: {error.filename}", exc=error) from error
        return _Builder(number, self._cloned).parseString(text)

    def _folder(self, name: str) -> str:
        folder = self._find(name)
        if folder is None:
            raise MissingError(name)
        return folder

    def _evaluate(self, evaluate: Callable[[str, Any], Any]) -> Callable[[str, Any], Any]:
        """Return xacro's evaluation of a text within a bounded time, which Python code alone could not keep to."""

        def evaluated(text: str, symbols: Any) -> Any:
            if "$" not in text:
                return evaluate(text, symbols)
            outer = self._noted
            self._noted = text
            self._note(text)
            left = signal.setitimer(
                signal.ITIMER_VIRTUAL, MOST_EXPRESSION_S
            )  # no handler: it ends the process
            try:
                return evaluate(text, symbols)
            finally:
                signal.setitimer(signal.ITIMER_VIRTUAL, *left)
                self._noted = outer

        return evaluated

    def _places(self, document: Any) -> tuple[list[Any], list[Any]]:
        """Return the place of each element, in the order of the text, None where it is in no file; and of comments."""
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
        """Return what xacro, or something that it called, did not like, and what it was about then."""
        chain: list[Any] = [error]
        while (
            getattr(chain[-1], "exc", None) is not None
        ):  # xacro wraps what it calls, again and again
            chain.append(chain[-1].exc)
        root = chain[-1]
        kind, reason = "refused", _reason(chain) or type(error).__name__
        if isinstance(root, MissingError):
            kind, reason = "package", str(root.args[0])
        elif isinstance(root, substitution_args.ArgException):
            kind, reason = "argument", str(root)
        elif isinstance(root, LimitError):
            kind, reason = "limit", str(root)
        elif isinstance(root, MemoryError):
            _allow_all(resource.RLIMIT_AS)  # to say so
            words = [
                f"xacro needs more than {MOST_MEMORY_BYTES >> 30} GB of memory",
                *_suffixes(chain),
            ]
            kind, reason = "limit", " ".join(words)
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
        """Return the place of the innermost element that xacro was busy with, or None."""
        found, files = None, list(self._files)
        while trace is not None:
            node = _busy_with(trace.tb_frame)
            place = node.getUserData(_PLACE) if node is not None else None
            found = place or found
            trace = trace.tb_next
        return (files[found[0]], *found[1:]) if found else None


def _busy_with(frame: FrameType) -> Any | None:
    """Return the element that a function of xacro has as its argument, or that it has come to; None for others."""
    if frame.f_globals.get("__name__") != "xacro":
        return None
    node: Any = frame.f_locals.get("node") or frame.f_locals.get("elt")
    return (
        node
        if getattr(node, "nodeType", None) == Node.ELEMENT_NODE
        else getattr(node, "parentNode", None)
    )


def _reason(chain: list[Any]) -> str:
    """Return the message of a chain of exceptions in one line; the last one is the cause of the others."""
    root = chain[-1]
    if isinstance(root, OSError):
        words = [f"{root.strerror}: {root.filename}"]
    else:
        heads = [str(one.args[0]) for one in chain[:-1] if one.args and one.args[0]]
        own = (
            str(root)
            if hasattr(root, "suffix") or "line" in str(root)
            else f"{type(root).__name__}: {root}"
        )
        words = [*(head for head in heads if str(root) not in head), own]
        words += _suffixes(chain)
    return " ".join(" ".join(words).split())


def _suffixes(chain: list[Any]) -> list[str]:
    return [
        " ".join(str(one.suffix).split())
        for one in reversed(chain[:-1])
        if getattr(one, "suffix", None)
    ]


def _open(path: str) -> io.StringIO:
    """Return the text of a plain file of bounded size, open for reading.

    Raises:
        OSError: if it is none.
        UnicodeDecodeError: if it is not UTF-8.
    """
    if Path(path).exists() and not Path(path).is_file():  # a pipe would be waited for
        raise OSError(0, "not a plain file", path)
    with Path(path).open("rb") as file:
        data = file.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise OSError(0, f"larger than {MOST_BYTES:,} bytes", path)
    return io.StringIO(data.decode("utf-8-sig"))


def _limit() -> None:
    """Bound this process by the system."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C is for who asked
    signal.signal(signal.SIGXCPU, _refuse_more_time)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for kind, most in ((resource.RLIMIT_CPU, MOST_CPU_S), (resource.RLIMIT_AS, MOST_MEMORY_BYTES)):
        hard = resource.getrlimit(kind)[1]
        resource.setrlimit(
            kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard)
        )


def _allow_all(kind: int) -> None:
    hard = resource.getrlimit(kind)[1]
    resource.setrlimit(kind, (hard, hard))


def _refuse_more_time(_number: int, _frame: FrameType | None) -> None:
    raise LimitError(f"xacro takes more than {MOST_CPU_S} s")


def main(channel: int, noted: int) -> None:
    """Serve one request on a channel; ``noted`` is a file that keeps what is being evaluated. Both are descriptors."""
    _limit()
    with os.fdopen(channel, "r+b", buffering=0) as raw, mmap.mmap(noted, 0) as kept:
        lines = io.BufferedReader(raw)

        def write(message: Any) -> None:
            data = memoryview(json.dumps(message).encode() + b"\n")
            while data:
                data = data[raw.write(data) :]

        def find(name: str) -> str | None:
            write({"find": name})
            folder: str | None = json.loads(lines.readline())
            return folder

        def note(text: str) -> None:
            data = text.encode("utf-8", "replace")[: len(kept) - 1] + b"\0"
            kept[: len(data)] = data

        write(Expansion(find, note).made(json.loads(lines.readline())))
    os._exit(0)  # nothing is left to be done, and a large document takes long to be freed
