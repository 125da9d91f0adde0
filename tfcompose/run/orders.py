"""What the launcher tells the guard: one JSON object a line, on a pipe of their own.

``ORDERS_FD`` names the environment variable that holds the pipe's file descriptor.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import Any

ORDERS_FD = "TFCOMPOSE_ORDERS_FD"
#: Set for a guard that joins a plan that runs already: nobody was there before the start, as it sees it.
JOINS = "TFCOMPOSE_GUARD_JOINS"


@dataclass(frozen=True, slots=True)
class Absent:
    """A process of the plan was stopped on purpose, or ended: its silence is nobody's fault."""

    process: str


@dataclass(frozen=True, slots=True)
class Present:
    """A process of the plan is started, again: its edges are to be seen anew."""

    process: str


@dataclass(frozen=True, slots=True)
class Gate:
    """Say when this is there: a topic with a publisher, a service, or nodes in lifecycle states.

    ``topic`` and ``service`` are full names, or empty. ``nodes`` holds the lifecycle states that are waited for;
    ``drive`` says that the guard brings them there. ``writers`` are topics whose publishers are named while others look
    at what comes there. A gate at which nothing is to be seen replaces the process's, and is not looked at.
    """

    process: str
    topic: str = ""
    service: str = ""
    nodes: dict[str, str] = field(default_factory=dict)
    drive: bool = False
    writers: tuple[str, ...] = ()


GuardOrder = Absent | Present | Gate

_KINDS: dict[str, type[Any]] = {kind.__name__: kind for kind in (Absent, Present, Gate)}


def order_line(order: GuardOrder) -> str:
    """Return the order as one line of JSON, newline included."""
    return json.dumps({"order": type(order).__name__} | asdict(order), ensure_ascii=False) + "\n"


def order_of(line: str) -> GuardOrder:
    """Return the order that ``order_line`` wrote.

    Raises:
        ValueError: if the line is none.
    """
    data = json.loads(line)
    kind = _KINDS.get(data.pop("order", "")) if isinstance(data, dict) else None
    if kind is None:
        raise ValueError(f"not an order: {line!r}")
    if "writers" in data:
        data["writers"] = tuple(data["writers"])
    order: GuardOrder = kind(**data)
    return order
