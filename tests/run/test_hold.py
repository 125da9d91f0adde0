"""Publishers that load Python while the guard looks, and join ROS only when they are started."""

from __future__ import annotations

import os
import signal
import time
from typing import TYPE_CHECKING

import psutil
import pytest

from tests.run.test_supervisor import LISTEN, SLEEPER, launch, plan_of, program
from tests.waiting import gone, until
from tfcompose.ros.stop import Stop
from tfcompose.run.events import Clear, to_line
from tfcompose.run.hold import GO, HOLD_FD, wait_for_go
from tfcompose.run.launcher.notice import LogLine, Notice, ProcessState
from tfcompose.run.launcher.supervisor import supervise

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.run.test_supervisor import Launcher
    from tfcompose.plan import PlanProcess

__all__ = ["launch"]

#: Says what it has loaded before it is let go, as an own process would.
HELD = f"""
{LISTEN}
import os, time
print("pids", os.getpid(), "loaded", flush=True)
said = os.read(int(os.environ["{HOLD_FD}"]), 9)
print("went on" if said == {GO!r} else "was not let go", flush=True)
time.sleep(30)
"""


def slow_guard(seconds: float) -> PlanProcess:
    line = to_line(Clear()).encode()
    say = f"import os, time; time.sleep({seconds}); os.write(int(os.environ['TFCOMPOSE_EVENTS_FD']), {line!r})"
    return program("guard", f"{LISTEN}; {say}; {SLEEPER}", kind="guard")


@pytest.mark.parametrize(("sent", "ends"), [(GO, False), (b"", True), (b"no", True)])
def test_a_held_process_goes_on_when_it_is_told_and_ends_when_nobody_is_left_to_tell_it(
    monkeypatch: pytest.MonkeyPatch,
    sent: bytes,
    ends: bool,  # noqa: FBT001 (a parameter of the test)
) -> None:
    theirs, ours = os.pipe()
    monkeypatch.setenv(HOLD_FD, str(theirs))
    os.write(ours, sent)
    os.close(ours)
    stop = Stop()
    wait_for_go(stop)
    assert stop.requested is ends
    assert HOLD_FD not in os.environ
    wait_for_go(stop)  # nobody holds it any more


def test_own_publishers_load_while_the_guard_looks_and_go_on_when_they_are_started(tmp_path: Path) -> None:
    told: list[tuple[float, Notice]] = []

    def report(notice: Notice) -> None:
        told.append((time.monotonic(), notice))
        if isinstance(notice, LogLine) and notice.text == "went on":
            os.kill(os.getpid(), signal.SIGINT)

    plan = plan_of(slow_guard(1.0), program("static", HELD, kind="static"), program("other", SLEEPER))
    assert supervise(plan, tmp_path / "plan.json", report=report) == 0
    kinds = [notice for _, notice in told]
    started = next(i for i, one in enumerate(kinds) if isinstance(one, ProcessState) and one.process == "static")
    said = [one.text if isinstance(one, LogLine) else "" for one in kinds]
    loaded = next(i for i, text in enumerate(said) if text.endswith("loaded"))
    assert loaded < started < said.index("went on")
    pids = {one.pid for one in kinds if isinstance(one, ProcessState) and one.process == "static" and one.pid}
    assert pids == {int(said[loaded].split()[1])}
    others = [i for i, one in enumerate(kinds) if isinstance(one, ProcessState) and one.process == "other"]
    assert others[0] > loaded


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_one_that_is_held_when_the_launcher_ends_ends_with_it(launch: Callable[..., Launcher], number: int) -> None:
    launcher = launch(slow_guard(30), program("static", HELD, kind="static"))
    assert until(lambda: len(launcher.output.read_text().split("pids")) == 2)
    below = launcher.below()
    os.kill(launcher.popen.pid, number)
    assert launcher.popen.wait(10) == (0 if number == signal.SIGINT else -number)
    assert until(lambda: all(map(gone, below)), 5)


def test_one_that_dies_while_it_is_held_has_failed_when_it_is_started(tmp_path: Path) -> None:
    told: list[Notice] = []
    plan = plan_of(slow_guard(0.5), program("static", "raise SystemExit(3)", kind="static"))
    assert supervise(plan, tmp_path / "plan.json", report=told.append) == 1
    states = [one.state for one in told if isinstance(one, ProcessState) and one.process == "static"]
    assert states == ["STARTING", "RUNNING", "EXITED"]
    assert not psutil.Process().children(recursive=True)
