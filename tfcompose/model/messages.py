"""Messages between the processes of a run, as lines of JSON.

The guard sends events to the launcher on a pipe and receives orders on another pipe. Its log is
for people. Other commands send requests to the launcher's control socket. They receive answers, or
the notices that ``up`` prints.
"""

from __future__ import annotations

from typing import Any, Literal

import msgspec

from tfcompose.foundation.findings import Finding  # noqa: TC001 (msgspec needs it at run time)
from tfcompose.model.plan import LifecycleState, ProcessKind  # noqa: TC001

#: Exceptions of the decoder for a line that is not a message.
UNREADABLE = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)


class ProcessMessage(msgspec.Struct, frozen=True):
    """A message between processes, or a part of one."""


class _Event(ProcessMessage, frozen=True, tag_field="event", tag=True):
    """An event of the guard, a notice for the user, or both."""


class _Order(ProcessMessage, frozen=True, tag_field="order", tag=True):
    """An instruction from the launcher to the guard."""


class Request(ProcessMessage, frozen=True, tag_field="request", tag=True):
    """A request from another command to the launcher."""


def line_of(message: ProcessMessage) -> bytes:
    """Return the message as a line of JSON with a newline."""
    return msgspec.json.encode(message) + b"\n"


# Events: from the guard to the launcher.


class Clear(_Event, frozen=True):
    """The observation before the start has ended: no node publishes an edge of the plan."""


class EdgeTaken(_Event, frozen=True):
    """A planned edge was published before the start. The plan must not start, or must stop."""

    found: Finding


class Live(_Event, frozen=True):
    """Edges, identified by child frames, were received from their owner for the first time."""

    owner: str
    children: tuple[str, ...]


class Silent(_Event, frozen=True):
    """Live edges, identified by child frames, stopped arriving or arrive again."""

    children: tuple[str, ...]
    #: Whether the edges arrive again.
    over: bool


class OwnerReady(_Event, frozen=True):
    """All edges of a process are live."""

    process: str


class TreeComplete(_Event, frozen=True):
    """Every edge of the plan is live. This is also a notice."""

    edges: int
    #: Time since the start; 0 from the guard, which does not know it.
    seconds: float = 0.0


class FindingShown(_Event, frozen=True, omit_defaults=True):
    """A fault was found. This is also a notice."""

    found: Finding
    #: The process of the plan that caused it, if stopping the process would help.
    process: str = ""


class CurrentFindings(_Event, frozen=True):
    """All current findings, the worst first. They replace the findings sent before."""

    findings: tuple[Finding, ...]


class RecoveredShown(_Event, frozen=True):
    """A reported fault has ended; the text names it. This is also a notice."""

    text: str
    #: Since the start.
    seconds: float = 0.0


class FilterBypassed(_Event, frozen=True):
    """A process of a strict plan bypasses the filter and must be stopped."""

    found: Finding
    process: str
    #: The process id, which identifies the process if its environment was cleared.
    pid: int = 0


class GateState(_Event, frozen=True):
    """The state of a process's gate, the condition for its readiness."""

    process: str
    #: The observation that opened the gate, or the observed state while it is closed.
    seen: str
    is_open: bool


class Remember(_Event, frozen=True):
    """State for a new guard, in case this guard dies. The launcher stores it by key, unread."""

    changed: dict[str, Any]


LoadState = Literal["loaded", "not loaded", "unloaded"]


class ComponentState(_Event, frozen=True):
    """The state of a component, as the answer to an order.

    It is ``unloaded`` after an order to unload it, or if its container lost it or does not answer.
    It is ``not loaded`` if loading failed.
    """

    process: str
    #: The number of the answered order.
    number: int
    state: LoadState
    #: The reason why it is not loaded; empty if it is loaded.
    why: str = ""


class DescriptionState(_Event, frozen=True):
    """The result of passing the robot description to a node."""

    process: str
    #: The reason why the node did not accept it; empty if it did.
    why: str = ""


class Alive(_Event, frozen=True):
    """A sign of life of the guard, sent once a second."""


GuardEvent = (
    Alive
    | Clear
    | EdgeTaken
    | Live
    | Silent
    | OwnerReady
    | TreeComplete
    | FindingShown
    | CurrentFindings
    | FilterBypassed
    | RecoveredShown
    | GateState
    | Remember
    | ComponentState
    | DescriptionState
)

GUARD_EVENTS = msgspec.json.Decoder(GuardEvent)


# Orders: from the launcher to the guard.


class Absent(_Order, frozen=True):
    """A process of the plan was stopped on purpose or ended, so its silence is not a fault."""

    process: str


class Present(_Order, frozen=True):
    """A process of the plan starts or restarts, so the guard must wait for its edges again."""

    process: str


class Gate(_Order, frozen=True):
    """Watch a process's gate: a topic with a publisher, a service, or lifecycle states.

    A gate without conditions ends the watch for the process.
    """

    process: str
    #: A full name, or empty.
    topic: str = ""
    #: A full name, or empty.
    service: str = ""
    #: Lifecycle states to wait for, by node.
    nodes: dict[str, LifecycleState] = {}
    #: Whether the guard brings the nodes to these states.
    drive: bool = False
    #: Topics whose publishers the guard reports. Other code watches their messages.
    writers: tuple[str, ...] = ()


class ComponentOrder(_Order, frozen=True):
    """Have a container load or unload a component. The answer is a ``ComponentState``."""

    process: str
    #: The number to return in the answer.
    number: int
    do: Literal["load", "unload"]
    #: Whether a previous guard may already have loaded it.
    again: bool = False
    #: The file with the request to load.
    file: str = ""


class DescriptionOrder(_Order, frozen=True):
    """Pass the robot description in a process's parameter file to its node.

    The answer is a ``DescriptionState``.
    """

    process: str
    node: str
    file: str


class Reread(_Order, frozen=True):
    """Read the plan again: lines of edges, or poses that ``static`` publishes, have changed."""

    file: str


GuardOrder = Absent | Present | Gate | ComponentOrder | DescriptionOrder | Reread

GUARD_ORDERS = msgspec.json.Decoder(GuardOrder)


# Notices: from the launcher to a person, and to clients of its control socket.

#: supervisord's names of states, and a state for external processes. Users and programs read them.
StateName = Literal[
    "stopped", "starting", "running", "backoff", "stopping", "exited", "fatal", "expected"
]
Stream = Literal["stdout", "stderr"]


class LogLine(_Event, frozen=True):
    """A line that a process wrote, without its newline. Lines longer than 64 KiB are split."""

    process: str
    stream: Stream
    text: str


class ProcessState(_Event, frozen=True):
    """A process entered a state."""

    process: str
    state: StateName
    pid: int | None = None
    #: Details about the state, such as "exit code 3; again in 2 s".
    detail: str = ""


class OwnerLive(_Event, frozen=True):
    """All edges of an owner have arrived."""

    owner: str
    node: str
    #: Names of the edges, ``parent → child``.
    edges: tuple[str, ...]
    #: Since the start.
    seconds: float


class ProcessReady(_Event, frozen=True):
    """A process with its own gate is ready."""

    process: str
    #: The observation that opened the gate.
    seen: str
    #: Since the start.
    seconds: float


class AllStarted(_Event, frozen=True):
    """All processes that can start have started."""

    #: Number of started processes.
    started: int
    #: Processes that wait until other processes are ready or done.
    waiting: tuple[str, ...]
    #: Since the start.
    seconds: float


class StartRow(ProcessMessage, frozen=True):
    """The times when a process started and became ready, in seconds after the start."""

    process: str
    #: None for an external process.
    started: float | None
    ready: float


class AllReady(_Event, frozen=True):
    """Every process is ready, and every edge is live."""

    rows: tuple[StartRow, ...]
    #: Since the start.
    seconds: float
    #: Processes that the launcher gave up on.
    without: tuple[str, ...] = ()


class Replanned(_Event, frozen=True):
    """The launcher follows a changed plan from now on. Processes are listed by name."""

    changed: tuple[str, ...] = ()
    added: tuple[str, ...] = ()
    removed: tuple[str, ...] = ()
    #: Removed fixed edges, which running listeners keep.
    held: tuple[str, ...] = ()
    #: Processes that get a new description while they run.
    described: tuple[str, ...] = ()
    #: Fixed edges whose publisher sends another pose, without a restart.
    moved: tuple[str, ...] = ()


class Missing(ProcessMessage, frozen=True):
    """The unpublished edges of an owner, in the order of the plan."""

    owner: str
    node: str
    edges: tuple[str, ...]
    #: The number of edges that it owns.
    owned: int


class Waiting(_Event, frozen=True):
    """Edges that no node has published yet, by owner."""

    missing: tuple[Missing, ...]


class FilesRestored(_Event, frozen=True):
    """Files of the run were removed, and restored if possible."""

    #: The folder with the restored files; empty if they could not be restored.
    folder: str
    #: The reason why they could not be restored.
    why: str = ""


class Stopping(_Event, frozen=True):
    """All processes are being stopped, for this reason."""

    reason: str


class Ended(_Event, frozen=True):
    """All processes have stopped. This is the last notice."""

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


def notice_line(notice: Notice, time_s: float) -> str:
    """Return the notice as a line of JSON without the newline.

    The key ``at`` holds ``time_s``, the time in seconds since 1970.
    """
    data = {"event": "", "at": round(time_s, 3)} | msgspec.to_builtins(notice)
    return msgspec.json.encode(data).decode()


def read_notice(line: bytes) -> tuple[Notice, float]:
    """Return the notice that ``notice_line`` wrote, and its time in seconds since 1970.

    Raises:
        UNREADABLE: if the line is not a notice.
    """
    return NOTICES.decode(line), msgspec.json.decode(line, type=_Timed).at


# Requests of other commands to the launcher, and its answers.

Verb = Literal["stop", "start", "restart"]


class StatusRequest(Request, frozen=True):
    """Return the status of the run. The answer is a ``RobotStatus``."""


class EventsRequest(Request, frozen=True):
    """Send all notices so far, then each new notice. There is no other answer."""


class DownRequest(Request, frozen=True):
    """Stop all processes. The answer is ``Done``."""


class ProcessRequest(Request, frozen=True):
    """Stop, start or restart a process. The answer is ``Done``."""

    do: Verb
    name: str


class UpdateRequest(Request, frozen=True):
    """Follow another plan. The answer is a ``PlanChange``."""

    #: The path of the plan.
    plan: str
    #: The folder in which the plan was built.
    base: str


class AdjustRequest(Request, frozen=True):
    """Follow a plan that differs in poses of fixed edges. Answered by a ``PlanChange``.

    Refused if it would restart a process, or if ``replaces`` does not run any more.
    """

    #: The file of the plan.
    plan: str
    #: The file of the plan that it was made from.
    replaces: str


REQUESTS = msgspec.json.Decoder(
    StatusRequest | EventsRequest | DownRequest | ProcessRequest | UpdateRequest | AdjustRequest
)


class Refusal(ProcessMessage, frozen=True):
    """The request was rejected for this reason, and nothing was done."""

    error: str


class Done(ProcessMessage, frozen=True):
    """The request is accepted and being carried out."""

    ok: Literal[True] = True
    #: The conditions for which the process waits before its start.
    waits: str = ""


class PlanChange(ProcessMessage, frozen=True):
    """The differences between two plans.

    tf2 never forgets a fixed edge, so running listeners keep removed edges until they restart.
    """

    #: Processes that differ.
    changed: tuple[str, ...]
    #: New processes.
    added: tuple[str, ...]
    #: Removed processes.
    removed: tuple[str, ...]
    #: Removed fixed edges, which running listeners keep.
    held: tuple[str, ...]
    ok: Literal[True] = True
    #: Processes that get a new description while they run.
    described: tuple[str, ...] = ()
    #: Whether the plans differ, even if only in line numbers of the robot file.
    differs: bool = False
    #: Fixed edges whose publisher sends another pose, without a restart.
    moved: tuple[str, ...] = ()


class ProcessStatus(ProcessMessage, frozen=True):
    """The status of a process."""

    name: str
    kind: ProcessKind
    host: str | None
    state: StateName
    #: The reason for its state.
    detail: str
    required: bool | None
    failed: bool
    ready: bool
    #: The conditions for which the process waits.
    waits: str
    #: The observed state, while it waits.
    seen: str
    pid: int | None
    #: In seconds.
    uptime: float | None
    restarts: int
    #: The number of edges that it owns.
    edges: int
    #: The number of its edges that the guard receives.
    live: int
    nodes: tuple[str, ...]


class Adjustment(ProcessMessage, frozen=True):
    """An edge whose pose was adjusted on the running robot, and how far."""

    #: Its name, ``parent → child``.
    edge: str
    #: The distance from the built position, in metres.
    xyz_m: float
    #: The angle from the built orientation, in radians.
    rot_rad: float


class RobotStatus(ProcessMessage, frozen=True):
    """The status of a run."""

    robot: str
    host: str | None
    launcher: int
    #: Digest of the robot file from which the plan was built.
    plan: str
    #: In seconds.
    uptime: float
    complete: bool
    ready: bool
    stopping: bool
    missing: tuple[str, ...]
    silent: tuple[str, ...]
    processes: tuple[ProcessStatus, ...]
    #: The guard's current findings, the worst first.
    findings: tuple[Finding, ...] = ()
    #: Overlays that are merged over the robot file.
    overlays: tuple[str, ...] = ()
    adjusted: tuple[Adjustment, ...] = ()
