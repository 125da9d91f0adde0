"""Commands as systemd reads them in a unit, and commands that source setup files first."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

#: Sources its arguments up to ``--``, then becomes the command behind it; bash, because ROS's
#: setup files are bash's.
SOURCING = 'until [ "$1" = -- ]; do . "$1"; shift; done; shift; exec "$@"'


def source_then_run(setup: Sequence[str], argv: list[str]) -> list[str]:
    """Return the command that sources the setup files and becomes ``argv``.

    That itself without setup files.
    """
    return ["/bin/bash", "-c", SOURCING, "bash", *setup, "--", *argv] if setup else argv


def without_specifiers(text: str) -> str:
    """Return the text without systemd's specifiers: a percent sign is doubled."""
    return text.replace("%", "%%")


def quote(argument: str) -> str:
    """Return the argument as systemd reads it back; a percent sign is doubled."""
    text = without_specifiers(argument)
    if text and all(c.isalnum() or c in "/.:=@+,-_%" for c in text):
        return text
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
