"""What the process machine knows, what can happen to it, and what it wants done: values only.

Times are seconds of one monotonic clock.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from tfcompose.run.events import GuardEvent

if TYPE_CHECKING:
    from tfcompose.diagnostic import Diagnostic
    from tfcompose.plan import Plan, PlanEdge, PlanProcess
    from tfcompose.run.launcher.notice import Notice, StateName
    from tfcompose.run.orders import GuardOrder


@dataclass(frozen=True, slots=True)
class Times:
    """How long the launcher waits, in seconds."""

    clear_s: float = 20.0
    """for the guard's word that nobody publishes a planned edge yet"""
    interrupt_s: float = 5.0
    """between SIGINT and SIGTERM"""
    terminate_s: float = 5.0
    """between SIGTERM and SIGKILL"""
    waiting_s: float = 5.0
    """until missing edges are named, and between two such notices"""
    backoff_s: float = 1.0
    """before the first restart; doubled with each further one"""
    backoff_limit_s: float = 30.0
    """the longest wait before a restart"""
    steady_s: float = 10.0
    """a run as long as this makes earlier failures forgotten"""
    ready_s: float = 30.0
    """for a process to be ready, where it says by what and not until when"""
    same_signal_s: float = 0.2
    """two signals closer than this are one: ``timeout`` and closing terminals send theirs twice"""


Verb = Literal["stop", "start", "restart"]

MAX_RESTARTS = 5
#: The exit code when nobody reads the output any more: what a shell says of a program that SIGPIPE ended.
UNREAD = 141


# What happens.


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
class Asked:
    """Somebody asks for one process to be stopped, started or restarted; ``refusal`` says when not to ask."""

    name: str
    verb: Verb


@dataclass(frozen=True, slots=True)
class Down:
    """Somebody asks for everything to be stopped."""


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
    | Asked
    | Down
    | NewPlan
    | GuardEvent
)


# What is to be done.


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
    found: Diagnostic


Action = Start | Kill | Tell | TellLate | Order | Finish


# What is known.


@dataclass(frozen=True, slots=True)
class Tracked:
    """One process. ``since`` is when it came into its state, or when it was sent its last signal.

    ``order`` counts the starts of all processes, 0 for one that was never started; ``failures`` the short runs in a
    row; ``restarts`` all starts but the first; ``level`` how often it was told to stop, each time more firmly.
    ``leaving`` says what follows once it has stopped: "stop" and it stays so, "again" and it is started, "drop" and it
    is forgotten. ``seen`` is what its gate saw last, ``late`` whether it was said to be late.
    """

    process: PlanProcess
    state: StateName
    pid: int | None = None
    since: float = 0.0
    order: int = 0
    failures: int = 0
    level: int = 0
    ready: bool = False
    wanted: bool = True
    leaving: Literal["", "stop", "again", "drop"] = ""
    restarts: int = 0
    began: float = 0.0
    ready_since: float | None = None
    seen: str = ""
    late: bool = False

    @property
    def alive(self) -> bool:
        """Whether there is an operating system's process, or will be in a moment."""
        return self.state in ("STARTING", "RUNNING", "STOPPING")

    @property
    def was_started(self) -> bool:
        """Whether it has run, or runs."""
        return self.order > 0 and self.state != "STARTING"


@dataclass(frozen=True, slots=True)
class Stop:
    """Why everything stops, and how it will have ended. ``signals`` counts those that asked for it."""

    cause: Literal["signal", "time", "taken", "failure"]
    exit_code: int
    signals: int = 0
    signalled: float = 0.0


@dataclass(frozen=True, slots=True)
class State:
    """Everything that is known about a running plan.

    ``live`` holds the children of the edges that were seen; ``begun_anew`` is when another plan came, if one did.
    ``memory`` is what the guard said that the next one must know; ``unwatched`` is since when it is dead, if it is.
    """

    plan: Plan
    times: Times
    tracked: dict[str, Tracked]
    guard: str | None
    begun: float | None = None
    begun_anew: float = 0.0
    clear: float | None = None
    live: frozenset[str] = frozenset()
    complete: bool = False
    shown: frozenset[str] = frozenset()
    waiting: frozenset[str] = frozenset()
    waiting_said: float | None = None
    all_started: bool = False
    all_ready: bool = False
    stop: Stop | None = None
    because: tuple[str, ...] = ()
    finished: bool = False
    memory: dict[str, Any] = field(default_factory=dict)
    unwatched: float | None = None

    @property
    def missing(self) -> tuple[PlanEdge, ...]:
        """The edges that were not seen yet; none where no guard looks."""
        return () if self.guard is None else tuple(edge for edge in self.plan.edges if edge.child not in self.live)


def initial(plan: Plan, times: Times | None = None) -> State:
    """Return the state before ``Begin``: nothing runs."""
    processes = plan.processes
    guards = [process.name for process in processes if process.kind == "guard"]
    tracked = {
        process.name: Tracked(process, "EXPECTED" if process.kind == "external" else "STOPPED") for process in processes
    }
    return State(plan, times or Times(), tracked, guards[0] if guards else None, complete=not plan.edges)
