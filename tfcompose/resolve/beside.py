"""Files that a robot file names: their paths are relative to the file that names them."""

from __future__ import annotations

import posixpath
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.findings import Span


def beside(named: str, at: Span) -> str:
    """Return the path of a file that is named at a place; on the command line it is relative to the folder."""
    folder = "" if at.file.startswith("--") else posixpath.dirname(at.file)
    return posixpath.normpath(posixpath.join(folder, named))
