"""Histories of single processes.

Gates, restarts, requests by name, and plans that change, with a clock set by hand.
"""

from dataclasses import replace
from signal import SIGINT, SIGKILL, SIGQUIT, SIGTERM
from typing import Any

import pytest

from tests.support.findings import expect
from tests.support.machine_history import (
    GUARD,
    SLAM,
    STATIC,
    History,
    begin,
    plan_of,
    run_process,
)
from tfcompose.launcher.answers import status
from tfcompose.launcher.events import Exited, LogMatched, NewPlan, Signalled
from tfcompose.launcher.stopping import refusal
from tfcompose.model.messages import (
    Absent,
    Alive,
    AllReady,
    AllStarted,
    Clear,
    DescriptionOrder,
    DescriptionState,
    DownRequest,
    Gate,
    GateState,
    Live,
    OwnerReady,
    Present,
    ProcessReady,
    ProcessRequest,
    RecoveredShown,
    Remember,
    Replanned,
    Reread,
    Silent,
    TreeComplete,
    Verb,
)
from tfcompose.model.plan import GuardPolicy, Plan, PlanProcess, Ready, RestartPolicy, StopRule


def gated(
    name: str = "lidar", *, kind: Any = "topic", text: str = "/scan", **more: Any
) -> PlanProcess:
    ready = Ready(kind, text, more.pop("number", 0.0), more.pop("timeout_s", None))
    return PlanProcess(name, "run", ready=ready, nodes=(f"/{name}",), **more)


AFTER = run_process("b", after={"lidar": "ready"})


# Gates.


@pytest.mark.parametrize(
    ("kind", "gate"),
    [
        ("topic", Gate("lidar", topic="/scan")),
        ("service", Gate("lidar", service="/scan")),
        ("lifecycle", Gate("lidar", nodes={"/lidar": "active"})),
    ],
)
def test_the_guard_checks_a_gate_and_what_waits_is_started_when_it_opens(
    kind: str, gate: Gate
) -> None:
    text = "active" if kind == "lifecycle" else "/scan"
    history = begin(GUARD, gated(kind=kind, text=text), AFTER).feed(Clear())
    assert history.orders == [gate]
    assert history.started == ["guard", "lidar"]
    history.wait(2).feed(GateState("lidar", "/scan", is_open=True))
    assert history.started == ["guard", "lidar", "b"]
    assert history.all(ProcessReady) == [ProcessReady("lidar", "/scan", 2.0)]


def test_a_gate_that_stays_shut_is_reported_once_and_may_still_open() -> None:
    history = begin(GUARD, gated(timeout_s=3.0), AFTER).feed(
        Clear(), GateState("lidar", "topics /tf, /scan_raw", is_open=False)
    )
    assert history.sleep_until_due() == pytest.approx(3)
    (finding,) = history.late
    expect(finding, "TF817", "lidar", " 3 s", "/scan", "topics /tf, /scan_raw")
    assert len(history.wait(60).late) == 1
    assert history.started == ["guard", "lidar"]
    history.feed(GateState("lidar", "/scan", is_open=True))
    assert history.started[-1] == "b"


def test_a_gate_without_its_own_timeout_is_late_after_30_s_and_edges_never() -> None:
    history = begin(GUARD, gated(), SLAM).feed(Clear()).wait(29.9)
    assert history.late == []
    assert len(history.wait(0.2).late) == 1


def test_a_line_a_time_and_an_exit_code_open_their_gates() -> None:
    line, time = gated("line", kind="log", text="up"), gated("time", kind="time", number=2.0)
    code = gated("code", kind="exit", number=3.0)
    history = begin(
        line,
        time,
        code,
        *(run_process(f"after_{n}", after={n: "ready"}) for n in ("line", "time", "code")),
    )
    assert history.started == ["line", "time", "code"]
    assert history.sleep_until_due() == pytest.approx(2)
    assert history.started[3:] == ["after_time"]
    assert history.feed(LogMatched("line", "up and running")).started[4:] == ["after_line"]
    assert history.feed(Exited("code", 3)).started[5:] == ["after_code"]
    assert history.findings() == []


def test_an_exit_code_that_is_not_the_one_is_a_failure() -> None:
    history = begin(gated("code", kind="exit", number=3.0), STATIC).feed(Exited("code", 0))
    expect(history.only(), "TF808", "code", "exit code 0")


def test_tf_senders_are_observed_only_while_an_edges_gate_is_shut() -> None:
    slam = replace(SLAM, ready=Ready("edges", timeout_s=3.0))
    history = begin(GUARD, STATIC, slam).feed(
        Clear(), GateState("slam", "/tf: nobody", is_open=False)
    )
    assert history.orders == [Gate("slam", writers=("/tf", "/tf_static"))]
    history.wait(3)
    (late,) = history.late
    expect(late, "TF817", "slam", " 3 s", "map → odom", "/tf: nobody")
    assert history.feed(OwnerReady("slam")).orders[-1] == Gate("slam")


@pytest.mark.parametrize("restart", ["no", "on-failure"])
def test_one_that_was_ready_and_is_done_stays_what_others_wait_for(restart: RestartPolicy) -> None:
    both = run_process("both", after={"map": "ready", "lidar": "ready"})
    history = begin(run_process("map", restart), gated(kind="log"), both).feed(
        Exited("map", 0), LogMatched("lidar", "up")
    )
    assert history.started[-1] == "both"


def test_a_process_fails_with_the_reason_if_its_dependency_ended_unready() -> None:
    history = begin(STATIC, gated(), AFTER).feed(Exited("lidar", 0))
    assert history.started == ["static", "lidar", "b"], "without a guard nobody looks at a topic"
    history = begin(GUARD, STATIC, gated(), AFTER).feed(Clear(), Exited("lidar", 0))
    expect(history.findings()[-1], "TF808", "b", "lidar to be ready", "lidar has ended")
    assert history.state.stop


def test_lifecycle_nodes_are_driven_and_ready_means_that_they_are_there() -> None:
    slam = PlanProcess("lidar", "run", lifecycle={"/slam": "active"}, owns=(("map", "odom"),))
    history = begin(GUARD, slam, AFTER).feed(Clear(), OwnerReady("lidar"))
    assert history.orders == [Gate("lidar", nodes={"/slam": "active"}, drive=True)]
    assert history.started == ["guard", "lidar"]
    assert history.feed(GateState("lidar", "/slam is active", is_open=True)).started[-1] == "b"


def test_all_ready_is_reported_once_with_when_each_was_started_and_ready() -> None:
    history = begin(GUARD, STATIC, gated()).wait(1).feed(Clear()).wait(1)
    assert [notice.waiting for notice in history.all(AllStarted)] == [()]
    history.feed(Live("static", ("laser",)), OwnerReady("static"), TreeComplete(1)).wait(1)
    assert history.all(AllReady) == []
    history.feed(GateState("lidar", "x", is_open=True))
    (notices,) = history.all(AllReady)
    assert {row.process: (row.started, row.ready) for row in notices.rows} == {
        "guard": (0.0, 0.0),
        "static": (1.0, 2.0),
        "lidar": (1.0, 3.0),
    }
    assert notices.seconds == pytest.approx(3)


def test_after_another_plan_all_ready_tells_of_what_was_started_for_it() -> None:
    a = run_process("a")
    history = begin(GUARD, a, run_process("b")).feed(Clear()).wait(5)
    changed = replace(a, argv=("other",))
    history.feed(NewPlan(plan_of(GUARD, changed, run_process("b")), frozenset({"a"})))
    history.wait(1).feed(Exited("a", 0)).wait(1)
    notice = history.all(AllReady)[-1]
    assert {row.process: (row.started, row.ready) for row in notice.rows} == {"a": (1.0, 1.0)}


# Ends.


def test_max_restarts_is_the_plans() -> None:
    history = begin(replace(run_process("a", restart="on-failure"), max_restarts=2))
    for _ in range(2):
        history.feed(Exited("a", 1)).sleep_until_due()
    assert history.feed(Exited("a", 1)).states("a")[-1] == "fatal"
    expect(history.only(), "TF808", "a", "exit code 1", " 2 restarts")


def test_a_required_process_that_ends_ends_everything_even_when_it_is_done() -> None:
    history = begin(replace(run_process("a"), required=True), STATIC).feed(Exited("a", 0))
    expect(history.only(), "TF808", "a", "exit code 0", "requires")
    assert history.killed == [("static", SIGINT)]


@pytest.mark.parametrize(
    ("rule", "signals", "times"),
    [
        (StopRule("SIGTERM", 2.0), [SIGTERM, SIGKILL], [2]),
        (StopRule("SIGQUIT", 1.0), [SIGQUIT, SIGTERM, SIGKILL], [1, 1]),
        (StopRule("SIGINT"), [SIGINT, SIGTERM, SIGKILL], [5, 5]),
        (StopRule("SIGKILL"), [SIGKILL], []),
    ],
)
def test_the_signals_and_times_are_the_plans(
    rule: StopRule, signals: list[int], times: list[float]
) -> None:
    history = begin(replace(run_process("a"), stop=rule)).feed(Signalled(SIGINT))
    assert [history.sleep_until_due() for _ in times] == pytest.approx(times)
    assert [number for _, number in history.wait(60).killed] == signals


def test_everything_is_stopped_on_request_with_exit_code_0() -> None:
    history = begin(STATIC, run_process("a")).feed(DownRequest())
    assert history.killed == [("a", SIGINT), ("static", SIGINT)]
    assert history.feed(Exited("a", 0), Exited("static", 0)).exit_code == 0


# Requests.


def test_a_process_is_restarted_and_the_guard_is_informed_before_and_after() -> None:
    history = begin(GUARD, STATIC, SLAM).feed(Clear(), Live("slam", ("odom",)), OwnerReady("slam"))
    history.feed(ProcessRequest("restart", "slam"))
    assert history.killed == [("slam", SIGINT)]
    assert history.orders == [Absent("slam")]
    assert "odom" not in history.state.live
    history.feed(Exited("slam", -SIGINT))
    assert history.started == ["guard", "static", "slam", "slam"]
    assert history.orders[-1] == Present("slam")
    assert history.state.tracked["slam"].restarts == 1
    assert history.findings() == []


def test_a_process_that_was_stopped_stays_so_until_it_is_started() -> None:
    history = begin(STATIC, run_process("a", restart="always"))
    history.feed(ProcessRequest("stop", "a"), Exited("a", 1)).wait(60)
    assert (history.states("a")[-1], history.exit_code) == ("stopped", None)
    assert history.started == ["static", "a"]
    assert history.feed(ProcessRequest("start", "a")).started == ["static", "a", "a"]
    assert history.findings() == []


def test_a_process_that_ignores_a_request_to_stop_gets_a_firmer_signal() -> None:
    history = begin(STATIC, run_process("a")).feed(ProcessRequest("stop", "a"))
    assert [history.sleep_until_due(), history.sleep_until_due()] == pytest.approx([5, 5])
    assert history.killed == [("a", SIGINT), ("a", SIGTERM), ("a", SIGKILL)]


def test_a_process_that_awaits_its_restart_can_be_started_or_stopped() -> None:
    history = begin(STATIC, run_process("a", restart="always")).feed(Exited("a", 1))
    assert history.feed(ProcessRequest("start", "a")).started == ["static", "a", "a"]
    history.feed(Exited("a", 1), ProcessRequest("stop", "a")).wait(60)
    assert len(history.started) == 3


@pytest.mark.parametrize(
    ("name", "verb", "why"),
    [
        ("statik", "stop", "static?"),
        ("guard", "stop", "guard "),
        ("static", "start", "1002"),
        ("drive", "restart", "drive"),
    ],
)
def test_what_cannot_be_done_is_refused_with_the_reason(name: str, verb: Verb, why: str) -> None:
    history = begin(GUARD, STATIC, PlanProcess("drive", "external")).feed(Clear())
    assert why in (refusal(history.state, name, verb) or "")
    assert refusal(history.state, "guard", "restart") is None


def test_a_restarted_guard_learns_absent_owners_and_shut_gates() -> None:
    history = begin(GUARD, STATIC, SLAM, gated()).feed(
        Clear(), ProcessRequest("stop", "slam"), Exited("slam", 0)
    )
    history.orders.clear()
    history.feed(ProcessRequest("restart", "guard"), Exited("guard", 0))
    assert history.started[-1] == "guard"
    assert history.orders == [Absent("slam"), Gate("lidar", topic="/scan")]
    assert history.findings() == []


def test_a_guard_that_dies_is_restarted_with_its_reports_and_live_edges() -> None:
    history = begin(GUARD, STATIC, SLAM).feed(Clear(), Live("slam", ("odom",)), OwnerReady("slam"))
    history.feed(Remember({"a": 1, "b": 1}), Remember({"b": 2}))
    history.notices.clear()
    history.feed(Exited("guard", -SIGKILL, ("last words",)))
    expect(history.only(), "TF808", "guard", "SIGKILL", "guard: last words")
    assert history.only().severity == "warning"
    assert history.states("guard") == ["backoff"]
    assert history.state.live == {"odom"}
    assert history.sleep_until_due() == pytest.approx(1)
    assert (history.started[-1], history.state.memory) == ("guard", {"a": 1, "b": 2})
    assert history.orders == [Absent("static"), Present("static")]
    history.wait(0.5).feed(Clear())
    (back,) = history.all(RecoveredShown)
    assert (back.text.split()[0], back.text[-5:]) == ("guard", "1.5 s")
    assert (history.state.stop, history.state.reported, history.killed) == (None, frozenset(), [])
    assert history.state.tracked["guard"].restarts == 1


@pytest.mark.parametrize(
    ("mode", "did"), [("watch", "watched nothing"), ("strict", "forwarded nothing")]
)
def test_a_hanging_guard_is_reported_and_ends_like_one_that_dies(mode: str, did: str) -> None:
    history = begin(GUARD, STATIC, guard=GuardPolicy(mode)).feed(Clear(), Alive())  # type: ignore[arg-type]
    history.wait(9).feed(Alive())
    assert (history.sleep_until_due(), history.killed) == (
        10.0,
        [],
    ), "the launcher may have been kept from running"
    assert (history.sleep_until_due(), history.killed) == (5.0, [("guard", SIGKILL)])
    expect(history.only(), "TF808", "guard hangs", " 15 s", did)
    assert history.only().severity == "warning"
    history.wait(60).feed(Exited("guard", -SIGKILL)).wait(2)
    assert history.started[-1] == "guard"
    history.wait(60)
    assert len(history.killed) == 1, "the next one has not said yet that it looks"


def test_a_guard_that_is_heard_again_before_it_is_believed_to_hang_goes_on() -> None:
    history = begin(GUARD, STATIC).feed(Clear(), Alive())
    for _ in range(3):
        history.wait(3600)  # the launcher, or the whole machine, stood still
        history.wait(1).feed(Alive())
    assert (history.killed, history.findings()) == ([], [])


def test_silent_edges_do_not_count_as_live_until_they_are_heard_again() -> None:
    def counted() -> tuple[bool, tuple[str, ...], int]:
        answer = status(history.state, history.now)
        return answer.complete, answer.silent, answer.processes[1].live

    history = begin(GUARD, STATIC).feed(
        Clear(), Live("static", ("laser",)), OwnerReady("static"), TreeComplete(1)
    )
    assert counted() == (True, (), 1)
    history.feed(Silent(("laser",), over=False))
    assert counted() == (False, ("base_link → laser",), 0)
    history.feed(Silent(("laser",), over=True))
    assert counted() == (True, (), 1)
    history.feed(
        Remember({"a": 1}), Silent(("laser",), over=False), Exited("guard", -SIGKILL)
    ).wait(1)
    assert counted() == (True, (), 1), "the next guard says itself what is silent"


def test_a_strict_guard_that_dies_lets_nothing_pass_and_says_so() -> None:
    history = begin(GUARD, STATIC)
    history.state = replace(
        history.state, plan=replace(history.state.plan, guard=GuardPolicy("strict"))
    )
    expect(
        history.feed(Clear(), Exited("guard", 1)).only(), "TF808", "guard", "exit code 1", "/tf"
    )


def test_an_owner_that_ended_while_nobody_watched_must_be_observed_anew() -> None:
    slam = replace(SLAM, restart="always")
    history = begin(GUARD, slam).feed(Clear(), Live("slam", ("odom",)), Remember({"a": 1}))
    history.feed(Exited("guard", 1), Exited("slam", 1))
    history.orders.clear()
    history.wait(1)
    assert history.started == ["guard", "slam", "guard", "slam"]
    assert (history.orders[0], history.orders[-1]) == (Absent("slam"), Present("slam"))
    assert history.state.missing[0].child == "odom"


def test_a_guard_that_dies_again_and_again_ends_everything_with_1() -> None:
    history = begin(GUARD, STATIC).feed(Clear(), Remember({"a": 1}))
    for _ in range(5):
        history.feed(Exited("guard", 1)).sleep_until_due()
    history.feed(Exited("guard", 1))
    expect(history.findings()[-1], "TF808", "guard", "exit code 1", " 5 restarts")
    assert [finding.severity for finding in history.findings()] == ["warning"] * 5 + ["error"]
    assert history.feed(Exited("static", 0)).exit_code == 1


def test_a_guard_restarted_on_request_or_for_a_plan_has_no_memory() -> None:
    history = begin(GUARD, STATIC).feed(Clear(), Remember({"a": 1}), Live("static", ("laser",)))
    history.feed(ProcessRequest("restart", "guard"), Exited("guard", 0))
    assert (history.state.memory, history.state.live, history.findings()) == ({}, frozenset(), [])
    history.feed(Clear(), Remember({"a": 1}), Exited("guard", 1))
    history.feed(NewPlan(plan_of(GUARD, STATIC), frozenset({"guard"})))
    assert (history.state.memory, history.state.live, history.started[-1]) == (
        {},
        frozenset(),
        "guard",
    )


# Other plans.


def test_another_plan_restarts_changed_starts_new_and_stops_removed_ones() -> None:
    a, b, new = run_process("a"), run_process("b"), run_process("new")
    history = begin(STATIC, a, b)
    plan: Plan = plan_of(STATIC, replace(a, argv=("other",)), new)
    history.feed(NewPlan(plan, frozenset({"a"}), ("base_link → x",)))
    assert sorted(history.killed) == [("a", SIGINT), ("b", SIGINT)]
    assert history.started[3:] == ["new"]
    history.feed(Exited("a", 0), Exited("b", 0))
    assert history.started[3:] == ["new", "a"]
    assert list(history.state.tracked) == ["static", "a", "new"]
    assert history.all(Replanned) == [Replanned(("a",), ("new",), ("b",), ("base_link → x",))]
    assert history.findings() == []


def test_a_guard_that_goes_on_reads_another_plan() -> None:
    history = begin(GUARD, STATIC).feed(Clear())
    history.feed(NewPlan(plan_of(GUARD, STATIC), frozenset({"static"}), file="new.json"))
    assert Reread("new.json") in history.orders
    history.feed(NewPlan(plan_of(GUARD, STATIC), frozenset({"guard"}), file="newer.json"))
    assert Reread("newer.json") not in history.orders, "the next one reads it itself"


@pytest.mark.parametrize("runs", [True, False])
def test_a_running_follower_reads_the_plan_after_the_guard(runs: bool) -> None:  # noqa: FBT001
    history = begin(GUARD, STATIC).feed(Clear())
    if not runs:
        history.feed(ProcessRequest("stop", "static"), Exited("static", 0))
    before = list(history.killed)
    followers = frozenset({"static"})
    history.feed(NewPlan(plan_of(GUARD, STATIC), frozenset(), file="b.json", followers=followers))
    assert Reread("b.json") in history.orders
    assert history.followed == ([("static", "b.json", len(history.orders))] if runs else [])
    assert history.killed == before


DESCRIBED = replace(run_process("rsp"), params_file="params/rsp.yaml", nodes=("/rsp",))
GIVEN = DescriptionOrder("rsp", "/rsp", "b/params/rsp.yaml")


def given_a_description(*, guard: bool = True) -> History:
    guards = (GUARD,) if guard else ()
    history = begin(*guards, STATIC, DESCRIBED).feed(*[Clear()] * int(guard))
    plan = plan_of(*guards, STATIC, DESCRIBED)
    return history.feed(NewPlan(plan, frozenset(), (), "b/plan.json", frozenset({"rsp"})))


def test_the_guard_gives_a_process_a_new_description_and_nothing_restarts() -> None:
    history = given_a_description()
    assert GIVEN in history.orders
    history.feed(DescriptionState("rsp"))
    assert history.killed == []
    assert history.all(Replanned) == [Replanned(described=("rsp",))]


def test_a_process_that_refuses_its_description_is_started_anew() -> None:
    history = given_a_description().feed(DescriptionState("rsp", "not a URDF"))
    assert history.killed == [("rsp", SIGINT)]
    assert history.state.tracked["rsp"].should_run, "nothing is ready without it"
    assert history.feed(Exited("rsp", 0)).started[-1] == "rsp"
    assert history.all(Replanned)[-1] == Replanned(("rsp",))
    before = list(history.killed)
    assert history.feed(DescriptionState("rsp", "late")).killed == before, "it was answered"


def test_a_guard_that_follows_gives_the_description_that_was_not_taken() -> None:
    history = given_a_description().feed(Exited("guard", 1))
    history.sleep_until_due()
    assert history.orders.count(GIVEN) == 2
    history.feed(DescriptionState("rsp"), Exited("guard", 1)).sleep_until_due()
    assert history.orders.count(GIVEN) == 2


def test_a_process_that_started_anew_has_read_its_description() -> None:
    history = given_a_description().feed(ProcessRequest("restart", "rsp"), Exited("rsp", 0))
    history.feed(DescriptionState("rsp", "it does not answer")).feed(Exited("guard", 1))
    history.sleep_until_due()
    assert (history.orders.count(GIVEN), history.killed) == (1, [("rsp", SIGINT)])


def test_without_a_guard_a_new_description_is_a_restart() -> None:
    history = given_a_description(guard=False)
    assert (history.killed, history.orders) == ([("rsp", SIGINT)], [])


def test_a_tree_stays_complete_where_another_plan_changes_nothing_of_it() -> None:
    a = run_process("a")
    history = begin(GUARD, STATIC, a).feed(
        Clear(), Live("static", ("laser",)), OwnerReady("static"), TreeComplete(1)
    )
    history.feed(
        NewPlan(plan_of(GUARD, STATIC, replace(a, argv=("other",))), frozenset({"a"})),
        Exited("a", 0),
    )
    assert status(history.state, history.now).complete
    history.feed(
        NewPlan(plan_of(GUARD, replace(STATIC, argv=("other",)), a), frozenset({"static"}))
    )
    assert not status(history.state, history.now).complete, "its owner is restarted"
    history.feed(Exited("static", 0), Live("static", ("laser",)), OwnerReady("static"))
    history.feed(NewPlan(plan_of(GUARD, STATIC, SLAM), frozenset()))
    assert not status(history.state, history.now).complete, "an edge is new"
