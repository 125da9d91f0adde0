"""Switched edges, loops, self-loops, edges open to anybody, and how they are published."""

import time
from dataclasses import replace

import pytest

from tests.support.findings import expect, words_of
from tests.support.guard_history import EDGES, PROCESSES, SETTLE_S, TOOL, History
from tfcompose.guard.judge import Judge
from tfcompose.guard.ledger import MOST_UNDECLARED, MOST_VERDICT_EDGES
from tfcompose.model.messages import EdgeTaken, FindingShown
from tfcompose.model.plan import EdgePattern, GuardPolicy, Plan, PlanProcess, RosSettings
from tfcompose.tf.live.publishers import Publisher


def test_the_owner_may_hang_a_switched_edge_only_on_its_declared_parents() -> None:
    history = History(edges=(*EDGES, TOOL)).clear()
    changer = history.joins("/changer")
    for parent in ("arm", "rack_1", "rack_2", "arm"):
        history.repeat(changer, f"{parent} tool", 5)
    assert history.reports() == []
    history.repeat(changer, "table tool", 10)
    expect(history.only(), "TF802", "changer (/changer)", "table → tool", "arm → tool")


def test_another_node_may_publish_a_switched_edge_on_none_of_its_parents() -> None:
    history = History(edges=(*EDGES, TOOL)).clear()
    history.repeat(history.joins("/changer"), "arm tool", 5)
    history.repeat(history.joins("/rogue"), "rack_1 tool", 10)
    expect(history.only(), "TF801", "/rogue")


@pytest.mark.parametrize(
    "policy",
    [GuardPolicy(), GuardPolicy(allow=(EdgePattern("*", "*"),)), GuardPolicy("watch", "ignore")],
)
def test_an_edge_that_closes_a_loop_is_always_an_error_and_names_the_loop(
    policy: GuardPolicy,
) -> None:
    running = History(policy).clear()
    running.repeat(running.joins("/rogue"), "base map", 5)
    expect(
        running.only(), "TF820", "map → odom → base → map", "base → map from /rogue", "stop /rogue"
    )
    assert running.only().severity == "error"


def test_a_loop_through_several_strangers_is_found_at_its_last_edge(
    running: History,
) -> None:
    first, second = running.joins("/one"), running.joins("/other")
    for _ in range(5):
        running.send(first, "base cup").send(second, "cup map").wait(0.1)
    loop = next(finding.message for finding in running.findings() if finding.code == "TF820")
    assert loop.endswith("cup → map from /other")
    assert "the frames map → odom → base → cup → map" in next(
        reports for reports in running.reports() if "TF820" in reports
    )


def test_a_loop_of_allowed_foreign_frames_is_not_reported() -> None:
    running = History(
        GuardPolicy(allow=(EdgePattern("cup", "saucer"), EdgePattern("saucer", "cup")))
    ).clear()
    running.repeat(running.joins("/waiter"), "cup saucer, saucer cup", 10)
    assert running.reports() == []


def test_an_edge_that_others_stopped_sending_closes_no_loop_any_more(running: History) -> None:
    first = running.joins("/one")
    running.repeat(first, "base cup", 3).leaves(first)
    running.wait(12).repeat(running.joins("/other"), "cup map", 3)
    assert [reports[:5] for reports in running.reports()] == ["TF803", "TF803"]


def test_a_stranger_that_sends_for_long_closes_a_loop_all_the_same(running: History) -> None:
    first = running.joins("/one")
    running.repeat(first, "base cup", 200)
    running.send(running.joins("/other"), "cup map").send(first, "base cup").wait(0.2)
    assert "TF820" in [reports[:5] for reports in running.reports()]


def test_the_end_of_a_loop_and_a_loop_before_the_start_are_reported(
    running: History,
) -> None:
    rogue = running.joins("/rogue")
    running.repeat(rogue, "base map", 5).leaves(rogue)
    (over,) = running.wait(4).over()
    assert words_of(over) >= {"base", "map", "/rogue"}
    early = History()
    early.repeat(early.joins("/rogue"), "base map", 20)
    assert early.all(FindingShown) == []
    assert isinstance(early.events[0], EdgeTaken)
    expect(early.only(), "TF807", "base → map", "/rogue", "map → odom → base → map")


def test_two_nodes_that_publish_one_allowed_frame_are_named(running: History) -> None:
    running = History(GuardPolicy(allow=(EdgePattern("*", "person_*"),))).clear()
    a, b = running.joins("/a"), running.joins("/b")
    for _ in range(10):
        running.send(a, "map person_1").send(b, "odom person_1").wait(0.1)
    assert len(running.findings()) in {1, 2}
    for finding in running.findings():
        expect(finding, "TF822", "person_1", "/a", "/b")


def test_a_node_that_was_started_anew_is_no_second_writer() -> None:
    running = History(GuardPolicy(allow=(EdgePattern("*", "person_*"),))).clear()
    for _ in range(3):
        tracker = running.joins("/tracker")
        running.repeat(tracker, "map person_1", 5).leaves(tracker)
    assert running.reports() == []


@pytest.mark.parametrize("static", [False, True])
def test_a_best_effort_writer_is_reported_once(running: History, static: bool) -> None:  # noqa: FBT001
    writer = Publisher(b"w" * 16, "/slam", static, reliable=False)
    for _ in range(5):
        running.events += running.judge.graph([writer], running.now)
    topic = "/tf_static" if static else "/tf"
    expect(running.only(), "TF826", "/slam", f"{topic} ")


def test_only_the_plans_own_nodes_leak_to_the_global_topic() -> None:
    plan = Plan("rover", "0", "base", RosSettings("/rover"), EDGES, PROCESSES)
    judge = Judge(plan, SETTLE_S, 0.0, 0)
    writers = [
        Publisher(bytes([n]) * 16, node, static=n == 1)
        for n, node in enumerate(
            ["/rover/ekf", "/rover/static", "/other/ekf", None, "/roverette/ekf"]
        )
    ]
    events = [
        event
        for _ in range(3)
        for event in judge.leaks(writers, ("/rover/tf", "/rover/tf_static"))
    ]
    first, second = [event.found for event in events if isinstance(event, FindingShown)]
    expect(first, "TF827", "/rover/ekf", " /tf,", "/rover/tf")
    expect(second, "TF827", "/rover/static", " /tf_static,", "/rover/tf_static")


def test_where_a_publisher_runs_is_a_note(running: History) -> None:
    rogue = running.joins("/rogue")
    running.events += running.judge.graph(
        [Publisher(rogue.gid, "/rogue", static=False, where="on another machine")], running.now
    )
    running.send(rogue, "map odom")
    running.events += running.judge.tick(running.now + 0.1)
    expect(running.only(), "TF801", "/rogue", "another machine")


def test_the_process_that_can_be_stopped_is_named_only_where_it_is_sure() -> None:
    running = History(
        processes=tuple(replace(process, nodes=(f"/{process.name}",)) for process in PROCESSES)
    ).clear()
    running.repeat(running.joins("/slam", process="slam"), "odom base", 3)
    running.repeat(running.joins("/rogue", process=""), "base lidar", 3)
    running.repeat(running.joins("/drive", process=""), "base camera", 3)
    events = [event for event in running.events if isinstance(event, FindingShown)]
    assert [(event.found.code, event.process) for event in events] == [
        ("TF801", "slam"),
        ("TF801", ""),
        ("TF801", ""),
    ]


def test_a_guard_that_goes_on_knows_the_processes_that_another_plan_adds() -> None:
    running = History().clear()
    mapper = PlanProcess("mapper", "run", nodes=("/mapper",))
    plan = running.judge.plan
    running.judge.follow(replace(plan, processes=(*plan.processes, mapper)))
    running.repeat(running.joins("/mapper", process="mapper"), "odom base", 3)
    events = [event for event in running.events if isinstance(event, FindingShown)]
    assert [(event.found.code, event.process) for event in events] == [("TF801", "mapper")]


@pytest.mark.parametrize(
    ("edges", "advice"),
    [
        ("odom base", "owner: slam"),
        ("map base", "let /mapper"),
    ],
)
def test_an_own_program_is_advised_to_omit_the_edge_and_not_to_end(
    edges: str, advice: str
) -> None:
    slam = next(process for process in PROCESSES if process.name == "slam")
    history = History(
        processes=(
            *(process for process in PROCESSES if process != slam),
            replace(slam, nodes=("/mapper",)),
        )
    ).clear()
    history.repeat(history.joins("/mapper"), edges, 5).repeat(history.joins("/rogue"), edges, 5)
    own_finding, stranger = history.findings()
    expect(own_finding, own_finding.code, advice)
    expect(stranger, own_finding.code, "stop /rogue")


# Floods: what nobody declared is judged up to a bound, what is declared always.


def flood_of(count: int, begin: int = 0) -> str:
    return ", ".join(f"f{number} f{number + 1}" for number in range(begin, begin + count))


def test_an_undeclared_flood_is_reported_once_and_declared_edges_judged() -> None:
    running = History(GuardPolicy(mode="strict")).clear()
    rogue, slam = running.joins("/rogue"), running.joins("/slam")
    running.check().send(rogue, flood_of(3000)).wait(0.2)
    running.send(rogue, f"{flood_of(3000)}, map odom").wait(0.2)
    assert running.admitted == frozenset()
    running.send(slam, "map odom")
    assert running.admitted is None
    running.wait(1)
    codes = [finding.code for finding in running.findings()]
    assert codes.count("TF853") == 1
    assert "TF801" in codes, "the declared edge in the flood"
    expect(
        next(finding for finding in running.findings() if finding.code == "TF853"),
        "TF853",
        "/rogue",
        "3,000 frames",
    )


@pytest.mark.parametrize("more", [0, 1])
def test_a_flood_begins_with_one_edge_more_than_the_bound(more: int) -> None:
    running = History().clear()
    rogue = running.joins("/rogue")
    running.check().send(rogue, flood_of(MOST_UNDECLARED + more)).wait(1)
    assert (rogue.gid in running.judge.ledger.flooders) == bool(more)


def test_a_flood_is_reported_with_how_much_and_how_often() -> None:
    running = History().clear()
    rogue = running.joins("/rogue")
    running.check()
    for _ in range(25):
        running.judge.report_flood(rogue.gid, 10_000, running.now)
        running.wait(0.05)
    expect(
        next(finding for finding in running.findings() if finding.code == "TF853"),
        "TF853",
        "/rogue",
        "10,000 frames",
        "20 Hz",
    )


def test_others_are_judged_during_a_flood_and_what_is_allowed_passes() -> None:
    allow = (EdgePattern(parent="map", child="person_*"),)
    running = History(GuardPolicy(mode="strict", allow=allow)).clear()
    rogue, tracker = running.joins("/rogue"), running.joins("/tracker")
    running.check().send(rogue, f"{flood_of(3000)}, map person_7").wait(0.2)
    assert running.admitted == frozenset({("map", "person_7")})
    running.send(tracker, "map person_1").send(tracker, "map person_2, map cup").wait(1)
    assert running.admitted == frozenset({("map", "person_2")})
    reported = [
        (finding.code, word)
        for finding in running.findings()
        for word in ("/rogue", "/tracker")
        if word in finding.message
    ]
    assert sorted(set(reported)) == [
        ("TF803", "/rogue"),
        ("TF803", "/tracker"),
        ("TF853", "/rogue"),
    ]


def test_edges_with_ever_new_names_are_remembered_up_to_a_bound() -> None:
    running = History().clear()
    rogue = running.joins("/rogue")
    running.check()
    for number in range(60):
        running.send(rogue, flood_of(500, number * 500)).wait(0.1)
    assert len(running.judge.ledger.entries) <= MOST_UNDECLARED + len(EDGES) + 500
    judged = running.judge.ledger._judged
    assert sum(len(edges) for _, _, edges in judged) <= MOST_VERDICT_EDGES
    assert [finding.code for finding in running.findings()].count("TF853") == 1


def test_the_cost_of_a_chain_grows_with_its_edges_and_not_faster() -> None:
    def seconds(edges: int) -> float:
        running = History().clear()
        rogue = running.joins("/rogue")
        message = flood_of(edges)
        begun = time.process_time()
        running.check().send(rogue, message).send(rogue, message)
        return time.process_time() - begun

    seconds(100)
    assert min(seconds(8000) for _ in range(3)) < 16 * min(seconds(1000) for _ in range(3))
