"""Messages between the processes of a run, as lines of JSON.

The guard sends events to the launcher on a pipe, and takes orders on another; its log is for
people. Other commands send requests to the launcher's control socket and get answers, or the
notices that a person at ``up`` reads too.
"""

from __future__ import annotations

from typing import Any, Literal

import msgspec

from tfcompose.foundation.findings import Finding  # noqa: TC001 (messages are read by these types)
from tfcompose.model.plan import LifecycleState, ProcessKind  # noqa: TC001

#: What a decoder raises for a line that is no message.
UNREADABLE = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)


class ProcessMessage(msgspec.Struct, frozen=True):
    """What one process tells another, or a part of that."""


class _Event(ProcessMessage, frozen=True, tag_field="event", tag=True):
    """What happened: an event of the guard, a notice, or both."""


class _Order(ProcessMessage, frozen=True, tag_field="order", tag=True):
    """What the launcher has the guard do."""


class Request(ProcessMessage, frozen=True, tag_field="request", tag=True):
    """What another command asks of the launcher."""


def line_of(message: ProcessMessage) -> bytes:
    """Return the message as one line of JSON, newline included."""
    return msgspec.json.encode(message) + b"\n"


# Events: from the guard to the launcher.


class Clear(_Event, frozen=True):
    """The look before the start is over and no planned edge was published by anybody."""


class Taken(_Event, frozen=True):
    """A planned edge was published before the start: the plan must not start, or must end."""

    found: Finding


class Live(_Event, frozen=True):
    """Edges, named by their children, were received from their owner for the first time."""

    owner: str
    children: tuple[str, ...]


class Silent(_Event, frozen=True):
    """Live edges, named by their children, stopped arriving, or arrive again."""

    children: tuple[str, ...]
    #: Whether they arrive again.
    over: bool


class OwnerReady(_Event, frozen=True):
    """All edges of a process are live."""

    process: str


class TreeComplete(_Event, frozen=True):
    """Every edge of the plan is live: a notice too."""

    edges: int
    #: Since the start; 0 from the guard, which does not know it.
    seconds: float = 0.0


class FindingShown(_Event, frozen=True, omit_defaults=True):
    """Something is wrong: a notice too, as users see it."""

    found: Finding
    #: The plan's process that caused it, if stopping that one would help.
    process: str = ""


class CurrentFindings(_Event, frozen=True):
    """All that is wrong now, worst first; what was sent before does not count any more."""

    findings: tuple[Finding, ...]


class RecoveredShown(_Event, frozen=True):
    """A reported fault is over; the text says which. A notice too."""

    text: str
    #: Since the start.
    seconds: float = 0.0


class Unfenced(_Event, frozen=True):
    """A process of a strict plan bypasses the fence, and must be stopped."""

    found: Finding
    process: str
    #: Identifies it instead of ``process`` where its environment was cleared.
    pid: int = 0


class GateState(_Event, frozen=True):
    """The state of a process's gate: whether what it waits for is there."""

    process: str
    #: What is there, or what is there instead.
    seen: str
    is_open: bool


class Remember(_Event, frozen=True):
    """State for the next guard, should this one die. The launcher stores it by key, unread."""

    changed: dict[str, Any]


LoadState = Literal["loaded", "not loaded", "unloaded"]


class ComponentState(_Event, frozen=True):
    """The state of a component, in answer to an order.

    A component counts as unloaded, too, if its container lost it or does not answer.
    """

    process: str
    #: The number of the order that this answers.
    number: int
    state: LoadState
    #: The reason that it is not loaded.
    why: str = ""


class DescriptionState(_Event, frozen=True):
    """The answer of a node that was given the robot's description."""

    process: str
    #: The reason that it refused it; empty: it took it.
    why: str = ""


class Alive(_Event, frozen=True):
    """The guard looks; it says so once a second."""


GuardEvent = (
    Alive
    | Clear
    | Taken
    | Live
    | Silent
    | OwnerReady
    | TreeComplete
    | FindingShown
    | CurrentFindings
    | Unfenced
    | RecoveredShown
    | GateState
    | Remember
    | ComponentState
    | DescriptionState
)

GUARD_EVENTS = msgspec.json.Decoder(GuardEvent)


# Orders: from the launcher to the guard.


class Absent(_Order, frozen=True):
    """A process of the plan was stopped on purpose, or ended: its silence is nobody's fault."""

    process: str


class Present(_Order, frozen=True):
    """A process of the plan is started, again: its edges are to be seen anew."""

    process: str


class Gate(_Order, frozen=True):
    """Report when this is there: a topic with a publisher, a service, or lifecycle states.

    An empty gate replaces the process's gate, and is not watched.
    """

    process: str
    #: A full name, or empty.
    topic: str = ""
    #: A full name, or empty.
    service: str = ""
    #: The lifecycle states to wait for.
    nodes: dict[str, LifecycleState] = {}
    #: Whether the guard brings the nodes to these states.
    drive: bool = False
    #: Topics whose publishers are named while others look at what comes there.
    writers: tuple[str, ...] = ()


class ComponentOrder(_Order, frozen=True):
    """Have a container load or unload a component; a ``ComponentState`` answers."""

    process: str
    #: Returned in the answer.
    number: int
    do: Literal["load", "unload"]
    #: Whether an earlier guard may have loaded it already.
    again: bool = False
    file: str = ""


class DescriptionOrder(_Order, frozen=True):
    """Give a process's node the robot's description that its parameter file has now.

    A ``DescriptionState`` answers it.
    """

    process: str
    node: str
    file: str


class Reread(_Order, frozen=True):
    """Read the plan anew: its edges' lines have changed, or poses that ``static`` sends."""

    file: str


GuardOrder = Absent | Present | Gate | ComponentOrder | DescriptionOrder | Reread

GUARD_ORDERS = msgspec.json.Decoder(GuardOrder)


# Notices: from the launcher to a person, and to clients of its control socket.

#: supervisord's states, and that of an external process; people and programs read these words.
StateName = Literal[
    "stopped", "starting", "running", "backoff", "stopping", "exited", "fatal", "expected"
]
Stream = Literal["stdout", "stderr"]


class LogLine(_Event, frozen=True):
    """A line that a process wrote, without its end. A line longer than 64 KiB comes in pieces."""

    process: str
    stream: Stream
    text: str


class ProcessState(_Event, frozen=True):
    """A process went into this state.

    ``detail`` says why, where there is more to say: "exit code 3; again in 2 s".
    """

    process: str
    state: StateName
    pid: int | None = None
    detail: str = ""


class OwnerLive(_Event, frozen=True):
    """All edges of an owner were received from it, ``seconds`` after the start.

    ``edges`` are their names.
    """

    owner: str
    node: str
    edges: tuple[str, ...]
    seconds: float


class ProcessReady(_Event, frozen=True):
    """A process that waited for something of its own is ready, ``seconds`` after the start.

    ``seen`` says by what.
    """

    process: str
    seen: str
    seconds: float


class AllStarted(_Event, frozen=True):
    """Whatever can be started was.

    ``waiting`` are processes that wait for others to be ready, or done.
    """

    started: int
    waiting: tuple[str, ...]
    seconds: float


class StartRow(ProcessMessage, frozen=True):
    """When a process was started and ready, in seconds after the start; None: it is external."""

    process: str
    started: float | None
    ready: float


class AllReady(_Event, frozen=True):
    """Every process is ready and every edge live, ``seconds`` after the start.

    But for those that were given up.
    """

    rows: tuple[StartRow, ...]
    seconds: float
    without: tuple[str, ...] = ()


class Replanned(_Event, frozen=True):
    """The launcher follows a changed plan from now on. Processes are given by name."""

    changed: tuple[str, ...] = ()
    added: tuple[str, ...] = ()
    removed: tuple[str, ...] = ()
    #: Frames that listeners still hold.
    held: tuple[str, ...] = ()
    #: Processes that get a new description while they run.
    described: tuple[str, ...] = ()


class Missing(ProcessMessage, frozen=True):
    """The unpublished edges of one owner, in the plan's order."""

    owner: str
    node: str
    edges: tuple[str, ...]
    #: The number of edges that it owns.
    owned: int


class Waiting(_Event, frozen=True):
    """Edges that nobody has published yet, by owner."""

    missing: tuple[Missing, ...]


class FilesRestored(_Event, frozen=True):
    """The files of the run were removed, and restored where possible."""

    #: The folder that they are in again; empty: they are in none.
    folder: str
    #: The reason that they could not be restored.
    why: str = ""


class Stopping(_Event, frozen=True):
    """Everything is being stopped, for this reason."""

    reason: str


class Ended(_Event, frozen=True):
    """Nothing runs any more: the last notice."""

    exit_code: int
    #: The message and notes of the first failure.
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
    | FilesRestored
    | Stopping
    | Ended
)

NOTICES = msgspec.json.Decoder(Notice)


class _Timed(ProcessMessage, frozen=True):
    at: float


def notice_line(notice: Notice, at: float) -> str:
    """Return the notice as one line of JSON, without its end.

    ``at`` is when, in seconds since 1970.
    """
    data = {"event": "", "at": round(at, 3)} | msgspec.to_builtins(notice)
    return msgspec.json.encode(data).decode()


def read_notice(line: bytes) -> tuple[Notice, float]:
    """Return the notice that ``notice_line`` wrote, and when.

    Raises:
        UNREADABLE: if the line is none.
    """
    return NOTICES.decode(line), msgspec.json.decode(line, type=_Timed).at


# Requests: what other commands ask of the launcher, and its answers.

Verb = Literal["stop", "start", "restart"]


class StatusRequest(Request, frozen=True):
    """What is known of the run? Answered by a ``RobotStatus``."""


class EventsRequest(Request, frozen=True):
    """From now on, the notices: first those that were sent already. Answered by these alone."""


class DownRequest(Request, frozen=True):
    """Stop everything. Answered by ``Done``."""


class ProcessRequest(Request, frozen=True):
    """Stop, start or restart one process. Answered by ``Done``."""

    do: Verb
    name: str


class UpdateRequest(Request, frozen=True):
    """Follow another plan: its file, and the folder that it was built in.

    Answered by a ``PlanChange``.
    """

    plan: str
    base: str


REQUESTS = msgspec.json.Decoder(
    StatusRequest | EventsRequest | DownRequest | ProcessRequest | UpdateRequest
)


class Refusal(ProcessMessage, frozen=True):
    """Nothing was done, for this reason."""

    error: str


class Done(ProcessMessage, frozen=True):
    """The request is being carried out."""

    ok: Literal[True] = True
    #: What a process that is started waits for first.
    waits: str = ""


class PlanChange(ProcessMessage, frozen=True):
    """The changes that another plan brings.

    tf2 never forgets a fixed edge, so listeners hold those that vanish until they restart.
    """

    #: Processes that differ.
    changed: tuple[str, ...]
    #: New processes.
    added: tuple[str, ...]
    #: Processes that are gone.
    removed: tuple[str, ...]
    #: Fixed edges that vanish.
    held: tuple[str, ...]
    ok: Literal[True] = True
    #: Processes that get a new description while they run.
    described: tuple[str, ...] = ()
    #: Whether the plan is another one at all, if only in its lines of the robot file.
    differs: bool = False


class ProcessStatus(ProcessMessage, frozen=True):
    """The status of one process."""

    name: str
    kind: ProcessKind
    host: str | None
    state: StateName
    #: The reason for its state.
    detail: str
    required: bool | None
    failed: bool
    ready: bool
    #: What it waits for.
    waits: str
    #: What is there instead.
    seen: str
    pid: int | None
    #: In seconds.
    uptime: float | None
    restarts: int
    #: The number of edges that it owns.
    edges: int
    #: The number of these that the guard receives.
    live: int
    nodes: tuple[str, ...]


class RobotStatus(ProcessMessage, frozen=True):
    """The status of a run."""

    robot: str
    host: str | None
    launcher: int
    #: The digest of the robot file that the plan was built from.
    plan: str
    #: In seconds.
    uptime: float
    complete: bool
    ready: bool
    stopping: bool
    missing: tuple[str, ...]
    silent: tuple[str, ...]
    processes: tuple[ProcessStatus, ...]
    #: What the guard sees wrong now, worst first.
    findings: tuple[Finding, ...] = ()
