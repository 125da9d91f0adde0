"""Histories that are replayed to the process machine, with a clock that is set by hand."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

from tfcompose.foundation.geometry import Pose
from tfcompose.launcher.events import (
    Action,
    Begin,
    Event,
    Finish,
    Follow,
    Kill,
    Notify,
    NotifyLate,
    Order,
    Start,
    Started,
    Tick,
)
from tfcompose.launcher.machine import step, wake_time
from tfcompose.launcher.state import State, initial
from tfcompose.model.messages import (
    ComponentOrder,
    ComponentState,
    FindingShown,
    Notice,
    ProcessState,
)
from tfcompose.model.plan import GuardPolicy, Plan, PlanEdge, PlanProcess, RosSettings, SourceLine

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.foundation.findings import Finding
    from tfcompose.model.messages import GuardOrder
    from tfcompose.model.plan import RestartPolicy, StartCondition

N = TypeVar("N", bound=Notice)

GUARD = PlanProcess("guard", "guard")
STATIC = PlanProcess("static", "static", owns=(("base_link", "laser"),))
SLAM = PlanProcess("slam", "run", owns=(("map", "odom"),))


def edge(parent: str, child: str, owner: str) -> PlanEdge:
    return PlanEdge(
        parent, child, "static", owner, f"/{owner}", Pose(), None, SourceLine("robot.yaml", 1)
    )


def plan_of(*processes: PlanProcess, guard: GuardPolicy | None = None) -> Plan:
    edges = tuple(
        edge(parent, child, process.name)
        for process in processes
        for parent, child in process.owns
    )
    return Plan("rover", "", "base_link", RosSettings(), edges, processes, guard or GuardPolicy())


def run_process(
    name: str,
    restart: RestartPolicy = "no",
    after: Mapping[str, StartCondition] | None = None,
    **more: Any,
) -> PlanProcess:
    return PlanProcess(name, "run", restart=restart, after=dict(after or {}), **more)


@dataclass
class History:
    """A machine that is fed events.

    What it does is written down, and starts succeed by themselves.
    """

    plan: Plan
    now: float = 100.0
    started: list[str] = field(default_factory=list)
    killed: list[tuple[str, int]] = field(default_factory=list)
    notices: list[Any] = field(default_factory=list)
    orders: list[GuardOrder] = field(default_factory=list)
    requested: list[ComponentOrder] = field(default_factory=list)
    late: list[Finding] = field(default_factory=list)
    #: Processes that were to read a plan again, its file, and how many orders were before.
    followed: list[tuple[str, str, int]] = field(default_factory=list)
    exit_code: int | None = None
    starts: bool = True
    state: State = field(init=False)

    def __post_init__(self) -> None:
        self.state = initial(self.plan)

    def feed(self, *events: Event) -> History:
        for event in events:
            self.state, actions = step(self.state, event, self.now)
            for action in actions:
                self.do(action)
        return self

    def do(self, action: Action) -> None:
        match action:
            case Start(name):
                self.started.append(name)
                if self.starts:
                    self.feed(Started(name, 1000 + len(self.started)))
            case Kill(name, number):
                self.killed.append((name, number))
            case Notify(notice):
                self.notices.append(notice)
            case Order(ComponentOrder() as order):
                self.requested.append(order)
            case Order(order):
                self.orders.append(order)
            case Follow(name, file):
                self.followed.append((name, file, len(self.orders)))
            case NotifyLate(_, finding):
                self.late.append(finding)
            case Finish(code):
                self.exit_code = code

    def answer(self, *names: str, why: str = "") -> History:
        """Have containers answer what they were requested last about these components."""
        for name in names:
            last = next(request for request in reversed(self.requested) if request.process == name)
            if last.do == "unload":
                self.feed(ComponentState(name, last.number, "unloaded", why))
            elif why:
                self.feed(ComponentState(name, last.number, "not loaded", why))
            else:
                self.feed(ComponentState(name, last.number, "loaded"))
        return self

    def loads(self) -> list[str]:
        """Return the components that containers were requested to load, in order."""
        return [request.process for request in self.requested if request.do == "load"]

    def wait(self, seconds: float) -> History:
        self.now += seconds
        return self.feed(Tick())

    def sleep_until_due(self) -> float:
        """Sleep as the launcher does, and return for how long."""
        due = wake_time(self.state)
        assert due is not None
        slept = due - self.now
        self.wait(slept)
        return slept

    def all(self, kind: type[N]) -> list[N]:
        return [notice for notice in self.notices if isinstance(notice, kind)]

    def findings(self) -> list[Finding]:
        return [notice.found for notice in self.all(FindingShown)]

    def only(self) -> Finding:
        """Return what was shown, which is one finding."""
        (finding,) = self.findings()
        return finding

    def states(self, name: str) -> list[str]:
        return [notice.state for notice in self.all(ProcessState) if notice.process == name]


def begin(*processes: PlanProcess, guard: GuardPolicy | None = None) -> History:
    return History(plan_of(*processes, guard=guard)).feed(Begin())
