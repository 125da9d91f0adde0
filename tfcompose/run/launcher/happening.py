"""What can happen to the process machine, as values; what the guard says and other commands ask is in ``ipc``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.ipc import DownRequest, GuardEvent, ProcessRequest

if TYPE_CHECKING:
    from tfcompose.plan import Plan


@dataclass(frozen=True, slots=True)
class Begin:
    """The launcher is ready to start processes."""


@dataclass(frozen=True, slots=True)
class Started:
    """A process was started."""

    name: str
    pid: int


@dataclass(frozen=True, slots=True)
class StartFailed:
    """A process could not be started."""

    name: str
    why: str


@dataclass(frozen=True, slots=True)
class Exited:
    """A process ended: exit code, or minus the signal's number. ``last_lines`` is the end of its log."""

    name: str
    returncode: int
    last_lines: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Signalled:
    """The launcher was sent a signal."""

    signal: int


@dataclass(frozen=True, slots=True)
class OutputLost:
    """Nobody reads the launcher's output any more."""


@dataclass(frozen=True, slots=True)
class Tick:
    """Nothing but time has passed."""


@dataclass(frozen=True, slots=True)
class TimeUp:
    """The time that was asked for is over."""


@dataclass(frozen=True, slots=True)
class LogSeen:
    """A process wrote the line that its gate waits for."""

    process: str
    text: str


@dataclass(frozen=True, slots=True)
class NewPlan:
    """From now on another plan holds; ``changed`` are the processes that must be started anew for it."""

    plan: Plan
    changed: frozenset[str]
    held: tuple[str, ...] = ()


Event = (
    Begin
    | Started
    | StartFailed
    | Exited
    | Signalled
    | OutputLost
    | Tick
    | TimeUp
    | LogSeen
    | ProcessRequest
    | DownRequest
    | NewPlan
    | GuardEvent
)
