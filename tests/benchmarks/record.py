"""Results of benchmarks, and the file that keeps those the README and the topics quote."""

from __future__ import annotations

import json
import os
import platform
import re
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
FILE = Path(__file__).with_name("record.json")


@dataclass(frozen=True)
class RowResult:
    """A row's samples."""

    title: str
    unit: str
    #: By contender; index ``n`` of each is of the same round.
    samples: dict[str, list[float]]


@dataclass(frozen=True)
class Result:
    """A benchmark's rows, and how they came to be."""

    about: str
    command: str
    #: The day it ended, UTC.
    date: str
    #: The machine's load of the last minute, before and after: runnable processes.
    load: tuple[float, float]
    machine: dict[str, Any]
    #: Versions of contenders that have one.
    versions: dict[str, str]
    #: Contenders that the machine does not have, with the reason.
    missing: dict[str, str]
    rows: dict[str, RowResult] = field(default_factory=dict)


def machine() -> dict[str, Any]:
    """Return the machine's properties, without its name."""
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


def read(file: Path = FILE) -> dict[str, Result]:
    """Return the recorded results by the names of their benchmarks."""
    if not file.exists():
        return {}
    data: dict[str, dict[str, Any]] = json.loads(file.read_text("utf-8"))
    return {name: from_json(entry) for name, entry in data.items()}


def from_json(entry: dict[str, Any]) -> Result:
    """Return a result from its form in JSON."""
    rows = {name: RowResult(**row) for name, row in entry["rows"].items()}
    return Result(**entry | {"load": tuple(entry["load"]), "rows": rows})


def to_json(result: Result) -> dict[str, Any]:
    """Return a result's form in JSON, with four significant digits of each sample."""
    entry = asdict(result)
    for row in entry["rows"].values():
        row["samples"] = {
            name: [float(f"{value:.4g}") for value in values]
            for name, values in row["samples"].items()
        }
    return entry


def write(results: dict[str, Result], file: Path = FILE) -> None:
    """Replace the entries of these benchmarks, and keep the others."""
    entries = {name: to_json(result) for name, result in (read(file) | results).items()}
    text = json.dumps(dict(sorted(entries.items())), indent=1, ensure_ascii=False)
    # A list of samples is one line.
    text = re.sub(r"\[\s+([^\[\]{}\"]+?)\s+\]", lambda m: f"[{' '.join(m[1].split())}]", text)
    file.write_text(text + "\n", encoding="utf-8")
