"""Tables in the README and the topics: rows of the record.

A table is below a line ``<!-- figures: start joints -->`` that names its benchmarks.
``python -m tests.benchmarks.pages`` writes all tables anew.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from tests.benchmarks.record import ROOT, read
from tests.benchmarks.table import table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tests.benchmarks.record import Result

PAGES = (ROOT / "README.md", *sorted((ROOT / "tfcompose").glob("**/topics/*.md")))
_TABLE = re.compile(r"(<!-- figures: ([a-z_ ]+) -->\n\n)((?:\|.*\n)*)")


def with_tables(text: str, results: Mapping[str, Result]) -> str:
    """Return a page with the rows of its tables as the record has them."""

    def replace(match: re.Match[str]) -> str:
        recorded = [results[name] for name in match[2].split() if name in results]
        if not recorded:
            return match[1]
        is_apart = match[3] or match.end() == len(text)
        return match[1] + table(recorded) + ("" if is_apart else "\n")

    return _TABLE.sub(replace, text)


def quoted(text: str) -> set[str]:
    """Return the benchmarks whose rows a page prints."""
    return {name for match in _TABLE.finditer(text) for name in match[2].split()}


def tables_of(text: str) -> str:
    """Return the tables of a page."""
    return "".join(match[3] for match in _TABLE.finditer(text))


def main() -> None:
    """Write the tables of all pages."""
    results = read()
    for page in PAGES:
        page.write_text(with_tables(page.read_text("utf-8"), results), encoding="utf-8")


if __name__ == "__main__":
    main()
