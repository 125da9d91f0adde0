"""Robots from several files: ``include``, overlay files, and single values from the command line.

``include: [base.yaml]`` lays the file over what it includes; paths are relative to the file that writes them.
"""

from __future__ import annotations

import posixpath
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tfcompose.findings import Finding, Note, RejectedError, Span, finding
from tfcompose.language.overlay import lay_over, without
from tfcompose.load import DEEPEST, Path, Place, Source, load

if TYPE_CHECKING:
    from collections.abc import Callable

    Reader = Callable[[str], str]

MOST_FILES = 50


def with_includes(source: Source, read: Reader) -> Source:
    """Return the source laid over the files that it includes, and they over theirs; ``read`` gives a file's text.

    Raises:
        RejectedError: if a file cannot be read or is not YAML, if files include each other, or are too many.
    """
    return _Includer(read).include(source, (source.file,))


class _Includer:
    def __init__(self, read: Reader) -> None:
        self.read = read
        self.files = 0

    def include(self, source: Source, chain: tuple[str, ...]) -> Source:
        if "include" not in source.data:
            return source
        base: Source | None = None
        for index, name in self._names(source):
            at = source.at(("include", index) if isinstance(source.data["include"], list) else ("include",))
            file = posixpath.normpath(posixpath.join(posixpath.dirname(source.file), name))
            self.files += 1
            if file in chain or self.files > MOST_FILES:
                circle = " → ".join([*chain, file])
                message = f"files include each other: {circle}" if file in chain else f"more than {MOST_FILES} files"
                raise RejectedError([*source.found, finding("TF015", message, at, help="remove one include")])
            included = self.include(self._load(file, at, source), (*chain, file))
            base = lay_over(base, included, is_overlay=False) if base else included
        own = without(source, "include")
        if base is None:
            return own
        merged = lay_over(base, own, is_overlay=False)
        return replace(merged, file=source.file)

    def _names(self, source: Source) -> list[tuple[int, str]]:
        included = source.data["include"]
        names = included if isinstance(included, list) else [included]
        wrong = [index for index, name in enumerate(names) if not isinstance(name, str) or not name]
        if wrong:
            advice = "for example include: [base.yaml]"
            found = finding("TF103", "include takes the names of files", source.at(("include",)), help=advice)
            raise RejectedError([*source.found, found])
        return list(enumerate(names))

    def _load(self, file: str, at: Span, source: Source) -> Source:
        try:
            return load(self.read(file), file)
        except RejectedError as error:
            raise RejectedError([*source.found, *(_included(one, at) for one in error.findings)]) from None


def _included(found: Finding, at: Span) -> Finding:
    """Return the finding about an included file, with the place that includes it."""
    return replace(found, notes=(*found.notes, Note("included here", at)))


def set_value(setting: str) -> Source:
    """Return the overlay that ``PATH=VALUE`` means; the value is read as YAML: ``sensors.camera.xyz=[0.2, 0, 10 cm]``.

    Raises:
        RejectedError: if there is no ``=``, the value is not YAML, or the key is one that is read before.
    """
    span = Span(f"--set {setting}")
    path_text, sign, value_text = setting.partition("=")
    path: Path = tuple(path_text.strip().split("."))
    if not sign or not all(path):
        message = f"--set takes PATH=VALUE, not {setting!r}"
        raise RejectedError([finding("TF016", message, span, help="for example sensors.camera.tf=driver")])
    if len(path) > DEEPEST:
        message = f"--set names a key in {len(path)} levels; a robot has no more than {DEEPEST}"
        raise RejectedError([finding("TF016", message, Span("--set"))])
    if path[0] == "include":
        message = "--set cannot include files: it is laid over what they hold"
        raise RejectedError([finding("TF016", message, span, help="--overlay FILE")])
    read = load(f"value: {value_text.strip() or 'null'}", span.file)
    data: Any = read.data["value"]
    below = read.places.inside["value"]
    full = Place(Span(span.file, 1, 1, below.span.end_line, below.span.end_column))
    place = full.with_inside(below.inside, below.keys)
    for step in reversed(path):
        data, place = {step: data}, full.with_inside({step: place}, {str(step): full})
    return Source(span.file, data, place, read.found)
