"""Messages between the processes of a run, as lines of JSON.

The guard sends events to the launcher on a pipe, and takes orders on another; its log is for
people. Other commands send requests to the launcher's control socket. They get answers, or the
same notices that ``up`` prints.
"""

from __future__ import annotations

from typing import Any, Literal

import msgspec

from tfcompose.foundation.findings import Finding  # noqa: TC001 (msgspec needs it at run time)
from tfcompose.model.plan import LifecycleState, ProcessKind  # noqa: TC001

#: What a decoder raises for a line that is not a message.
UNREADABLE = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)


class ProcessMessage(msgspec.Struct, frozen=True):
    """A message between processes, or a part of one."""


class _Event(ProcessMessage, frozen=True, tag_field="event", tag=True):
    """An event of the guard, a notice, or both."""


class _Order(ProcessMessage, frozen=True, tag_field="order", tag=True):
    """An instruction from the launcher to the guard."""


class Request(ProcessMessage, frozen=True, tag_field="request", tag=True):
    """A request from another command to the launcher."""


def line_of(message: ProcessMessage) -> bytes:
    """Return the message as one line of JSON, newline included."""
    return msgspec.json.encode(message) + b"\n"


# Events: from the guard to the launcher.


class Clear(_Event, frozen=True):
    """The check before the start is over: no node publishes a planned edge."""


class Taken(_Event, frozen=True):
    """A planned edge was published before the start: the plan must not start, or must stop."""

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
    """Every edge of the plan is live. Also a notice."""

    edges: int
    #: Since the start; 0 from the guard, which does not know it.
    seconds: float = 0.0


class FindingShown(_Event, frozen=True, omit_defaults=True):
    """Something is wrong. Also a notice, as users see it."""

    found: Finding
    #: The plan's process that caused it, if stopping that one would help.
    process: str = ""


class CurrentFindings(_Event, frozen=True):
    """Everything that is wrong now, worst first. It replaces what was sent before."""

    findings: tuple[Finding, ...]


class RecoveredShown(_Event, frozen=True):
    """A reported fault is over; the text says which. Also a notice."""

    text: str
    #: Since the start.
    seconds: float = 0.0


class Unfenced(_Event, frozen=True):
    """A process of a strict plan bypasses the filter and must be stopped."""

    found: Finding
    process: str
    #: Identifies it instead of ``process`` where its environment was cleared.
    pid: int = 0


class GateState(_Event, frozen=True):
    """The state of a process's gate, the condition that it waits for."""

    process: str
    #: What opened it, or what was found instead.
    seen: str
    is_open: bool


class Remember(_Event, frozen=True):
    """State for the next guard, should this one die. The launcher stores it by key, unread."""

    changed: dict[str, Any]


LoadState = Literal["loaded", "not loaded", "unloaded"]


class ComponentState(_Event, frozen=True):
    """The state of a component, in answer to an order.

    It is ``unloaded`` after an order to unload it, and if its container lost it or does not
    answer. It is ``not loaded`` if loading failed.
    """

    process: str
    #: The number of the order that this answers.
    number: int
    state: LoadState
    #: Why it is not loaded; empty if it is.
    why: str = ""


class DescriptionState(_Event, frozen=True):
    """The outcome of giving a node the robot's description."""

    process: str
    #: Why the node did not take it; empty if it did.
    why: str = ""


class Alive(_Event, frozen=True):
    """Heartbeat: the guard is watching. Sent once a second."""


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
    """A process of the plan was stopped on purpose, or ended: its silence is no fault."""

    process: str


class Present(_Order, frozen=True):
    """A process of the plan is started or restarted: wait for its edges again."""

    process: str


class Gate(_Order, frozen=True):
    """Watch a process's gate: a topic with a publisher, a service, or lifecycle states.

    An empty gate removes the process's gate.
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
    #: Topics whose publishers the guard reports; other code watches their messages.
    writers: tuple[str, ...] = ()


class ComponentOrder(_Order, frozen=True):
    """Have a container load or unload a component; a ``ComponentState`` answers."""

    process: str
    #: Returned in the answer.
    number: int
    do: Literal["load", "unload"]
    #: Whether an earlier guard may have loaded it already.
    again: bool = False
    #: The parameter file with what to load.
    file: str = ""


class DescriptionOrder(_Order, frozen=True):
    """Give a process's node the robot's description from its parameter file, as it is now.

    A ``DescriptionState`` answers it.
    """

    process: str
    node: str
    file: str


class Reread(_Order, frozen=True):
    """Read the plan again: lines of its edges, or poses that ``static`` sends, have changed."""

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
    """A process entered a state."""

    process: str
    state: StateName
    pid: int | None = None
    #: Why, if there is more to say: "exit code 3; again in 2 s".
    detail: str = ""


class OwnerLive(_Event, frozen=True):
    """All edges of an owner were received from it."""

    owner: str
    node: str
    #: Their names, ``parent → child``.
    edges: tuple[str, ...]
    #: Since the start.
    seconds: float


class ProcessReady(_Event, frozen=True):
    """A process with its own gate is ready."""

    process: str
    #: What opened the gate.
    seen: str
    #: Since the start.
    seconds: float


class AllStarted(_Event, frozen=True):
    """Everything that can be started has been."""

    #: The number of processes that were started.
    started: int
    #: Processes that wait until others are ready, or done.
    waiting: tuple[str, ...]
    #: Since the start.
    seconds: float


class StartRow(ProcessMessage, frozen=True):
    """When a process was started and ready, in seconds after the start."""

    process: str
    #: None: the process is external.
    started: float | None
    ready: float


class AllReady(_Event, frozen=True):
    """Every process is ready and every edge live."""

    rows: tuple[StartRow, ...]
    #: Since the start.
    seconds: float
    #: Processes that the launcher gave up on.
    without: tuple[str, ...] = ()


class Replanned(_Event, frozen=True):
    """The launcher follows a changed plan from now on. Processes are given by name."""

    changed: tuple[str, ...] = ()
    added: tuple[str, ...] = ()
    removed: tuple[str, ...] = ()
    #: Removed fixed edges, which running listeners keep.
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
    """Edges that no node has published yet, by owner."""

    missing: tuple[Missing, ...]


class FilesRestored(_Event, frozen=True):
    """The files of the run were removed, and restored where possible."""

    #: The folder with the restored files; empty if they could not be restored.
    folder: str
    #: Why they could not be restored.
    why: str = ""


class Stopping(_Event, frozen=True):
    """Everything is being stopped, for this reason."""

    reason: str


class Ended(_Event, frozen=True):
    """Everything has stopped. The last notice."""

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
    """Return the notice as one line of JSON, without the newline.

    ``at`` is its time, in seconds since 1970.
    """
    data = {"event": "", "at": round(at, 3)} | msgspec.to_builtins(notice)
    return msgspec.json.encode(data).decode()


def read_notice(line: bytes) -> tuple[Notice, float]:
    """Return the notice that ``notice_line`` wrote, and its time in seconds since 1970.

    Raises:
        UNREADABLE: if the line is not a notice.
    """
    return NOTICES.decode(line), msgspec.json.decode(line, type=_Timed).at


# Requests: what other commands ask of the launcher, and its answers.

Verb = Literal["stop", "start", "restart"]


class StatusRequest(Request, frozen=True):
    """Return the status of the run. Answered by a ``RobotStatus``."""


class EventsRequest(Request, frozen=True):
    """Send all notices so far, then new ones as they come. Answered by these alone."""


class DownRequest(Request, frozen=True):
    """Stop everything. Answered by ``Done``."""


class ProcessRequest(Request, frozen=True):
    """Stop, start or restart one process. Answered by ``Done``."""

    do: Verb
    name: str


class UpdateRequest(Request, frozen=True):
    """Follow another plan. Answered by a ``PlanChange``."""

    #: The file of the plan.
    plan: str
    #: The folder that it was built in.
    base: str


REQUESTS = msgspec.json.Decoder(
    StatusRequest | EventsRequest | DownRequest | ProcessRequest | UpdateRequest
)


class Refusal(ProcessMessage, frozen=True):
    """Nothing was done, for this reason."""

    error: str


class Done(ProcessMessage, frozen=True):
    """The request is accepted and being carried out."""

    ok: Literal[True] = True
    #: What the process waits for before it starts.
    waits: str = ""


class PlanChange(ProcessMessage, frozen=True):
    """The changes that another plan brings.

    tf2 never forgets a fixed edge, so running listeners keep removed ones until they restart.
    """

    #: Processes that differ.
    changed: tuple[str, ...]
    #: New processes.
    added: tuple[str, ...]
    #: Processes that are gone.
    removed: tuple[str, ...]
    #: Removed fixed edges, which running listeners keep.
    held: tuple[str, ...]
    ok: Literal[True] = True
    #: Processes that get a new description while they run.
    described: tuple[str, ...] = ()
    #: Whether the plan differs at all, even if only in line numbers of the robot file.
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
    #: What was found instead.
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
    #: The guard's current findings, worst first.
    findings: tuple[Finding, ...] = ()
