"""Events and actions of the process machine, as values.

Reports from the guard and requests from other commands are also events.
``tfcompose.model.messages`` defines them.
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
    """A process ended."""

    name: str
    #: The exit code, or minus the number of the signal.
    returncode: int
    #: The last lines of its log.
    last_lines: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Signalled:
    """The launcher received a signal."""

    signal: int


@dataclass(frozen=True, slots=True)
class OutputLost:
    """The reader of the launcher's output has gone."""


@dataclass(frozen=True, slots=True)
class Tick:
    """Time has passed, and nothing else has happened."""


@dataclass(frozen=True, slots=True)
class TimeUp:
    """The plan has run for the requested time."""


@dataclass(frozen=True, slots=True)
class LogMatched:
    """A process wrote the log line that makes it ready."""

    process: str
    text: str


@dataclass(frozen=True, slots=True)
class NewPlan:
    """Another plan replaces the current plan."""

    plan: Plan
    #: Processes that must restart for the new plan.
    changed: frozenset[str]
    #: Removed fixed edges that listeners keep until they restart.
    held: tuple[str, ...] = ()
    #: The path of the plan.
    file: str = ""
    #: Processes for which only the robot description changed. The guard can pass it to them while
    #: they run.
    described: frozenset[str] = frozenset()
    #: Processes that read the plan again while they run.
    followers: frozenset[str] = frozenset()
    #: Fixed edges that are sent with another pose, without a restart.
    moved: tuple[str, ...] = ()


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
    """Send the signal to the process and its group."""

    name: str
    signal: int


@dataclass(frozen=True, slots=True)
class Notify:
    """Send a notice to the user, and to clients of the control socket."""

    notice: Notice


@dataclass(frozen=True, slots=True)
class NotifyLate:
    """Report that a process is not ready in time, with the last lines of its log."""

    name: str
    finding: Finding


@dataclass(frozen=True, slots=True)
class Order:
    """Send an order to the guard. A request for a container is written to the order's file."""

    order: GuardOrder


@dataclass(frozen=True, slots=True)
class Follow:
    """Have one of tfcompose's own processes read the plan again while it runs."""

    name: str
    file: str


@dataclass(frozen=True, slots=True)
class Finish:
    """No process runs any more; exit with this code."""

    exit_code: int


Action = Start | Kill | Notify | NotifyLate | Order | Follow | Finish
