"""When each process was started and ready, as a table."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.ipc import AllReady


def table_of(notice: AllReady) -> list[str]:
    """Return the lines: process, seconds from the start until it was started, and until it was ready; and the total."""
    width = max(len(row.process) for row in notice.rows)
    lines = [f"{'process':<{max(width, 7)}}  started   ready"]
    for row in sorted(notice.rows, key=lambda row: row.ready):
        started = "      –" if row.started is None else f"{row.started:5.2f} s"
        lines.append(f"{row.process:<{max(width, 7)}}  {started}  {max(row.ready, 0.0):5.2f} s")
    return [*lines, f"all ready after {notice.seconds:.2f} s"]
