"""The launcher's notices as lines of JSON: ``{"event": …, "at": …}`` and the notice's own fields."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

from tfcompose.run.events import finding_of
from tfcompose.run.launcher.notice import (
    AllReady,
    AllStarted,
    Ended,
    FindingShown,
    LogLine,
    Missing,
    Notice,
    OwnerLive,
    ProcessReady,
    ProcessState,
    RecoveredShown,
    Replanned,
    StartRow,
    Stopping,
    TreeComplete,
    Waiting,
)

_KINDS: dict[str, type[Any]] = {
    kind.__name__: kind
    for kind in (
        AllReady, AllStarted, Ended, FindingShown, LogLine, OwnerLive, ProcessReady, ProcessState, RecoveredShown,
        Replanned, Stopping, TreeComplete, Waiting,
    )
}  # fmt: skip


def told_line(notice: Notice, at: float) -> str:
    """Return the notice as one line of JSON, without its end; ``at`` is when, in seconds since 1970."""
    return json.dumps({"event": type(notice).__name__, "at": round(at, 3)} | asdict(notice), ensure_ascii=False)


def notice_of(line: str) -> tuple[Notice, float]:
    """Return the notice that ``told_line`` wrote, and when.

    Raises:
        ValueError: if the line is none.
    """
    data = json.loads(line)
    kind = _KINDS.get(data.pop("event", "")) if isinstance(data, dict) else None
    if kind is None:
        raise ValueError(f"not an event: {line!r}")
    at = float(data.pop("at"))
    if "found" in data:
        data["found"] = finding_of(data["found"])
    if "missing" in data:
        data["missing"] = tuple(Missing(**one | {"edges": tuple(one["edges"])}) for one in data["missing"])
    if "rows" in data:
        data["rows"] = tuple(StartRow(**row) for row in data["rows"])
    for key, value in data.items():
        if isinstance(value, list):
            data[key] = tuple(value)
    notice: Notice = kind(**data)
    return notice, at
