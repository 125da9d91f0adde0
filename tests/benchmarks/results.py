"""The figures that the README and the topics print: each from a file that a benchmark wrote.

``python -m tests.benchmarks.bench_buffer --record`` measures and writes ``results/buffer.json``:
the rows as they are printed, and with what machine, when, under what load and by which command
they came to be. A table on a page stands below a line ``<!-- figures: buffer joints -->`` that
names its files; ``python -m tests.benchmarks.results --write`` writes all tables anew.
"""

from __future__ import annotations

import json
import os
import platform
import re
import sys
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", *sorted((ROOT / "tfcompose").glob("**/topics/*.md")))
FOLDER = Path(__file__).with_name("results")
#: A row's name, and its cells.
Rows = dict[str, list[str]]

_TABLE = re.compile(
    r"(?P<mark><!-- figures: (?P<names>[a-z ]+)"
    r" -->\n\n)(?P<head>\|.*\n\|[-|]+\|\n)(?P<rows>(?:\|.*\n)*)"
)


def machine() -> dict[str, Any]:
    """Return what the machine is, without its name."""
    model = re.search(
        r"^model name\s*: (.*)$", Path("/proc/cpuinfo").read_text("utf-8"), re.MULTILINE
    )
    pages = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return {
        "processor": model[1] if model else platform.machine(),
        "cores": len(os.sched_getaffinity(0)),
        "memory_gb": round(pages / 1e9),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
    }


def record(name: str, rows: Rows, load: float) -> None:
    """Print the rows, and write them to the file of that name with ``--record``.

    ``load`` is the system's load of the last minute before the benchmark began:
    ``os.getloadavg()[0]``.
    """
    for row, cells in rows.items():
        sys.stdout.write(f"| {' | '.join([row, *cells])} |\n")
    if "--record" not in sys.argv:
        return
    data = {
        "command": f"python -m tests.benchmarks.bench_{name} --record",
        "date": datetime.now(timezone.utc).date().isoformat(),
        "load": round(load, 2),
        "machine": machine(),
        "rows": rows,
    }
    FOLDER.mkdir(exist_ok=True)
    file = FOLDER / f"{name}.json"
    file.write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    sys.stdout.write(f"wrote {file.relative_to(ROOT)}\n")


def recorded(name: str) -> dict[str, Any]:
    """Return what a benchmark wrote."""
    data: dict[str, Any] = json.loads((FOLDER / f"{name}.json").read_text("utf-8"))
    return data


def rewritten(text: str) -> str:
    """Return a text with the rows of its tables as they were recorded."""

    def table(found: re.Match[str]) -> str:
        rows = {
            row: cells
            for name in found["names"].split()
            for row, cells in recorded(name)["rows"].items()
        }
        lines = (
            f"| {' | '.join([row, *cells])} |\n".replace("|  |", "| |")
            for row, cells in rows.items()
        )
        return f"{found['mark']}{found['head']}{''.join(lines)}"

    return _TABLE.sub(table, text)


def named(text: str) -> set[str]:
    """Return the files whose figures a text prints."""
    return {name for found in _TABLE.finditer(text) for name in found["names"].split()}


def main() -> None:
    """Write the tables of all pages, or print them."""
    for page in PAGES:
        text = rewritten(page.read_text("utf-8"))
        if "--write" in sys.argv:
            page.write_text(text, encoding="utf-8")
        else:
            sys.stdout.write("".join(found[0] + "\n" for found in _TABLE.finditer(text)))


if __name__ == "__main__":
    main()
