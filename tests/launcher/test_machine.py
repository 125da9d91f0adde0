"""Histories replayed to the process machine with a clock that is set by hand."""

from dataclasses import replace
from signal import SIGHUP, SIGINT, SIGKILL, SIGSEGV, SIGTERM
from typing import Literal

import pytest

from tests.support.findings import expect
from tests.support.machine_history import GUARD, SLAM, STATIC, begin, plan_of, run_process
from tfcompose.foundation.findings import finding
from tfcompose.launcher.events import (
    Begin,
    Exited,
    Finish,
    Kill,
    LogMatched,
    OutputLost,
    Signalled,
    Start,
    Started,
    StartFailed,
    TimeUp,
)
from tfcompose.launcher.machine import step, wake_time
from tfcompose.launcher.state import initial
from tfcompose.model.messages import (
    Clear,
    EdgeTaken,
    Ended,
    FilterBypassed,
    FindingShown,
    Live,
    Missing,
    OwnerLive,
    OwnerReady,
    ProcessRequest,
    RecoveredShown,
    Stopping,
    TreeComplete,
    Waiting,
)
from tfcompose.model.plan import GuardPolicy, PlanProcess, Ready, StopRule
from tfcompose.model.variables import SETTLE

DRIVE = PlanProcess("drive", "external", owns=(("odom", "base_link"),))
ERROR = finding("TF801", "rogue publishes base_link → laser, which is static's", None)
WARNING = finding("TF803", "nobody declared base_link → thing", None, severity="warning")


# The start.


def test_the_guard_starts_first_and_the_rest_in_plan_order_once_clear() -> None:
    history = begin(SLAM, STATIC, GUARD)
    assert history.started == ["guard"]
    history.wait(19)
    assert history.started == ["guard"]
    history.feed(Clear())
    assert history.started == ["guard", "slam", "static"]


def test_dependencies_of_the_guard_start_first_and_the_guard_once_ready() -> None:
    router = PlanProcess("router", "run", ready=Ready("log", "listens"))
    history = begin(SLAM, router, replace(GUARD, after={"router": "ready"}))
    assert history.started == ["router"]
    history.feed(LogMatched("router", "it listens"))
    assert history.started == ["router", "guard"]
    history.feed(Clear())
    assert history.started == ["router", "guard", "slam"]


def test_a_guard_whose_router_fails_is_not_started() -> None:
    router = PlanProcess("router", "run", ready=Ready("log", "listens"))
    history = begin(SLAM, router, replace(GUARD, after={"router": "ready"}))
    history.feed(Exited("router", 1))
    assert (history.started, history.exit_code) == (["router"], 1)


def test_without_a_guard_everything_starts_at_once() -> None:
    assert begin(SLAM, STATIC).started == ["slam", "static"]


def test_a_disabled_guard_is_not_awaited_and_reports_live_and_ready() -> None:
    off, waits = GuardPolicy(mode="off"), run_process("b", after={"slam": "ready"})
    history = begin(SLAM, GUARD, waits, guard=off)
    assert history.started == ["guard", "slam"]
    assert history.wait(60).findings() == []
    history.feed(Live("slam", ("odom",)), OwnerReady("slam"), TreeComplete(1))
    assert history.started == ["guard", "slam", "b"]
    assert (
        history.feed(TimeUp(), Exited("b", 0), Exited("slam", 0), Exited("guard", 0)).exit_code
        == 0
    )


def test_an_external_process_is_expected_and_not_started() -> None:
    history = begin(DRIVE, SLAM, guard=GuardPolicy(mode="off"))
    assert history.states("drive") == ["expected"]
    assert history.started == ["slam"]


def test_a_guard_that_is_not_clear_within_20_s_is_a_named_failure() -> None:
    history = begin(GUARD, SLAM)
    assert history.sleep_until_due() == pytest.approx(20)
    expect(history.only(), "TF808", "guard", " 20 s ")
    assert history.feed(Exited("guard", 0)).exit_code == 1
    assert history.started == ["guard"]


def test_the_time_of_the_guards_observation_is_waited_besides() -> None:
    history = begin(replace(GUARD, env={SETTLE: "30"}), SLAM)
    assert history.sleep_until_due() == pytest.approx(50)
    expect(history.only(), "TF808", "guard", " 50 s ")


def test_a_guard_that_dies_before_it_is_clear_is_a_failure_that_says_so() -> None:
    history = begin(GUARD, SLAM).feed(Exited("guard", 1, ("no rclpy",)))
    expect(history.only(), "TF808", "guard", "exit code 1", "guard: no rclpy")
    assert history.exit_code == 1


def test_an_edge_already_taken_is_shown_and_nothing_else_starts() -> None:
    second = finding("TF807", "somebody publishes b", None)
    taken = finding("TF807", "stranger publishes base_link → laser already", None)
    history = begin(GUARD, STATIC).feed(EdgeTaken(taken), EdgeTaken(second), Clear())
    assert history.findings() == [taken, second]
    assert history.killed == [("guard", SIGINT)]
    assert history.all(Stopping) == [Stopping("TF807 edge_taken_before_start")]
    assert history.feed(Exited("guard", 0)).exit_code == 1
    assert history.started == ["guard"]


def test_a_process_that_cannot_start_is_named_and_ends_everything_with_1() -> None:
    history = begin(STATIC, SLAM).feed(StartFailed("slam", "Permission denied"))
    expect(history.only(), "TF808", "slam", "Permission denied")
    assert history.killed == [("static", SIGINT)]
    assert history.feed(Exited("static", 0)).exit_code == 1


# after.


def test_after_started_waits_until_the_process_runs() -> None:
    history = begin(run_process("b", after={"a": "started"}), run_process("a"))
    assert history.started == ["a", "b"]


def test_a_process_is_started_when_the_operating_system_has_confirmed_it() -> None:
    state, actions = step(
        initial(plan_of(run_process("a"), run_process("b", after={"a": "started"}))), Begin(), 0.0
    )
    assert [action for action in actions if isinstance(action, Start)] == [Start("a")]
    assert Start("b") in step(state, Started("a", 7), 0.1)[1]


def test_after_ready_awaits_the_guard_even_for_an_external_process() -> None:
    a, b = run_process("a", after={"drive": "ready"}), run_process("b", after={"slam": "ready"})
    history = begin(GUARD, a, b, DRIVE, SLAM).feed(Clear())
    assert history.started == ["guard", "slam"]
    history.feed(OwnerReady("slam"))
    assert history.started == ["guard", "slam", "b"]
    history.feed(OwnerReady("drive"))
    assert history.started == ["guard", "slam", "b", "a"]


def test_a_process_that_owns_no_edge_is_ready_when_it_has_started() -> None:
    assert begin(GUARD, run_process("b", after={"a": "ready"}), run_process("a")).feed(
        Clear()
    ).started[1:] == [
        "a",
        "b",
    ]


def test_after_ready_means_started_where_no_guard_runs() -> None:
    assert begin(run_process("b", after={"slam": "ready"}), SLAM).started == ["slam", "b"]


def test_after_done_waits_until_the_process_has_ended_with_0() -> None:
    history = begin(run_process("b", after={"a": "done"}), run_process("a"), STATIC)
    assert history.started == ["a", "static"]
    assert history.feed(Exited("a", 0)).started == ["a", "static", "b"]


# Processes that end.


@pytest.mark.parametrize(("code", "how"), [(3, "exit code 3"), (-SIGSEGV, "SIGSEGV")])
def test_a_failed_process_ends_everything_with_exit_1_and_is_named(code: int, how: str) -> None:
    history = begin(STATIC, SLAM).feed(Exited("slam", code, ("one", "two")))
    expect(history.only(), "TF808", "slam", how, "slam: one", "slam: two")
    assert history.all(Stopping) == [Stopping("TF808 process_failed")]
    assert history.killed == [("static", SIGINT)]
    assert history.feed(Exited("static", -SIGINT)).exit_code == 1


@pytest.mark.parametrize("kind", ["static", "joints", "simulate"])
def test_a_built_in_process_that_ends_has_failed_even_with_exit_code_0(
    kind: Literal["static", "joints", "simulate"],
) -> None:
    history = begin(PlanProcess("it", kind), SLAM).feed(Clear(), Exited("it", 0))
    expect(history.only(), "TF808", "it", "exit code 0")


def test_a_program_that_ends_with_0_is_done_and_the_others_go_on() -> None:
    history = begin(STATIC, SLAM).feed(Exited("slam", 0))
    assert history.states("slam")[-1] == "exited"
    assert (history.findings(), history.killed, history.exit_code) == ([], [], None)


def test_a_required_program_that_others_await_may_end_with_0() -> None:
    """A spawner of controllers: it loads one, ends, and what drives starts then."""
    drive = run_process("drive", after={"spawner": "done"})
    spawners = (
        run_process("spawner", required=True),
        run_process("spawner", required=True, ready=Ready("exit")),
    )
    for spawner, waiting in zip(spawners, ((drive,), ()), strict=True):
        history = begin(spawner, STATIC, *waiting).feed(Exited("spawner", 0))
        assert (history.findings(), history.exit_code) == ([], None)
        assert history.started == [
            "spawner",
            "static",
            *(process.name for process in waiting),
        ]
    for code, waiting in ((0, ()), (1, (drive,))):
        history = begin(spawners[0], STATIC, *waiting).feed(Exited("spawner", code))
        expect(history.only(), "TF808", "spawner", f"exit code {code}")


def test_when_every_program_is_done_the_launcher_is_too() -> None:
    assert begin(SLAM, DRIVE, guard=GuardPolicy(mode="off")).feed(Exited("slam", 0)).exit_code == 0


def test_backoff_grows_and_ends_as_a_failure() -> None:
    history = begin(run_process("a", restart="on-failure"))
    delays = []
    for _ in range(5):
        history.feed(Exited("a", 1))
        assert history.states("a")[-1] == "backoff"
        delays.append(history.sleep_until_due())
    assert delays == pytest.approx([1, 2, 4, 8, 16])
    assert history.started == ["a"] * 6
    history.feed(Exited("a", 1))
    assert history.states("a")[-1] == "fatal"
    expect(history.only(), "TF808", "a", "exit code 1", " 5 restarts")
    assert history.exit_code == 1


def test_a_process_may_say_how_long_after_its_end_it_is_started_again() -> None:
    history = begin(replace(run_process("a", restart="on-failure"), restart_delay=2.5))
    delays = [history.feed(Exited("a", 1)).sleep_until_due() for _ in range(3)]
    assert delays == pytest.approx([2.5, 2.5, 2.5])


def test_the_delay_before_a_restart_has_a_limit() -> None:
    history = begin(run_process("a", restart="on-failure"))
    history.state = replace(history.state, times=replace(history.state.times, backoff_limit_s=3.0))
    delays = [history.feed(Exited("a", 1)).sleep_until_due() for _ in range(4)]
    assert delays == pytest.approx([1, 2, 3, 3])


def test_a_run_of_10_s_makes_earlier_failures_forgotten() -> None:
    history = begin(run_process("a", restart="on-failure"))
    for _ in range(3):
        history.feed(Exited("a", 1)).sleep_until_due()
    history.wait(9.9).feed(Exited("a", 1))
    assert history.sleep_until_due() == pytest.approx(8)
    history.wait(10).feed(Exited("a", 1))
    assert history.sleep_until_due() == pytest.approx(1)


def test_on_failure_leaves_a_finished_program_and_always_restarts_it() -> None:
    history = begin(
        run_process("a", restart="on-failure"), run_process("b", restart="always"), STATIC
    )
    history.feed(Exited("a", 0), Exited("b", 0))
    assert (history.states("a")[-1], history.states("b")[-1]) == ("exited", "backoff")


def test_a_process_that_awaits_its_restart_does_not_start_during_a_stop() -> None:
    history = (
        begin(run_process("a", restart="always"), STATIC)
        .feed(Exited("a", 1), Signalled(SIGINT))
        .wait(2)
    )
    assert history.started == ["a", "static"]
    assert history.states("a")[-1] == "stopped"
    assert history.feed(Exited("static", 0)).exit_code == 0


# What the guard sees.


def test_what_the_guard_finds_is_reported_with_the_seconds_since_the_start() -> None:
    history = begin(GUARD, STATIC).wait(1.5).feed(Clear()).wait(0.5)
    live = Live("static", ("laser",))
    history.feed(live, OwnerReady("static"), TreeComplete(1), RecoveredShown("it is back"))
    assert history.all(OwnerLive) == [OwnerLive("static", "/static", ("base_link → laser",), 2.0)]
    assert history.all(TreeComplete) == [TreeComplete(1, 2.0)]
    assert history.all(RecoveredShown) == [RecoveredShown("it is back", 2.0)]


def test_a_violation_ends_everything_with_exit_1_where_the_policy_is_stop() -> None:
    history = begin(GUARD, STATIC, guard=GuardPolicy(on_violation="stop")).feed(
        Clear(), FindingShown(WARNING)
    )
    assert history.killed == []
    history.feed(FindingShown(ERROR))
    assert history.findings() == [WARNING, ERROR]
    assert history.all(Stopping) == [Stopping("TF801 foreign_publisher")]
    assert history.feed(Exited("static", 0), Exited("guard", 0)).exit_code == 1


def test_policy_stop_offender_stops_the_plans_own_offender_for_good() -> None:
    policy = GuardPolicy(on_violation="stop-offender")
    history = begin(GUARD, STATIC, run_process("slam", restart="always"), guard=policy).feed(
        Clear()
    )
    history.feed(FindingShown(WARNING, "slam"), FindingShown(ERROR))
    assert (history.killed, history.findings()) == ([], [WARNING, ERROR])
    history.feed(FindingShown(ERROR, "slam"))
    assert history.killed == [("slam", SIGINT)]
    expect(history.findings()[-1], "TF801", "slam is stopped")
    history.feed(Exited("slam", -SIGINT)).wait(60)
    assert (history.started, history.states("slam")[-1], history.exit_code) == (
        ["guard", "static", "slam"],
        "stopped",
        None,
    )
    expect(
        history.feed(FindingShown(ERROR, "slam")).findings()[-1],
        "TF801",
        "nothing is stopped",
        "slam",
    )


def test_a_process_past_the_fence_is_stopped_even_under_policy_report() -> None:
    history = begin(GUARD, STATIC, run_process("slam", restart="always")).feed(
        Clear(), FilterBypassed(ERROR, "slam")
    )
    assert history.killed == [("slam", SIGINT)]
    expect(history.findings()[-1], "TF801", "slam is stopped", "strict")
    everything = begin(GUARD, STATIC, guard=GuardPolicy(on_violation="stop")).feed(
        Clear(), FilterBypassed(ERROR, "static")
    )
    assert everything.all(Stopping) == [Stopping("TF801 foreign_publisher")]


def test_a_number_identifies_a_process_past_the_fence_without_environment() -> None:
    slam, idle = run_process("slam", restart="always"), run_process("idle")
    history = begin(GUARD, STATIC, slam, idle).feed(Clear())
    pid = history.state.tracked["slam"].pid
    assert pid
    history.feed(ProcessRequest("stop", "idle"), Exited("idle", 0))
    for unknown in (0, pid + 1000):
        history.feed(FilterBypassed(ERROR, "", unknown))
        expect(history.findings()[-1], "TF801", "nothing is stopped")
    assert [name for name, _ in history.killed] == ["idle"]
    history.killed.clear()
    expect(history.findings()[-1], "TF801", "nothing is stopped", f"kill {pid + 1000}")
    history.feed(FilterBypassed(ERROR, "", pid))
    assert history.killed == [("slam", SIGINT)]
    expect(history.findings()[-1], "TF801", "slam is stopped", "strict")


def test_an_offender_that_somebody_else_started_is_not_stopped() -> None:
    history = begin(GUARD, DRIVE, STATIC, guard=GuardPolicy(on_violation="stop-offender")).feed(
        Clear()
    )
    history.feed(FindingShown(ERROR, "drive"))
    expect(history.findings()[-1], "TF801", "nothing is stopped", "drive")
    assert history.killed == []


def test_a_violation_is_only_shown_where_the_policy_is_report() -> None:
    history = begin(GUARD, STATIC).feed(Clear(), FindingShown(ERROR))
    assert history.findings() == [ERROR]
    assert (history.killed, history.exit_code) == ([], None)


def test_missing_edges_are_named_after_5_s_and_again_only_if_they_change() -> None:
    history = begin(GUARD, STATIC, SLAM).wait(3).feed(Clear())
    assert history.sleep_until_due() == pytest.approx(5)
    assert [[gap.owner for gap in notice.missing] for notice in history.all(Waiting)] == [
        ["static", "slam"]
    ]
    assert wake_time(history.state) is None
    history.wait(60)
    assert len(history.all(Waiting)) == 1
    history.feed(Live("static", ("laser",)))
    assert history.all(Waiting)[1:] == [Waiting((Missing("slam", "/slam", ("map → odom",), 1),))]
    history.feed(Live("slam", ("odom",)), TreeComplete(2)).wait(60)
    assert len(history.all(Waiting)) == 2


def test_a_tree_that_the_guard_calls_complete_misses_nothing() -> None:
    assert begin(GUARD, STATIC).feed(Clear(), TreeComplete(1)).wait(60).all(Waiting) == []


def test_two_notices_of_missing_edges_are_5_s_apart() -> None:
    history = begin(GUARD, STATIC, SLAM).feed(Clear()).wait(5).feed(Live("static", ("laser",)))
    assert len(history.all(Waiting)) == 1
    assert history.sleep_until_due() == pytest.approx(5)
    assert len(history.all(Waiting)) == 2


# The stop.


@pytest.mark.parametrize("number", [SIGINT, SIGTERM, SIGHUP])
def test_a_signal_stops_all_in_reverse_order_the_guard_last_with_exit_0(
    number: int,
) -> None:
    history = begin(GUARD, STATIC, SLAM).feed(Clear(), Signalled(number))
    assert history.killed == [("slam", SIGINT), ("static", SIGINT)]
    history.feed(Exited("slam", -SIGINT), Exited("static", 0))
    assert history.killed == [("slam", SIGINT), ("static", SIGINT), ("guard", SIGINT)]
    assert history.exit_code is None
    assert history.feed(Exited("guard", 0)).exit_code == 0
    assert history.notices[-1] == Ended(0)


def test_a_process_is_stopped_only_when_those_that_wait_for_it_are_gone() -> None:
    history = begin(run_process("a"), run_process("b", after={"a": "started"})).feed(
        Signalled(SIGINT)
    )
    assert history.killed == [("b", SIGINT)]
    assert history.feed(Exited("b", 0)).killed == [("b", SIGINT), ("a", SIGINT)]


def test_a_process_that_does_not_stop_gets_a_firmer_signal_every_5_s() -> None:
    history = begin(STATIC).feed(Signalled(SIGINT))
    assert [history.sleep_until_due(), history.sleep_until_due()] == pytest.approx([5, 5])
    assert history.killed == [("static", SIGINT), ("static", SIGTERM), ("static", SIGKILL)]
    assert wake_time(history.state) is None
    assert history.wait(60).killed[3:] == []
    assert history.feed(Exited("static", -SIGKILL)).exit_code == 0


def test_a_second_and_a_third_ctrl_c_speed_it_up_for_everything() -> None:
    history = begin(GUARD, STATIC).feed(Clear(), Signalled(SIGINT)).wait(1).feed(Signalled(SIGINT))
    assert history.killed[1:] == [("static", SIGTERM), ("guard", SIGTERM)]
    history.wait(1).feed(Signalled(SIGINT))
    assert history.killed[3:] == [("static", SIGKILL), ("guard", SIGKILL)]


def test_a_signal_that_is_delivered_twice_counts_once() -> None:
    history = begin(STATIC).feed(Signalled(SIGTERM)).wait(0.1).feed(Signalled(SIGTERM))
    assert history.killed == [("static", SIGINT)]


def test_the_first_ctrl_c_while_a_failure_ends_everything_changes_nothing() -> None:
    history = begin(STATIC, SLAM).feed(Exited("slam", 1)).wait(1).feed(Signalled(SIGINT))
    assert history.killed == [("static", SIGINT)]
    assert history.feed(Exited("static", 0)).exit_code == 1


def test_what_the_guard_says_while_everything_stops_is_not_shown() -> None:
    history = begin(GUARD, STATIC).feed(Clear(), Signalled(SIGINT))
    notices = len(history.notices)
    history.feed(
        FindingShown(ERROR), EdgeTaken(ERROR), TreeComplete(1), Live("static", ("laser",))
    )
    assert history.notices[notices:] == []
    assert history.feed(Exited("static", 1), Exited("guard", 1)).exit_code == 0
    assert history.findings() == []


def test_a_process_starting_at_the_stop_is_stopped_too() -> None:
    plan = plan_of(STATIC)
    state, _ = step(initial(plan), Begin(), 0.0)
    state, actions = step(state, Signalled(SIGINT), 0.1)
    assert not any(isinstance(action, (Kill, Finish)) for action in actions)
    state, actions = step(state, Started("static", 7), 0.2)
    assert Kill("static", SIGINT) in actions


def test_nothing_happens_after_the_end() -> None:
    history = begin(STATIC).feed(Signalled(SIGINT), Exited("static", 0))
    notices = len(history.notices)
    history.feed(Signalled(SIGINT), Exited("static", 1), TimeUp(), Clear()).wait(100)
    assert (len(history.notices), history.exit_code) == (notices, 0)


def test_output_that_nobody_reads_any_more_ends_everything_with_exit_141() -> None:
    history = begin(STATIC).feed(OutputLost(), Exited("static", 0))
    assert len(history.all(Stopping)) == 1
    assert history.exit_code == 141


# An end that was asked for.


def test_time_is_up_ends_with_0_when_the_tree_was_complete() -> None:
    history = begin(GUARD, STATIC).feed(Clear(), TreeComplete(1), FindingShown(WARNING), TimeUp())
    assert history.feed(Exited("static", 0), Exited("guard", 0)).exit_code == 0


def test_time_is_up_ends_with_1_when_an_error_was_shown() -> None:
    history = begin(GUARD, STATIC).feed(Clear(), TreeComplete(1), FindingShown(ERROR), TimeUp())
    assert history.feed(Exited("static", 0), Exited("guard", 0)).exit_code == 1


def test_a_timeout_ends_with_1_and_names_the_edges_never_observed() -> None:
    history = begin(GUARD, STATIC, SLAM).feed(Clear(), Live("static", ("laser",)), TimeUp())
    expect(history.only(), "TF811", "slam", "map → odom")
    history.feed(Exited("slam", 0), Exited("static", 0), Exited("guard", 0))
    assert history.exit_code == 1


def test_a_stopped_process_is_not_reported_as_never_published() -> None:
    slam = replace(SLAM, argv=("slam",))
    history = begin(GUARD, STATIC, slam).feed(
        Clear(), Live("static", ("laser",)), Live("slam", ("odom",)), TreeComplete(2)
    )
    history.feed(ProcessRequest("stop", "slam"), Exited("slam", -SIGINT), TimeUp())
    expect(history.only(), "TF811", "map → odom", "slam is stopped", "SIGINT")


def test_a_process_that_was_never_started_is_not_blamed_for_its_edges() -> None:
    slam = replace(SLAM, after={"drive": "ready"})
    history = begin(GUARD, STATIC, slam, DRIVE).feed(Clear(), TimeUp())
    static, slam_, drive = history.findings()
    expect(static, "TF811", "static", "base_link → laser")
    expect(slam_, "TF811", "map → odom", "slam", "drive")
    expect(drive, "TF811", "drive", "odom → base_link")


def test_time_is_up_ends_with_0_where_no_guard_runs() -> None:
    assert begin(STATIC).feed(TimeUp(), Exited("static", 0)).exit_code == 0


def test_a_step_leaves_the_state_it_was_given_as_it_was() -> None:
    before = initial(plan_of(GUARD, STATIC, DRIVE))
    tracked = dict(before.tracked)
    step(before, Begin(), 0.0)
    assert before == initial(plan_of(GUARD, STATIC, DRIVE))
    assert before.tracked == tracked


def test_a_stubborn_process_is_killed_after_the_time_that_is_its_own() -> None:
    rule = StopRule("SIGINT", 2.0, kill_timeout_s=7.0)
    history = begin(run_process("slow", stop=rule)).feed(Signalled(SIGINT))
    assert history.sleep_until_due() == pytest.approx(2.0)
    assert history.sleep_until_due() == pytest.approx(7.0)
    assert history.killed == [("slow", SIGINT), ("slow", SIGTERM), ("slow", SIGKILL)]
    history = begin(run_process("slow", stop=replace(rule, signal="SIGTERM"))).feed(
        Signalled(SIGINT)
    )
    assert history.sleep_until_due() == pytest.approx(7.0)
