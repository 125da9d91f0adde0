"""What is executed for a process of a plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True, slots=True)
class Command:
    """Program and arguments, environment, and folder.

    ``own`` says that it is one of tfcompose's. ``fence`` is a file that must be there first, and what it holds.
    ``missing`` says, of a process that the run goes on without, why it cannot be started.
    """

    argv: tuple[str, ...]
    env: dict[str, str]
    folder: Path
    own: bool = False
    fence: tuple[Path, str] | None = None
    missing: str = ""
