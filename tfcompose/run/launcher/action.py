"""What the process machine wants done: values only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.findings import Finding
    from tfcompose.ipc import GuardOrder, Notice


@dataclass(frozen=True, slots=True)
class Start:
    """Start the process; the answer is ``Started`` or ``StartFailed``."""

    name: str


@dataclass(frozen=True, slots=True)
class Kill:
    """Send the signal to the process and all of its group."""

    name: str
    signal: int


@dataclass(frozen=True, slots=True)
class Tell:
    """Tell the person."""

    notice: Notice


@dataclass(frozen=True, slots=True)
class Finish:
    """Nothing runs any more: leave with this exit code."""

    exit_code: int


@dataclass(frozen=True, slots=True)
class Order:
    """Tell the guard."""

    order: GuardOrder


@dataclass(frozen=True, slots=True)
class TellLate:
    """Tell the person that a process is not ready in time, with what it said last."""

    name: str
    found: Finding


Action = Start | Kill | Tell | TellLate | Order | Finish
