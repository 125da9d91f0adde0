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
    """Edges, named by their children, that were live come no more.

    Or, if that is ``over``, come again.
    """

    children: tuple[str, ...]
    over: bool


class OwnerReady(_Event, frozen=True):
    """All edges of a process are live."""

    process: str


class TreeComplete(_Event, frozen=True):
    """Every edge of the plan is live: a notice too.

    ``seconds`` is how long after the start; the guard, which does not know it, leaves it at 0.
    """

    edges: int
    seconds: float = 0.0


class FindingShown(_Event, frozen=True, omit_defaults=True):
    """Something is wrong: a notice too, as it goes on to people.

    ``process`` is the plan's process that did it, where it can be stopped for it.
    """

    found: Finding
    process: str = ""


class CurrentFindings(_Event, frozen=True):
    """All that is wrong now, worst first; what was sent before does not count any more."""

    findings: tuple[Finding, ...]


class RecoveredShown(_Event, frozen=True):
    """A case that was reported is over; the text says which. A notice too.

    ``seconds`` is how long after the start, as in ``TreeComplete``.
    """

    text: str
    seconds: float = 0.0


class Unfenced(_Event, frozen=True):
    """A process of a strict plan sends past the fence.

    It must be stopped, whatever else is only reported.

    Where its environment was cleared, ``pid`` says which process it is instead of ``process``.
    """

    found: Finding
    process: str
    pid: int = 0


class GateState(_Event, frozen=True):
    """A process's gate, looked at: whether what it waits for is there.

    ``seen`` says what is there, or what is there instead.
    """

    process: str
    seen: str
    is_open: bool


class Remember(_Event, frozen=True):
    """What the next guard must know, should this one die.

    The launcher keeps it by key and does not look into it.
    """

    changed: dict[str, Any]


LoadState = Literal["loaded", "not loaded", "unloaded"]


class ComponentState(_Event, frozen=True):
    """What has become of a component; ``number`` is that of the order that is answered.

    It is unloaded, too, where its container has it no more or does not answer. ``why`` says why it
    is not loaded.
    """

    process: str
    number: int
    state: LoadState
    why: str = ""


class DescriptionState(_Event, frozen=True):
    """A node took the robot's description; ``why`` says why it did not."""

    process: str
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
    """Say when this is there: a topic with a publisher, a service, or nodes in lifecycle states.

    ``topic`` and ``service`` are full names, or empty. ``nodes`` holds the lifecycle states that
    are waited for; ``drive`` says that the guard brings them there. ``writers`` are topics whose
    publishers are named while others look at what comes there. A gate at which nothing is to be
    seen replaces the process's, and is not looked at.
    """

    process: str
    topic: str = ""
    service: str = ""
    nodes: dict[str, LifecycleState] = {}
    drive: bool = False
    writers: tuple[str, ...] = ()


class ComponentOrder(_Order, frozen=True):
    """Have a container load or unload a component, as the file says.

    A ``ComponentState`` with the order's ``number`` answers it. ``again`` says that a guard before
    this one may have had it loaded.
    """

    process: str
    number: int
    do: Literal["load", "unload"]
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
    """A changed plan is followed from now on.

    The names of processes, and the frames that listeners will still hold. ``described`` are given
    a new description while they run.
    """

    changed: tuple[str, ...] = ()
    added: tuple[str, ...] = ()
    removed: tuple[str, ...] = ()
    held: tuple[str, ...] = ()
    described: tuple[str, ...] = ()


class Missing(ProcessMessage, frozen=True):
    """The unpublished edges of one owner, in the plan's order, of ``owned`` ones."""

    owner: str
    node: str
    edges: tuple[str, ...]
    owned: int


class Waiting(_Event, frozen=True):
    """Edges that nobody has published yet, by owner."""

    missing: tuple[Missing, ...]


class FilesRestored(_Event, frozen=True):
    """The files of the run were removed.

    They are in ``folder`` again, or nowhere, for the reason ``why``.
    """

    folder: str
    why: str = ""


class Stopping(_Event, frozen=True):
    """Everything is being stopped, for this reason."""

    reason: str


class Ended(_Event, frozen=True):
    """Nothing runs any more: the last notice.

    ``because`` is the failure that came first, and what was said last.
    """

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
    """It is being done; ``waits`` says what a process that is started waits for first."""

    ok: Literal[True] = True
    waits: str = ""


class PlanChange(ProcessMessage, frozen=True):
    """What another plan changes.

    The processes that are different, new, and no more, and the fixed edges that vanish.
    ``described`` are given a new description while they run. ``differs`` says that the plan is
    another one at all, if only in its places in the robot file.

    tf2 never forgets a fixed edge, so listeners hold those that vanish until they start anew.
    """

    changed: tuple[str, ...]
    added: tuple[str, ...]
    removed: tuple[str, ...]
    held: tuple[str, ...]
    ok: Literal[True] = True
    described: tuple[str, ...] = ()
    differs: bool = False


class ProcessStatus(ProcessMessage, frozen=True):
    """One process.

    ``detail`` says why it is in its state, ``waits`` what it is without, ``seen`` what is there
    instead. ``uptime`` is in seconds; ``edges`` counts those that it owns, ``live`` those of them
    that are received.
    """

    name: str
    kind: ProcessKind
    host: str | None
    state: StateName
    detail: str
    required: bool | None
    failed: bool
    ready: bool
    waits: str
    seen: str
    pid: int | None
    uptime: float | None
    restarts: int
    edges: int
    live: int
    nodes: tuple[str, ...]


class RobotStatus(ProcessMessage, frozen=True):
    """All that is known of a run.

    ``plan`` is the digest of what it was made from, ``uptime`` is in seconds, ``findings`` are
    what the guard sees wrong now, worst first.
    """

    robot: str
    host: str | None
    launcher: int
    plan: str
    uptime: float
    complete: bool
    ready: bool
    stopping: bool
    missing: tuple[str, ...]
    silent: tuple[str, ...]
    processes: tuple[ProcessStatus, ...]
    findings: tuple[Finding, ...] = ()
