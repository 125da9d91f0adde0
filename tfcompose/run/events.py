"""What the guard tells the launcher: one JSON object a line, on a pipe of their own.

The guard is a process like the others; its log is for people, these lines are for the launcher. ``EVENTS_FD`` names
the environment variable that holds the pipe's file descriptor.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import Any

from tfcompose.findings import Finding, Note

EVENTS_FD = "TFCOMPOSE_EVENTS_FD"
#: The descriptor of what the guard before this one left, in JSON; see ``tfcompose.run.guard.memory``.
MEMORY_FD = "TFCOMPOSE_MEMORY_FD"
#: For how many seconds the guard is to look before it says that all is clear.
SETTLE = "TFCOMPOSE_SETTLE_S"


@dataclass(frozen=True, slots=True)
class Clear:
    """The look before the start is over and no planned edge was published by anybody."""


@dataclass(frozen=True, slots=True)
class Taken:
    """A planned edge was published before the start: the plan must not start, or must end."""

    found: Finding


@dataclass(frozen=True, slots=True)
class Live:
    """Edges, named by their children, were received from their owner for the first time."""

    owner: str
    children: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Silent:
    """Edges, named by their children, that were live come no more; or, if that is ``over``, come again."""

    children: tuple[str, ...]
    over: bool


@dataclass(frozen=True, slots=True)
class OwnerReady:
    """All edges of a process are live."""

    process: str


@dataclass(frozen=True, slots=True)
class Complete:
    """Every edge of the plan is live."""

    edges: int


@dataclass(frozen=True, slots=True)
class Found:
    """A violation, once per case; ``process`` is the plan's process that did it, where it can be stopped for it."""

    found: Finding
    process: str = ""


@dataclass(frozen=True, slots=True)
class Recovered:
    """A case that was reported is over; the sentence says which."""

    message: str


@dataclass(frozen=True, slots=True)
class GateOpen:
    """What a process's gate waits for is there; ``seen`` says what."""

    process: str
    seen: str


@dataclass(frozen=True, slots=True)
class GateShut:
    """What a process's gate waits for is not there yet; ``seen`` says what is there instead."""

    process: str
    seen: str


@dataclass(frozen=True, slots=True)
class Remember:
    """What the next guard must know, should this one die: the launcher keeps it by key and does not look into it."""

    changed: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Alive:
    """The guard looks; it says so once a second."""


GuardEvent = (
    Alive | Clear | Taken | Live | Silent | OwnerReady | Complete | Found | Recovered | GateOpen | GateShut | Remember
)

_KINDS: dict[str, type[GuardEvent]] = {
    kind.__name__: kind
    for kind in (
        Alive, Clear, Taken, Live, Silent, OwnerReady, Complete, Found, Recovered, GateOpen, GateShut, Remember,
    )
}  # fmt: skip


def to_line(event: GuardEvent) -> str:
    """Return the event as one line of JSON, newline included."""
    return json.dumps({"event": type(event).__name__} | asdict(event), ensure_ascii=False) + "\n"


def from_line(line: str) -> GuardEvent:
    """Return the event that ``to_line`` wrote.

    Raises:
        ValueError: if the line is not one.
    """
    data = json.loads(line)
    kind = _KINDS.get(data.pop("event", "")) if isinstance(data, dict) else None
    if kind is None:
        raise ValueError(f"not an event: {line!r}")
    if "children" in data:
        data["children"] = tuple(data["children"])
    if "found" in data:
        data["found"] = finding_of(data["found"])
    return kind(**data)


def finding_of(data: dict[str, Any]) -> Finding:
    """Return the finding that ``asdict`` took apart, without places."""
    notes = tuple(Note(note["message"]) for note in data["notes"])
    return Finding(data["code"], data["name"], data["severity"], data["message"], None, notes, data["help"])
