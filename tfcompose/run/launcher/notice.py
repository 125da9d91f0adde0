"""What the launcher tells a person. How it looks is decided by whoever is given these."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from tfcompose.findings import Finding

#: supervisord's names, and EXPECTED for a process that somebody else starts.
StateName = Literal["STOPPED", "STARTING", "RUNNING", "BACKOFF", "STOPPING", "EXITED", "FATAL", "EXPECTED"]
Stream = Literal["stdout", "stderr"]


@dataclass(frozen=True, slots=True)
class LogLine:
    """A line that a process wrote, without its end. A line longer than 64 KiB comes in pieces."""

    process: str
    stream: Stream
    text: str


@dataclass(frozen=True, slots=True)
class ProcessState:
    """A process went into this state. ``detail`` says why, where there is more to say: "exit code 3; again in 2 s"."""

    process: str
    state: StateName
    pid: int | None = None
    detail: str = ""


@dataclass(frozen=True, slots=True)
class OwnerLive:
    """All edges of an owner were received from it, ``seconds`` after the start; ``edges`` are their names."""

    owner: str
    node: str
    edges: tuple[str, ...]
    seconds: float


@dataclass(frozen=True, slots=True)
class ProcessReady:
    """A process that waited for something of its own is ready, ``seconds`` after the start; ``seen`` says by what."""

    process: str
    seen: str
    seconds: float


@dataclass(frozen=True, slots=True)
class AllStarted:
    """Whatever can be started was; ``waiting`` are processes that wait for others to be ready, or done."""

    started: int
    waiting: tuple[str, ...]
    seconds: float


@dataclass(frozen=True, slots=True)
class StartRow:
    """When a process was started and ready, in seconds after the start; None: somebody else started it."""

    process: str
    started: float | None
    ready: float


@dataclass(frozen=True, slots=True)
class AllReady:
    """Every process is ready and every edge live, ``seconds`` after the start; but for those that were given up."""

    rows: tuple[StartRow, ...]
    seconds: float
    without: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Replanned:
    """A changed plan is followed from now on: the names of processes, and the frames that listeners will still hold."""

    changed: tuple[str, ...] = ()
    added: tuple[str, ...] = ()
    removed: tuple[str, ...] = ()
    held: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class TreeComplete:
    """Every edge of the plan is live, ``seconds`` after the start."""

    edges: int
    seconds: float


@dataclass(frozen=True, slots=True)
class Missing:
    """The edges of one owner that nobody has published yet, in the plan's order, of ``owned`` ones."""

    owner: str
    node: str
    edges: tuple[str, ...]
    owned: int


@dataclass(frozen=True, slots=True)
class Waiting:
    """Edges that nobody has published yet, by owner."""

    missing: tuple[Missing, ...]


@dataclass(frozen=True, slots=True)
class FindingShown:
    """Something is wrong."""

    found: Finding


@dataclass(frozen=True, slots=True)
class RecoveredShown:
    """A case that was shown is over, ``seconds`` after the start."""

    text: str
    seconds: float


@dataclass(frozen=True, slots=True)
class Stopping:
    """Everything is being stopped, for this reason."""

    reason: str


@dataclass(frozen=True, slots=True)
class Ended:
    """Nothing runs any more: the last notice. ``because`` is the failure that came first, and what was said last."""

    exit_code: int
    because: tuple[str, ...] = ()


Notice = (
    LogLine
    | ProcessState
    | OwnerLive
    | ProcessReady
    | AllStarted
    | AllReady
    | Replanned
    | TreeComplete
    | Waiting
    | FindingShown
    | RecoveredShown
    | Stopping
    | Ended
)
