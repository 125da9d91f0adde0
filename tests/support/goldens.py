"""Golden files: a folder of texts, rewritten by ``python -m MODULE --write``."""

from __future__ import annotations

import difflib
import sys
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


def compare(folder: Path, texts: Mapping[str, str]) -> None:
    """Fail with the difference if texts differ from the files of the same names."""
    difference: list[str] = []
    for name, text in texts.items():
        golden = (folder / f"{name}.txt").read_text("utf-8").splitlines(keepends=True)
        difference += difflib.unified_diff(
            golden, text.splitlines(keepends=True), f"golden {name}", "now", n=0
        )
    if difference:
        pytest.fail(f"{len(difference)} lines of difference\n{''.join(difference)}", pytrace=False)


def write(folder: Path, texts: Mapping[str, str]) -> None:
    """Write the texts, if that is what the command line says."""
    if sys.argv[1:] != ["--write"]:
        sys.exit(f"{sys.orig_argv[2]} --write")
    folder.mkdir(exist_ok=True)
    for name, text in texts.items():
        (folder / f"{name}.txt").write_text(text, "utf-8")
