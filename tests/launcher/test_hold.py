"""Publishers that join ROS while the guard looks, and publish only when they are started."""

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest

from tests.support.launcher import LISTEN, SLEEPER, Launcher, plan_of, program
from tests.support.waiting import TIMEOUT_S, gone, until
from tfcompose.foundation.signals import Stop
from tfcompose.launcher.publishers.static import static
from tfcompose.launcher.supervisor import supervise
from tfcompose.model.messages import (
    Clear,
    LogLine,
    Notice,
    ProcessState,
    line_of,
)
from tfcompose.model.plan import PlanProcess
from tfcompose.model.variables import GO, HOLD_FD
from tfcompose.tf.process import read_own, wait_for_go

#: Says what it has loaded before it is let go, as an own process would.
HELD = f"""
{LISTEN}
import os, time
print("pids", os.getpid(), "loaded", flush=True)
open("loaded", "w").close()
order = os.read(int(os.environ["{HOLD_FD}"]), 9)
print("went on" if order == {GO!r} else "was not let go", flush=True)
time.sleep(180)
"""


def observing_until(file: str) -> PlanProcess:
    """Return a guard whose look before the start ends when there is such a file."""
    observation = f"import os, time\nwhile not os.path.exists({file!r}): time.sleep(0.01)\n"
    say = f"os.write(int(os.environ['TFCOMPOSE_EVENTS_FD']), {line_of(Clear())!r}); {SLEEPER}"
    return program("guard", f"{LISTEN}; {observation}{say}", kind="guard", cwd=".")


@pytest.mark.parametrize(("sent", "ends"), [(GO, False), (b"", True), (b"no", True)])
def test_a_held_process_continues_on_order_and_ends_without_a_launcher(
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


def test_one_that_begins_anew_while_it_is_held_is_held_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    theirs, ours = os.pipe()
    monkeypatch.setenv(HOLD_FD, str(theirs))
    stop = Stop()
    stop.request()
    assert not wait_for_go(stop)
    os.write(ours, GO)
    os.close(ours)
    assert wait_for_go(Stop())
    assert HOLD_FD not in os.environ


@contextmanager
def _fake_node(calls: list[str]) -> Iterator[object]:
    calls.append("joined")
    yield object()


def test_a_held_publisher_joins_ros_and_sends_nothing_before_its_release(
    monkeypatch: pytest.MonkeyPatch, write: Callable[..., Path]
) -> None:
    node = pytest.importorskip("tfcompose.tf.ros.node")
    calls: list[str] = []

    class Publisher:
        def __init__(self, *_: object, **__: object) -> None:
            calls.append("publisher")

        def publish(self, _: bytes) -> None:
            calls.append("publish")

    def not_released(_: Stop) -> bool:
        calls.append("held")
        return False

    monkeypatch.setattr(node, "open_node", lambda *_, **__: _fake_node(calls))
    monkeypatch.setattr(node, "TFPublisher", Publisher)
    monkeypatch.setattr("tfcompose.launcher.publishers.static.wait_for_go", not_released)
    file = str(write([], PlanProcess("static", "static")))
    static(read_own([file, "static"], "static"), Stop())
    assert calls == ["joined", "publisher", "held"]


def test_own_publishers_load_while_the_guard_observes_and_resume_at_start(
    tmp_path: Path,
) -> None:
    notices: list[tuple[float, Notice]] = []

    def report(notice: Notice) -> None:
        notices.append((time.monotonic(), notice))
        if isinstance(notice, LogLine) and notice.text == "went on":
            os.kill(os.getpid(), signal.SIGINT)

    plan = plan_of(
        observing_until("loaded"),
        program("static", HELD, kind="static", cwd="."),
        program("other", SLEEPER),
    )
    assert supervise(plan, tmp_path / "plan.json", report=report) == 0
    kinds = [notice for _, notice in notices]
    started = next(
        i
        for i, kind in enumerate(kinds)
        if isinstance(kind, ProcessState) and kind.process == "static"
    )
    output = [kind.text if isinstance(kind, LogLine) else "" for kind in kinds]
    loaded = next(i for i, text in enumerate(output) if text.endswith("loaded"))
    assert loaded < started < output.index("went on")
    pids = {
        kind.pid
        for kind in kinds
        if isinstance(kind, ProcessState) and kind.process == "static" and kind.pid
    }
    assert pids == {int(output[loaded].split()[1])}
    start_times = [
        i
        for i, kind in enumerate(kinds)
        if isinstance(kind, ProcessState) and kind.process == "other"
    ]
    assert start_times[0] > loaded


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_one_that_is_held_when_the_launcher_ends_ends_with_it(
    launch: Callable[..., Launcher], tmp_path: Path, number: int
) -> None:
    launcher = launch(observing_until("never"), program("static", HELD, kind="static", cwd="."))
    assert until((tmp_path / "loaded").exists)
    below = launcher.below()
    os.kill(launcher.popen.pid, number)
    assert launcher.popen.wait(TIMEOUT_S) == (0 if number == signal.SIGINT else -number)
    assert until(lambda: all(map(gone, below)))


def test_one_that_dies_while_it_is_held_has_failed_when_it_is_started(tmp_path: Path) -> None:
    notices: list[Notice] = []
    dies = program(
        "static", "open('dies', 'w').close(); raise SystemExit(3)", kind="static", cwd="."
    )
    plan = plan_of(observing_until("dies"), dies)
    assert supervise(plan, tmp_path / "plan.json", report=notices.append) == 1
    states = [
        notice.state
        for notice in notices
        if isinstance(notice, ProcessState) and notice.process == "static"
    ]
    assert states == ["starting", "running", "exited"]
    assert not psutil.Process().children(recursive=True)


def test_a_process_that_died_in_hold_ends_nothing_when_the_guard_dies(
    tmp_path: Path,
) -> None:
    notices: list[Notice] = []
    observation = "import os, time\nwhile not os.path.exists('dies'): time.sleep(0.01)\n"
    dies = program(
        "static", "open('dies', 'w').close(); raise SystemExit(3)", kind="static", cwd="."
    )
    plan = plan_of(
        program("guard", f"{observation}raise SystemExit(4)", kind="guard", cwd="."), dies
    )
    assert supervise(plan, tmp_path / "plan.json", report=notices.append) == 1
    assert {
        notice.process
        for notice in notices
        if isinstance(notice, ProcessState) and notice.state == "exited"
    } == {"guard"}
    assert not psutil.Process().children(recursive=True)


def test_one_that_is_dismissed_has_time_to_leave_ros(tmp_path: Path) -> None:
    leaves = f"""
{LISTEN}
import os, time
open("loaded", "w").close()
os.read(int(os.environ["{HOLD_FD}"]), 9)
time.sleep(0.1)
open("left", "w").close()
"""
    observation = "import os, time\nwhile not os.path.exists('loaded'): time.sleep(0.01)\n"
    plan = plan_of(
        program("guard", f"{observation}raise SystemExit(4)", kind="guard", cwd="."),
        program("static", leaves, kind="static", cwd="."),
    )
    assert supervise(plan, tmp_path / "plan.json", report=lambda _: None) == 1
    assert (tmp_path / "left").exists()
