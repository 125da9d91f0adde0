"""State of the process machine, and one transition of it with its actions.

Times are seconds of one monotonic clock. All values are immutable: a step replaces them.
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
    """Waiting times of the launcher, in seconds."""

    #: For the guard's report that no planned edge is published yet, in addition to the settle
    #: time.
    clear_s: float = 20.0
    #: Between SIGINT and SIGTERM.
    interrupt_s: float = 5.0
    #: Between SIGTERM and SIGKILL.
    terminate_s: float = 5.0
    #: Until missing edges are reported, and between two such notices.
    waiting_s: float = 5.0
    #: Before the first restart; doubled with each further one.
    backoff_s: float = 1.0
    #: The longest wait before a restart.
    backoff_limit_s: float = 30.0
    #: After a run of this length, earlier failures do not count.
    steady_s: float = 10.0
    #: For a process to become ready, if its readiness check has no timeout.
    ready_s: float = 30.0
    #: Without a sign of life of the guard, until it is overdue.
    guard_silent_s: float = 10.0
    #: From then until the guard counts as hung.
    guard_overdue_s: float = 5.0
    #: Two signals closer than this count as one: ``timeout`` and closing terminals send them
    #: twice.
    same_signal_s: float = 0.2


#: The exit code when the reader of the output has gone, as a shell reports SIGPIPE.
UNREAD = 141


@dataclass(frozen=True, slots=True)
class Tracked:
    """One process of the plan."""

    process: PlanProcess
    state: StateName
    pid: int | None = None
    #: When it entered its state, or when it was sent its last signal.
    since: float = 0.0
    #: Its place among the starts of all processes; 0: never started.
    order: int = 0
    #: Short runs in a row.
    failures: int = 0
    #: Number of stop orders sent, each stronger than the one before.
    level: int = 0
    ready: bool = False
    wanted: bool = True
    #: After its stop: "stop", it stays stopped; "again", it starts again; "drop", it is forgotten.
    leaving: Literal["", "stop", "again", "drop"] = ""
    #: Starts after the first one.
    restarts: int = 0
    began: float = 0.0
    ready_since: float | None = None
    #: The last result of its readiness check.
    observed: str = ""
    #: True: a late readiness was reported.
    late: bool = False
    #: The reason for its state.
    detail: str = ""
    #: The reported finding and the end of the log, if the run goes on without it.
    failed: tuple[str, ...] = ()
    #: The parameter file with a description that its node has not read yet.
    description: str = ""

    @property
    def alive(self) -> bool:
        """Whether the process exists in the operating system, or is about to."""
        return self.state in ("starting", "running", "stopping")

    @property
    def was_started(self) -> bool:
        """Whether it runs or has run."""
        return self.order > 0 and self.state != "starting"


@dataclass(frozen=True, slots=True)
class StopReason:
    """The reason for stopping everything."""

    cause: Literal["signal", "time", "taken", "failure"]
    exit_code: int
    #: Number of signals that requested it.
    signals: int = 0
    signalled: float = 0.0


@dataclass(frozen=True, slots=True)
class State:
    """State of a running plan."""

    plan: Plan
    times: Times
    tracked: dict[str, Tracked]
    guard: str | None
    begun: float | None = None
    #: When another plan arrived; 0: never.
    replanned: float = 0.0
    #: When the guard reported that no edge of the plan is published yet.
    clear: float | None = None
    #: Children of the edges that were received.
    live: frozenset[str] = frozenset()
    #: Children of the edges that are no longer received.
    silent: frozenset[str] = frozenset()
    #: Current findings of the guard.
    findings: tuple[Finding, ...] = ()
    complete: bool = False
    #: Codes of the errors that were shown.
    reported: frozenset[str] = frozenset()
    #: Missing edges in the last notice.
    reminded_of: frozenset[str] = frozenset()
    reminded: float | None = None
    all_started: bool = False
    all_ready: bool = False
    stop: StopReason | None = None
    because: tuple[str, ...] = ()
    finished: bool = False
    #: State handed to the next guard.
    memory: dict[str, Any] = field(default_factory=dict)
    #: Since when the guard is dead.
    unwatched: float | None = None
    #: The guard's last sign of life.
    guard_alive: float | None = None
    #: Since when a sign of life is overdue.
    guard_overdue: float | None = None

    @property
    def missing(self) -> tuple[PlanEdge, ...]:
        """The edges not received yet; empty without a guard."""
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
        """The failed processes without which the run goes on."""
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
    """State and actions of one step."""

    def __init__(self, state: State, now: float) -> None:
        self.state = state
        self.now = now
        self.actions: list[Action] = []

    @property
    def since_begin(self) -> float:
        """Seconds since the launcher began."""
        return self.now - (self.state.begun or 0.0)

    def update(self, **changes: object) -> None:
        """Replace fields of the state."""
        self.state = replace(self.state, **changes)  # type: ignore[arg-type]

    def track(self, name: str, tracked: Tracked) -> None:
        """Replace the state of one process."""
        self.update(tracked=self.state.tracked | {name: tracked})

    def notify(self, notice: Notice) -> None:
        """Send a notice to the user."""
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
        """Order the start of a process."""
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

    def report(self, finding: Finding) -> None:
        """Show the finding, and remember an error."""
        if finding.severity == "error":
            self.update(reported=self.state.reported | {finding.code})
        self.notify(FindingShown(finding))

    def fail_process(self, name: str, finding: Finding) -> None:
        """Report that the process failed for good, and stop everything if it is required."""
        tracked = self.state.tracked[name]
        if tracked.process.required is not False:
            self.fail(finding)
        elif self.state.stop is None:
            advice = (
                f"the robot continues without it (required: false); tfcompose start {name} tries"
                " again"
            )
            self.report(replace(finding, severity="warning", help=advice))
            self.track(
                name,
                replace(
                    tracked, failed=(finding.message, *(note.message for note in finding.notes))
                ),
            )

    def fail(self, finding: Finding) -> None:
        """Report the finding and stop everything.

        Does nothing if everything stops already: further failures are consequences.
        """
        if self.state.stop is None:
            self.report(finding)
            self.update(because=(finding.message, *(note.message for note in finding.notes)))
            self.stop(StopReason("failure", 1), finding.label)

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
