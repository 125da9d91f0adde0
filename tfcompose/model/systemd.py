"""Command lines for systemd units, and command lines that source setup files first."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

#: Sources its arguments up to ``--``, then becomes the command after it. Requires bash, because
#: ROS's setup files are for bash.
SOURCING = 'until [ "$1" = -- ]; do . "$1"; shift; done; shift; exec "$@"'


def source_then_run(setup: Sequence[str], argv: list[str]) -> list[str]:
    """Return the command that sources the setup files and becomes ``argv``.

    Without setup files, return ``argv``.
    """
    return ["/bin/bash", "-c", SOURCING, "bash", *setup, "--", *argv] if setup else argv


def without_specifiers(text: str) -> str:
    """Return the text with percent signs doubled, so that systemd finds no specifiers in it."""
    return text.replace("%", "%%")


def quote(argument: str) -> str:
    """Return the argument quoted for systemd, with percent signs doubled."""
    text = without_specifiers(argument)
    if text and all(c.isalnum() or c in "/.:=@+,-_%" for c in text):
        return text
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
