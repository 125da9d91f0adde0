"""State of the process machine, and one transition of it with its actions.

Times are seconds of one monotonic clock. What is known are values only: a step replaces them.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

from tfcompose.launcher.events import Action, Finish, Notify, Order, Start
from tfcompose.model.messages import (
    ComponentOrder,
    Ended,
    FindingShown,
    Notice,
    Present,
    ProcessState,
    StateName,
    Stopping,
)
from tfcompose.model.variables import SETTLE

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Finding
    from tfcompose.model.plan import Plan, PlanEdge, PlanProcess


@dataclass(frozen=True, slots=True)
class Times:
    """How long the launcher waits, in seconds."""

    #: For the guard's report that no planned edge is published yet, besides its observation.
    clear_s: float = 20.0
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
    """for a process to be ready, where it has a readiness check without a timeout"""
    guard_silent_s: float = 10.0
    """without a sign of life of the guard's, until it is overdue"""
    guard_overdue_s: float = 5.0
    """further, until it is taken to hang"""
    same_signal_s: float = 0.2
    """two signals closer than this are one: ``timeout`` and closing terminals send theirs twice"""


#: The exit code when nobody reads the output any more: what a shell says of a program that SIGPIPE
#: ended.
UNREAD = 141


@dataclass(frozen=True, slots=True)
class Tracked:
    """One process. ``since`` is when it came into its state, or when it was sent its last signal.

    ``order`` counts the starts of all processes, 0 for one that was never started; ``failures``
    the short runs in a row; ``restarts`` all starts but the first; ``level`` how often it was
    ordered to stop, each time more firmly. ``leaving`` says what follows once it has stopped:
    "stop" and it stays so, "again" and it is started, "drop" and it is forgotten. ``observed`` is
    what its gate found last, ``late`` whether that was reported. ``detail`` says why it is in its
    state. ``failed`` is what was reported when the run went on without it: the finding and the end
    of its log. ``description`` is the parameter file with a description that its node has not
    taken.
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
    observed: str = ""
    late: bool = False
    detail: str = ""
    failed: tuple[str, ...] = ()
    description: str = ""

    @property
    def alive(self) -> bool:
        """Whether there is an operating system's process, or will be in a moment."""
        return self.state in ("starting", "running", "stopping")

    @property
    def was_started(self) -> bool:
        """Whether it has run, or runs."""
        return self.order > 0 and self.state != "starting"


@dataclass(frozen=True, slots=True)
class StopReason:
    """Why everything stops, and the exit code. ``signals`` counts those that requested it."""

    cause: Literal["signal", "time", "taken", "failure"]
    exit_code: int
    signals: int = 0
    signalled: float = 0.0


@dataclass(frozen=True, slots=True)
class State:
    """Everything that is known about a running plan.

    ``clear`` is when the guard reported that no edge of the plan is published yet. ``live`` holds
    the children of the edges that were received, ``silent`` those that come no more; ``findings``
    are what the guard sees wrong now. ``reported`` are the codes of the errors that were shown,
    ``reminded_of`` the missing edges that were named last. ``replanned`` is when another plan
    came, if one did. ``memory`` is what the guard wants the next one to know; ``unwatched`` is
    since when it is dead, if it is; ``guard_alive`` when it last reported that it works, and
    ``guard_overdue`` since when that is missed.
    """

    plan: Plan
    times: Times
    tracked: dict[str, Tracked]
    guard: str | None
    begun: float | None = None
    replanned: float = 0.0
    clear: float | None = None
    live: frozenset[str] = frozenset()
    silent: frozenset[str] = frozenset()
    findings: tuple[Finding, ...] = ()
    complete: bool = False
    reported: frozenset[str] = frozenset()
    reminded_of: frozenset[str] = frozenset()
    reminded: float | None = None
    all_started: bool = False
    all_ready: bool = False
    stop: StopReason | None = None
    because: tuple[str, ...] = ()
    finished: bool = False
    memory: dict[str, Any] = field(default_factory=dict)
    unwatched: float | None = None
    guard_alive: float | None = None
    guard_overdue: float | None = None

    @property
    def missing(self) -> tuple[PlanEdge, ...]:
        """The edges that were not received yet; none where there is no guard."""
        return (
            ()
            if self.guard is None
            else tuple(edge for edge in self.plan.edges if edge.child not in self.live)
        )

    @property
    def awaited(self) -> tuple[PlanEdge, ...]:
        """The missing edges that may still come: their owners have not failed."""
        return tuple(edge for edge in self.missing if not self.tracked[edge.owner].failed)

    def components_of(self, container: str) -> tuple[Tracked, ...]:
        """Return the components of a container, in the order of the plan."""
        return tuple(
            tracked
            for tracked in self.tracked.values()
            if tracked.process.component and tracked.process.component.container == container
        )

    @property
    def given_up(self) -> tuple[str, ...]:
        """The processes that have failed, and without which the run goes on."""
        return tuple(name for name, tracked in self.tracked.items() if tracked.failed)


def initial(plan: Plan, times: Times | None = None) -> State:
    """Return the state before ``Begin``: nothing runs."""
    processes = plan.processes
    guards = [process.name for process in processes if process.kind == "guard"]
    tracked = {}
    for process in processes:
        state: StateName = "expected" if process.kind == "external" else "stopped"
        tracked[process.name] = Tracked(process, state)
    times = times or Times()
    settle_s = sum(float(tracked[name].process.env.get(SETTLE, 0)) for name in guards)
    times = replace(times, clear_s=times.clear_s + settle_s)
    return State(plan, times, tracked, guards[0] if guards else None, complete=not plan.edges)


def by_owner(edges: tuple[PlanEdge, ...]) -> tuple[tuple[str, tuple[PlanEdge, ...]], ...]:
    """Return each owner with its edges, in the order of the edges."""
    owners = dict.fromkeys(edge.owner for edge in edges)
    return tuple((owner, tuple(edge for edge in edges if edge.owner == owner)) for owner in owners)


class Transition:
    """The step's state and actions, for one step only; its state is replaced, never changed."""

    def __init__(self, state: State, now: float) -> None:
        self.state = state
        self.now = now
        self.actions: list[Action] = []

    @property
    def since_begin(self) -> float:
        """Seconds since the launcher began."""
        return self.now - (self.state.begun or 0.0)

    def update(self, **changes: object) -> None:
        """Replace what is known."""
        self.state = replace(self.state, **changes)  # type: ignore[arg-type]

    def track(self, name: str, tracked: Tracked) -> None:
        """Replace what is known of one process."""
        self.update(tracked=self.state.tracked | {name: tracked})

    def notify(self, notice: Notice) -> None:
        """Tell the person."""
        self.actions.append(Notify(notice))

    def enter(
        self, name: str, state: StateName, detail: str = "", **changes: float | None
    ) -> None:
        """Put the process into the state, since now, and notify."""
        pid = changes.pop("pid", None)
        before = self.state.tracked[name]
        entered = replace(before, state=state, since=self.now, detail=detail, failed=())
        tracked = replace(entered, pid=pid, **changes)  # type: ignore[arg-type]
        self.track(name, tracked)
        self.notify(ProcessState(name, state, tracked.pid, detail))

    def start(self, name: str) -> None:
        """Have the process started."""
        order = 1 + max(tracked.order for tracked in self.state.tracked.values())
        before = self.state.tracked[name]
        self.track(name, replace(before, description=""))  # it reads its file
        again = before.order > 0
        component = before.process.component
        began = self.now if component else before.began
        self.enter(
            name, "starting", order=order, level=0, restarts=before.restarts + again, began=began
        )
        if again and before.process.owns and self.state.guard not in (None, name):
            self.actions.append(Order(Present(name)))
        if component:
            self.actions.append(Order(ComponentOrder(name, order, "load")))
        else:
            self.actions.append(Start(name))

    def report(self, found: Finding) -> None:
        """Show the finding, and remember an error."""
        if found.severity == "error":
            self.update(reported=self.state.reported | {found.code})
        self.notify(FindingShown(found))

    def fail_process(self, name: str, found: Finding) -> None:
        """Report that the process failed for good, and stop everything if it is required."""
        tracked = self.state.tracked[name]
        if tracked.process.required is not False:
            self.fail(found)
        elif self.state.stop is None:
            advice = (
                f"the rest goes on without it: required is false; tfcompose start {name} tries"
                " again"
            )
            self.report(replace(found, severity="warning", help=advice))
            self.track(
                name,
                replace(tracked, failed=(found.message, *(note.message for note in found.notes))),
            )

    def fail(self, found: Finding) -> None:
        """Report the finding and stop everything.

        Once that is under way, further failures follow from it.
        """
        if self.state.stop is None:
            self.report(found)
            self.update(because=(found.message, *(note.message for note in found.notes)))
            self.stop(StopReason("failure", 1), found.label)

    def stop(self, stop: StopReason, reason: str) -> None:
        """Begin to stop everything, unless that is under way."""
        if self.state.stop:
            return
        self.update(stop=stop)
        self.notify(Stopping(reason))
        for name, tracked in self.state.tracked.items():
            if tracked.state == "backoff":
                self.enter(name, "stopped")

    def finish(self, exit_code: int) -> None:
        """End: nothing runs any more."""
        self.update(finished=True)
        failed = [tracked for tracked in self.state.tracked.values() if tracked.failed]
        failed.sort(
            key=lambda tracked: (tracked.order == 0, tracked.since)
        )  # what was not started waited for another
        self.notify(Ended(exit_code, self.state.because or (failed[0].failed if failed else ())))
        self.actions.append(Finish(exit_code))
