"""Histories of containers and their components, replayed to the process machine."""

from dataclasses import replace
from signal import SIGINT, SIGKILL
from typing import Any

import pytest

from tests.support.findings import expect
from tests.support.machine_history import GUARD, History, begin, run_process
from tfcompose.launcher.components import writer_of
from tfcompose.launcher.events import (
    Exited,
    NewPlan,
    Order,
    Start,
    Started,
    Tick,
)
from tfcompose.launcher.machine import step
from tfcompose.launcher.readiness import waits_for
from tfcompose.model.messages import (
    Absent,
    Clear,
    ComponentOrder,
    ComponentState,
    DownRequest,
    GateState,
    Live,
    OwnerReady,
    Present,
    ProcessRequest,
    Remember,
)
from tfcompose.model.plan import Component, PlanProcess, Ready

BOX = PlanProcess(
    "box", "run", ("box",), nodes=("/box",), ready=Ready("service", "/box/_container/load_node")
)


def component(name: str, **more: Any) -> PlanProcess:
    after = {"box": "ready"} | more.pop("after", {})
    return PlanProcess(
        name,
        "component",
        nodes=(f"/{name}",),
        component=Component("box", "demo", f"demo::{name}"),
        after=after,
        **more,
    )


def loaded(*components: PlanProcess, box: PlanProcess = BOX) -> History:
    """Return a history in which the container has loaded all of them."""
    history = begin(GUARD, box, *components).feed(Clear(), GateState("box", "there", is_open=True))
    return history.answer(*(process.name for process in components))


def test_components_load_in_plan_order_once_their_container_is_ready() -> None:
    history = begin(GUARD, component("b"), component("a"), BOX).feed(Clear())
    assert history.started == ["guard", "box"]
    assert history.loads() == []
    history.feed(GateState("box", "there", is_open=True))
    assert history.loads() == ["b", "a"]
    assert history.started == ["guard", "box"], (
        "no process of the operating system is started for them"
    )
    assert history.answer("a", "b").states("a") == ["starting", "running"]
    assert history.state.tracked["a"].pid == history.state.tracked["box"].pid


def test_what_waits_for_a_component_follows_it_and_its_edges_make_it_ready() -> None:
    owner = component("odo", owns=(("odom", "base_link"),))
    history = begin(GUARD, BOX, owner, run_process("nav", after={"odo": "ready"})).feed(Clear())
    history.feed(GateState("box", "there", is_open=True)).answer("odo")
    assert history.started == ["guard", "box"]
    history.feed(Live("odo", ("base_link",)), OwnerReady("odo"))
    assert history.started == ["guard", "box", "nav"]


def test_a_failed_component_ends_everything_with_the_containers_text() -> None:
    history = begin(GUARD, BOX, component("a")).feed(
        Clear(), GateState("box", "there", is_open=True)
    )
    history.answer("a", why="/box did not load demo/demo::a: no such class")
    expect(history.only(), "TF808", "a", "/box", "no such class")
    assert [name for name, _ in history.killed] == ["box"]
    assert history.feed(Exited("box", 0), Exited("guard", 0)).exit_code == 1


def test_an_optional_component_that_fails_leaves_the_rest_running() -> None:
    history = begin(GUARD, BOX, component("a", required=False), component("b")).feed(
        Clear(), GateState("box", "there", is_open=True)
    )
    history.answer("a", why="no device").answer("b")
    assert history.only().severity == "warning"
    assert history.state.tracked["b"].state == "running"
    assert history.killed == []


@pytest.mark.parametrize("policy", ["on-failure", "always"])
def test_a_component_is_loaded_again_after_a_while_as_its_policy_says(policy: Any) -> None:
    history = begin(GUARD, BOX, component("a", restart=policy, max_restarts=1)).feed(
        Clear(), GateState("box", "there", is_open=True)
    )
    history.answer("a", why="no device")
    assert history.states("a")[-1] == "backoff"
    assert history.sleep_until_due() == pytest.approx(1.0)
    assert history.loads() == ["a", "a"]
    history.answer("a", why="no device")
    expect(history.only(), "TF808", "no device", "1 restart")


def test_a_container_that_dies_comes_back_with_its_components_in_order() -> None:
    box = replace(BOX, restart="on-failure")
    history = loaded(component("b", owns=(("odom", "base_link"),)), component("a"), box=box)
    history.feed(Live("b", ("base_link",)), OwnerReady("b"), Exited("box", -SIGKILL))
    assert history.states("a")[-1] == history.states("b")[-1] == "stopped"
    assert Absent("b") in history.orders, "its silence is nobody's fault"
    history.wait(1.0)
    assert history.loads() == ["b", "a"], "not before the container is ready again"
    history.feed(GateState("box", "there", is_open=True))
    assert history.loads() == ["b", "a", "b", "a"]
    assert history.orders.count(Present("b")) == 1
    history.answer("b", "a")
    assert [history.state.tracked[name].restarts for name in ("box", "a", "b")] == [1, 1, 1]
    assert history.findings() == []


def test_an_answer_of_the_old_container_does_not_count_for_the_new_one() -> None:
    box = replace(BOX, restart="on-failure")
    history = begin(GUARD, box, component("a")).feed(
        Clear(), GateState("box", "there", is_open=True)
    )
    before = history.requested[-1]
    history.feed(Exited("box", -SIGKILL))
    assert history.orders[-1] == Absent("a"), "the guard forgets what it was ordered"
    history.wait(1.0).feed(GateState("box", "there", is_open=True))
    assert history.requested[-1].number != before.number
    history.requested.append(before)
    history.answer("a", why="went away")
    assert history.state.tracked["a"].state == "starting"


def test_a_container_that_ends_for_good_takes_its_components_with_it() -> None:
    history = loaded(component("a", required=False), box=replace(BOX, required=False))
    history.feed(Exited("box", 3))
    codes = [(finding.code, finding.severity) for finding in history.findings()]
    assert codes == [("TF808", "warning"), ("TF808", "warning")]
    expect(history.findings()[1], "TF808", "a", "box")


def test_a_component_is_stopped_started_and_restarted_alone() -> None:
    history = loaded(component("a"), component("b"))
    number = history.requested[-1].number
    history.feed(ProcessRequest("stop", "b"))
    assert history.requested[-1] == ComponentOrder("b", number, "unload")
    assert history.answer("b").states("b")[-2:] == ["stopping", "stopped"]
    history.wait(60).feed(ProcessRequest("start", "b")).answer("b")
    assert history.states("b")[-1] == "running"
    history.feed(ProcessRequest("restart", "b")).answer("b").answer("b")
    assert history.states("b")[-4:] == ["stopping", "stopped", "starting", "running"]
    assert history.killed == []
    assert history.states("a") == ["starting", "running"]


def test_a_component_that_is_stopped_while_it_is_loaded_is_unloaded() -> None:
    history = begin(GUARD, BOX, component("a")).feed(
        Clear(), GateState("box", "there", is_open=True), ProcessRequest("stop", "a")
    )
    assert history.requested[-1].do == "unload"
    assert history.answer("a").state.tracked["a"].state == "stopped"


def test_a_restarted_container_reloads_all_but_stopped_components() -> None:
    history = loaded(component("a"), component("b")).feed(ProcessRequest("stop", "b")).answer("b")
    history.feed(ProcessRequest("restart", "box"))
    assert history.killed == [("box", SIGINT)]
    assert history.states("a")[-1] == "stopped"
    history.feed(Exited("box", 0), GateState("box", "there", is_open=True)).answer("a")
    assert history.loads() == ["a", "b", "a"]
    assert history.state.tracked["b"].state == "stopped"


def test_a_full_stop_unloads_no_component_and_ends_in_order() -> None:
    history = loaded(component("a"), component("b", after={"a": "ready"})).feed(
        GateState("box", "there", is_open=True)
    )
    history.answer("b")
    history.feed(DownRequest())
    assert not any(request.do == "unload" for request in history.requested)
    assert history.killed == [("box", SIGINT)]
    assert history.feed(Exited("box", 0), Exited("guard", 0)).exit_code == 0


def test_a_stop_of_everything_waits_for_no_answer_of_a_container() -> None:
    history = (
        begin(GUARD, BOX, component("a"), component("b"))
        .feed(Clear(), GateState("box", "there", is_open=True))
        .answer("b")
    )
    history.feed(ProcessRequest("stop", "b"), DownRequest())
    assert history.killed == [("box", SIGINT)]
    assert history.feed(Exited("box", 0), Exited("guard", 0)).exit_code == 0


def test_components_of_an_external_container_are_unloaded_at_the_end() -> None:
    box = replace(BOX, kind="external", argv=())
    history = loaded(component("a"), box=box).feed(DownRequest())
    assert history.requested[-1] == ComponentOrder("a", history.requested[0].number, "unload")
    assert history.killed == []
    history.answer("a")
    assert history.feed(Exited("guard", 0)).exit_code == 0


def test_a_guard_that_follows_another_is_given_what_is_not_answered_yet() -> None:
    history = (
        begin(GUARD, BOX, component("a"), component("b"))
        .feed(Clear(), GateState("box", "there", is_open=True))
        .answer("b")
    )
    first, second = history.requested
    history.feed(Exited("guard", 1)).wait(1.0)
    again = [
        ComponentOrder(name, number, "load", again=True)
        for name, number in (("a", first.number), ("b", second.number))
    ]
    assert history.requested[2:] == again
    history.answer("b")
    assert history.states("b") == ["starting", "running"], "it runs already"


def test_a_component_without_its_containers_answer_is_reported_once() -> None:
    history = begin(GUARD, BOX, component("a")).feed(
        Clear(), GateState("box", "there", is_open=True)
    )
    history.wait(31).wait(31)
    (finding,) = history.late
    expect(finding, "TF817", "a", "box")
    assert waits_for(history.state, history.state.tracked["a"]).startswith("box")


def test_a_changed_component_is_reloaded_and_a_removed_one_is_unloaded() -> None:
    history = loaded(component("a"), component("b"))
    plan = replace(
        history.plan,
        processes=tuple(process for process in history.plan.processes if process.name != "b"),
    )
    history.feed(NewPlan(plan, frozenset({"a"})))
    assert [(request.do, request.process) for request in history.requested[2:]] == [
        ("unload", "b"),
        ("unload", "a"),
    ]
    history.answer("b", "a")
    assert "b" not in history.state.tracked
    before = history.state
    history.answer("b")
    assert history.state == before, "it was answered, and is of the plan no more"
    assert history.loads() == ["a", "b", "a"]


def test_a_container_removed_by_another_plan_takes_its_components_along() -> None:
    history = loaded(component("a"))
    history.feed(NewPlan(replace(history.plan, processes=(GUARD,)), frozenset()))
    history.feed(Exited("box", 0))
    assert set(history.state.tracked) == {"guard"}


def test_a_line_of_a_container_is_of_the_component_whose_logger_wrote_it() -> None:
    state = loaded(component("a"), replace(component("b"), nodes=("/front/b",))).state
    lines = {
        "[INFO] [1795427604.518547811] [a]: up": "a",
        "[WARN] [1795427604.518547811] [front.b]: hot": "b",
        "\x1b[33m[WARN] [1795427604.5] [front.b.rclcpp_lifecycle]: late\x1b[0m": "b",
        "[INFO] [1795427604.518547811] [box]: Load Library: liba.so": "box",
        "[INFO] [1795427604.518547811] [ab]: another": "box",
        "terminate called": "box",
    }
    assert {line: writer_of(state, "box", line) for line in lines} == lines
    assert writer_of(state, "guard", "[a]") == "guard"


def gone(history: History, name: str) -> History:
    number = history.state.tracked[name].order
    return history.feed(ComponentState(name, number, "unloaded", f"/box has no /{name} any more"))


def test_a_component_unloaded_by_others_reloads_as_its_policy_says() -> None:
    history = gone(loaded(component("a")), "a")
    expect(history.only(), "TF808", "a", "/box")
    assert [name for name, _ in history.killed] == ["box"]
    history = gone(loaded(component("a", restart="on-failure", owns=(("odom", "base"),))), "a")
    assert history.findings() == []
    assert history.orders[-1] == Absent("a")
    history.wait(1.0).answer("a")
    assert history.states("a")[-3:] == ["backoff", "starting", "running"]


def test_a_load_that_fails_slowly_is_given_up_as_one_that_fails_at_once() -> None:
    history = begin(GUARD, BOX, component("a", restart="on-failure", max_restarts=1))
    history.feed(Clear(), GateState("box", "there", is_open=True))
    for _ in range(2):
        history.wait(25).answer("a", why="no device").wait(1.0)
    assert history.state.tracked["a"].state == "fatal"


def test_a_successor_guard_hears_of_an_owner_before_it_loads_it() -> None:
    history = begin(GUARD, BOX, component("a", owns=(("odom", "base"),))).feed(
        Clear(), Remember({"x": 1})
    )
    history.feed(GateState("box", "there", is_open=True), Exited("guard", 1))
    actions = step(history.wait(0.9).state, Tick(), history.now + 0.1)[1]
    again = step(
        step(history.state, Tick(), history.now + 0.1)[0], Started("guard", 9), history.now + 0.1
    )[1]
    assert Start("guard") in actions
    orders = [request.order if isinstance(request, Order) else request for request in again]
    load = next(order for order in orders if isinstance(order, ComponentOrder))
    assert orders.index(load) > orders.index(Present("a")) > orders.index(Absent("a"))
