"""A plan over several machines: what each starts, and what it expects of the others."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.support.findings import expect
from tests.support.plans import compiled_plan
from tests.support.robots import ON_TWO_HOSTS
from tfcompose.foundation.findings import Finding, RejectedError
from tfcompose.guard.verdict.ownership import relays_of
from tfcompose.launcher.runtime_dir import runtime_dir_of
from tfcompose.model.plan import Plan, PlanHost, Ready
from tfcompose.model.plan.file import read_plan, write_plan
from tfcompose.model.plan.hosts import describe_share, hosts_of, share_of
from tfcompose.model.plan.topics import partition_of

NAMED = ON_TWO_HOSTS + "  static: {host: main}\n"


def started(plan: Plan | Finding) -> set[str]:
    assert isinstance(plan, Plan), plan
    return {process.name for process in plan.processes if process.kind != "external"}


@pytest.mark.parametrize(
    ("text", "machines"),
    [
        (ON_TWO_HOSTS, [("jetson", "x"), (None, "x")]),
        (NAMED, [("jetson", "x"), ("main", "x")]),
        (NAMED, [(None, "jetson.lan"), (None, "main")]),
    ],
)
def test_exactly_one_machine_starts_each_process_and_each_its_guard(
    text: str, machines: list[tuple[str | None, str]]
) -> None:
    plan = compiled_plan(text)
    shares = [started(share_of(plan, requested, machine)) for requested, machine in machines]
    assert all("guard" in share for share in shares)
    assert all((a & b) == {"guard"} for a, b in pairwise(shares))
    assert set().union(*shares) == {process.name for process in plan.processes}


def test_what_names_no_host_runs_where_static_does() -> None:
    plan = compiled_plan(NAMED)
    assert {process.name: process.host for process in plan.processes} == {
        "static": "main",
        "drive": "main",
        "arm_drive": "jetson",
        "guard": None,
    }
    assert hosts_of(plan) == ("main", "jetson")


def test_each_machine_sees_all_edges_with_their_owners() -> None:
    plan = compiled_plan(ON_TWO_HOSTS)
    for requested in ("jetson", None):
        share = share_of(plan, requested, "elsewhere")
        assert isinstance(share, Plan)
        assert share.edges == plan.edges
        assert [process.owns for process in share.processes] == [
            process.owns for process in plan.processes
        ]


def test_a_plan_without_hosts_is_complete_on_every_machine() -> None:
    plan = compiled_plan(ON_TWO_HOSTS.replace(", host: jetson", ""))
    assert share_of(plan, None, "jetson") is plan
    assert describe_share(plan) == ()


@pytest.mark.parametrize(
    ("text", "requested", "names"),
    [
        (ON_TWO_HOSTS, "jetsn", ["rover", "jetsn", "jetson?"]),
        (NAMED, "zzz", ["rover", "zzz", "main, jetson"]),
        (NAMED, None, ["desk", "rover", "--host main", "--host jetson"]),
        (ON_TWO_HOSTS.replace(", host: jetson", ""), "a", ["rover", " a", "--host"]),
    ],
)
def test_a_host_that_the_plan_does_not_know_is_a_finding(
    text: str, requested: str | None, names: list[str]
) -> None:
    result = share_of(compiled_plan(text), requested, "desk")
    assert isinstance(result, Finding)
    expect(result, "TF819", *names)


STRICT = "guard: {mode: strict}\n"


def test_each_machine_of_a_strict_plan_has_a_fence_and_hears_other_guards() -> None:
    plan = compiled_plan(ON_TWO_HOSTS + STRICT)
    shares = [
        share
        for requested in ("jetson", None)
        if isinstance(share := share_of(plan, requested, "x"), Plan)
    ]
    assert [{edge.child: edge.node for edge in share.edges} for share in shares] == [
        {"base_link": "/tfcompose_guard", "lidar": "/tfcompose_guard", "arm": "/arm_drive"},
        {"base_link": "/drive", "lidar": "/tfcompose_static", "arm": "/tfcompose_guard_jetson"},
    ]
    assert [partition_of(share) for share in shares] == ["tfc_rover.jetson", "tfc_rover"]
    for each_plan in (plan, *shares):
        assert relays_of(each_plan) == {"/tfcompose_guard", "/tfcompose_guard_jetson"}


def test_a_strict_guard_on_one_machine_passes_on_no_edges_of_others() -> None:
    result = share_of(
        compiled_plan(ON_TWO_HOSTS + "  guard: {host: jetson}\n" + STRICT), "jetson", "x"
    )
    assert isinstance(result, Finding)
    expect(result, "TF819", "jetson", "guard: {mode: watch}")


def test_a_share_is_saved_and_read_and_has_a_folder_of_its_own(tmp_path: Path) -> None:
    tmp_path.chmod(0o700)
    env = {"XDG_RUNTIME_DIR": str(tmp_path), "ROS_DOMAIN_ID": "7"}
    plan = compiled_plan(ON_TWO_HOSTS)
    jetson, main = share_of(plan, "jetson", "x"), share_of(plan, None, "x")
    assert isinstance(jetson, Plan)
    assert isinstance(main, Plan)
    assert read_plan(write_plan(jetson), "plan.json") == jetson
    assert read_plan(write_plan(main), "plan.json") == main
    assert [runtime_dir_of(share, env).name for share in (plan, main, jetson)] == [
        "rover@7",
        "rover@7",
        "rover.jetson@7",
    ]


def test_two_guards_have_two_names() -> None:
    plan = compiled_plan(ON_TWO_HOSTS)
    nodes = [
        share.process("guard").nodes
        for requested in ("jetson", None)
        if isinstance(share := share_of(plan, requested, "x"), Plan)
    ]
    assert nodes == [("/tfcompose_guard_jetson",), ("/tfcompose_guard",)]


def test_a_guard_with_a_host_judges_there_only() -> None:
    plan = compiled_plan(ON_TWO_HOSTS + "  guard: {host: jetson}\n")
    modes = [
        share.guard.mode
        for requested in ("jetson", None)
        if isinstance(share := share_of(plan, requested, "x"), Plan)
    ]
    assert modes == ["watch", "off"]


def test_what_only_the_own_launcher_sees_is_not_waited_for_from_elsewhere() -> None:
    """A line of output and a code are not seen from another machine.

    A lifecycle state is, and is driven there.
    """
    plan = compiled_plan(ON_TWO_HOSTS)
    cases: list[tuple[dict[str, Any], Ready | None]] = [
        ({"ready": Ready("log", "up")}, None),
        ({"ready": Ready("topic", "/scan")}, Ready("topic", "/scan")),
        ({"lifecycle": {"/arm_drive": "active"}}, Ready("lifecycle", "active")),
    ]
    for fields, expected in cases:
        processes = tuple(
            replace(p, **fields) if p.name == "arm_drive" else p for p in plan.processes
        )
        share = share_of(replace(plan, processes=processes), None, "x")
        assert isinstance(share, Plan)
        arm = share.process("arm_drive")
        assert (arm.ready, arm.lifecycle) == (expected, {})


def test_the_plan_has_the_computers_that_the_robot_declares() -> None:
    declared = (
        "hosts: {main: {}, jetson: {ssh: pi@10.0.0.3, port: 2222, python: /opt/py, setup:"
        " ros.sh}}\nprocesses:\n"
    )
    plan = compiled_plan(NAMED.replace("processes:\n", declared))
    assert plan.hosts == {
        "main": PlanHost("main"),
        "jetson": PlanHost("pi@10.0.0.3", 2222, "/opt/py", ("ros.sh",)),
    }
    assert read_plan(write_plan(plan), "plan.json") == plan
    assert compiled_plan(NAMED).hosts == {}


def test_a_plan_whose_host_names_no_folder_is_refused() -> None:
    plan = replace(compiled_plan(NAMED), hosts={"../main": PlanHost("main")})
    with pytest.raises(RejectedError) as refused:
        read_plan(write_plan(plan), "plan.json")
    expect(refused.value.findings[0], "TF902", "../main")
