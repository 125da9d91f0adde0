"""``tfcompose lint --fix`` applies fixes that have a single safe answer.

Each edit is first applied in memory. An edit is kept only if it removes its finding and causes no
new finding.
"""

from __future__ import annotations

import codecs
import os
from collections import Counter
from dataclasses import dataclass, field
from difflib import unified_diff
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.reading import read_text
from tfcompose.cli.writing import replace_file
from tfcompose.foundation.findings import apply_edits
from tfcompose.foundation.reading import is_file

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from tfcompose.foundation.findings import Edit, Finding

    Reader = Callable[[str], str]
    Lint = Callable[[str, Reader], list[Finding]]


_NO_YAML = "TF002"


class ChangedError(OSError):
    """Another program has changed the file since it was read."""


@dataclass(slots=True)
class Fixer:
    """Fixes the named files."""

    files: Sequence[str]
    #: Returns a file's findings. It reads files with the function in its argument.
    lint: Lint
    #: The removed findings with their former places.
    fixed: list[Finding] = field(default_factory=list)
    #: New text by file.
    texts: dict[str, str] = field(default_factory=dict)
    _read: dict[str, str] = field(default_factory=dict)

    def fix(self, file: str) -> list[Finding]:
        """Fix one file in memory and return the findings that remain."""
        findings = self._findings([file])
        while True:
            todo = [
                finding
                for finding in findings
                if finding.edits and all(self._may_edit(edit.span.file) for edit in finding.edits)
            ]
            kept = self._sound(file, [], todo)
            if not kept:
                return self.lint(file, self.read)
            self.texts |= self._apply_edits(kept) or {}
            self.fixed += kept
            findings = self._findings([file])

    def write(self) -> None:
        """Write the files that changed.

        Raises:
            OSError: if a file cannot be written, or another program has changed it. The files
                before it are already written.
        """
        for path, text in self.texts.items():
            rewrite(Path(path), self._read[path], text)

    def diff(self) -> Iterator[str]:
        """Yield the unified differences of the files that would change."""
        names = {_path(file): file for file in self.files}
        for path, text in self.texts.items():
            before = self._read[path].splitlines(keepends=True)
            yield from unified_diff(
                before, text.splitlines(keepends=True), names[path], names[path]
            )

    def read(self, file: str) -> str:
        """Return the file's future text. Each file is read from the disk only once."""
        path = _path(file)
        if path not in self._read:
            self._read[path] = read_text(file)
        return self.texts.get(path, self._read[path])

    def _may_edit(self, file: str) -> bool:
        path = _path(file)
        return path in map(_path, self.files) and is_file(path)

    def _findings(self, files: Iterable[str]) -> list[Finding]:
        return [finding for file in files for finding in self.lint(file, self.read)]

    def _sound(self, file: str, kept: list[Finding], todo: list[Finding]) -> list[Finding]:
        """Return ``kept`` and those fixes of ``todo`` that are sound together with ``kept``.

        If not all fixes are sound, the function halves ``todo`` and tries the parts.
        """
        if not todo:
            return kept
        if self._is_sound(file, [*kept, *todo]):
            return [*kept, *todo]
        if len(todo) == 1:
            return kept
        half = len(todo) // 2
        return self._sound(file, self._sound(file, kept, todo[:half]), todo[half:])

    def _is_sound(self, file: str, fixed: list[Finding]) -> bool:
        """Return whether the edits remove the findings and cause no other findings."""
        files = dict.fromkeys(
            [file, *(edit.span.file for finding in fixed for edit in finding.edits)]
        )
        before, texts = _count_findings(self._findings(files)), self._apply_edits(fixed)
        if texts is None:
            return False
        self.texts, old = self.texts | texts, self.texts
        after = _count_findings(self._findings(files))
        self.texts = old
        come = after - before
        if any(finding.code == _NO_YAML for finding in fixed):
            # The file was not YAML before. Its other findings existed already, but were not
            # detected.
            come = Counter({key: count for key, count in come.items() if key[0] == _NO_YAML})
        return not come and not _count_findings(fixed) - (before - after)

    def _apply_edits(self, fixed: list[Finding]) -> dict[str, str] | None:
        """Return the new texts by file, or None if edits overlap."""
        by_file: dict[str, dict[Edit, None]] = {}
        for edit in (edit for finding in fixed for edit in finding.edits):
            by_file.setdefault(edit.span.file, {})[edit] = None
        texts = {
            _path(file): apply_edits(self.read(file), list(edits))
            for file, edits in by_file.items()
        }
        complete = {file: text for file, text in texts.items() if text is not None}
        return complete if len(complete) == len(texts) == len(by_file) else None


def _path(file: str) -> str:
    return str(Path(file).resolve())


def _count_findings(findings: Iterable[Finding]) -> Counter[tuple[str, str]]:
    return Counter((finding.code, finding.message) for finding in findings)


def rewrite(path: Path, old: str, new: str) -> None:
    """Replace the file's text atomically.

    Mode, owner and byte order mark stay.

    Raises:
        OSError: if the file cannot be written; the file is then unchanged.
    """
    if not os.access(path, os.W_OK):
        raise PermissionError(13, "Permission denied", str(path))
    data = path.read_bytes()
    mark = codecs.BOM_UTF8 if data.startswith(codecs.BOM_UTF8) else b""
    if data != mark + old.encode():
        raise ChangedError(0, "it changed in the meantime", str(path))
    replace_file(path, mark + new.encode())
