"""Results as a table in Markdown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.benchmarks.benchmark import TFCOMPOSE
from tests.benchmarks.summary import ratios, spread

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from tests.benchmarks.record import Result, RowResult


def table(results: Iterable[Result]) -> str:
    """Return a line for each row and peer.

    Columns: title; tfcompose; the peer; the ratio of tfcompose to it. A peer that was missing is a
    dash with the reason. Without any peer the last two columns are left out.
    """
    lines = [line for result in results for line in _lines(result)]
    columns = 4 if any(peer or ratio for _, _, peer, ratio in lines) else 2
    head = ("", "tfcompose", "peer, in the same run", "ratio")
    rows = [head, ("---",) * 4, *lines]
    return "".join(
        "".join(f"| {cell} " if cell else "| " for cell in row[:columns]) + "|\n" for row in rows
    )


def _lines(result: Result) -> Iterator[tuple[str, str, str, str]]:
    for row in result.rows.values():
        title, mine = row.title, spread(row.samples[TFCOMPOSE.name], row.unit)
        for peer, ratio in _peers(row, result.missing) or [("", "")]:
            yield title, mine, peer, ratio
            title = mine = ""


def _peers(row: RowResult, missing: dict[str, str]) -> list[tuple[str, str]]:
    """Return each peer with its value, and the ratio."""
    mine = row.samples[TFCOMPOSE.name]
    measured = [
        (f"{name}: {spread(values, row.unit)}", _ratio(ratios(mine, values)))
        for name, values in row.samples.items()
        if name != TFCOMPOSE.name
    ]
    return measured + [(f"{name}: – ({reason})", "–") for name, reason in missing.items()]


def _ratio(values: list[float]) -> str:
    return spread(values, "times") if values else "–"
