"""One step of the process machine, while it is being taken: what is known so far, and what is to be done so far."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.ipc import Ended, FindingShown, Notice, Present, ProcessState, StateName, Stopping
from tfcompose.launcher.events import Action, Finish, Notify, Order, Start
from tfcompose.launcher.failures import in_short
from tfcompose.launcher.state import State, Stop, Tracked

if TYPE_CHECKING:
    from tfcompose.findings import Finding


class Transition:
    """The step's state and actions. It lives no longer than the step, and its state is replaced, never changed."""

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

    def enter(self, name: str, state: StateName, detail: str = "", **changes: float | None) -> None:
        """Put the process into the state, since now, and tell."""
        pid = changes.pop("pid", None)
        before = self.state.tracked[name]
        one = replace(before, state=state, since=self.now, pid=pid, detail=detail, failed=(), **changes)  # type: ignore[arg-type]
        self.track(name, one)
        self.notify(ProcessState(name, state, one.pid, detail))

    def start(self, name: str) -> None:
        """Have the process started."""
        order = 1 + max(one.order for one in self.state.tracked.values())
        before = self.state.tracked[name]
        again = before.order > 0
        self.enter(name, "STARTING", order=order, level=0, restarts=before.restarts + again)
        if again and before.process.owns and self.state.guard not in (None, name):
            self.actions.append(Order(Present(name)))
        self.actions.append(Start(name))

    def report(self, found: Finding) -> None:
        """Show the finding, and remember an error."""
        if found.severity == "error":
            self.update(reported=self.state.reported | {found.code})
        self.notify(FindingShown(found))

    def fail_process(self, name: str, found: Finding) -> None:
        """Report that the process has failed for good, and stop everything, unless the run goes on without it."""
        one = self.state.tracked[name]
        if one.process.required is not False:
            self.fail(found)
        elif self.state.stop is None:
            advice = f"the rest goes on without it: required is false; tfcompose start {name} tries again"
            self.report(replace(found, severity="warning", help=advice))
            self.track(name, replace(one, failed=(found.message, *(note.message for note in found.notes))))

    def fail(self, found: Finding) -> None:
        """Report the finding and stop everything; once that is under way, further failures follow from it."""
        if self.state.stop is None:
            self.report(found)
            self.update(because=(found.message, *(note.message for note in found.notes)))
            self.stop(Stop("failure", 1), in_short(found))

    def stop(self, stop: Stop, reason: str) -> None:
        """Begin to stop everything, unless that is under way."""
        if self.state.stop:
            return
        self.update(stop=stop)
        self.notify(Stopping(reason))
        for name, one in self.state.tracked.items():
            if one.state == "BACKOFF":
                self.enter(name, "STOPPED")

    def finish(self, exit_code: int) -> None:
        """End: nothing runs any more."""
        self.update(finished=True)
        failed = [one for one in self.state.tracked.values() if one.failed]
        failed.sort(key=lambda one: (one.order == 0, one.since))  # what was not started waited for another
        self.notify(Ended(exit_code, self.state.because or (failed[0].failed if failed else ())))
        self.actions.append(Finish(exit_code))
