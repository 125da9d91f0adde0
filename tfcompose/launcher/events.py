"""Events and actions of the process machine, as values.

What the guard reports and what other commands request are events too; they are in
``tfcompose.model.messages``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.model.messages import DownRequest, GuardEvent, ProcessRequest

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Finding
    from tfcompose.model.messages import GuardOrder, Notice
    from tfcompose.model.plan import Plan


# Events.


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
    """A process ended: exit code, or minus the signal's number.

    ``last_lines`` is the end of its log.
    """

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
    """The time for which the plan was to run is over."""


@dataclass(frozen=True, slots=True)
class LogMatched:
    """A process wrote the line that makes it ready."""

    process: str
    text: str


@dataclass(frozen=True, slots=True)
class NewPlan:
    """From now on another plan holds.

    ``changed`` are the processes that must be started anew for it, ``held`` the fixed edges that
    listeners still hold, ``file`` is where the plan is. ``described`` only have another
    description, which the guard can give them while they run.
    """

    plan: Plan
    changed: frozenset[str]
    held: tuple[str, ...] = ()
    file: str = ""
    described: frozenset[str] = frozenset()


Event = (
    Begin
    | Started
    | StartFailed
    | Exited
    | Signalled
    | OutputLost
    | Tick
    | TimeUp
    | LogMatched
    | ProcessRequest
    | DownRequest
    | NewPlan
    | GuardEvent
)


# Actions.


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
class Notify:
    """Send a notice to the person, and to clients of the control socket."""

    notice: Notice


@dataclass(frozen=True, slots=True)
class NotifyLate:
    """Report that a process is not ready in time, with the last lines of its log."""

    name: str
    finding: Finding


@dataclass(frozen=True, slots=True)
class Order:
    """Send the guard an order; what a container is asked is written to the order's file."""

    order: GuardOrder


@dataclass(frozen=True, slots=True)
class Finish:
    """Nothing runs any more: leave with this exit code."""

    exit_code: int


Action = Start | Kill | Notify | NotifyLate | Order | Finish
