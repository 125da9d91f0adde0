"""State of the process machine, and a transition of it with the resulting actions.

Times are seconds of a monotonic clock. All values are immutable; a step replaces them.
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
    """Time limits and delays of the launcher, in seconds."""

    #: Limit for the guard's report that no edge of the plan is published yet, in addition to the
    #: settle time.
    clear_s: float = 20.0
    #: Delay between SIGINT and SIGTERM.
    interrupt_s: float = 5.0
    #: Delay between SIGTERM and SIGKILL.
    terminate_s: float = 5.0
    #: Delay until missing edges are reported, and between two such reports.
    waiting_s: float = 5.0
    #: Delay before the first restart. Each further restart doubles it.
    backoff_s: float = 1.0
    #: Maximum delay before a restart.
    backoff_limit_s: float = 30.0
    #: After a process has run for this time, its earlier failures do not count.
    steady_s: float = 10.0
    #: Limit for a process to become ready, if its readiness check has no timeout.
    ready_s: float = 30.0
    #: Time without a sign of life from the guard until the guard is overdue.
    guard_silent_s: float = 10.0
    #: Further time until an overdue guard counts as hung.
    guard_overdue_s: float = 5.0
    #: Signals within this time count as a single signal, because ``timeout`` and closing terminals
    #: send signals twice.
    same_signal_s: float = 0.2


#: Exit code if the reader of the output has gone, like a shell's exit code for SIGPIPE.
UNREAD = 141


@dataclass(frozen=True, slots=True)
class Tracked:
    """The state of a process of the plan."""

    process: PlanProcess
    state: StateName
    pid: int | None = None
    #: Time when it entered its state or received its last signal.
    since: float = 0.0
    #: Number of its last start among the starts of all processes; 0 if it has never started.
    order: int = 0
    #: Number of consecutive short runs.
    failures: int = 0
    #: Number of stop signals sent to it. Each signal is stronger than the previous one.
    level: int = 0
    ready: bool = False
    should_run: bool = True
    #: Action after its stop: "stop" keeps it stopped, "again" starts it again, "drop" forgets it.
    leaving: Literal["", "stop", "again", "drop"] = ""
    #: Number of starts after the first start.
    restarts: int = 0
    began: float = 0.0
    ready_since: float | None = None
    #: The last result of its readiness check.
    observed: str = ""
    #: Whether the launcher has reported that it is late.
    late: bool = False
    #: The reason for its state.
    detail: str = ""
    #: The reported finding and the last log lines, if the process failed and the run continues.
    failed: tuple[str, ...] = ()
    #: The parameter file with a new robot description that its node has not read yet.
    description: str = ""

    @property
    def alive(self) -> bool:
        """Whether the process exists in the operating system, or will exist in a moment."""
        return self.state in ("starting", "running", "stopping")

    @property
    def was_started(self) -> bool:
        """Whether the process runs or has run."""
        return self.order > 0 and self.state != "starting"


@dataclass(frozen=True, slots=True)
class StopReason:
    """The reason for stopping all processes."""

    cause: Literal["signal", "time", "taken", "failure"]
    exit_code: int
    #: Number of received signals that request the stop.
    signals: int = 0
    signalled: float = 0.0


@dataclass(frozen=True, slots=True)
class State:
    """The state of a running plan."""

    plan: Plan
    times: Times
    tracked: dict[str, Tracked]
    guard: str | None
    begun: float | None = None
    #: Time when another plan arrived; 0 if none has.
    replanned: float = 0.0
    #: Time when the guard reported that no edge of the plan is published yet.
    clear: float | None = None
    #: Child frames of received edges.
    live: frozenset[str] = frozenset()
    #: Child frames of edges that are no longer received.
    silent: frozenset[str] = frozenset()
    #: Current findings of the guard.
    findings: tuple[Finding, ...] = ()
    complete: bool = False
    #: Codes of the errors shown so far.
    reported: frozenset[str] = frozenset()
    #: Missing edges in the last notice.
    reminded_of: frozenset[str] = frozenset()
    reminded: float | None = None
    all_started: bool = False
    all_ready: bool = False
    stop: StopReason | None = None
    because: tuple[str, ...] = ()
    finished: bool = False
    #: State of the guard, for a restarted guard.
    memory: dict[str, Any] = field(default_factory=dict)
    #: Time when the guard died.
    unwatched: float | None = None
    #: Time of the guard's last sign of life.
    guard_alive: float | None = None
    #: Time since when a sign of life is overdue.
    guard_overdue: float | None = None

    @property
    def missing(self) -> tuple[PlanEdge, ...]:
        """Edges that have not been received yet; empty without a guard."""
        return (
            ()
            if self.guard is None
            else tuple(edge for edge in self.plan.edges if edge.child not in self.live)
        )

    @property
    def awaited(self) -> tuple[PlanEdge, ...]:
        """Missing edges that may still come, because their owners have not failed."""
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
        """Failed processes without which the run continues."""
        return tuple(name for name, tracked in self.tracked.items() if tracked.failed)


def initial(plan: Plan, times: Times | None = None) -> State:
    """Return the state before ``Begin``, in which no process runs."""
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
    """The state and the actions of a step."""

    def __init__(self, state: State, now: float) -> None:
        self.state = state
        self.now = now
        self.actions: list[Action] = []

    @property
    def since_begin(self) -> float:
        """Seconds since the launcher started processes."""
        return self.now - (self.state.begun or 0.0)

    def update(self, **changes: object) -> None:
        """Replace fields of the state."""
        self.state = replace(self.state, **changes)  # type: ignore[arg-type]

    def track(self, name: str, tracked: Tracked) -> None:
        """Replace the state of a process."""
        self.update(tracked=self.state.tracked | {name: tracked})

    def notify(self, notice: Notice) -> None:
        """Send a notice to the user."""
        self.actions.append(Notify(notice))

    def enter(
        self, name: str, state: StateName, detail: str = "", **changes: float | None
    ) -> None:
        """Set the process's state from now on, and send a notice."""
        pid = changes.pop("pid", None)
        before = self.state.tracked[name]
        entered = replace(before, state=state, since=self.now, detail=detail, failed=())
        tracked = replace(entered, pid=pid, **changes)  # type: ignore[arg-type]
        self.track(name, tracked)
        self.notify(ProcessState(name, state, tracked.pid, detail))

    def start(self, name: str) -> None:
        """Start a process."""
        order = 1 + max(tracked.order for tracked in self.state.tracked.values())
        before = self.state.tracked[name]
        self.track(name, replace(before, description=""))  # the process reads the new file
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
        """Show the finding, and record the code of an error."""
        if finding.severity == "error":
            self.update(reported=self.state.reported | {finding.code})
        self.notify(FindingShown(finding))

    def fail_process(self, name: str, finding: Finding) -> None:
        """Report that the process has finally failed. If it is required, stop all processes."""
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
        """Report the finding and stop all processes.

        Do nothing if they are already stopping, because further failures are consequences.
        """
        if self.state.stop is None:
            self.report(finding)
            self.update(because=(finding.message, *(note.message for note in finding.notes)))
            self.stop(StopReason("failure", 1), finding.label)

    def stop(self, stop: StopReason, reason: str) -> None:
        """Begin to stop all processes, unless they are already stopping."""
        if self.state.stop:
            return
        self.update(stop=stop)
        self.notify(Stopping(reason))
        for name, tracked in self.state.tracked.items():
            if tracked.state == "backoff":
                self.enter(name, "stopped")

    def finish(self, exit_code: int) -> None:
        """End the run: no process runs any more."""
        self.update(finished=True)
        failed = [tracked for tracked in self.state.tracked.values() if tracked.failed]
        failed.sort(
            key=lambda tracked: (tracked.order == 0, tracked.since)
        )  # unstarted processes last: they waited for others
        self.notify(Ended(exit_code, self.state.because or (failed[0].failed if failed else ())))
        self.actions.append(Finish(exit_code))
