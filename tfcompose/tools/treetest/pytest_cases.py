"""Cases of a test file as items of pytest."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tfcompose.cli.terminal import print_findings
from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.signals import Stop
from tfcompose.tools.treetest.cases import CaseLoader
from tfcompose.tools.treetest.running import run_case

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Any

    from tfcompose.foundation.findings import Finding
    from tfcompose.tools.treetest.case import Case


class CaseFile(pytest.File):
    """A test file."""

    def collect(self) -> Iterator[CaseItem]:
        """Yield its cases.

        Raises:
            CollectError: with all that is wrong with the file, its robot and its recordings.
        """
        loader = CaseLoader(trust=self.config.getoption("tfcompose_trust"))
        path = os.path.relpath(self.path)
        if path.startswith(os.pardir):  # CTest works in the build folder
            path = str(self.path)
        try:
            cases = loader.load(path)
        except RejectedError as error:
            raise self.CollectError(_text(error.findings)) from None
        for case in cases:
            yield CaseItem.from_parent(self, name=case.spec.name, case=case)


class CaseFailedError(Exception):
    """Raised by a case whose expectations are not met."""

    def __init__(self, findings: Sequence[Finding], folder: Path | None) -> None:
        super().__init__("the tree is not as expected")
        self.findings = tuple(findings)
        self.folder = folder


class CaseItem(pytest.Item):
    """A case."""

    def __init__(self, *, case: Case, **arguments: Any) -> None:
        super().__init__(**arguments)
        self._case = case

    def runtest(self) -> None:
        """Run the case, as ``tfcompose test`` does.

        Raises:
            CaseFailedError: if it fails.
            KeyboardInterrupt: after a signal.
        """
        keep = self.config.getoption("tfcompose_keep")
        with Stop() as stop:
            result = run_case(self._case, stop, Path(keep) if keep else None)
            if stop.requested:
                raise KeyboardInterrupt
        if result.findings:
            raise CaseFailedError(result.findings, result.folder)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """Return the findings of a failed case as text."""
        if not isinstance(excinfo.value, CaseFailedError):
            return super().repr_failure(excinfo, style)
        folder = excinfo.value.folder
        return _text(excinfo.value.findings) + (f"\nsee {folder}" if folder else "")

    def reportinfo(self) -> tuple[Path, int, str]:
        """Return the file, the line, counted from 0, and the name of the case."""
        return self.path, self._case.value_span("name").line - 1, self.name


def _text(findings: Sequence[Finding]) -> str:
    stream = io.StringIO()
    print_findings(findings, stream)
    return stream.getvalue().rstrip()
