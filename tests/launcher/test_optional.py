"""Processes that the run goes on without: ``required: false``."""

from dataclasses import replace
from signal import SIGINT
from typing import Any

import pytest

from tests.support.findings import expect
from tests.support.machine_history import GUARD, SLAM, STATIC, History, begin, run_process
from tfcompose.launcher.answers import status
from tfcompose.launcher.events import Exited, Signalled, StartFailed, TimeUp
from tfcompose.model.messages import (
    AllReady,
    AllStarted,
    Clear,
    Ended,
    Live,
    OwnerReady,
    ProcessRequest,
    Waiting,
)
from tfcompose.model.plan import PlanProcess, Ready, RestartPolicy

LIVE = (Live("static", ("laser",)), OwnerReady("static"))


def optional(name: str = "camera", **more: Any) -> PlanProcess:
    return run_process(name, required=False, **more)


def failed(*processes: PlanProcess) -> History:
    """Return a history in which the optional camera has failed, and the tree is live."""
    return begin(GUARD, STATIC, optional(), *processes).feed(
        Clear(), *LIVE, Exited("camera", 3, ("no device",))
    )


@pytest.mark.parametrize("restart", ["no", "on-failure"])
def test_a_failed_optional_process_is_named_with_its_last_lines(
    restart: RestartPolicy,
) -> None:
    history = begin(STATIC, replace(optional(), restart=restart, max_restarts=0)).feed(
        Exited("camera", 3, ("no device",))
    )
    expect(
        history.only(),
        "TF808",
        "camera",
        "exit code 3",
        "camera: no device",
        "tfcompose start camera",
    )
    assert history.only().severity == "warning"
    assert (history.state.stop, history.killed, history.exit_code) == (None, [], None)
    assert history.state.given_up == ("camera",)


def test_it_is_first_started_again_as_often_as_the_plan_says() -> None:
    history = begin(STATIC, replace(optional(), restart="on-failure", max_restarts=2))
    slept = [history.feed(Exited("camera", 1)).sleep_until_due() for _ in range(2)]
    assert slept == [1.0, 2.0]
    assert history.feed(Exited("camera", 1)).states("camera")[-1] == "fatal"
    assert history.state.stop is None


def test_one_that_the_operating_system_does_not_start_is_given_up_too() -> None:
    history = begin(STATIC, optional()).feed(StartFailed("camera", "no such program"))
    expect(history.only(), "TF808", "camera", "no such program")
    assert (history.states("camera")[-1], history.state.stop) == ("fatal", None)


def test_one_that_ends_as_it_should_has_not_failed() -> None:
    history = begin(STATIC, optional()).feed(Exited("camera", 0))
    assert (history.findings(), history.state.given_up) == ([], ())


def test_ready_awaits_neither_it_nor_its_edges_and_reports_its_absence() -> None:
    camera = replace(optional(), owns=(("base_link", "camera"),), restart="always", max_restarts=0)
    history = begin(GUARD, STATIC, camera).feed(Clear(), *LIVE, Exited("camera", 1)).wait(60)
    (ready,) = history.all(AllReady)
    assert ready.without == ("camera",)
    assert [row.process for row in ready.rows] == ["guard", "static"]
    assert history.all(Waiting) == []
    assert (history.state.complete, [edge.child for edge in history.state.missing]) == (
        False,
        ["camera"],
    )


def test_what_else_is_missing_is_still_waited_for() -> None:
    history = begin(GUARD, STATIC, optional()).feed(Clear(), Exited("camera", 1)).wait(6)
    assert history.all(AllReady) == []
    assert [edge.owner for edge in history.all(Waiting)[0].missing] == ["static"]


def test_who_waits_for_it_fails_and_ends_everything_unless_optional_too() -> None:
    gate = Ready("log", "up")
    camera = replace(optional(), ready=gate)
    history = begin(STATIC, camera, run_process("nav", after={"camera": "ready"})).feed(
        Exited("camera", 1)
    )
    expect(history.findings()[1], "TF808", "nav", "camera to be ready", "failed")
    assert history.feed(Exited("static", 0)).exit_code == 1
    history = begin(STATIC, camera, optional("nav", after={"camera": "ready"})).feed(
        Exited("camera", 1)
    )
    expect(history.findings()[1], "TF808", "nav", "camera to be ready", "failed")
    assert (history.state.stop, history.state.given_up) == (None, ("camera", "nav"))


@pytest.mark.parametrize(
    ("what", "code", "started"), [("started", 1, 2), ("done", 1, 1), ("done", 0, 2)]
)
def test_a_failed_process_fulfils_started_if_it_ran_and_never_done(
    what: str, code: int, started: int
) -> None:
    history = begin(optional(), optional("nav", after={"camera": what})).feed(
        Exited("camera", code)
    )
    assert history.started == ["camera", "nav"][:started]


def test_one_that_never_ran_does_not_count_as_started() -> None:
    history = begin(GUARD, optional(), optional("nav", after={"camera": "started"}))
    history.starts = False
    history.feed(Clear(), StartFailed("camera", "no such program")).wait(1)
    assert history.state.tracked["nav"].state == "stopped"
    assert history.state.given_up == ("camera", "nav")


def test_it_is_started_again_on_request_and_what_waited_for_it_follows() -> None:
    camera = replace(optional(), ready=Ready("time", number=1.0))
    history = begin(STATIC, camera, optional("nav", after={"camera": "ready"})).feed(
        Exited("camera", 1)
    )
    history.feed(ProcessRequest("start", "camera"))
    assert history.state.given_up == ("nav",)
    history.wait(1)
    assert history.started[-2:] == ["camera", "nav"]
    assert not [tracked for tracked in history.state.tracked.values() if tracked.failed]


def test_the_exit_code_is_0_after_a_signal_and_1_after_a_timeout() -> None:
    history = failed().feed(Signalled(SIGINT), Exited("static", 0), Exited("guard", 0))
    assert history.exit_code == 0
    history = failed().feed(TimeUp(), Exited("static", 0), Exited("guard", 0))
    (finding,) = history.findings()
    assert history.all(Ended) == [Ended(1, (finding.message, "camera: no device"))]


def test_if_all_end_the_exit_code_is_1_and_the_first_failure_is_named() -> None:
    history = begin(optional("a"), optional("b")).feed(Exited("b", 2)).wait(1).feed(Exited("a", 1))
    assert history.all(Ended) == [Ended(1, (history.findings()[0].message,))]
    expect(history.findings()[0], "TF808", "b", "exit code 2")


def test_an_optional_process_does_not_hold_back_that_all_is_started() -> None:
    history = begin(
        STATIC,
        replace(optional(), ready=Ready("log", "up")),
        optional("nav", after={"camera": "ready"}),
    )
    assert [event.waiting for event in history.all(AllStarted)] == [("nav",)]


def test_ps_says_what_is_optional_why_it_ended_and_that_it_has_failed() -> None:
    history = failed(SLAM)
    output = {process.name: process for process in status(history.state, history.now).processes}
    camera = output["camera"]
    assert (camera.state, camera.detail, camera.failed) == ("exited", "exit code 3", True)
    assert (camera.required, output["slam"].required) == (False, None)


def test_what_waited_in_vain_is_not_named_as_the_first_that_failed() -> None:
    nav = optional("nav", after={"camera": "done"})
    history = begin(STATIC, nav, optional()).feed(Exited("camera", 3))
    assert history.state.given_up == ("nav", "camera")
    history.feed(TimeUp(), Exited("static", 0))
    assert [event.because[0].split()[0] for event in history.all(Ended)] == ["camera"]


def test_a_deliberately_stopped_process_does_not_fail_with_its_dependency() -> None:
    nav = optional("nav", after={"camera": "done"})
    history = begin(STATIC, nav, optional()).feed(ProcessRequest("stop", "nav"))
    history.feed(Exited("camera", 3))
    assert history.state.given_up == ("camera",)
